// What an adapter costs: its step through the plugin against a loop written by hand over the engine's own API, on the
// same model from the same state. Both end in the same bits, or the comparison is void and the program says so with
// status 1.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/build_info.h"
#include "base/errors.h"
#include "base/paths.h"
#include "direct.h"
#include "engines/registry.h"
#include "load/mjcf.h"
#include "measures/statistics.h"

namespace assay::benchmarks {
namespace {

constexpr double kTarget = 1.01;
constexpr double kTimestep = 1e-3;          // s
constexpr double kBatchTime = 0.02;         // s, what a timed batch should take
constexpr int kFewest = 100, kMost = 5000;  // steps of a batch; the chain gains energy and must not blow up

constexpr int kWarmUp = 20;                  // steps
constexpr unsigned kLargestShift = 1 << 18;  // bytes

// CPU time of this thread, so that other processes on the machine matter less.
double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + (1e-9 * static_cast<double>(now.tv_nsec));
}

// The processor as Linux names it.
std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(std::min(line.find(':') + 2, line.size()));
  }
  return "unknown";
}

template <typename Body>
double timed(const Body& body) {
  const double start = cpu_seconds();
  body();
  return cpu_seconds() - start;
}

enum class Loop { kBatch, kStep, kTorque };

const char* loop_text(Loop loop) {
  switch (loop) {
    case Loop::kBatch:
      return "advance(n)";
    case Loop::kStep:
      return "advance(1) n times";
    case Loop::kTorque:
      return "set_torques, advance(1) n times";
  }
  return "";
}

using MakeDirect = decltype(DirectEntry::make);

struct Row {
  std::string contender, system;
  Loop loop = Loop::kBatch;
  int steps = 0;
  Interval ratio;                        // adapter over direct
  double adapter_us = 0, direct_us = 0;  // medians, per step
  double difference = 0;                 // m, largest between the final positions
};

class Comparison {
 public:
  Comparison(const Scene& scene, const ResolvedContender& contender, MakeDirect make_direct, double warm_up)
      : scene_(scene), engine_(contender.engine), settings_(contender.settings), make_direct_(make_direct) {
    settings_.timestep = kTimestep;
    torques_.assign(scene.model.joints.size(), 1e-3);
    // a state typical of the run
    const auto simulation = engine_->create(scene.model, scene.model.initial, settings_);
    simulation->advance(static_cast<int>(warm_up / kTimestep));
    simulation->read_state(start_);
  }

  Row run(Loop loop, int rounds) const {
    Row row;
    row.loop = loop;
    row.steps = calibrate(loop);
    std::vector<double> ratios, adapter, direct;
    for (int round = 0; round < rounds; ++round) {
      // A D D A, then D A A D: a drift of the machine's speed falls on both alike
      double a = 0, d = 0;
      for (int turn = 0; turn < 4; ++turn) {
        const bool adapter_turn = (turn == 0 || turn == 3) == (round % 2 == 0);
        std::vector<Vec3>& end = adapter_turn ? adapter_end_ : direct_end_;
        (adapter_turn ? a : d) += adapter_turn ? time_adapter(loop, row.steps, end) : time_direct(loop, row.steps, end);
      }
      ratios.push_back(a / d);
      adapter.push_back(a / 2 / row.steps * 1e6);
      direct.push_back(d / 2 / row.steps * 1e6);
      for (size_t i = 0; i < adapter_end_.size(); ++i) {
        const double difference = (adapter_end_[i] - direct_end_[i]).norm();
        row.difference = std::max(row.difference, std::isfinite(difference) ? difference : 1e30);
      }
    }
    row.ratio = bootstrap_median(ratios, 1);
    row.adapter_us = median(adapter);
    row.direct_us = median(direct);
    return row;
  }

 private:
  int calibrate(Loop loop) const {
    std::vector<Vec3> end;
    const double step = time_direct(loop, kFewest, end) / kFewest;
    return std::clamp(static_cast<int>(kBatchTime / step), kFewest, kMost);
  }

