#include "cli/check_folder.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/json.h"
#include "base/output_file.h"
#include "base/text.h"
#include "base/write_file.h"
#include "check/dataset/baseline.h"
#include "check/dataset/junit.h"
#include "check/dataset/robots.h"
#include "check/dataset/sarif.h"
#include "cli/answer.h"
#include "cli/cli.h"
#include "engines/engine_files.h"
#include "load/outside_files.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;
using dataset::FileReport;
using dataset::KindCount;
using dataset::Known;
using dataset::Rank;
using dataset::Record;
using dataset::Report;

// ---- options ---------------------------------------------------------------------------------------------------------

std::optional<Rank> fail_on(const FolderFlags& flags) {
  const std::string level = flags.fail_on.value_or(dataset::rank_text(Rank::kRefused));
  if (level == "never") return std::nullopt;
  const std::optional<Rank> rank = dataset::rank_named(level);
  if (!rank) throw InputError(fmt::format("--fail-on is '{}': use refused, mend, know or never", level));
  return rank;
}

// What can be said of an output before hours of work.
void check_output_path(const std::string& option, const std::string& path) {
  if (path.empty() || path == "-") {
    throw InputError(
        fmt::format("{} is '{}': give the name of a file (--json prints on standard output)", option, path));
  }
  std::error_code error;
  if (fs::is_directory(path, error))
    throw InputError(fmt::format("{} '{}' is a folder: give a file in it", option, path));
  const fs::path folder = fs::absolute(path).parent_path();
  if (!fs::is_directory(folder, error)) {
    throw InputError(
        fmt::format("{} '{}' cannot be written: there is no folder '{}'; make it, or give a file in a folder "
                    "that exists",
                    option, path, folder.string()));
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    throw SystemError(fmt::format("{} '{}' cannot be written ({}): give a file in a folder where you may write", option,
                                  path, std::strerror(errno)));
  }
}

using Outputs = std::vector<std::pair<std::string, std::string>>;  // option, path

Outputs outputs_of(const FolderFlags& flags) {
  Outputs outputs;
  for (const auto& [option, path] : {std::pair("--sarif", &flags.sarif), std::pair("--junit", &flags.junit),
                                     std::pair("--write-baseline", &flags.write_baseline)}) {
    const std::string file = path->value_or("");
    if (!path->has_value()) continue;
    check_output_path(option, file);
    const fs::path own = fs::absolute(file).lexically_normal();
    for (const auto& [other, its_file] : outputs) {
      if (fs::absolute(its_file).lexically_normal() != own) continue;
      throw InputError(fmt::format("{} and {} name the same file '{}': give two", other, option, file));
    }
    outputs.emplace_back(option, file);
  }
  return outputs;
}

// Makes the folder of the repaired files.
void prepare_repair(const FolderCheck& check) {
  const std::string& into = check.repair_into;
  for (const auto& [option, given] : {std::pair("--baseline", check.flags.baseline.has_value()),
                                      std::pair("--write-baseline", check.flags.write_baseline.has_value())}) {
    if (given && check.load.repair) {
      throw InputError(
          fmt::format("--repair and {} contradict each other: a baseline is of the files as they are, so "
                      "leave out one of them",
                      option));
    }
  }
  if (into.empty()) return;
  std::error_code error;
  if (fs::exists(into, error) && !fs::is_directory(into, error)) {
    throw InputError(fmt::format("--repair '{}' is a file, and '{}' is a folder: give a folder", into, check.folder));
  }
  if (is_below(into, check.folder) || is_below(check.folder, into)) {
    throw InputError(
        fmt::format("--repair '{}' and '{}' lie in each other, so that files could replace those that are "
                    "read: give a folder elsewhere",
                    into, check.folder));
  }
  fs::create_directories(into, error);
  if (error) {
    throw SystemError(
        fmt::format("--repair '{}' cannot be made ({}): give a folder where you may write", into, error.message()));
  }
}

dataset::How how_of(const FolderCheck& check) {
  dataset::How how;
  how.load = check.load;
  how.repair_into = check.repair_into;
  how.jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  if (check.flags.jobs) how.jobs = parse_count("--jobs", *check.flags.jobs, 1, kMostJobs);
  if (check.flags.time_limit) how.limit_s = parse_positive("--time-limit", *check.flags.time_limit, "s");
  how.writable = model_caches();
  if (!how.repair_into.empty()) how.writable.push_back(how.repair_into);
  return how;
}

