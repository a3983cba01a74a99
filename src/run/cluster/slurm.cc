#include "run/cluster/slurm.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/external_files.h"
#include "base/input_file.h"
#include "base/json.h"
#include "base/paths.h"
#include "base/text.h"
#include "base/write_file.h"
#include "results/store/store.h"
#include "run/cluster/program.h"

namespace assay {

using nlohmann::json;
namespace fs = std::filesystem;

namespace {

std::string jobs_dir(const std::string& out) { return out + "/jobs"; }

// Lines that Slurm reads as options. `title` names the job and its log.
std::string options_of(const SlurmRequest& request, const std::string& title, bool array) {
  std::string text = fmt::format("#!/bin/sh\n#SBATCH --job-name=assay-{}\n#SBATCH --output={}/{}{}.log\n", title,
                                 jobs_dir(request.out), title, array ? "-%a" : "");
  text += "#SBATCH --ntasks=1\n#SBATCH --open-mode=append\n";
  if (!request.partition.empty()) text += fmt::format("#SBATCH --partition={}\n", request.partition);
  if (!request.account.empty()) text += fmt::format("#SBATCH --account={}\n", request.account);
  if (!request.time_limit.empty()) text += fmt::format("#SBATCH --time={}\n", request.time_limit);
  for (const std::string& option : request.options) text += fmt::format("#SBATCH {}\n", option);
  return text;
}

// The user's, of the command that submits: a request that a stranger wrote has none.
const char* agreement() { return agreed_to_external_files() ? " --allow-external-files" : ""; }

// `cells` as --cells has them; `folder` of the parts, to which their number is added.
std::string part_command(const SlurmRequest& request, const std::string& cells, const std::string& folder, int parts) {
  return fmt::format("exec {} run {}{} --shard \"${{SLURM_ARRAY_TASK_ID}}/{}\" --cells {} --references {} --out {}/{}",
                     shell_word(request.program), shell_word(request.campaign), agreement(), parts, cells,
                     shell_word(request.out + "/references"), shell_word(request.out), folder) +
         "\"${SLURM_ARRAY_TASK_ID}\"";
}

std::string request_file(const std::string& out) { return jobs_dir(out) + "/request.json"; }

// As a whole: another job may be reading it.
void write_request(const SlurmRequest& request) {
  write_file(request_file(request.out), dump_json(request.to_json(), 1) + "\n");
}

// Makes the folders that jobs write into, of which none may lead elsewhere.
void make_folders(const SlurmRequest& request) {
  const std::string jobs = jobs_dir(request.out), shards = request.out + "/shards";
  for (const std::string& folder : {jobs, shards}) make_own_folder(folder);
  for (const char* folder : {"/references", "/runs"}) refuse_linked_folder(request.out + folder);
  const Parts all = all_parts(request);
  for (const auto& [kind, parts] :
       {std::pair("accuracy", &all.accuracy), std::pair("timing", &all.timing), std::pair("runs", &all.runs)}) {
    for (const int part : *parts) refuse_linked_folder(part_dir(request, kind, part));
  }
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(jobs, error)) {
    if (!entry.is_symlink(error)) continue;
    throw InputError(fmt::format("'{}' is a symbolic link, and Slurm would write a job's log through it: remove it",
                                 entry.path().string()));
  }
}

// Slurm's number of a job in what `sbatch --parsable` says: "12" or "12;cluster", in the last line that looks so, since
// wrappers of sbatch greet first. Empty for none.
std::optional<std::string> job_number(const std::string& said) {
  std::optional<std::string> found;
  for (size_t at = 0; at < said.size();) {
    const size_t line_end = std::min(said.find('\n', at), said.size());
    std::string line = said.substr(at, line_end - at);
    at = line_end + 1;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    const size_t number_end = std::min(line.find(';'), line.size());
    const bool cluster = number_end == line.size() || (number_end + 1 < line.size() &&
                                                       line.find_first_of(" \t;", number_end + 1) == std::string::npos);
    const auto number = parse_integer(line.substr(0, number_end));
    if (cluster && number && *number > 0) found = std::to_string(*number);
  }
  return found;
}

// Warnings may come before what is wrong, and "Batch job submission failed: ..." says it last.
std::string reason_of(const ProgramEnd& end) {
  std::string first, error;
  for (size_t at = 0; at < end.error.size();) {
    const size_t line_end = std::min(end.error.find('\n', at), end.error.size());
    std::string line = end.error.substr(at, line_end - at);
    at = line_end + 1;
    if (first.empty()) first = line;
    for (const std::string_view prefix : {"sbatch: error: ", "sbatch: fatal: "}) {
      if (line.starts_with(prefix)) error = line.substr(prefix.size());
    }
  }
  std::string why = error.empty() ? first : error;
  while (!why.empty() && (why.back() == '.' || why.back() == ' ')) why.pop_back();
  return why.empty() ? fmt::format("sbatch ended with status {}", end.status) : why;
}

// The last line of an answer that is none, cut where it is long.
std::string quoted_end(std::string said) {
  constexpr size_t kMost = 100;
  while (!said.empty() && (said.back() == '\n' || said.back() == '\r' || said.back() == ' ')) said.pop_back();
  if (const size_t line = said.rfind('\n'); line != std::string::npos) said.erase(0, line + 1);
  if (said.size() > kMost) said = said.substr(0, kMost) + "...";
  return said.empty() ? "it is empty" : fmt::format("'{}'", said);
}

constexpr std::array<std::pair<JobKind, const char*>, 4> kKindNames = {{{JobKind::kRuns, "runs"},
                                                                        {JobKind::kAccuracy, "accuracy"},
                                                                        {JobKind::kTiming, "timing"},
                                                                        {JobKind::kFinish, "finish"}}};

// As the scripts are called, and their jobs after "assay-".
const char* kind_name(JobKind kind) {
  return std::ranges::find(kKindNames, kind, &std::pair<JobKind, const char*>::first)->second;
}

json job_json(const SubmittedJob& job) { return {{"id", job.id}, {"kind", kind_name(job.kind)}, {"parts", job.parts}}; }

SubmittedJob job_of(const json& from) {
  SubmittedJob job;
  job.id = from.at("id");
  const std::string kind = from.at("kind");
  for (const auto& [each, name] : kKindNames) {
    if (kind == name) job.kind = each;
  }
  job.parts = from.at("parts").get<std::vector<int>>();
  return job;
}

json plan_json(const std::vector<PartPlan>& plan) {
  json rows = json::array();
  for (const PartPlan& part : plan)
    rows.push_back({{"cells", part.cells}, {"seconds", part.seconds}, {"waits", part.waits}});
  return rows;
}

std::vector<PartPlan> plan_of(const json& from, const char* name) {
  std::vector<PartPlan> plan;
  if (!from.contains(name)) return plan;
  for (const json& row : from.at(name)) plan.push_back({row.at("cells"), row.at("seconds"), row.value("waits", true)});
  return plan;
}

std::optional<std::string> read_text(const std::string& path) {
  constexpr std::uintmax_t kMostBytes = 64 << 20;  // a row for each part
  std::error_code error;
  if (!fs::exists(fs::symlink_status(path, error))) return std::nullopt;
  return input_file(path, "the record of the jobs", "the directory of 'assay submit'", kMostBytes);
}

// A new submission beside jobs that the record named would start every part twice.
[[noreturn]] void refuse_record(const std::string& path, const std::string& why) {
  throw InputError(fmt::format(
      "'{}' {}: look with 'squeue --me' whether its jobs wait or run and end them with 'scancel', then move "
      "the file away and submit the campaign again with 'assay submit --slurm'",
      path, why));
}

// Of a file that somebody else may have written.
void check(const SlurmRequest& request) {
  const auto in = [](int number, int least) { return least <= number && number <= kMostParts; };
  const auto known = [&](const SubmittedJob& job) {
    return parse_integer(job.id).value_or(0) > 0 &&
           std::ranges::all_of(job.parts, [&](int part) { return in(part, 1); });
  };
  if (!in(request.accuracy_parts, 0) || !in(request.timing_parts, 0) || !in(request.runs_parts, 0) ||
      !in(request.cpus, 1) || !in(request.nodes, 1) || !in(request.tries, 1) || request.jobs.size() > kMostParts ||
      !std::ranges::all_of(request.jobs, known)) {
    throw InputError("it has numbers that no submission makes");
  }
  require_one_line("the partition", request.partition);
  require_one_line("the account", request.account);
  require_one_line("the time limit", request.time_limit);
  require_one_line("the campaign", request.campaign);
  for (const std::string& option : request.options) parse_sbatch_option(option);
}

SlurmRequest request_of_text(const std::string& text, const std::string& out, const std::string& path) {
  SlurmRequest request;
  try {
    request = SlurmRequest::from_json(json::parse(text));
    check(request);
  } catch (const json::exception&) {
    refuse_record(path, "is damaged");
  } catch (const InputError& why) {
    refuse_record(path, fmt::format("is no record of a submission ({})", why.what()));
  }
  request.program = program_path();
  request.out = fs::absolute(out).lexically_normal().string();
  while (request.out.size() > 1 && request.out.ends_with('/')) request.out.pop_back();
  return request;
}

void add_parts(std::vector<int>& parts, const std::vector<int>& more) {
  parts.insert(parts.end(), more.begin(), more.end());
  std::ranges::sort(parts);
  const auto repeated = std::ranges::unique(parts);
  parts.erase(repeated.begin(), repeated.end());
}

bool has_ended(std::string_view state) {
  // COMPLETING: its processes have ended or are being killed; the lock tells whether one still writes
  constexpr auto kEnded =
      std::to_array<std::string_view>({"BOOT_FAIL", "CANCELLED", "COMPLETED", "COMPLETING", "DEADLINE", "FAILED",
                                       "NODE_FAIL", "OUT_OF_MEMORY", "PREEMPTED", "REVOKED", "TIMEOUT"});
  return std::ranges::find(kEnded, state) != kEnded.end();
}

// Submits jobs of one request, in turn; all or none.
class Submission {
 public:
  // `waits`: whether the request's jobs are known to wait or run. Slurm may refuse to wait for one that it has
  // forgotten.
  Submission(SlurmRequest request, bool waits)
      : request_(std::move(request)), before_(request_.jobs.size()), first_(waits ? 0 : before_) {}