  // Each on a fresh instance at a random place of memory, its first steps (memory is touched) untimed.
  double time_adapter(Loop loop, int steps, std::vector<Vec3>& end) const {
    const std::vector<char> shift(random_() % kLargestShift);
    const auto simulation = engine_->create(scene_.model, start_, settings_);
    simulation->advance(kWarmUp);
    double seconds = 0;
    switch (loop) {
      case Loop::kBatch:
        seconds = timed([&] { simulation->advance(steps); });
        break;
      case Loop::kStep:
        seconds = timed([&] {
          for (int i = 0; i < steps; ++i) simulation->advance(1);
        });
        break;
      case Loop::kTorque:
        seconds = timed([&] {
          for (int i = 0; i < steps; ++i) simulation->step(torques_);
        });
        break;
    }
    State state;
    simulation->read_state(state);
    end.clear();
    for (const BodyState& body : state.bodies) end.push_back(body.p_WBcm);
    return seconds;
  }

  double time_direct(Loop loop, int steps, std::vector<Vec3>& end) const {
    const std::vector<char> shift(random_() % kLargestShift);
    const auto direct = make_direct_(scene_, start_, settings_);
    direct->run(kWarmUp);
    const double seconds = timed([&] {
      if (loop == Loop::kTorque) {
        direct->run_with_torques(torques_, steps);
      } else {
        direct->run(steps);
      }
    });
    end = direct->positions();
    return seconds;
  }

  const Scene& scene_;
  const Engine* engine_;
  Settings settings_;
  MakeDirect make_direct_;
  std::vector<double> torques_;
  State start_;
  mutable std::mt19937 random_{std::random_device{}()};
  mutable std::vector<Vec3> adapter_end_, direct_end_;
};

struct Subject {
  std::string contender;
  MakeDirect make_direct;
};

// The hand-written loops that were built, each in a library beside the program.
std::vector<Subject> find_subjects() {
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  std::error_code none;
  const fs::path folder = fs::path(program_path()).parent_path() / "../benchmarks/direct";
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (entry.path().extension() == ".so") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<Subject> result;
  for (const std::string& file : files) {
    void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) throw SystemError(fmt::format("cannot load a hand-written loop: {}", dlerror()));
    const auto describe = reinterpret_cast<void (*)(DirectEntry*)>(dlsym(library, "assay_direct_loop"));
    if (describe == nullptr) throw SystemError(fmt::format("'{}' does not end with ASSAY_DIRECT_LOOP(...)", file));
    DirectEntry entry;
    describe(&entry);
    for (const std::string& contender : entry.contenders) result.push_back({contender, entry.make});
  }
  return result;
}

const std::vector<Subject>& subjects() {
  static const std::vector<Subject> found = find_subjects();
  return found;
}

// Refused models, as contact by an engine that has none, have no row.
bool takes(const ResolvedContender& contender, const Model& model) {
  return std::ranges::none_of(contender.engine->check(model, contender.settings),
                              [](const Limitation& finding) { return finding.fidelity == Fidelity::kRefused; });
}

Scene load_scene(const std::string& name) {
  const std::string path = find_model(name);
  return {path, load_model(path)};
}

using Json = nlohmann::json;

Json row_json(const Row& row) {
  return {{"contender", row.contender},   {"system", row.system},
          {"loop", loop_text(row.loop)},  {"steps", row.steps},
          {"adapter_us", row.adapter_us}, {"direct_us", row.direct_us},
          {"ratio", row.ratio.value},     {"low", row.ratio.low},
          {"high", row.ratio.high},       {"difference_m", row.difference}};
}

// All rows, measured in this process.
Json measure(const std::string& only, int rounds) {
  const Scene chain = load_scene("planar-chain");
  const Scene capsules = load_scene("capsules-27");
  const Registry& registry = Registry::instance();
  const std::vector<std::string> present = registry.contender_names();
  Json rows = Json::array();
  for (const Subject& subject : subjects()) {
    if (!only.empty() && only != subject.contender) continue;
    if (std::ranges::find(present, subject.contender) == present.end()) continue;
    const ResolvedContender contender = registry.resolve(subject.contender);
    const auto compare = [&](const Scene& scene, const char* name, double warm_up, const std::vector<Loop>& loops) {
      if (!takes(contender, scene.model)) return;
      const Comparison comparison(scene, contender, subject.make_direct, warm_up);
      for (const Loop loop : loops) {
        Row row = comparison.run(loop, rounds);
        row.contender = subject.contender;
        row.system = name;
        rows.push_back(row_json(row));
      }
    };
    compare(chain, "planar-chain", 0, {Loop::kBatch, Loop::kStep, Loop::kTorque});
    compare(capsules, "capsules-27", 0.5, {Loop::kBatch, Loop::kStep});
  }
  return rows;
}