// ---- for people ------------------------------------------------------------------------------------------------------

// "start-overlap 2, inertia-far" of the findings of a rank.
std::string kinds_text(const FileReport& file, Rank rank) {
  std::vector<std::pair<std::string, size_t>> kinds;
  for (const Record& record : file.records) {
    if (record.rank != rank) continue;
    const auto same = std::ranges::find(kinds, record.kind, &std::pair<std::string, size_t>::first);
    if (same == kinds.end()) {
      kinds.emplace_back(record.kind, 1);
    } else {
      ++same->second;
    }
  }
  std::vector<std::string> words;
  words.reserve(kinds.size());
  for (const auto& [kind, count] : kinds) words.push_back(count == 1 ? kind : fmt::format("{} {}", kind, count));
  return join(words, ", ");
}

std::string details_text(const FileReport& file, bool has_baseline) {
  const auto count = [&](auto&& is_one) { return static_cast<size_t>(std::ranges::count_if(file.records, is_one)); };
  std::vector<std::string> parts;
  if (const size_t refused = count([](const Record& r) { return r.rank == Rank::kRefused; }); refused > 0) {
    parts.push_back(file.records.front().message + (refused > 1 ? fmt::format(" (and {} more)", refused - 1) : ""));
  }
  if (const std::string mend = kinds_text(file, Rank::kMend); !mend.empty()) parts.push_back(mend);
  if (const size_t know = count([](const Record& r) { return r.rank == Rank::kKnow; }); know > 0) {
    parts.push_back(fmt::format("{} to know", know));
  }
  if (has_baseline && !file.records.empty()) {
    parts.push_back(fmt::format("{} new", count([](const Record& r) { return !r.known; })));
  }
  if (!file.repaired.empty()) parts.push_back(fmt::format("repaired by {}", counted(file.repairs.size(), "change")));
  return join(parts, "; ");
}

// "arm/arm.urdf  mend     start-overlap 2; 3 to know"
std::string file_line(const FileReport& file, size_t width, bool has_baseline) {
  constexpr size_t kVerdict = 7;
  const std::string verdict = file.verdict();
  const std::string shown =
      verdict == dataset::rank_text(Rank::kMend) ? styled(verdict, Style::kWarning) : status(verdict);
  const size_t taken = display_width(file.file);
  std::string line = file.file + std::string(width > taken ? width - taken : 0, ' ') + "  " + shown;
  const std::string details = details_text(file, has_baseline);
  if (!details.empty()) line += std::string(kVerdict - verdict.size() + 2, ' ') + details;
  return paragraph(line, 4);
}

std::string not_checked_text(const Report& report) {
  std::vector<std::string> parts;
  if (!report.parts.empty()) parts.push_back(counted(report.parts.size(), "file") + " that others include");
  if (report.other_xml > 0) parts.push_back(counted(report.other_xml, ".xml file") + " of other programs");
  for (const auto& [ending, count] : report.not_read) parts.push_back(counted(count, ending + " file"));
  if (report.links_out > 0)
    parts.push_back(counted(report.links_out, "link out of the folder", "links out of the folder"));
  return join(parts, ", ");
}

// In Markdown a text of a file is code, so that it names nobody and draws nothing.
std::string cell_text(const std::string& text, bool markdown) {
  if (!markdown) return text;
  std::string code = "`";
  for (const char c : printable(text)) {
    if (c == '|') code += '\\';
    code += c == '`' ? '\'' : c;
  }
  return code + "`";
}

void add_gone(const Report& report, bool markdown, Answer& answer) {
  constexpr size_t kMostGone = 5;
  if (report.gone.empty()) return;
  size_t count = 0;
  for (const Known& each : report.gone) count += each.count;
  answer.line(fmt::format("{} of the baseline {} gone: write it again with --write-baseline", counted(count, "finding"),
                          count == 1 ? "is" : "are"));
  for (size_t i = 0; i < std::min(report.gone.size(), kMostGone); ++i) {
    const Known& each = report.gone[i];
    answer.line(fmt::format("gone: {}: {}{}", cell_text(each.file, markdown), each.kind,
                            each.subject.empty() ? "" : ", " + cell_text(each.subject, markdown)));
  }
  if (report.gone.size() > kMostGone)
    answer.line(fmt::format("gone: {} more (--json)", report.gone.size() - kMostGone));
}