  // Slurm's number of the job that `words` submit. It is stored at once: the process may be killed.
  std::string submit(const std::vector<std::string>& words, JobKind kind, const std::vector<int>& parts) {
    const auto end = run_program(words);
    if (!end) {
      throw InputError(
          "there is no Slurm here ('sbatch' is not in PATH): run this on a cluster's login node, or measure parts with "
          "'assay run --shard I/N'");
    }
    if (end->status != 0) throw InputError(fmt::format("Slurm refuses the job: {}", reason_of(*end)));
    const auto job = job_number(end->out);
    if (!job) {
      throw InputError(
          fmt::format("Slurm's answer has no job number: {} (if 'squeue --me' shows a job 'assay-{}' all the same, end "
                      "it with 'scancel')",
                      quoted_end(end->out), kind_name(kind)));
    }
    request_.jobs.push_back({*job, kind, parts});
    write_request(request_);
    return *job;
  }

  // After a failure: ends what was submitted. How that went, for a message.
  std::string undo() {
    std::vector<SubmittedJob> stay;
    std::vector<std::string> ids;
    for (size_t i = before_; i < request_.jobs.size(); ++i) {
      if (is_cancelled(request_.jobs[i].id)) continue;
      stay.push_back(request_.jobs[i]);
      ids.push_back(request_.jobs[i].id);
    }
    request_.jobs.resize(before_);
    request_.jobs.insert(request_.jobs.end(), stay.begin(), stay.end());
    try {
      write_request(request_);
    } catch (const SystemError&) {  // NOLINT(bugprone-empty-catch): what stays is named all the same
    }
    return ids.empty()
               ? "nothing was submitted"
               : fmt::format("jobs that could not be cancelled stay: end them with 'scancel {}'", join(ids, " "));
  }

