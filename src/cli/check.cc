// `assay check`: what each engine does with a model, before anything is run.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "base/quantity.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/facts.h"
#include "cli/model_options.h"
#include "cli/output_file.h"
#include "model/mjcf.h"
#include "model/repair.h"

namespace assay::cli {
namespace {

struct Options {
  ModelOptions model;
  std::optional<std::string> repair;
  bool json = false;
};

// One engine's contenders that treat the model alike.
struct Verdict {
  std::string engine;
  std::vector<std::string> contenders;
  std::vector<Limitation> limitations;  // nothing of kind kExact

  Fidelity worst() const {
    Fidelity worst = Fidelity::kExact;
    for (const Limitation& limitation : limitations) worst = std::max(worst, limitation.fidelity);
    return worst;
  }
  std::string count(Fidelity fidelity) const {
    const auto items = std::ranges::count(limitations, fidelity, &Limitation::fidelity);
    return items == 0 ? "" : std::to_string(items);
  }
};

bool alike(const std::vector<Limitation>& a, const std::vector<Limitation>& b) {
  return std::ranges::equal(a, b, [](const Limitation& x, const Limitation& y) {
    return x.fidelity == y.fidelity && x.element == y.element && x.how == y.how;
  });
}

std::vector<Verdict> verdicts_on(const Model& model) {
  const Registry& registry = Registry::instance();
  std::vector<Verdict> verdicts;
  for (const std::string& name : registry.contender_names()) {
    const ResolvedContender contender = registry.resolve(name);
    std::vector<Limitation> limitations = contender.engine->check(model, contender.settings);
    std::erase_if(limitations, [](const Limitation& limitation) { return limitation.fidelity == Fidelity::kExact; });
    const auto same = std::ranges::find_if(verdicts, [&](const Verdict& verdict) {
      return verdict.engine == contender.engine->name() && alike(verdict.limitations, limitations);
    });
    if (same != verdicts.end()) {
      same->contenders.push_back(name);
    } else {
      verdicts.push_back({contender.engine->name(), {name}, std::move(limitations)});
    }
  }
  return verdicts;
}

Json verdicts_json(const Model& model, const std::vector<Verdict>& verdicts) {
  Json json = {{"model", model_json(model.name, model)}, {"engines", Json::array()}};
  for (const Verdict& verdict : verdicts) {
    Json limitations = Json::array();
    for (const Limitation& limitation : verdict.limitations) {
      limitations.push_back(
          {{"fidelity", fidelity_text(limitation.fidelity)}, {"element", limitation.element}, {"how", limitation.how}});
    }
    json["engines"].push_back({{"engine", verdict.engine},
                               {"contenders", verdict.contenders},
                               {"verdict", fidelity_text(verdict.worst())},
                               {"findings", limitations}});
  }
  return json;
}

// ---- for people ------------------------------------------------------------------------------------------------------

// Everything that engines treat in one way, and the contenders that do so.
struct Statement {
  Fidelity fidelity = Fidelity::kExact;
  std::string what, how;
  std::vector<std::pair<std::string, std::vector<std::string>>> contenders;  // by engine
};

// "joint 'knee' armature" as what stands before the name, the name, and what stands after it.
struct Element {
  std::string before, name, after;

