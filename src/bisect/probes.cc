#include "bisect/probes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <iterator>
#include <memory>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "base/text.h"
#include "conformance/conformance.h"
#include "isolate/child.h"
#include "run/coordinator/pool.h"

namespace assay {
namespace {

constexpr size_t kColumns = 5;

std::vector<std::string> columns_of(const std::string& line) {
  std::vector<std::string> columns;
  std::istringstream text(line);
  for (std::string column; std::getline(text, column, '\t');) columns.push_back(column);
  return columns;
}

std::string probe_program(const std::string& plugin) { return std::filesystem::path(plugin).parent_path() / "probes"; }

// What moves freely, joints, closed loops, limits and friction of joints, contacts by shape, friction, impacts, stacks.
constexpr std::array kSuiteProbes = {"free-fall",
                                     "fast-motion",
                                     "torque-free-top",
                                     "pendulum-period",
                                     "planar-chain",
                                     "spatial-chain",
                                     "spring-damper",
                                     "armature",
                                     "joint-limit",
                                     "slide-limit",
                                     "dry-friction",
                                     "coupling",
                                     "connect",
                                     "weld",
                                     "tendon-limit",
                                     "ball-spring",
                                     "resting-height",
                                     "resting-shapes",
                                     "bodies-collide",
                                     "sliding-capsule",
                                     "sphere-rolls",
                                     "rolling-slows",
                                     "friction-per-pair",
                                     "friction-of-links",
                                     "friction-directions",
                                     "box-slides",
                                     "hull-slides",
                                     "box-tips",
                                     "cylinder-rolls",
                                     "ellipsoid-rocks",
                                     "height-field",
                                     "torsional-friction",
                                     "inelastic-impact",
                                     "armature-impact",
                                     "stick-and-slip",
                                     "stacks-at-rest",
                                     "stack-10",
                                     "stack-1000",
                                     "contact-forces"};
constexpr double kCounts = 0.01;          // of a test's tolerance
constexpr double kMostProbeSeconds = 60;  // of one test

// Runs tests of the suite in worker processes; one that ends its worker is left out.
class SuiteProbes {
 public:
  SuiteProbes(const Side& side, int jobs, const std::function<void(size_t, size_t)>& progress)
      : contender_({side.contender, recipe_of(side).contender.base, recipe_of(side).overrides}),
        progress_(progress),
        jobs_(static_cast<size_t>(std::max(1, jobs))),
        pool_(program_path(), std::max(1, jobs), interrupts_) {}

  ProbeRun run() {
    std::vector<std::vector<std::string>> parts(jobs_);
    for (size_t i = 0; i < kSuiteProbes.size(); ++i) parts[i % jobs_].emplace_back(kSuiteProbes[i]);
    for (std::vector<std::string>& part : parts) add(std::move(part));
    pool_.run({});
    if (interrupts_.signal() != 0) throw SystemError("interrupted: nothing was found out");
    ProbeRun run;
    for (const char* test : kSuiteProbes) {  // in this order, whichever process was first
      std::ranges::copy_if(values_, std::back_inserter(run.values),
                           [&](const ProbeValue& value) { return value.condition == test; });
    }
    if (run.values.empty()) run.failure = why_.empty() ? "no test of the conformance suite applies" : why_;
    return run;
  }

 private:
  void add(std::vector<std::string> tests) {
    if (tests.empty()) return;
    Job job;
    job.request = ConformanceJob{contender_, tests};
    job.title = "conformance " + contender_.name;
    job.limit_s = kMostProbeSeconds;
    auto ran = std::make_shared<size_t>(0);
    job.on_test = [this, ran](const TestResult& result) {
      ++*ran;
      take(result);
      if (progress_) progress_(++done_, kSuiteProbes.size());
    };
    job.on_end = [this, ran, tests = std::move(tests)](const JobEnd& end) {
      size_t next = *ran;
      if (!end.answer) {
        if (next < tests.size()) why_ = fmt::format("{} ends the process: {}", tests[next], end.failure.reason);
        ++next;
      } else if (next == 0) {  // it has no memory left for any
        next = tests.size();
      }
      if (next < tests.size()) add({tests.begin() + static_cast<std::ptrdiff_t>(next), tests.end()});
    };
    pool_.add(std::move(job));
  }