  // "--dependency=afterany:1:2" on what was submitted and what was live of these kinds; empty for none.
  std::vector<std::string> after(const std::vector<JobKind>& kinds) const {
    std::vector<std::string> ids;
    for (size_t i = first_; i < request_.jobs.size(); ++i) {
      const SubmittedJob& job = request_.jobs[i];
      if (std::ranges::find(kinds, job.kind) != kinds.end()) ids.push_back(job.id);
    }
    if (ids.empty()) return {};
    return {"--dependency=afterany:" + join(ids, ":")};
  }

 private:
  SlurmRequest request_;
  size_t before_ = 0;  // jobs that were there before
  size_t first_ = 0;   // that later ones may wait for

  static bool is_cancelled(const std::string& id) {
    try {
      const auto end = run_program({"scancel", id});
      return end && end->status == 0;
    } catch (const SystemError&) {
      return false;
    }
  }
};

SlurmJobs submit_jobs(Submission& submission, const SlurmRequest& request, const Parts& parts, int attempt) {
  const auto script = [&](const char* name) { return jobs_dir(request.out) + "/" + name; };
  SlurmJobs jobs;
  const auto submit_after = [&](std::vector<std::string> words, const std::vector<JobKind>& kinds, const char* name,
                                JobKind kind, const std::vector<int>& of_job) {
    for (std::string& word : submission.after(kinds)) words.push_back(std::move(word));
    words.push_back(script(name));
    return submission.submit(words, kind, of_job);
  };
  if (!parts.runs.empty()) {
    jobs.runs = submit_after({"sbatch", "--parsable", "--array=" + array_text(parts.runs)}, {}, "runs.sh",
                             JobKind::kRuns, parts.runs);
  }
  // what reads no run fills the nodes while the last runs end
  const auto [free, waiting] = apart(request, parts.accuracy);
  if (!free.empty()) {
    jobs.accuracy.push_back(submit_after({"sbatch", "--parsable", "--array=" + array_text(free)}, {}, "accuracy.sh",
                                         JobKind::kAccuracy, free));
  }
  if (!waiting.empty()) {
    jobs.accuracy.push_back(submit_after({"sbatch", "--parsable", "--array=" + array_text(waiting)}, {JobKind::kRuns},
                                         "accuracy.sh", JobKind::kAccuracy, waiting));
  }
  if (!parts.timing.empty()) {
    // afterwards, so that the fine-step runs are there
    jobs.timing =
        submit_after({"sbatch", "--parsable", fmt::format("--array={}%{}", array_text(parts.timing), request.nodes)},
                     {JobKind::kRuns, JobKind::kAccuracy}, "timing.sh", JobKind::kTiming, parts.timing);
  }
  // After another job that finishes, too: two at a time would write one directory.
  jobs.finish = submit_after({"sbatch", "--parsable", fmt::format("--export=ALL,ASSAY_ATTEMPT={}", attempt)},
                             {JobKind::kRuns, JobKind::kAccuracy, JobKind::kTiming, JobKind::kFinish}, "finish.sh",
                             JobKind::kFinish, {});
  return jobs;
}

}  // namespace

