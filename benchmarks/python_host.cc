// Times of calls of advance() through the interface, for benchmarks/python_host.py: one JSON list of numbers, µs a
// step.
#include <ctime>
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/paths.h"
#include "engines/registry.h"
#include "load/mjcf.h"

namespace {

struct Options {
  std::string contender, system = "planar-chain";
  double timestep_ms = 1;
  int steps = 1000, calls = 1, rounds = 20;
};

// Processor time: other work on the machine does not count. Of the process, because XLA steps in a thread of its own.
double cpu_time_us() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return (1e6 * static_cast<double>(now.tv_sec)) + (1e-3 * static_cast<double>(now.tv_nsec));
}

nlohmann::json measure(const Options& options) {
  using namespace assay;
  const Model model = without_contacts(load_model(find_model(options.system)));
  ResolvedContender contender = Registry::instance().resolve(options.contender);
  contender.settings.timestep = options.timestep_ms / 1e3;
  const std::unique_ptr<Simulation> simulation = contender.engine->create(model, model.initial, contender.settings);
  simulation->advance(options.steps);
  nlohmann::json times = nlohmann::json::array();
  for (int round = 0; round < options.rounds; ++round) {
    const double start = cpu_time_us();
    for (int call = 0; call < options.calls; ++call) simulation->advance(options.steps);
    times.push_back((cpu_time_us() - start) / options.steps / options.calls);
  }
  return times;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Times of advance() through the interface, µs a step");
  Options options;
  app.add_option("contender", options.contender)->required();
  app.add_option("--system", options.system);
  app.add_option("--timestep", options.timestep_ms, "ms");
  app.add_option("--steps", options.steps, "of a call")->check(CLI::PositiveNumber);
  app.add_option("--calls", options.calls, "of a round")->check(CLI::PositiveNumber);
  app.add_option("--rounds", options.rounds)->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    std::cout << measure(options) << "\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}