// The same in a process of its own: where memory and code happen to lie moves a ratio by a percent for a whole process.
Json measure_in_child(const std::string& only, int rounds) {
  std::string command = fmt::format("'{}' --processes 1 --json --rounds {}", program_path(), rounds);
  if (!only.empty()) command += " --contender " + only;
  FILE* pipe = popen(command.c_str(), "r");  // NOLINT(bugprone-command-processor): our own program and checked words
  if (pipe == nullptr) throw SystemError("cannot start a process");
  std::string text;
  std::array<char, 4096> buffer{};
  for (size_t got = 0; (got = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) text.append(buffer.data(), got);
  pclose(pipe);
  return Json::parse(text).at("rows");
}

// Row by row the median over processes; the interval is that of the processes' medians.
Json over_processes(const std::string& only, int rounds, int processes) {
  std::vector<Json> runs;
  runs.reserve(processes);
  for (int i = 0; i < processes; ++i) {
    runs.push_back(measure_in_child(only, rounds));
    fmt::print(stderr, "process {} of {} done\n", i + 1, processes);
  }
  Json rows = runs.front();
  for (size_t i = 0; i < rows.size(); ++i) {
    const auto collect = [&](const char* key) {
      std::vector<double> values;
      values.reserve(runs.size());
      for (const Json& run : runs) values.push_back(run.at(i).at(key).get<double>());
      return values;
    };
    const Interval ratio = bootstrap_median(collect("ratio"), 1);
    rows[i]["ratio"] = ratio.value;
    rows[i]["low"] = ratio.low;
    rows[i]["high"] = ratio.high;
    for (const char* key : {"adapter_us", "direct_us"}) rows[i][key] = median(collect(key));
    rows[i]["difference_m"] = std::ranges::max(collect("difference_m"));
  }
  return rows;
}

void print_table(const Json& rows) {
  fmt::print("{:<18} {:<13} {:<32} {:>10} {:>9}  ratio\n", "contender", "system", "loop", "adapter us", "direct us");
  for (const Json& row : rows) {
    const auto text = [&](const char* key) { return row.at(key).get<std::string>(); };
    const auto number = [&](const char* key) { return row.at(key).get<double>(); };
    const double difference = number("difference_m");
    fmt::print("{:<18} {:<13} {:<32} {:>10.3f} {:>9.3f}  {:.4f} [{:.4f}, {:.4f}]  {}\n", text("contender"),
               text("system"), text("loop"), number("adapter_us"), number("direct_us"), number("ratio"), number("low"),
               number("high"), difference == 0 ? "same bits" : fmt::format("differs by {:.1e} m", difference));
  }
  fmt::print("target: at most {} in the median; on {}\n", kTarget, cpu_name());
}

int main_or_throw(int argc, char** argv) {
  CLI::App app(
      "Cost of an adapter's step against a loop over the engine's own API: CPU time of the thread, median of "
      "paired ratios with its 95 % bootstrap interval.");
  int rounds = 10;
  int processes = 9;
  bool json = false;
  std::string only;
  app.add_option("--rounds", rounds, "rounds a row and process, each of two batches either way")
      ->check(CLI::Range(1, 100000));
  app.add_option("--processes", processes, "processes that repeat it all, one after the other")
      ->check(CLI::Range(1, 1000));
  std::vector<std::string> names;
  for (const Subject& subject : subjects()) names.push_back(subject.contender);
  app.add_option("--contender", only, "only this contender")->check(CLI::IsMember(names));
  app.add_flag("--json", json, "JSON on standard output");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  const Json rows = processes == 1 ? measure(only, rounds) : over_processes(only, rounds, processes);
  if (json) {
    const Json result = {{"version", kVersion},        {"commit", kGitCommit},
                         {"cpu", cpu_name()},          {"compiler", ASSAY_BUILD_COMPILER},
                         {"flags", ASSAY_BUILD_FLAGS}, {"timestep_ms", kTimestep * 1e3},
                         {"rounds", rounds},           {"processes", processes},
                         {"target", kTarget},          {"rows", rows}};
    fmt::print("{}\n", result.dump(2));
  } else {
    print_table(rows);
  }
  const auto same = [](const Json& row) { return row.at("difference_m") == 0.0; };
  if (!std::ranges::all_of(rows, same)) {
    fmt::print(stderr, "an adapter and its hand-written loop ended in different states\n");
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace assay::benchmarks

int main(int argc, char** argv) {
  try {
    return assay::benchmarks::main_or_throw(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