void add_failing(const Report& report, Answer& answer) {
  constexpr size_t kMostRows = 50;
  std::vector<std::vector<std::string>> rows;
  for (const FileReport& file : report.files) {
    for (const Record& record : file.records) {
      if (!report.fails(record) || rows.size() == kMostRows) continue;
      std::string place = record.file.empty() ? file.file : record.file;
      if (record.line > 0) place += fmt::format(":{}", record.line);
      rows.push_back(
          {cell_text(place, true), dataset::rank_text(record.rank), record.kind, cell_text(record.message, true)});
    }
  }
  if (rows.empty()) return;
  answer.part("What fails");
  const size_t more = report.failing() - rows.size();
  if (more > 0) answer.line(fmt::format("the first {}, and {} more", rows.size(), more));
  answer.table({"file", "level", "kind", "finding"}, rows);
}

Answer folder_summary(const Report& report, bool markdown) {
  const size_t refused = report.count(dataset::rank_text(Rank::kRefused)),
               mend = report.count(dataset::rank_text(Rank::kMend)), failing = report.failing();
  Answer answer;
  answer.part(fmt::format("{}: {}, {} ok, {} to mend, {} refused",
                          markdown ? cell_text(report.folder, true) : report.folder,
                          counted(report.files.size(), "robot"), report.files.size() - mend - refused, mend, refused));
  if (const std::string text = not_checked_text(report); !text.empty()) answer.line("not checked: " + text);
  const auto repaired = std::ranges::count_if(report.files, [](const FileReport& f) { return !f.repaired.empty(); });
  if (repaired > 0) answer.line(fmt::format("{} repaired", counted(static_cast<size_t>(repaired), "file")));
  const std::vector<KindCount> kinds = report.kinds();
  if (report.has_baseline) {
    size_t findings = 0, fresh = 0;
    for (const KindCount& each : kinds) {
      findings += each.findings;
      fresh += each.fresh;
    }
    answer.line(fmt::format("{} new, {} known", counted(fresh, "finding"), findings - fresh));
  }
  add_gone(report, markdown, answer);
  if (report.fail_on) {
    answer.line(failing == 0 ? fmt::format("nothing fails (--fail-on {})", dataset::rank_text(*report.fail_on))
                             : fmt::format("{} (--fail-on {})", counted(failing, "finding fails", "findings fail"),
                                           dataset::rank_text(*report.fail_on)));
  }
  if (markdown) add_failing(report, answer);
  if (kinds.empty()) return answer;
  answer.part("findings by kind");
  std::vector<std::string> headings = {"kind", "level", "findings", "files"};
  if (report.has_baseline) headings.emplace_back("new");
  headings.emplace_back("what");
  std::vector<std::vector<std::string>> rows;
  for (const KindCount& each : kinds) {
    std::vector<std::string> row = {each.kind, dataset::rank_text(each.worst), std::to_string(each.findings),
                                    std::to_string(each.files)};
    if (report.has_baseline) row.push_back(std::to_string(each.fresh));
    row.push_back(each.title);
    rows.push_back(std::move(row));
  }
  answer.table(headings, rows, report.has_baseline ? std::vector<size_t>{2, 3, 4} : std::vector<size_t>{2, 3});
  return answer;
}

// How far the check is.
class Progress {
 public:
  explicit Progress(size_t all) : all_(all) {}

  void show(size_t done) {
    if (!line_.due() || done == 0 || done == all_) return;
    const double so_far = std::chrono::duration<double>(Clock::now() - start_).count();
    const double left = so_far / static_cast<double>(done) * static_cast<double>(all_ - done);
    line_.show(fmt::format("checked {} of {} files, about {} left", done, all_, duration_label(left)));
  }
  void clear() { line_.clear(); }