  explicit Element(const std::string& text) {
    const size_t opens = text.find(" '");
    const size_t closes = opens == std::string::npos ? opens : text.find('\'', opens + 2);
    if (closes == std::string::npos) {
      before = text;
      return;
    }
    before = text.substr(0, opens);
    name = text.substr(opens + 2, closes - opens - 2);
    after = text.substr(closes + 1);
    after.erase(0, after.find_first_not_of(' '));
  }
};

// "armature of all 22 joints", "limit of 2 joints ('knee', 'hip')".
std::string elements_text(const Element& first, const std::vector<std::string>& names, const Model& model) {
  constexpr size_t kMostNames = 6;
  const size_t noun_begins = first.before.rfind(' ') + 1;  // 0 where there is one word
  const std::string noun = first.before.substr(noun_begins);
  std::string text = first.after.empty() ? "" : first.after + " of ";
  text += first.before.substr(0, noun_begins);
  const bool all = noun == "joint" && names.size() == model.joints.size();
  text += fmt::format("{}{} {}", all ? "all " : "", names.size(), noun == "body" ? "bodies" : noun + "s");
  if (all) return text;
  std::vector<std::string> shown;
  for (size_t i = 0; i < std::min(names.size(), kMostNames); ++i) shown.push_back(fmt::format("'{}'", names[i]));
  if (names.size() > kMostNames) shown.push_back(fmt::format("{} more", names.size() - kMostNames));
  return text + fmt::format(" ({})", join(shown, ", "));
}

// Limitations that differ in the element's name only become one statement; so do contenders that state the same.
std::vector<Statement> statements_of(const std::vector<Verdict>& verdicts, const Model& model) {
  std::vector<Statement> statements;
  for (const Verdict& verdict : verdicts) {
    std::vector<Limitation> left = verdict.limitations;
    while (!left.empty()) {
      const Limitation first = left.front();
      const Element element(first.element);
      std::vector<std::string> names;
      std::erase_if(left, [&](const Limitation& limitation) {
        const Element other(limitation.element);
        if (limitation.fidelity != first.fidelity || limitation.how != first.how || other.before != element.before ||
            other.after != element.after) {
          return false;
        }
        names.push_back(other.name);
        return true;
      });
      const bool alone = names.size() == 1 || element.name.empty();
      const std::string what = alone ? first.element : elements_text(element, names, model);
      auto same = std::ranges::find_if(statements, [&](const Statement& statement) {
        return statement.fidelity == first.fidelity && statement.what == what && statement.how == first.how;
      });
      if (same == statements.end()) {
        same = statements.insert(same, {first.fidelity, what, first.how, {}});
      }
      auto& contenders = same->contenders;
      if (contenders.empty() || contenders.back().first != verdict.engine) contenders.push_back({verdict.engine, {}});
      auto& own = contenders.back().second;
      own.insert(own.end(), verdict.contenders.begin(), verdict.contenders.end());
    }
  }
  return statements;
}

// Some contenders of an engine, in as few words as name them: "all 12", "all but mujoco-rk4", their names.
std::string contenders_text(const std::vector<std::string>& contenders, const std::vector<std::string>& of_engine) {
  constexpr size_t kMostExceptions = 2;
  std::vector<std::string> others = of_engine;
  std::erase_if(others,
                [&](const std::string& name) { return std::ranges::find(contenders, name) != contenders.end(); });
  if (of_engine.size() == 1 || contenders.size() <= others.size() || others.size() > kMostExceptions) {
    return join(contenders, ", ");
  }
  return others.empty() ? fmt::format("all {}", of_engine.size()) : "all but " + join(others, ", ");
}

void print_report(const Model& model, const std::vector<Verdict>& verdicts) {
  print(paragraph(fmt::format("{}: {}, {} DOF, {}, {}", model.name, counted(model.bodies.size(), "body", "bodies"),
                              model.dof(), counted(model.contacts.size(), "contact pair", "contact pairs"),
                              quantity_text(model.total_mass(), "kg"))));
  for (const std::string& note : model.notes) print(paragraph("  note: " + note, 4));

  std::map<std::string, std::vector<std::string>> of_engine;
  for (const Verdict& verdict : verdicts) {
    auto& names = of_engine[verdict.engine];
    names.insert(names.end(), verdict.contenders.begin(), verdict.contenders.end());
  }
  std::vector<std::vector<std::string>> rows;
  rows.reserve(verdicts.size());
  for (const Verdict& verdict : verdicts) {
    rows.push_back({verdict.engine, status(fidelity_text(verdict.worst())), verdict.count(Fidelity::kRefused),
                    verdict.count(Fidelity::kApproximated),
                    contenders_text(verdict.contenders, of_engine.at(verdict.engine))});
  }
  print("\n" + table({"engine", "verdict", "refused", "approximated", "contenders"}, rows, {2, 3}));

  const std::vector<Statement> statements = statements_of(verdicts, model);
  for (const Fidelity fidelity : {Fidelity::kRefused, Fidelity::kApproximated}) {
    bool first = true;
    for (const Statement& statement : statements) {
      if (statement.fidelity != fidelity) continue;
      if (std::exchange(first, false)) print("\n" + status(fidelity_text(fidelity)) + "\n");
      print(paragraph(fmt::format("  {}: {}", statement.what, statement.how), 4));
      std::vector<std::string> parts;
      for (const auto& [engine, contenders] : statement.contenders) {
        const std::string names = contenders_text(contenders, of_engine.at(engine));
        parts.push_back(names.starts_with("all ") ? fmt::format("{} ({})", engine, names) : names);
      }
      print(paragraph("    " + join(parts, ", "), 4));
    }
  }
}

// ---- a file that is refused, and its repair --------------------------------------------------------------------------

Json problem_json(const Problem& problem) {
  return {{"severity", problem.severity == Severity::kRefused ? "refused" : "left out"},
          {"element", problem.element},
          {"line", problem.line > 0 ? Json(problem.line) : Json(nullptr)},
          {"message", problem.message},
          {"mend", problem.mend},
          {"option", problem.option}};
}

// Several problems, each on a line of its own; one is an error like every other.
int print_refusal(const std::string& file, const LoadReport& report, const Options& options) {
  std::vector<const Problem*> refused;
  for (const Problem& problem : report.problems) {
    if (problem.severity == Severity::kRefused) refused.push_back(&problem);
  }
  if (options.json) {
    Json problems = Json::array();
    for (const Problem& problem : report.problems) problems.push_back(problem_json(problem));
    print_json({{"file", file}, {"problems", problems}});
    return kWrongInput;
  }
  if (refused.size() == 1) throw InputError(fmt::format("{}: {}", file, problem_text(*refused.front())));
  message(fmt::format("{}: it is refused for {} problems", file, refused.size()));
  for (const Problem* problem : refused) message("  " + problem_text(*problem));
  return kWrongInput;
}

int repair(const std::string& file, const std::string& out, const LoadOptions& how) {
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  std::vector<Mend> mends;
  const std::string mended = mended_model(text, file, out, mends);
  OutputFile output(out);
  output.write(mended);
  output.finish();
  for (const Mend& mend : mends) {
    message(mend.line > 0 ? fmt::format("line {}: {}", mend.line, mend.what) : mend.what);
  }
  if (out == "-") return kDone;
  const LoadReport report = inspect_model(out, how);
  message(fmt::format("{}: changes {}{}", out, mends.size(), report.refused() ? "" : ", and it loads"));
  return report.refused() ? print_refusal(out, report, {}) : kDone;
}

int check(const Options& options) {
  const LoadOptions how = load_options(options.model);
  const std::string file = find_model(options.model.model);
  if (options.repair) return repair(file, *options.repair, how);
  const LoadReport report = inspect_model(file, how);
  if (!report.model) return print_refusal(file, report, options);
  const Model& model = *report.model;
  const std::vector<Verdict> verdicts = verdicts_on(model);
  if (options.json) {
    print_json(verdicts_json(model, verdicts));
  } else {
    print_report(model, verdicts);
  }
  return kDone;
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "check", "Show what each engine represents exactly, approximates or refuses in a model",
      {{"assay check planar-chain", "a system that comes with assay"},
       {"assay check my_robot.xml --drop-unsupported", "leaves out what no engine can be given, and names it"},
       {"assay check my_robot.urdf --json", "URDF files load the same way"}});
  const auto options = std::make_shared<Options>();
  add_model_options(*command, options->model);
  command->add_option("--repair", options->repair, "Write a mended URDF or MJCF file there and say what was changed")
      ->type_name("OUT");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return check(*options); }; });
}

}  // namespace assay::cli
