#include "cluster/slurm.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json.h"
#include "base/text.h"
#include "cluster/program.h"
#include "store/store.h"

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
  return text;
}

std::string part_command(const SlurmRequest& request, const std::string& kind, int parts) {
  return fmt::format(
             "exec {} run {} --shard \"${{SLURM_ARRAY_TASK_ID}}/{}\" --cells {} --references {} --out {}/shards/{}-",
             shell_word(request.program), shell_word(request.campaign), parts, kind,
             shell_word(request.out + "/references"), shell_word(request.out), kind) +
         "\"${SLURM_ARRAY_TASK_ID}\"";
}

void write_text(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) throw SystemError(fmt::format("cannot write '{}'", path));
}

// Slurm's number of the job that `words` submit.
std::string submit(const std::vector<std::string>& words, const std::vector<std::string>& submitted) {
  const auto end = run_program(words);
  const auto take_back = [&] {
    for (const std::string& job : submitted) {
      if (!job.empty()) run_program({"scancel", job});
    }
  };
  if (!end) {
    throw InputError(
        "there is no Slurm here ('sbatch' is not in PATH): run this on a cluster's login node, or measure parts with "
        "'assay run --shard I/N'");
  }
  if (end->status != 0) {
    take_back();
    std::string why = end->error.substr(0, end->error.find('\n'));
    constexpr std::string_view kPrefix = "sbatch: error: ";
    if (why.starts_with(kPrefix)) why.erase(0, kPrefix.size());
    while (!why.empty() && (why.back() == '.' || why.back() == ' ')) why.pop_back();
    throw InputError(fmt::format("Slurm refuses the job: {}; nothing was submitted",
                                 why.empty() ? fmt::format("sbatch ended with status {}", end->status) : why));
  }
  // "12" or "12;cluster"
  std::string job = end->out.substr(0, end->out.find_first_of(";\n"));
  return job;
}

}  // namespace

json SlurmRequest::to_json() const {
  return {{"program", program},
          {"campaign", campaign},
          {"out", out},
          {"partition", partition},
          {"account", account},
          {"time_limit", time_limit},
          {"accuracy_parts", accuracy_parts},
          {"timing_parts", timing_parts},
          {"cpus", cpus},
          {"nodes", nodes},
          {"tries", tries}};
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
  request.cpus = from.at("cpus");
  request.nodes = from.at("nodes");
  request.tries = from.at("tries");
  return request;
}

Parts all_parts(const SlurmRequest& request) {
  Parts parts;
  for (int part = 1; part <= request.accuracy_parts; ++part) parts.accuracy.push_back(part);
  for (int part = 1; part <= request.timing_parts; ++part) parts.timing.push_back(part);
  return parts;
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
  if (request.accuracy_parts > 0) {
    scripts["accuracy.sh"] =
        options_of(request, "accuracy", true) + fmt::format("#SBATCH --cpus-per-task={}\n", request.cpus) +
        part_command(request, "accuracy", request.accuracy_parts) + fmt::format(" --jobs {}\n", request.cpus);
  }
  if (request.timing_parts > 0) {
    // assay pins the engine's process to one core of the node, which nobody else uses meanwhile
    scripts["timing.sh"] = options_of(request, "timing", true) + "#SBATCH --exclusive\n" +
                           part_command(request, "timing", request.timing_parts) + " --jobs 1\n";
  }
  scripts["finish.sh"] = options_of(request, "finish", false) +
                         fmt::format("exec {} submit --resume --out {} --attempt \"${{ASSAY_ATTEMPT:-1}}\"\n",
                                     shell_word(request.program), shell_word(request.out));
  return scripts;
}

std::string part_dir(const SlurmRequest& request, const std::string& kind, int part) {
  return fmt::format("{}/shards/{}-{}", request.out, kind, part);
}

Parts lost_parts(const SlurmRequest& request) {
  const auto is_lost = [&](const std::string& kind, int part) {
    const std::string dir = part_dir(request, kind, part);
    std::error_code error;
    if (!fs::is_regular_file(dir + "/assay.sqlite", error)) return true;
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
    if (is_lost("accuracy", part)) lost.accuracy.push_back(part);
  }
  for (const int part : all.timing) {
    if (is_lost("timing", part)) lost.timing.push_back(part);
  }
  return lost;
}

SlurmJobs submit_to_slurm(const SlurmRequest& request, const Parts& parts, int attempt) {
  std::error_code error;
  for (const std::string& folder : {jobs_dir(request.out), request.out + "/shards"}) {
    fs::create_directories(folder, error);
    if (error) throw SystemError(fmt::format("cannot make the directory '{}': {}", folder, error.message()));
  }
  write_text(jobs_dir(request.out) + "/request.json", dump_json(request.to_json(), 1) + "\n");
  for (const auto& [name, text] : slurm_scripts(request)) write_text(jobs_dir(request.out) + "/" + name, text);

  SlurmJobs jobs;
  const auto script = [&](const char* name) { return jobs_dir(request.out) + "/" + name; };
  std::vector<std::string> submitted;
  if (!parts.accuracy.empty()) {
    jobs.accuracy =
        submit({"sbatch", "--parsable", "--array=" + array_text(parts.accuracy), script("accuracy.sh")}, submitted);
    submitted.push_back(jobs.accuracy);
  }
  if (!parts.timing.empty()) {
    std::vector<std::string> words = {"sbatch", "--parsable",
                                      fmt::format("--array={}%{}", array_text(parts.timing), request.nodes)};
    // afterwards, so that the fine-step runs are there
    if (!jobs.accuracy.empty()) words.push_back("--dependency=afterany:" + jobs.accuracy);
    words.push_back(script("timing.sh"));
    jobs.timing = submit(words, submitted);
    submitted.push_back(jobs.timing);
  }
  std::vector<std::string> words = {"sbatch", "--parsable", fmt::format("--export=ALL,ASSAY_ATTEMPT={}", attempt)};
  if (!submitted.empty()) words.push_back("--dependency=afterany:" + join(submitted, ":"));
  words.push_back(script("finish.sh"));
  jobs.finish = submit(words, submitted);
  return jobs;
}

SlurmRequest read_request(const std::string& out) {
  const std::string path = jobs_dir(out) + "/request.json";
  std::ifstream file(path);
  if (!file) {
    throw InputError(
        fmt::format("'{}' is not there: give the directory that 'assay submit' was given with --out", path));
  }
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  try {
    SlurmRequest request = SlurmRequest::from_json(json::parse(text));
    request.out = fs::absolute(out).lexically_normal().string();
    return request;
  } catch (const json::exception&) {
    throw InputError(fmt::format("'{}' is damaged: submit the campaign again with 'assay submit --slurm'", path));
  }
}

}  // namespace assay