 private:
  using Clock = std::chrono::steady_clock;
  ProgressLine line_;
  size_t all_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace

std::string FolderFlags::given() const {
  for (const auto& [option, is_given] :
       {std::pair("--sarif", sarif.has_value()), std::pair("--junit", junit.has_value()),
        std::pair("--baseline", baseline.has_value()), std::pair("--write-baseline", write_baseline.has_value()),
        std::pair("--fail-on", fail_on.has_value()), std::pair("--time-limit", time_limit.has_value()),
        std::pair("--jobs", jobs.has_value()), std::pair("--markdown", markdown)}) {
    if (is_given) return option;
  }
  return "";
}

void add_folder_flags(CLI::App& command, FolderFlags& flags, CLI::Option* json) {
  constexpr const char* kFolder = "A folder of robots";
  const auto option = [&](const char* name, std::optional<std::string>& value, const char* meaning, const char* type) {
    command.add_option(name, value, meaning)->type_name(type)->group(kFolder);
  };
  option("--fail-on", flags.fail_on,
         "Status 1 where a finding, new where there is a baseline, is of this level or worse (default: refused)",
         "refused|mend|know|never");
  option("--baseline", flags.baseline, "Known findings, a file of --write-baseline: they do not fail", "FILE");
  option("--write-baseline", flags.write_baseline, "Write all findings as known ones", "FILE");
  option("--sarif", flags.sarif, "Write SARIF 2.1.0, which forges show at the lines", "FILE");
  option("--junit", flags.junit, "Write JUnit's XML: a test for each file", "FILE");
  command.add_flag("--markdown", flags.markdown, "Print Markdown, as for a comment on a pull request")
      ->disable_flag_override()
      ->excludes(json)
      ->group(kFolder);
  option("--time-limit", flags.time_limit, "Most time for a file (default: 60)", "SECONDS");
  option("--jobs", flags.jobs, "Files at a time (default: one per core)", "N");
}

int check_folder(const FolderCheck& check) {
  if (!check.load.qpos.empty()) {
    throw InputError(
        fmt::format("--qpos is of one robot, and '{}' is a folder: give a file, or leave out --qpos", check.folder));
  }
  const std::optional<Rank> fails_from = fail_on(check.flags);
  const Outputs outputs = outputs_of(check.flags);
  std::optional<dataset::Baseline> baseline;
  if (check.flags.baseline) baseline = dataset::Baseline::read(*check.flags.baseline);
  const dataset::How how = how_of(check);
  prepare_repair(check);

  dataset::Robots robots = dataset::find_robots(check.folder, how);
  std::vector<std::string> read;
  size_t width = 0;
  for (const std::string& file : robots.files) {
    constexpr size_t kMostWidth = 60;
    width = std::max(width, std::min(kMostWidth, display_width(dataset::utf8_text(file))));
    read.push_back(fmt::format("{}/{}", check.folder, file));
  }
  for (const auto& [file, by] : robots.report.parts) read.push_back(fmt::format("{}/{}", check.folder, file));
  for (const auto& [option, path] : outputs) refuse_to_overwrite(option, path, read);

  const bool lines = !check.json && !check.flags.markdown;
  Progress progress(robots.files.size());
  Report report = dataset::check_robots(
      std::move(robots), how,
      [&](FileReport& file) {
        if (baseline) baseline->mark(file);
        if (!lines) return;
        progress.clear();
        print(file_line(file, width, baseline.has_value()));
      },
      [&](size_t done) { progress.show(done); });
  progress.clear();
  report.fail_on = fails_from;
  report.has_baseline = baseline.has_value();
  if (baseline) {
    report.gone = baseline->left();
    if (!baseline->is_of_this_folder()) {
      message(fmt::format("note: no robot of the baseline '{}' is in '{}': was it written for another folder?",
                          check.flags.baseline.value_or(""), check.folder));
    }
  }

  for (const auto& [option, path] : outputs) {
    if (option == "--sarif") write_file(path, dump_json(dataset::sarif_json(report), 1) + "\n");
    if (option == "--junit") write_file(path, dataset::junit_text(report) + "\n");
    if (option == "--write-baseline") write_file(path, dataset::baseline_text(report.files));
  }
  if (check.json) {
    print_json(dataset::report_json(report));
  } else if (check.flags.markdown) {
    print_markdown(folder_summary(report, true));
  } else {
    print("\n");
    print(folder_summary(report, false));
  }
  return report.failing() > 0 ? kFailed : kDone;
}

}  // namespace assay::cli