  void take(const TestResult& result) {
    const ConformanceStatus status = parse_conformance_status(result.status);
    if (status == ConformanceStatus::kNotApplicable || status == ConformanceStatus::kNotRun) return;
    const bool passed = status != ConformanceStatus::kFail;
    const double tolerance = result.tolerance.value_or(0);
    if (passed || tolerance > 0) {  // a failure may have no figure
      values_.push_back(
          {"conformance", result.test, "figure", result.unit, result.figure.value_or(0), kCounts * tolerance});
    }
    values_.push_back({"conformance", result.test, "passed", "", passed ? 1.0 : 0.0});
    if (!passed) why_ = fmt::format("{} fails: {}", result.test, result.note);
  }

  ContenderSpec contender_;
  const std::function<void(size_t, size_t)>& progress_;
  size_t jobs_, done_ = 0;
  Interrupts interrupts_;
  Pool pool_;
  std::vector<ProbeValue> values_;
  std::string why_;
};

}  // namespace

bool has_probe_program(const std::string& plugin) {
  std::error_code error;
  return std::filesystem::exists(probe_program(plugin), error);
}

std::span<const char* const> suite_probes() { return kSuiteProbes; }

ProbeRun run_suite_probes(const Side& side, int jobs, const std::function<void(size_t done, size_t of)>& progress) {
  return SuiteProbes(side, jobs, progress).run();
}

ProbeRun run_probes(const std::string& plugin, double limit_s) {
  ProbeRun run;
  const std::string program = probe_program(plugin);
  Pipe ends = make_pipe();
  const pid_t child = start_child([&] {
    ::alarm(static_cast<unsigned>(std::ceil(limit_s)));
    ::dup2(ends.writing.get(), STDOUT_FILENO);
    ::dup2(::open("/dev/null", O_WRONLY | O_CLOEXEC), STDERR_FILENO);  // NOLINT(*-vararg)
    ::execl(program.c_str(), program.c_str(), nullptr);                // NOLINT(*-vararg)
    return 127;
  });
  ends.writing.close();
  const std::string said = read_to_end(ends.reading.get());
  const int status = wait_for(child);
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::string> columns = columns_of(line);
    if (columns.size() != kColumns || columns[0] == "version") continue;
    const auto value = parse_number(columns[4]);
    if (value) run.values.push_back({columns[0], columns[1], columns[2], columns[3], *value});
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    run.failure = fmt::format("probes took more than {:g} s", limit_s);
  } else if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    run.failure = fmt::format("probes ended early ({})", end_text(status));
  }
  return run;
}

std::vector<ProbeChange> probe_changes(const std::vector<ProbeValue>& before, const std::vector<ProbeValue>& after) {
  constexpr double kRelative = 1e-9, kAbsolute = 1e-12;
  std::vector<ProbeChange> changes;
  for (const ProbeValue& old : before) {
    const auto found = std::ranges::find_if(after, [&](const ProbeValue& each) {
      return each.probe == old.probe && each.condition == old.condition && each.quantity == old.quantity;
    });
    if (found == after.end()) continue;
    const double larger = std::max(std::abs(old.value), std::abs(found->value));
    if (std::abs(old.value - found->value) > std::max({kAbsolute, kRelative * larger, old.least, found->least}))
      changes.push_back({old, found->value});
  }
  return changes;
}

std::string probe_change_text(const ProbeChange& change) {
  const ProbeValue& of = change.before;
  const std::string unit = of.unit.empty() || of.unit == "1" ? "" : " " + of.unit;
  return fmt::format("{} ({}): {} {:.4g} to {:.4g}{}", of.probe, of.condition, of.quantity, of.value, change.after,
                     unit);
}

}  // namespace assay
