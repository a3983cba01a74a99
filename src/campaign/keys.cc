#include "campaign/keys.h"

#include <span>
#include <string_view>

#include <fmt/format.h>

#include "base/text.h"
#include "load/load_options.h"
#include "measures/reference/certified.h"

namespace assay {
namespace {

struct KeyRow {
  std::string name, example, otherwise, meaning;
};

std::string default_text(bool value) { return value ? "true" : "false"; }
std::string default_text(int value) { return std::to_string(value); }
std::string default_text(double value) { return shortest(value); }
std::string default_text(const std::string& value) { return value.empty() ? "none" : value; }

template <typename Table>
std::string default_of(const Key<Table>& key) {
  if (key.otherwise != nullptr) return key.otherwise;
  return std::visit(
      [](auto member) -> std::string {
        if constexpr (std::is_same_v<decltype(member), std::monostate>) {
          return "none";
        } else {
          return default_text(Table().*member);
        }
      },
      key.member);
}

template <typename... Lists>
std::vector<KeyRow> rows_of(const Lists&... lists) {
  std::vector<KeyRow> rows;
  const auto add = [&](const auto& list) {
    for (const auto& key : list) rows.push_back({key.name, key.example, default_of(key), key.meaning});
  };
  (add(lists), ...);
  return rows;
}

std::vector<KeyRow> load_rows() {
  std::vector<KeyRow> rows;
  const LoadOptions defaults;
  visit_load_fields(
      defaults,
      Overloaded{[&](const LoadField& field, bool) { rows.push_back({field.key, "true", "false", field.meaning}); },
                 [&](const LoadField& field, const std::string&) {
                   const bool model = field.key == std::string_view("sdf_model");
                   const char* example = field.is_path() ? "\"pose.txt\"" : model ? "\"arm\"" : "\"home\"";
                   rows.push_back({field.key, example, "none", field.meaning});
                 },
                 [&](const LoadField& field, const Folders&) {
                   rows.push_back({field.key, R"({my_robot = "../my_robot"})", "none", field.meaning});
                 },
                 [&](const LoadField& field, const auto&) {
                   for (const LoadChoice& each : field.choices) {
                     rows.push_back({each.key, "true", "false", each.meaning});
                   }
                 }});
  return rows;
}

std::vector<KeyRow> control_rows() {
  std::vector<KeyRow> rows = rows_of(kControlKeys);
  for (const ControlPart& part : kControlParts) {
    const std::string value = shortest(ControlSpec().*part.member);
    rows.push_back({part.name, value, value, fmt::format("`{}`: {}", part.kind, part.meaning)});
  }
  for (KeyRow& row : rows_of(kFileControlKeys, kPolicyControlKeys)) rows.push_back(std::move(row));
  return rows;
}

std::vector<KeyRow> perturbation_rows() {
  std::vector<KeyRow> rows;
  for (const PerturbationPart& part : kPerturbationParts) {
    const std::string value = shortest(Perturbation().*part.member);
    rows.push_back({part.name, value, value, part.meaning});
  }
  return rows;
}

std::vector<KeyRow> sweep_rows() {
  std::vector<KeyRow> rows = rows_of(kSweepKeys);
  for (const std::string& role : setting_role_names()) {
    rows.push_back({role, "[2, 10, 50]", "none", "Values of each engine's own setting that decides this"});
  }
  return rows;
}

// A cell of a Markdown table.
std::string cell(std::string text) {
  for (size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
  return text;
}

std::string section_text(std::string_view heading, std::string_view about, const std::vector<KeyRow>& rows) {
  std::string text = fmt::format("\n## {}\n\n{}\n\n| key | example | default | meaning |\n| --- | --- | --- | --- |\n",
                                 heading, about);
  for (const KeyRow& row : rows) {
    text +=
        fmt::format("| `{}` | `{}` | {} | {} |\n", row.name, cell(row.example), cell(row.otherwise), cell(row.meaning));
  }
  return text;
}

}  // namespace

std::string campaign_keys_markdown() {
  const auto listed = [](const std::vector<std::string>& names) { return fmt::format("`{}`", join(names, "`, `")); };
  std::string text =
      "# Keys of a campaign's file\n\n"
      "A campaign is a TOML file: which systems, contenders, timesteps and measures. `assay run FILE --out DIR` "
      "measures\n"
      "it, and `campaigns/quick.toml` is an example. Names of keys end with their unit: `_s`, `_ms`, `_m`. An unknown "
      "key\n"
      "is an error.\n\n"
      "`docs/update.py files ASSAY` writes them into docs/files.md.\n";
  text += section_text("The campaign", "At the top of the file.", rows_of(kCampaignKeys));
  text += section_text("[[system]]", "One table for each system.", rows_of(kSystemKeys));
  text +=
      "\n## Solutions\n\nMotions that `truth` compares with where a system names their `solution`. A model may have "
      "other sizes, masses, friction and\nstarts than those of assay. `solution = \"file.csv\"` gives a motion of "
      "one's own "
      "instead, as `assay simulate` writes it: a header\n`time,body,x,y,z` and a line for each body and sample with "
      "the position of the centre of mass (m); orientations and\nvelocities may follow.\n\n| solution | of |\n| --- | "
      "--- |\n";
  for (const CertifiedSolution& solution : certified_solutions()) {
    text += fmt::format("| `{}` | {} |\n", solution.name, solution.about);
  }
  text += section_text("[[system]]: how the model is read",
                       "As the options of `assay check`. Paths count from the campaign's folder.", load_rows());
  text += section_text("[[system]]: how the model is changed", "After it was read.", rows_of(kVariantKeys));
  text += section_text("control", "Of a system. Kinds are " + listed(control_kinds()) + ".", control_rows());
  text += section_text("perturbation",
                       "Of a system: half widths of uniform distributions around the model's own initial state.",
                       perturbation_rows());
  text += section_text("push", "Of a system.", rows_of(kPushKeys));
  text += section_text("grasp", "Of a system.", rows_of(kGraspKeys));
  text += section_text("[timing]", "How the speed is measured.", rows_of(kTimingKeys));
  text += section_text("[search]", "With this table only what can still win is measured, unless `--full` is given.",
                       rows_of(kSearchKeys, kSearchLimits));
  text += section_text("[[contender]]",
                       "A contender that is derived from another. When no list names it, it joins the "
                       "campaign's list.",
                       rows_of(kContenderKeys));
  text += section_text("[[sweep]]",
                       "Contenders over lists of their settings. Every combination is one; several tables add up.",
                       sweep_rows());
  text += section_text("[[ratio]]", "A contender's step time over another's, with an interval.", rows_of(kRatioKeys));
  text +=
      "\n## Measures\n\n" + listed(measure_names()) + ": [methodology.md](methodology.md)\nhas what each of them is.\n";
  return text;
}

}  // namespace assay
