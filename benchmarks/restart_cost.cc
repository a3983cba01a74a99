// What it changes in a contender's step time that the timing starts its windows from states: the same steps of one
// whole run, and of simulations that are created anew from that run's states and take the timing's warm-up first.
//
//   assay_benchmark_restart_cost CONTENDER... [--system capsules-27] [--timestep MS] [--duration S] [--windows N]
//       [--steps N] [--warmup N] [--repeats N]
//
// Both do the same work where the engine's state is all in positions and velocities. So the least time of a window's
// repeats is compared, which other work on the machine can only miss from above. Prints for each contender the step
// time of the whole run's windows, that of the fresh ones, their ratio, and the quartiles of the windows' ratios.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/paths.h"
#include "engines/registry.h"
#include "load/mjcf.h"

namespace {

using namespace assay;

struct Options {
  std::vector<std::string> contenders;
  std::string system = "capsules-27";
  double timestep_ms = 1, duration_s = 3.2;
  int windows = 16, steps = 50, warmup = 3, repeats = 7;
};

double timed_us(Simulation& simulation, int steps) {
  const auto start = std::chrono::steady_clock::now();
  simulation.advance(steps);
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count() / steps;
}

struct Times {
  std::vector<double> whole, fresh;  // least time of a step of each window, us
};

Times measure(const Options& options, const Model& model, const ResolvedContender& contender) {
  const auto count = static_cast<size_t>(options.windows);
  const int all = static_cast<int>(std::lround(1e3 * options.duration_s / options.timestep_ms));
  Times times{std::vector<double>(count, std::numeric_limits<double>::infinity()),
              std::vector<double>(count, std::numeric_limits<double>::infinity())};
  const auto create = [&](const State& from) { return contender.engine->create(model, from, contender.settings); };
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    std::vector<State> states(count);
    const auto run = create(model.initial);
    int done = 0;
    for (size_t window = 0; window < count; ++window) {
      const int at = static_cast<int>(static_cast<size_t>(all) * window / count);
      if (at > done) run->advance(at - done);
      run->read_state(states[window]);
      run->advance(options.warmup);
      times.whole[window] = std::min(times.whole[window], timed_us(*run, options.steps));
      done = at + options.warmup + options.steps;
    }
    for (size_t window = 0; window < count; ++window) {
      const auto fresh = create(states[window]);
      fresh->advance(options.warmup);
      times.fresh[window] = std::min(times.fresh[window], timed_us(*fresh, options.steps));
    }
  }
  return times;
}

void report(const std::string& name, const Times& times) {
  const auto mean = [](const std::vector<double>& of) {
    return std::accumulate(of.begin(), of.end(), 0.0) / static_cast<double>(of.size());
  };
  std::vector<double> ratios;
  ratios.reserve(times.whole.size());
  for (size_t i = 0; i < times.whole.size(); ++i) ratios.push_back(times.fresh[i] / times.whole[i]);
  std::ranges::sort(ratios);
  fmt::print("| {} | {:.2f} | {:.2f} | {:.3f} | {:.3f} | {:.3f} |\n", name, mean(times.whole), mean(times.fresh),
             mean(times.fresh) / mean(times.whole), ratios[ratios.size() / 4], ratios[ratios.size() * 3 / 4]);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Step times of windows that start from states, and of the same steps of a whole run");
  Options options;
  app.add_option("contenders", options.contenders)->required();
  app.add_option("--system", options.system, "one without torques and explicit springs");
  app.add_option("--timestep", options.timestep_ms, "ms")->check(CLI::PositiveNumber);
  app.add_option("--duration", options.duration_s, "s")->check(CLI::PositiveNumber);
  app.add_option("--windows", options.windows)->check(CLI::PositiveNumber);
  app.add_option("--steps", options.steps, "of a window")->check(CLI::PositiveNumber);
  app.add_option("--warmup", options.warmup, "steps before a window")->check(CLI::NonNegativeNumber);
  app.add_option("--repeats", options.repeats)->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    if (1e3 * options.duration_s / options.timestep_ms < 1.0 * options.windows * (options.steps + options.warmup)) {
      throw std::invalid_argument("the windows do not fit into the run: give fewer, or shorter ones");
    }
    const Model model = load_model(find_model(options.system));
    fmt::print(
        "| contender | whole run, us a step | from states | ratio | quartile | quartile |\n"
        "| --- | ---: | ---: | ---: | ---: | ---: |\n");
    for (const std::string& name : options.contenders) {
      ResolvedContender contender = Registry::instance().resolve(name);
      contender.settings.timestep = options.timestep_ms / 1e3;
      report(name, measure(options, model, contender));
      std::fflush(stdout);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
