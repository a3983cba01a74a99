#include "check/dataset/examine.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/write_file.h"
#include "check/model_check.h"
#include "check/step_bounds.h"
#include "isolate/activity.h"
#include "load/mjcf.h"
#include "load/mjcf_document.h"
#include "load/outside_files.h"
#include "load/repair.h"
#include "load/urdf.h"

namespace assay::dataset {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostPlaces = 1000;  // of a kind in a file

// The path below the folder; empty where it is not below.
std::string path_below(const std::string& folder, const std::string& file) {
  if (!is_below(file, folder)) return "";
  std::error_code error;
  return fs::weakly_canonical(file, error).lexically_relative(fs::weakly_canonical(folder, error)).generic_string();
}

// Whether a text that is no XML was meant to be MJCF.
bool looks_like_mjcf(const std::string& text) {
  constexpr std::string_view kBegin = "<mujoco";
  for (size_t at = text.find(kBegin); at != std::string::npos; at = text.find(kBegin, at + 1)) {
    const size_t end = at + kBegin.size();
    if (end == text.size() || std::string_view(" \t\r\n>/").find(text[end]) != std::string_view::npos) return true;
  }
  return false;
}

Survey::Kind kind_of(const std::string& path, const std::string& text) {
  const std::string root = root_element(text);
  if (root == "mujoco") return Survey::Kind::kRobot;
  if (root == "mujocoinclude") return Survey::Kind::kPart;
  return ending_of(path) != ".xml" || (root.empty() && looks_like_mjcf(text)) ? Survey::Kind::kRobot
                                                                              : Survey::Kind::kOther;
}

// ---- a report under way ----------------------------------------------------------------------------------------------

class Examination {
 public:
  Examination(const std::string& folder, const std::string& path, LoadOptions options)
      : folder_(folder), file_(folder + "/" + path), options_(std::move(options)) {}

  // Mends the file into `out`.
  void repair(const std::string& out) {
    std::vector<Mend> mends;
    std::string mended;
    try {
      mended = mended_file(file_, out, mends, options_);
    } catch (const InputError&) {
      return;  // reading it says why
    }
    if (mends.empty()) return;
    for (const Mend& mend : mends) {
      repairs_.push_back(mend.line > 0 ? fmt::format("line {}: {}", mend.line, mend.what) : mend.what);
    }
    const fs::path within = fs::path(out).parent_path();
    std::error_code error;
    fs::create_directories(within, error);
    if (error || is_below(within.string(), folder_)) {
      const std::string why = error ? error.message() : "a link leads from there into the folder that is checked";
      add_repair(fmt::format("the repaired file '{}' is not written ({}): give --repair another folder", out, why));
      return;
    }
    try {
      write_file(out, mended);
    } catch (const SystemError& failure) {
      add_repair(fmt::format("the repaired file is not written: {}", failure.what()));
      return;
    }
    repaired_ = out;
    LoadReport report = inspect_model(out, options_);
    if (!report.refused()) return;
    LoadOptions trusting = options_;
    trusting.allow_external_files = true;
    if (!options_.allow_external_files && !inspect_model(out, trusting).refused()) {
      repairs_.emplace_back("it loads with --allow-external-files: it names files outside its folder");
    } else {
      const auto refused = std::ranges::find(report.problems, Severity::kRefused, &Problem::severity);
      refusal_of_repaired_ = fmt::format("the repaired file '{}' is refused: {}", out, problem_text(*refused));
    }
  }

  void inspect() {
    FileFacts facts;
    const LoadReport report = inspect_model(file_, options_, &facts);
    for (const Problem& problem : report.problems) add(problem);
    if (!report.model) return;
    if (!refusal_of_repaired_.empty()) add_repair(refusal_of_repaired_);
    const Model& model = *report.model;
    model_ = {
        {"name", model.name}, {"bodies", model.bodies.size()}, {"dof", model.dof()}, {"mass", model.total_mass()}};
    notes_ = model.notes;
    const Activity checking(fmt::format("checking '{}'", file_), kCheckLimits);
    for (const Finding& finding : check_model(model, facts, step_bounds(model, model.initial))) add(finding);
  }

  std::string text() const {
    return dump_json(Json{
        {"model", model_}, {"records", records_}, {"notes", notes_}, {"repairs", repairs_}, {"repaired", repaired_}});
  }

 private:
  // The piece's own limit of time comes first.
  static constexpr ActivityLimits kCheckLimits = {.cpu_s = 3600, .wall_s = 36000};

  void add(Rank rank, const std::string& kind, const std::string& title, const std::string& element, int line,
           const std::string& included, const std::string& message, const std::string& subject) {
    std::string file;
    if (!included.empty()) {
      const std::string own = model_folder(file_).string();
      file = path_below(folder_, included_file(own, own, included));
      if (file.empty()) line = 0;  // of a file that the folder does not have
    }
    records_.push_back({{"rank", rank_text(rank)},
                        {"kind", kind},
                        {"title", title},
                        {"element", element},
                        {"line", line},
                        {"file", file},
                        {"message", message},
                        {"subject", subject}});
  }

  void add(const Problem& problem) {
    const bool refused = problem.severity == Severity::kRefused;
    const std::string text = problem_text(problem);
    add(refused ? Rank::kRefused : Rank::kKnow, refused ? kinds::kRefused : kinds::kLeftOut,
        refused ? "the file is refused" : "left out of the file", problem.element, problem.line, problem.file, text,
        problem.element.empty() ? without_places(problem.message, folder_) : problem.element);
  }

