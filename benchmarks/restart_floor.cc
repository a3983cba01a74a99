// Whether a run-in lowers the restart floor: how far pieces that start from states of a run are from that run at their
// end, when they start at the piece's beginning and when they start some steps earlier, at the same timestep.
//
//   assay_benchmark_restart_floor CONTENDER... [--system capsules-27] [--timestep MS] [--duration S] [--pieces N]
//       [--piece MS] [--run-in STEPS,...]
//
// An engine that begins again without its contact points and impulses makes an error in the first steps; a run-in lets
// it find both before the piece begins, but makes that error too. Prints for each contender and length of the run-in
// the mean distance of the bodies' centres of mass from the run, in mm, at the beginning of the piece and at its end,
// over all pieces, and the largest at the end.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
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
  double timestep_ms = 0.125, duration_s = 3.2, piece_ms = 128;
  int pieces = 20;
  std::vector<int> run_in = {0, 8, 64, 512};  // steps
};

double distance_mm(const State& a, const State& b) {
  double sum = 0;
  for (size_t i = 0; i < a.bodies.size(); ++i) sum += (a.bodies[i].p_WBcm - b.bodies[i].p_WBcm).norm();
  return 1e3 * sum / static_cast<double>(a.bodies.size());
}

void measure(const Options& options, const Model& model, const ResolvedContender& contender) {
  const auto create = [&](const State& from) { return contender.engine->create(model, from, contender.settings); };
  const auto steps = [&](double ms) { return static_cast<int>(std::lround(ms / options.timestep_ms)); };
  const int piece = steps(options.piece_ms), all = steps(1e3 * options.duration_s);
  // Pieces lie evenly between the longest run-in and the run's end.
  const int first = std::ranges::max(options.run_in);
  std::vector<int> begins;
  begins.reserve(static_cast<size_t>(options.pieces));
  for (int i = 0; i < options.pieces; ++i) begins.push_back(first + (all - piece - first) * i / options.pieces);
  std::map<int, State> states;
  for (const int begin : begins) {
    states[begin], states[begin + piece];
    for (const int run_in : options.run_in) states[begin - run_in];
  }
  const auto run = create(model.initial);
  int done = 0;
  for (auto& [at, state] : states) {
    if (at > done) run->advance(at - done);
    done = at;
    run->read_state(state);
  }
  for (const int run_in : options.run_in) {
    double at_begin = 0, at_end = 0, largest = 0;
    for (const int begin : begins) {
      const auto restarted = create(states[begin - run_in]);
      State state;
      if (run_in > 0) restarted->advance(run_in);
      restarted->read_state(state);
      at_begin += distance_mm(state, states[begin]) / options.pieces;
      restarted->advance(piece);
      restarted->read_state(state);
      const double end = distance_mm(state, states[begin + piece]);
      at_end += end / options.pieces;
      largest = std::max(largest, end);
    }
    fmt::print("| {} | {} | {:.2g} | {:.2g} | {:.2g} |\n", contender.name, run_in, at_begin, at_end, largest);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The restart floor of pieces that start some steps earlier");
  Options options;
  app.add_option("contenders", options.contenders)->required();
  app.add_option("--system", options.system, "one without torques and explicit springs");
  app.add_option("--timestep", options.timestep_ms, "ms")->check(CLI::PositiveNumber);
  app.add_option("--duration", options.duration_s, "s")->check(CLI::PositiveNumber);
  app.add_option("--pieces", options.pieces)->check(CLI::PositiveNumber);
  app.add_option("--piece", options.piece_ms, "ms")->check(CLI::PositiveNumber);
  app.add_option("--run-in", options.run_in, "steps")->delimiter(',')->check(CLI::NonNegativeNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    if (1e3 * options.duration_s <
        options.piece_ms + options.timestep_ms * (std::ranges::max(options.run_in) + options.pieces)) {
      throw std::invalid_argument("the pieces do not fit into the run: give fewer or shorter ones, or a longer run");
    }
    const Model model = load_model(find_model(options.system));
    fmt::print(
        "| contender | run-in, steps | at the piece's beginning, mm | at its end | largest at its end |\n"
        "| --- | ---: | ---: | ---: | ---: |\n");
    for (const std::string& name : options.contenders) {
      ResolvedContender contender = Registry::instance().resolve(name);
      contender.settings.timestep = options.timestep_ms / 1e3;
      measure(options, model, contender);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
