#include "check/dataset/robots.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "check/dataset/examine.h"
#include "isolate/contained.h"

namespace assay::dataset {
namespace {

// "3 .sdf and 2 .xacro"
std::string endings_text(const std::map<std::string, size_t>& others) {
  std::vector<std::string> parts;
  parts.reserve(others.size());
  for (const auto& [ending, count] : others) parts.push_back(fmt::format("{} {}", count, ending));
  return join(parts, ", ");
}

// By the number of the file in `files`; .urdf and .sdf files are robots whatever is in them.
std::vector<Survey> surveys_of(const std::string& folder, const std::vector<std::string>& files, const How& how) {
  std::vector<Survey> surveys(files.size());
  std::vector<size_t> asked;
  for (size_t i = 0; i < files.size(); ++i) {
    const std::string ending = ending_of(files[i]);
    if (ending != ".urdf" && ending != ".sdf") asked.push_back(i);
  }
  run_pieces({.count = asked.size(),
              .jobs = how.jobs,
              .limit_s = how.limit_s,
              .what = [&](size_t piece) { return fmt::format("reading '{}/{}'", folder, files[asked[piece]]); },
              .work = [&](size_t piece) { return survey_text(folder, files[asked[piece]], how.load); },
              // what cannot be read is a robot here: checking it says why
              .on_end =
                  [&](size_t piece, const PieceEnd& end) {
                    if (end.kind == PieceEnd::Kind::kDone) surveys[asked[piece]] = read_survey(end.text);
                  },
              .writable = {}});
  return surveys;
}

[[noreturn]] void refuse_without_robots(const Report& report) {
  std::vector<std::string> instead;
  if (report.other_xml > 0) instead.push_back(counted(report.other_xml, ".xml file") + " of other programs");
  if (!report.parts.empty()) instead.push_back(counted(report.parts.size(), "file") + " to be included by others");
  if (!report.not_read.empty()) {
    instead.push_back(endings_text(report.not_read) +
                      ", which a check of a folder does not read: convert to URDF or MJCF first");
  }
  if (report.links_out > 0) instead.push_back(counted(report.links_out, "link out of it", "links out of it"));
  throw InputError(
      fmt::format("there is no robot in the folder '{}' (.urdf, .sdf, .mjcf, or .xml with <mujoco>){}{}; check "
                  "the path",
                  report.folder, instead.empty() ? "" : ", but ", join(instead, ", ")));
}

}  // namespace

Robots find_robots(const std::string& folder, const How& how) {
  Listing listing = list_files(folder);
  const std::vector<Survey> surveys = surveys_of(folder, listing.files, how);
  Robots robots;
  Report& report = robots.report;
  report.folder = folder;
  report.not_read = std::move(listing.others);
  report.links_out = listing.links_out;
  std::map<std::string, std::set<std::string>> includes;
  for (size_t i = 0; i < surveys.size(); ++i) {
    if (!surveys[i].includes.empty()) includes.emplace(listing.files[i], surveys[i].includes);
  }
  const std::map<std::string, std::string> parts = included_parts(includes);
  for (size_t i = 0; i < surveys.size(); ++i) {
    const std::string& file = listing.files[i];
    const auto part = parts.find(file);
    if (surveys[i].kind == Survey::Kind::kOther) {
      ++report.other_xml;
    } else if (part != parts.end()) {
      report.parts.emplace_back(utf8_text(file), utf8_text(part->second));
    } else if (surveys[i].kind == Survey::Kind::kPart) {
      report.parts.emplace_back(utf8_text(file), "");
    } else {
      robots.files.push_back(file);
    }
  }
  for (const std::string& each : listing.unreadable) {
    report.files.push_back(failed_examination(each + "/", kinds::kUnreadable,
                                              "the folder cannot be listed: change its permissions", report.titles));
  }
  if (robots.files.empty() && report.files.empty()) refuse_without_robots(report);
  return robots;
}

Report check_robots(Robots robots, const How& how, const std::function<void(FileReport&)>& on_file,
                    const std::function<void(size_t done)>& on_end) {
  Report report = std::move(robots.report);
  const std::vector<std::string>& files = robots.files;
  for (FileReport& each : report.files) on_file(each);
  std::vector<std::optional<FileReport>> reports(files.size());
  size_t done = 0, given = 0;
  const auto name = [&](size_t piece) { return fmt::format("{}/{}", report.folder, files[piece]); };
  const auto end_of = [&](size_t piece, const PieceEnd& end) -> FileReport {
    using Kind = PieceEnd::Kind;
    if (end.kind == Kind::kDone) {
      try {
        return read_examination(end.text, files[piece], report.titles);
      } catch (const std::exception&) {
        return failed_examination(files[piece], kinds::kCrashed,
                                  fmt::format("checking '{}' ended without a report", name(piece)), report.titles);
      }
    }
    const char* kind = kinds::kCrashed;
    if (end.kind == Kind::kThrew) kind = kinds::kUnreadable;
    if (end.kind == Kind::kTooLong) kind = kinds::kTimeLimit;
    return failed_examination(files[piece], kind, end.text, report.titles);
  };
  run_pieces({.count = files.size(),
              .jobs = how.jobs,
              .limit_s = how.limit_s,
              .what = [&](size_t piece) { return fmt::format("checking '{}'", name(piece)); },
              .work =
                  [&](size_t piece) {
                    const std::string out =
                        how.repair_into.empty() ? "" : fmt::format("{}/{}", how.repair_into, files[piece]);
                    return examination_text(report.folder, files[piece], how.load, out);
                  },
              .on_end =
                  [&](size_t piece, const PieceEnd& end) {
                    reports[piece] = end_of(piece, end);
                    ++done;
                    for (; given < reports.size() && reports[given]; ++given) on_file(*reports[given]);
                    on_end(done);
                  },
              .writable = how.writable});
  for (std::optional<FileReport>& each : reports) {
    if (each) report.files.push_back(std::move(*each));
  }
  std::ranges::stable_sort(report.files, {}, &FileReport::path);
  return report;
}

}  // namespace assay::dataset
