// What an adapter costs: its step through the plugin against a loop written by hand over the engine's own API, on the
// same model from the same state. Both end in the same bits, or the comparison is void and the program says so with
// status 1.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/build_info.h"
#include "base/paths.h"
#include "direct.h"
#include "engines/registry.h"
#include "measures/statistics.h"
#include "model/mjcf.h"

namespace assay::benchmarks {
namespace {

constexpr double kTarget = 1.01;
constexpr double kTimestep = 1e-3;          // s
constexpr double kBatchTime = 0.02;         // s, what a timed batch should take
constexpr int kFewest = 100, kMost = 5000;  // steps of a batch; the chain gains energy and must not blow up

// Time of this thread alone, so that other processes on the machine count less.
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

using MakeDirect = std::function<std::unique_ptr<Direct>(const Scene&, const State&, const Settings&)>;

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
      : scene_(scene), engine_(contender.engine), settings_(contender.settings), make_direct_(std::move(make_direct)) {
    settings_.timestep = kTimestep;
    torques_.assign(scene.model.hinges.size(), 1e-3);
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
        row.difference = difference <= row.difference ? row.difference : difference;  // keeps NaN
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

  // Each on a fresh instance, the first step untimed.
  double time_adapter(Loop loop, int steps, std::vector<Vec3>& end) const {
    const auto simulation = engine_->create(scene_.model, start_, settings_);
    simulation->advance(1);
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
    const auto direct = make_direct_(scene_, start_, settings_);
    direct->run(1);
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
  mutable std::vector<Vec3> adapter_end_, direct_end_;
};

struct Subject {
  const char* contender;
  MakeDirect make_direct;
};

std::vector<Subject> subjects() {
  return {
#ifdef ASSAY_DIRECT_MUJOCO
      {"mujoco-euler", direct_mujoco},
#endif
#ifdef ASSAY_DIRECT_BULLET
      {"bullet-si-f64", direct_bullet},
#endif
#ifdef ASSAY_DIRECT_ODE
      {"ode-quick", direct_ode},
#endif
  };
}

Scene load_scene(const std::string& name) {
  const std::string path = find_model(name);
  return {path, load_model(path)};
}

void print_row(const Row& row) {
  fmt::print("{:<14} {:<13} {:<32} {:>6} {:>9.3f} {:>9.3f}   {:.4f} [{:.4f}, {:.4f}]  {}\n", row.contender, row.system,
             loop_text(row.loop), row.steps, row.adapter_us, row.direct_us, row.ratio.value, row.ratio.low,
             row.ratio.high, row.difference == 0 ? "same bits" : fmt::format("differs by {:.1e} m", row.difference));
  std::fflush(stdout);
}

nlohmann::json row_json(const Row& row) {
  return {{"contender", row.contender},   {"system", row.system},
          {"loop", loop_text(row.loop)},  {"steps", row.steps},
          {"adapter_us", row.adapter_us}, {"direct_us", row.direct_us},
          {"ratio", row.ratio.value},     {"low", row.ratio.low},
          {"high", row.ratio.high},       {"same_bits", row.difference == 0}};
}

int main_or_throw(int argc, char** argv) {
  CLI::App app(
      "Cost of an adapter's step against a loop over the engine's own API: CPU time of the thread, median of "
      "paired ratios with its 95 % bootstrap interval.");
  int rounds = 60;
  bool json = false;
  std::string only;
  app.add_option("--rounds", rounds, "rounds a row, each of two batches either way")->check(CLI::Range(1, 100000));
  std::vector<std::string> names;
  for (const Subject& subject : subjects()) names.emplace_back(subject.contender);
  app.add_option("--contender", only, "this contender alone")->check(CLI::IsMember(names));
  app.add_flag("--json", json, "JSON on standard output");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  if (!json) {
    fmt::print("{:<14} {:<13} {:<32} {:>6} {:>9} {:>9}   {}\n", "contender", "system", "loop", "steps", "adapter us",
               "direct us", "ratio");
  }
  const Scene chain = load_scene("planar-chain");
  const Scene capsules = load_scene("capsules-27");
  const Registry& registry = Registry::instance();
  const std::vector<std::string> present = registry.contender_names();
  nlohmann::json rows = nlohmann::json::array();
  bool same = true;
  for (const Subject& subject : subjects()) {
    if (!only.empty() && only != subject.contender) continue;
    if (std::ranges::find(present, subject.contender) == present.end()) continue;
    const ResolvedContender contender = registry.resolve(subject.contender);
    const auto measure = [&](const Scene& scene, const char* name, double warm_up, const std::vector<Loop>& loops) {
      const Comparison comparison(scene, contender, subject.make_direct, warm_up);
      for (const Loop loop : loops) {
        Row row = comparison.run(loop, rounds);
        row.contender = subject.contender;
        row.system = name;
        same = same && row.difference == 0;
        if (json) {
          rows.push_back(row_json(row));
        } else {
          print_row(row);
        }
      }
    };
    measure(chain, "planar-chain", 0, {Loop::kBatch, Loop::kStep, Loop::kTorque});
    measure(capsules, "capsules-27", 0.5, {Loop::kBatch, Loop::kStep});
  }
  if (json) {
    const nlohmann::json result = {{"version", kVersion},
                                   {"commit", kGitCommit},
                                   {"cpu", cpu_name()},
                                   {"compiler", ASSAY_BUILD_COMPILER},
                                   {"flags", ASSAY_BUILD_FLAGS},
                                   {"timestep_ms", kTimestep * 1e3},
                                   {"rounds", rounds},
                                   {"target", kTarget},
                                   {"rows", rows}};
    fmt::print("{}\n", result.dump(2));
  } else {
    fmt::print("target: at most {} in the median; on {}\n", kTarget, cpu_name());
  }
  if (!same) fmt::print(stderr, "an adapter and its hand-written loop ended in different states\n");
  return same ? 0 : 1;
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
