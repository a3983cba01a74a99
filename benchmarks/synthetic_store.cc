// Writes results directories as a large campaign leaves them, with made-up figures: for measuring what reads and unites
// them, best in memory (/dev/shm), because each cell is a transaction. `assay_synthetic_store DIR --cells 100000 --runs
// 10000 --shards 100` makes DIR/shards/1 to 100; `assay_synthetic_store DIR --plan FILE --campaign NAME --hash HASH`
// makes DIR, in which all cells of a plan (assay_division) are measured.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"

namespace assay {
namespace {

constexpr int kSystems = 50, kContenders = 40, kRounds = 20, kPieces = 100;
const std::vector<std::string> kMeasures = {"reference", "consistency", "truth", "drift", "raw_speed"};

struct Asked {
  std::string dir, plan, campaign, hash;
  long long cells = 100000, runs = 10000;
  int shards = 100;
};

std::string system_name(long long index) { return fmt::format("system-{:02}", index); }
std::string contender_name(long long index) { return fmt::format("contender-{:02}", index); }

void describe(Store& store) {
  std::vector<SystemRow> systems;
  systems.reserve(kSystems);
  for (int s = 0; s < kSystems; ++s) {
    systems.push_back({system_name(s), nlohmann::json{{"model_hash", content_hash(system_name(s))},
                                                      {"bodies", 20},
                                                      {"dof", 26},
                                                      {"reference_ms", 0.015625},
                                                      {"duration_s", 2}}
                                           .dump()});
  }
  store.set_systems(systems);
  std::vector<ContenderRow> contenders;
  contenders.reserve(kContenders);
  for (int c = 0; c < kContenders; ++c) {
    contenders.push_back({contender_name(c), fmt::format("engine-{}", c / 4), "1.0", contender_name(c),
                          fmt::format("number={}", c), "{}", "{}"});
  }
  store.set_contenders(contenders);
  store.set_manifest({{"cpu", "Synthetic"}, {"cores", "2"}, {"seed", "1"}, {"commit", "0"}, {"started", "2026-01-01"}});
}

// The cell of this number: system by system, so that a shard has whole systems.
Cell make_cell(long long index, long long cells, std::mt19937_64& random, std::vector<SampleSeries>& samples) {
  std::normal_distribution<double> normal;
  const long long per_system = (cells + kSystems - 1) / kSystems;
  const long long of_system = index % per_system, contender = of_system % kContenders,
                  of_pair = of_system / kContenders;
  Cell cell;
  cell.key = content_hash(std::to_string(index));
  cell.system = system_name(index / per_system);
  cell.contender = contender_name(contender);
  cell.measure = kMeasures[static_cast<size_t>(of_pair) % kMeasures.size()];
  cell.timestep_ms = std::ldexp(0.015625, static_cast<int>(of_pair / std::ssize(kMeasures)));
  cell.wall_s = cell.cpu_s = cell.engine_s = 0.1;
  cell.started = 1.7e9 + static_cast<double>(index);
  cell.finished = cell.started + 1;
  const double error = 1e-5 * cell.timestep_ms * std::exp(normal(random));
  samples.clear();
  if (cell.measure == "consistency") {
    cell.values = {{"consistency", "m", error, 0.9 * error, 1.1 * error}};
    samples.push_back({"piece_error_m", {}});
    for (int i = 0; i < kPieces; ++i) samples.back().values.push_back(error * std::exp(normal(random)));
  } else if (cell.measure == "truth") {
    cell.values = {{"truth_error", "m", error, {}, {}}, {"truth_rounding", "m", 1e-12, {}, {}}};
  } else if (cell.measure == "drift") {
    cell.values = {{"energy_drift", "J", error, {}, {}}, {"energy_drift_relative", "1", error, {}, {}}};
  } else if (cell.measure == "raw_speed") {
    const double time = (1 + static_cast<double>(contender)) * std::exp(0.1 * normal(random));
    cell.values = {{"step_time", "us", time, 0.99 * time, 1.01 * time},
                   {"raw_speed", "kHz", 1e3 / time, 990 / time, 1010 / time},
                   {"realtime_factor", "1", 1e3 * cell.timestep_ms / time, 990 * cell.timestep_ms / time,
                    1010 * cell.timestep_ms / time}};
    SampleSeries rounds = {"round_step_time_us", {}}, processes = {"process", {}};
    for (int i = 0; i < kRounds; ++i) {
      rounds.values.push_back(time * std::exp(0.01 * normal(random)));
      processes.values.push_back(i);
    }
    samples = {rounds, processes};
  }
  return cell;
}

void write(const Asked& asked) {
  Trajectory run;
  run.states.resize(16);
  for (State& state : run.states) state.bodies.resize(20);
  for (int shard = 1; shard <= asked.shards; ++shard) {
    Store store =
        Store::create(fmt::format("{}/shards/{}", asked.dir, shard), {"synthetic", content_hash("synthetic")});
    describe(store);
    store.set_node(
        {fmt::format("node-{:04}", shard), nlohmann::json{{"name", fmt::format("node-{:04}", shard)},
                                                          {"cpu", "Synthetic"},
                                                          {"cores", "2"},
                                                          {"shard", fmt::format("{}/{}", shard, asked.shards)},
                                                          {"cells", "all"},
                                                          {"jobs", 1},
                                                          {"started", "2026-01-01"},
                                                          {"finished", "2026-01-02"},
                                                          {"wall_s", "10.0"}}
                                               .dump()});
    // A shard has whole systems where there are fewer shards than systems; else the timings of one system stay
    // together.
    std::mt19937_64 random(static_cast<std::uint64_t>(shard));
    std::vector<SampleSeries> samples;
    std::vector<PlanRow> plan;
    std::vector<RunRow> runs;
    const long long per_system = (asked.cells + kSystems - 1) / kSystems;
    for (long long index = 0; index < asked.cells; ++index) {
      const long long system = index / per_system, of_pair = index % per_system / kContenders;
      const bool timed = kMeasures[static_cast<size_t>(of_pair) % kMeasures.size()] == "raw_speed";
      const long long mine = timed ? system % asked.shards : index % asked.shards;
      if (mine + 1 != shard) continue;
      const Cell cell = make_cell(index, asked.cells, random, samples);
      store.put_cell(cell, samples);
      plan.push_back({cell.key, shard, 0.1, !timed});
    }
    for (long long index = shard - 1; index < asked.runs; index += asked.shards) {
      const std::string address = content_hash("run " + std::to_string(index));
      write_trajectory(store.trajectories_dir(), address, run);
      runs.push_back({address, system_name(index % kSystems), contender_name(index / kSystems % kContenders),
                      std::ldexp(0.015625, static_cast<int>(index / kSystems / kContenders))});
    }
    store.set_runs(runs);
    store.set_plan(plan);
  }
}

// All cells of a plan: key,shard,system,contender,timestep_ms,measure.
void write_plan(const Asked& asked) {
  Store store = Store::create(asked.dir, {asked.campaign, asked.hash});
  std::ifstream file(asked.plan);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<std::string> fields(1);
    for (const char c : line) {
      if (c == ',') {
        fields.emplace_back();
      } else {
        fields.back() += c;
      }
    }
    Cell cell;
    cell.key = fields.at(0);
    cell.system = fields.at(2);
    cell.contender = fields.at(3);
    cell.timestep_ms = std::stod(fields.at(4));
    cell.measure = fields.at(5);
    if (cell.measure == "truth") cell.values = {{"truth_error_max", "m", 1e-5 * cell.timestep_ms, {}, {}}};
    store.put_cell(cell);
  }
}

}  // namespace
}  // namespace assay

int main(int argc, char** argv) {
  assay::Asked asked;
  CLI::App app("Writes results directories with made-up figures.");
  app.add_option("DIR", asked.dir)->required();
  app.add_option("--cells", asked.cells)->check(CLI::PositiveNumber);
  app.add_option("--runs", asked.runs)->check(CLI::NonNegativeNumber);
  app.add_option("--shards", asked.shards)->check(CLI::PositiveNumber);
  app.add_option("--plan", asked.plan)->check(CLI::ExistingFile);
  app.add_option("--campaign", asked.campaign);
  app.add_option("--hash", asked.hash);
  CLI11_PARSE(app, argc, argv);
  try {
    asked.plan.empty() ? assay::write(asked) : assay::write_plan(asked);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