json SlurmRequest::to_json() const {
  json submitted = json::array();
  for (const SubmittedJob& job : jobs) submitted.push_back(job_json(job));
  return {{"program", program},
          {"campaign", campaign},
          {"out", out},
          {"partition", partition},
          {"account", account},
          {"time_limit", time_limit},
          {"accuracy_parts", accuracy_parts},
          {"timing_parts", timing_parts},
          {"runs_parts", runs_parts},
          {"cpus", cpus},
          {"nodes", nodes},
          {"tries", tries},
          {"options", options},
          {"accuracy_plan", plan_json(accuracy_plan)},
          {"timing_plan", plan_json(timing_plan)},
          {"runs_plan", plan_json(runs_plan)},
          {"jobs", std::move(submitted)}};
}

SlurmRequest SlurmRequest::from_json(const json& from) {
  SlurmRequest request;
  request.program = from.at("program");
  request.campaign = from.at("campaign");
  request.out = from.at("out");
  request.partition = from.at("partition");
  request.account = from.at("account");
  request.time_limit = from.at("time_limit");
  request.accuracy_parts = from.at("accuracy_parts");
  request.timing_parts = from.at("timing_parts");
  request.runs_parts = from.value("runs_parts", 0);
  request.cpus = from.at("cpus");
  request.nodes = from.at("nodes");
  request.tries = from.at("tries");
  request.options = from.value("options", std::vector<std::string>());
  request.accuracy_plan = plan_of(from, "accuracy_plan");
  request.timing_plan = plan_of(from, "timing_plan");
  request.runs_plan = plan_of(from, "runs_plan");
  if (from.contains("jobs")) {
    for (const json& job : from.at("jobs")) request.jobs.push_back(job_of(job));
  }
  return request;
}