  void add(const Finding& finding) {
    const Rank rank = finding.level == Level::kMend ? Rank::kMend : Rank::kKnow;
    for (size_t i = 0; i < finding.places.size(); ++i) {
      if (i == kMostPlaces) {
        add(rank, finding.kind, finding.title, "", 0, "",
            fmt::format("{}: {} more places", finding.title, finding.places.size() - i), "more places");
        return;
      }
      const Place& place = finding.places[i];
      add(rank, finding.kind, finding.title, place.element, place.line, place.file,
          fmt::format("{}: {}{}{}{}{}", finding.title, place.element, place.text.empty() ? "" : " ", place.text,
                      finding.advice.empty() ? "" : "; ", finding.advice),
          place.element);
    }
  }

  void add_repair(const std::string& message) {
    add(Rank::kRefused, kinds::kRepair, "the repaired file cannot be used", "", 0, "", message, "");
  }

  std::string folder_, file_;
  LoadOptions options_;
  Json model_ = nullptr;
  Json records_ = Json::array();
  std::vector<std::string> notes_, repairs_;
  std::string repaired_, refusal_of_repaired_;
};

Record record_of(const Json& json) {
  const auto text = [&](const char* key) { return json.at(key).get<std::string>(); };
  const auto rank = rank_named(text("rank"));
  if (!rank) throw InputError("a finding of an unknown level");
  return {.rank = *rank,
          .kind = text("kind"),
          .element = text("element"),
          .line = json.at("line").get<int>(),
          .file = text("file"),
          .message = text("message"),
          .subject = text("subject")};
}

}  // namespace

std::string survey_text(const std::string& folder, const std::string& path, const LoadOptions& options) {
  const std::string file = folder + "/" + path;
  const Activity reading(fmt::format("reading '{}'", file));
  const std::string text = model_text(file);
  const Survey::Kind kind = kind_of(path, text);
  Json includes = Json::array();
  if (kind != Survey::Kind::kOther && document_refusals(text, file, options).empty()) {
    for (const std::string& each : included_files(text, file)) {
      if (const std::string below = path_below(folder, each); !below.empty()) includes.push_back(below);
    }
  }
  const char* name = kind == Survey::Kind::kPart ? "part" : "other";
  if (kind == Survey::Kind::kRobot) name = "robot";
  return dump_json(Json{{"kind", name}, {"includes", includes}});
}

Survey read_survey(const std::string& text) {
  Survey survey;
  try {
    const Json json = Json::parse(text);
    const auto kind = json.at("kind").get<std::string>();
    if (kind != "robot") survey.kind = kind == "part" ? Survey::Kind::kPart : Survey::Kind::kOther;
    survey.includes = json.at("includes").get<std::set<std::string>>();
  } catch (const std::exception&) {
    return {};
  }
  return survey;
}

std::string examination_text(const std::string& folder, const std::string& path, const LoadOptions& options,
                             const std::string& repaired) {
  Examination examination(folder, path, options);
  if (!repaired.empty()) examination.repair(repaired);
  examination.inspect();
  return examination.text();
}

FileReport read_examination(const std::string& text, const std::string& path,
                            std::map<std::string, std::string>& titles) {
  const Json json = Json::parse(text);
  FileReport report;
  report.path = path;
  report.file = utf8_text(path);
  if (const Json& model = json.at("model"); !model.is_null()) {
    report.model = Sizes{.name = model.at("name").get<std::string>(),
                         .bodies = model.at("bodies").get<size_t>(),
                         .dof = model.at("dof").get<int>(),
                         .mass = model.at("mass").get<double>()};
  }
  for (const Json& each : json.at("records")) {
    report.records.push_back(record_of(each));
    titles.emplace(report.records.back().kind, each.at("title").get<std::string>());
  }
  std::ranges::stable_sort(report.records, {}, &Record::rank);
  report.notes = json.at("notes").get<std::vector<std::string>>();
  report.repairs = json.at("repairs").get<std::vector<std::string>>();
  report.repaired = json.at("repaired").get<std::string>();
  return report;
}

FileReport failed_examination(const std::string& path, const char* kind, const std::string& message,
                              std::map<std::string, std::string>& titles) {
  const std::string_view name = kind;
  const char* title = "reading or checking it ended its process";
  if (name == kinds::kUnreadable) title = "it cannot be read";
  if (name == kinds::kTimeLimit) title = "it takes longer than a limit of time";
  titles.emplace(kind, title);
  FileReport report;
  report.path = path;
  report.file = utf8_text(path);
  report.records.push_back({.rank = Rank::kRefused, .kind = kind, .message = utf8_text(message)});
  return report;
}

std::string without_places(std::string message, const std::string& folder) {
  std::error_code error;
  const auto erase_all = [&](const std::string& part) {
    for (size_t at = message.find(part); part.size() > 1 && at != std::string::npos; at = message.find(part, at)) {
      message.erase(at, part.size());
    }
  };
  erase_all(fs::weakly_canonical(folder, error).string() + "/");
  erase_all(folder + "/");
  constexpr std::string_view kLine = "line ";
  for (size_t at = message.find(kLine); at != std::string::npos; at = message.find(kLine, at + 1)) {
    const size_t begin = at + kLine.size();
    const size_t end = std::min(message.find_first_not_of("0123456789", begin), message.size());
    if (end > begin) message.erase(begin - 1, end - begin + 1);
  }
  return message;
}

}  // namespace assay::dataset