Parts all_parts(const SlurmRequest& request) {
  Parts parts;
  for (int part = 1; part <= request.accuracy_parts; ++part) parts.accuracy.push_back(part);
  for (int part = 1; part <= request.timing_parts; ++part) parts.timing.push_back(part);
  for (int part = 1; part <= request.runs_parts; ++part) parts.runs.push_back(part);
  return parts;
}

std::pair<std::vector<int>, std::vector<int>> apart(const SlurmRequest& request, const std::vector<int>& parts) {
  std::pair<std::vector<int>, std::vector<int>> found;
  for (const int part : parts) {
    const auto at = static_cast<size_t>(part) - 1;
    const bool waits = at >= request.accuracy_plan.size() || request.accuracy_plan[at].waits;
    (waits ? found.second : found.first).push_back(part);
  }
  return found;
}

std::string array_text(const std::vector<int>& parts) {
  std::vector<std::string> ranges;
  for (size_t i = 0; i < parts.size();) {
    size_t end = i;
    while (end + 1 < parts.size() && parts[end + 1] == parts[end] + 1) ++end;
    ranges.push_back(end == i ? std::to_string(parts[i]) : fmt::format("{}-{}", parts[i], parts[end]));
    i = end + 1;
  }
  return join(ranges, ",");
}

std::map<std::string, std::string> slurm_scripts(const SlurmRequest& request) {
  std::map<std::string, std::string> scripts;
  const auto shared = [&](const char* title, const char* cells, const char* folder, int parts) {
    return options_of(request, title, true) + fmt::format("#SBATCH --cpus-per-task={}\n", request.cpus) +
           part_command(request, cells, folder, parts) + fmt::format(" --jobs {}\n", request.cpus);
  };
  if (request.runs_parts > 0) scripts["runs.sh"] = shared("runs", "runs", "runs/", request.runs_parts);
  if (request.accuracy_parts > 0) {
    scripts["accuracy.sh"] = shared("accuracy", request.accuracy_cells(), "shards/accuracy-", request.accuracy_parts);
  }
  if (request.timing_parts > 0) {
    // assay pins the engine's process to one core of the node, which nobody else uses meanwhile
    scripts["timing.sh"] = options_of(request, "timing", true) + "#SBATCH --exclusive\n" +
                           part_command(request, "timing", "shards/timing-", request.timing_parts) + " --jobs 1\n";
  }
  scripts["finish.sh"] = options_of(request, "finish", false) +
                         fmt::format("exec {} submit --resume{} --out {} --attempt \"${{ASSAY_ATTEMPT:-1}}\"\n",
                                     shell_word(request.program), agreement(), shell_word(request.out));
  return scripts;
}

std::string part_dir(const SlurmRequest& request, const std::string& kind, int part) {
  return kind == "runs" ? fmt::format("{}/runs/{}", request.out, part)
                        : fmt::format("{}/shards/{}-{}", request.out, kind, part);
}

void require_one_line(const char* option, const std::string& text) {
  const auto breaks = [](unsigned char c) { return c < ' ' || c == 0x7f; };
  if (std::ranges::any_of(text, breaks)) {
    throw InputError(fmt::format("{} is '{}', which has a control character: name it without", option, text));
  }
}

std::string parse_sbatch_option(const std::string& text) {
  const auto refuse = [&](const std::string& why) { throw InputError(fmt::format("--sbatch is '{}': {}", text, why)); };
  if (!text.starts_with("--") || text.size() < 3) {
    refuse("give a long option of sbatch, as in --sbatch=--constraint=zen4");
  }
  for (const char c : text) {
    // a line of a script has no escapes that would be the same in all versions of Slurm
    if (c <= ' ' || c > '~' || c == '"' || c == '\'' || c == '\\' || c == '#') {
      refuse("spaces, quotes, # and what is not ASCII cannot be passed on; give one option, as in --sbatch=--mem=8G");
    }
  }
  const std::string name = text.substr(2, text.find('=') - 2);
  constexpr auto kOwn = std::to_array<std::pair<std::string_view, std::string_view>>({{"account", "--account"},
                                                                                      {"array", ""},
                                                                                      {"cpus-per-task", "--cpus"},
                                                                                      {"dependency", ""},
                                                                                      {"error", ""},
                                                                                      {"export", ""},
                                                                                      {"job-name", ""},
                                                                                      {"nodes", "--nodes"},
                                                                                      {"ntasks", ""},
                                                                                      {"open-mode", ""},
                                                                                      {"output", ""},
                                                                                      {"parsable", ""},
                                                                                      {"partition", "--partition"},
                                                                                      {"test-only", "--dry-run"},
                                                                                      {"time", "--time"},
                                                                                      {"wait", ""},
                                                                                      {"wrap", ""}});
  for (const auto& [own, instead] : kOwn) {
    // sbatch takes shortened names too
    if (name.empty() || own.starts_with(name)) {
      refuse(instead.empty() ? fmt::format("assay sets --{} itself, so leave it out", own)
                             : fmt::format("use {} of 'assay submit' for it", instead));
    }
  }
  return text;
}

std::vector<std::string> LiveJobs::ids() const {
  std::vector<std::string> ids;
  ids.reserve(jobs.size());
  for (const SubmittedJob& job : jobs) ids.push_back(job.id);
  return ids;
}

LiveJobs live_jobs(const SlurmRequest& request) {
  LiveJobs live;
  if (request.jobs.empty()) return live;
  live.jobs = request.jobs;
  const char* own = std::getenv("SLURM_JOB_ID");
  if (own != nullptr) std::erase_if(live.jobs, [&](const SubmittedJob& job) { return job.id == own; });
  if (live.jobs.empty()) return live;
  const auto end =
      run_program({"squeue", "--noheader", "--array", "--jobs=" + join(live.ids(), ","), "--format=%i %T"});
  if (!end) {
    live.unknown = "'squeue' is not in PATH";
    return live;
  }
  // squeue knows of ended jobs only for a while; it refuses a single number that it has forgotten
  const bool forgotten = end->error.find("Invalid job id") != std::string::npos;
  if (end->status != 0 && !forgotten) {
    live.unknown = fmt::format("squeue: {}", end->error.substr(0, end->error.find('\n')));
    return live;
  }
  std::map<std::string, std::vector<int>> waiting;  // parts by job
  for (size_t at = 0; at < end->out.size();) {
    const size_t line_end = std::min(end->out.find('\n', at), end->out.size());
    const std::string line = end->out.substr(at, line_end - at);
    at = line_end + 1;
    const std::string element = line.substr(0, line.find(' '));  // "41_3", or "43" for a job without an array
    if (element.size() >= line.size() || has_ended(line.substr(element.size() + 1))) continue;
    const size_t underline = std::min(element.find('_'), element.size());
    std::vector<int>& parts = waiting[element.substr(0, underline)];
    if (underline == element.size()) continue;
    const auto part = parse_integer(element.substr(underline + 1));
    if (part) {
      add_parts(parts, {static_cast<int>(*part)});
    } else {  // "41_[3-7]", from a squeue that does not take arrays apart
      for (const SubmittedJob& job : live.jobs) {
        if (job.id == element.substr(0, underline)) add_parts(parts, job.parts);
      }
    }
  }
  std::erase_if(live.jobs, [&](const SubmittedJob& job) { return !waiting.contains(job.id); });
  for (SubmittedJob& job : live.jobs) {
    std::erase_if(job.parts,
                  [&](int part) { return std::ranges::find(waiting[job.id], part) == waiting[job.id].end(); });
  }
  return live;
}

Parts busy_parts(const SlurmRequest& request, const LiveJobs& live) {
  Parts busy;
  if (live.known()) {
    for (const SubmittedJob& job : live.jobs) {
      if (job.kind == JobKind::kAccuracy) add_parts(busy.accuracy, job.parts);
      if (job.kind == JobKind::kTiming) add_parts(busy.timing, job.parts);
      if (job.kind == JobKind::kRuns) add_parts(busy.runs, job.parts);
    }
  }
  const Parts all = all_parts(request);
  for (const int part : all.accuracy) {
    if (Store::is_written(part_dir(request, "accuracy", part))) add_parts(busy.accuracy, {part});
  }
  for (const int part : all.timing) {
    if (Store::is_written(part_dir(request, "timing", part))) add_parts(busy.timing, {part});
  }
  for (const int part : all.runs) {
    if (Store::is_written(part_dir(request, "runs", part))) add_parts(busy.runs, {part});
  }
  return busy;
}

Parts lost_parts(const SlurmRequest& request, const Parts& busy) {
  const auto is_lost = [&](const std::string& kind, int part) {
    const std::string dir = part_dir(request, kind, part);
    std::error_code error;
    if (!fs::is_regular_file(dir + "/assay.sqlite", error) || fs::is_empty(dir + "/assay.sqlite", error)) return true;
    const Store store = Store::open(dir);
    // a part that has nothing to do has a plan without cells, and a node that says when it ended
    for (const Store::PartDone& done : store.plan_done()) {
      if (done.done < done.cells) return true;
    }
    return store.nodes().empty();
  };
  Parts lost;
  const Parts all = all_parts(request);
  for (const int part : all.accuracy) {
    if (!std::ranges::binary_search(busy.accuracy, part) && is_lost("accuracy", part)) lost.accuracy.push_back(part);
  }
  for (const int part : all.timing) {
    if (!std::ranges::binary_search(busy.timing, part) && is_lost("timing", part)) lost.timing.push_back(part);
  }
  return lost;
}

SlurmJobs submit_to_slurm(SlurmRequest request, const Parts& parts, int attempt, const LiveJobs& live) {
  make_folders(request);
  request.jobs = live.jobs;
  write_request(request);
  for (const auto& [name, text] : slurm_scripts(request)) write_file(jobs_dir(request.out) + "/" + name, text);
  Submission submission(request, live.known());
  try {
    return submit_jobs(submission, request, parts, attempt);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}; {}", error.what(), submission.undo()));
  } catch (const std::exception& error) {
    throw SystemError(fmt::format("{}; {}", error.what(), submission.undo()));
  }
}

std::optional<SlurmRequest> find_request(const std::string& out) {
  const std::string path = request_file(out);
  const auto text = read_text(path);
  if (!text) return std::nullopt;
  return request_of_text(*text, out, path);
}

SlurmRequest read_request(const std::string& out) {
  auto request = find_request(out);
  if (request) return *std::move(request);
  throw InputError(
      fmt::format("'{}' is not there: give the directory that 'assay submit' was given with --out", request_file(out)));
}

}  // namespace assay
