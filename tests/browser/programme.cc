#include "programme.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cells.h"
#include "load/mjcf.h"
#include "results/store/scene.h"
#include "run/coordinator/rows.h"

namespace assay {
namespace {

using nlohmann::json;

struct Made {
  std::string name, engine;
  bool joint = false, single = false;
  int order = 1;
  double kilohertz = 0;  // chain at 1 ms
  double error = 0;      // chain at 1 ms, m
  double holds_ms = 0;   // largest timestep that holds the object
};

const std::vector<Made>& made() {
  static const std::vector<Made> kMade = {{"mujoco-euler", "mujoco", true, false, 1, 1030, 4.3e-3, 16},
                                          {"mujoco-rk4", "mujoco", true, false, 4, 256, 2.1e-9, 16},
                                          {"mujoco-implicitfast", "mujoco", true, false, 1, 870, 4.4e-3, 16},
                                          {"mujoco-implicit", "mujoco", true, false, 1, 430, 1.8e-3, 16},
                                          {"mujoco-euler-dense", "mujoco", true, false, 1, 1010, 4.3e-3, 16},
                                          {"mujoco-euler-pgs", "mujoco", true, false, 1, 1025, 4.3e-3, 8},
                                          {"mujoco-euler-cg", "mujoco", true, false, 1, 1028, 4.3e-3, 16},
                                          {"bullet-si-f64", "bullet-f64", false, false, 1, 56, 1.45e-3, 1.0 / 32},
                                          {"bullet-si-f32", "bullet-f32", false, true, 1, 52, 1.45e-3, 1.0 / 32},
                                          {"bullet-mlcp-f64", "bullet-f64", false, false, 1, 100, 1.45e-3, 1.0 / 8},
                                          {"bullet-mb", "bullet-f64", true, false, 1, 410, 4.34e-3, 1},
                                          {"bullet-mb-rk4", "bullet-f64", true, false, 4, 110, 2.1e-9, 0},
                                          {"ode-quick", "ode", false, false, 1, 60, 1.449e-3, 0.25},
                                          {"ode-step", "ode", false, false, 1, 307, 1.447e-3, 0.5},
                                          {"physx-d6-pgs", "physx", false, true, 1, 80, 3.1e-3, 2},
                                          {"physx-d6-tgs", "physx", false, true, 1, 70, 2.6e-3, 4},
                                          {"physx-art-pgs", "physx", true, true, 1, 160, 4.2e-3, 2},
                                          {"physx-art-tgs", "physx", true, true, 1, 150, 4.1e-3, 4},
                                          {"havok", "havok", false, true, 1, 33, 5.4e-3, 0},
                                          {"jolt-f32", "jolt", false, true, 1, 120, 1.5e-3, 1},
                                          {"jolt-f64", "jolt", false, false, 1, 110, 1.46e-3, 1},
                                          {"rapier-impulse-f64", "rapier", false, false, 1, 90, 1.9e-3, 0.5},
                                          {"rapier-multibody-f64", "rapier", true, false, 1, 140, 4.35e-3, 1},
                                          {"dart", "dart", true, false, 1, 70, 4.34e-3, 4},
                                          {"simbody-euler", "simbody", true, false, 1, 40, 4.34e-3, 2},
                                          {"simbody-rkm", "simbody", true, false, 4, 9, 1.1e-9, 2}};
  return kMade;
}

constexpr double kReference = 1 / 64.0;
const std::vector<double>& steps() {
  static const std::vector<double> kSteps = {kReference, 1 / 32.0, 1 / 16.0, 1 / 8.0, 1 / 4.0, 1 / 2.0,
                                             1,          2,        4,        8,       16,      32};
  return kSteps;
}

struct System {
  std::string name, model;
  double slower = 1;   // than the chain
  double rougher = 1;  // its errors at 1 ms, of the chain's
  double duration_s = 5;
  bool contact = false;
};

const std::vector<System>& systems() {
  static const std::vector<System> kSystems = {{"planar-chain", "planar-chain", 1, 1, 10.016, false},
                                               {"humanoid", "humanoid", 12, 2, 5.024, true},
                                               {"astronaut", "astronaut", 9, 1.5, 5.024, true},
                                               {"astronaut-energy", "astronaut-energy", 6, 1, 5.024, false},
                                               {"grasp", "grasp", 30, 3, 5.024, true},
                                               {"capsules-27", "capsules-27", 60, 4, 3.2, true}};
  return kSystems;
}

const std::vector<int>& sizes() {
  static const std::vector<int> kSizes = {25, 50, 75, 100, 125, 150, 175, 200, 225, 250};
  return kSizes;
}

// The same number in [0, 1) for the same text everywhere.
double chance(const std::string& text) {
  std::uint32_t hash = 2166136261U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  std::mt19937 generator(hash);
  return generator() / 4294967296.0;
}

void put_speed(Store& store, const System& system, const Made& contender, double step) {
  const double kilohertz = contender.kilohertz / system.slower * (1 + 0.2 * chance(contender.name + system.name)) *
                           (contender.joint ? 1 : 1.6);
  const double wide = 0.01 + 0.03 * chance(contender.name), us = 1e3 / kilohertz;
  std::vector<double> samples;
  // Always the same numbers are wanted. NOLINTNEXTLINE(bugprone-random-generator-seed)
  std::mt19937 generator(7);
  for (int i = 0; i < 400; ++i) {
    const double u = generator() / 4294967296.0, spike = i % 97 == 0 ? 2.5 : 1;
    samples.push_back(us * (1 + wide * (4 * u * u * u - 1)) * spike);
  }
  put_speed(store, cell(system.name, contender.name, step, "raw_speed"), kilohertz, wide, samples);
}

double error_of(const System& system, const Made& contender, double step) {
  const int order = system.contact ? 1 : contender.order;
  const double at_1ms = system.contact && contender.order > 1 ? 2e-3 : contender.error;
  return at_1ms * system.rougher * std::pow(step, order) * (0.8 + 0.4 * chance(contender.name + system.name));
}

// Whether a contender fails here, as engines with soft joints do on large timesteps and mass ratios.
bool fails(const System& system, const Made& contender, double step) {
  if (system.name == "grasp")
    return (contender.engine == "ode" || contender.name.starts_with("bullet-si")) && step >= 2;
  return system.contact && contender.engine == "ode" && step >= 16;
}

// Whether it does; then that is stored.
bool diverges(Store& store, const System& system, const Made& contender, const Cell& cell) {
  if (!fails(system, contender, cell.timestep_ms)) return false;
  fail(store, cell, Outcome::kDiverged, "by 2.1 s: a state that is not finite");
  return true;
}

void put_consistency(Store& store, const System& system, const Made& contender, double step) {
  Cell made = cell(system.name, contender.name, step, "consistency");
  if (fails(system, contender, step)) {
    fail(store, made, Outcome::kDiverged, "piece 3, by 0.096 s: a body is 1.2e6 m away");
    return;
  }
  double rounding = system.contact && !contender.joint ? 2e-7 : 1e-14;
  if (contender.single) rounding = 4e-5;
  const bool reference = step == kReference;
  const double error = reference ? rounding : std::hypot(0.3 * error_of(system, contender, step), rounding);
  made.values = {{"consistency", "m", error, error * 0.8, error * 1.3}};
  if (reference) {
    made.values.push_back({"restart_floor", "m", error, error * 0.8, error * 1.3});
  } else if (error <= 3 * rounding) {
    made.values.push_back({"consistency_floor", "m", rounding, {}, {}});
  }
  std::vector<double> pieces;
  pieces.reserve(10);
  for (int i = 0; i < 10; ++i) pieces.push_back(error * (0.6 + 0.08 * i));
  store.put_cell(made, {{"piece_error_m", pieces}});
}

void put_truth(Store& store, const System& system, const Made& contender, double step) {
  Cell made = cell(system.name, contender.name, step, "truth");
  made.values = {{"truth_error", "m", error_of(system, contender, step), {}, {}}};
  store.put_cell(made);
}

void put_drift(Store& store, const System& system, const Made& contender, double step) {
  Cell made = cell(system.name, contender.name, step, "drift");
  if (diverges(store, system, contender, made)) return;
  const double error = error_of(system, contender, step);
  if (system.name == "astronaut") {
    // what has maximal coordinates keeps it to rounding, the better the fewer its steps
    const double momentum = contender.joint ? 0.4 * error : (contender.single ? 3e-6 : 2e-13) / std::sqrt(step);
    made.values = {{"linear_momentum_drift", "kg m/s", momentum, {}, {}},
                   {"linear_momentum_drift_relative", "1", momentum / 30, {}, {}},
                   {"angular_momentum_drift", "kg m^2/s", 0.7 * error, {}, {}},
                   {"angular_momentum_drift_relative", "1", 0.7 * error / 12, {}, {}}};
  } else {
    const double rate = (contender.joint ? 1e-4 : 2e-2) * step * (contender.name == "havok" ? 9 : 1);
    made.values = {{"energy_drift", "J", 0.9 * error, {}, {}},
                   {"energy_drift_relative", "1", 0.9 * error / 3.2, {}, {}},
                   {"angular_momentum_drift", "kg m^2/s", error / 7, {}, {}},
                   {"damping_rate", "1/s", rate, rate * 0.7, rate * 1.4}};
  }
  store.put_cell(made);
}

void put_violation(Store& store, const System& system, const Made& contender, double step) {
  Cell made = cell(system.name, contender.name, step, "violation");
  if (diverges(store, system, contender, made)) return;
  const double error = error_of(system, contender, step);
  if (system.name != "capsules-27") {
    const double apart = contender.joint ? 0 : 0.2 * error;
    made.values = {{"joint_dislocation_max", "m", apart, {}, {}}, {"joint_dislocation_rms", "m", apart / 3, {}, {}}};
  }
  if (system.name == "humanoid" || system.name == "grasp") {
    made.values.push_back({"limit_violation_max", "rad", 4 * error, {}, {}});
  }
  if (system.contact) made.values.push_back({"penetration_max", "m", 0.002 + 0.5 * error, {}, {}});
  if (system.name == "humanoid" && contender.engine != "havok" && step != kReference) {
    made.values.push_back({"signorini_residual", "m/s", error, {}, {}});
    if (contender.engine != "physx") made.values.push_back({"cone_violation", "1", 0.01 * step, {}, {}});
  }
  store.put_cell(made);
}

bool holds(const Made& contender, double step) {
  const bool hole = contender.name == "physx-d6-pgs" && step == 0.5;
  return step <= contender.holds_ms && !hole;
}

void put_grasp(Store& store, const System& system, const Made& contender) {
  double largest = 0, without_hole = 0;
  bool whole = true;
  for (const double step : steps()) {
    whole = whole && holds(contender, step);
    if (holds(contender, step)) largest = step;
    if (whole) without_hole = step;
  }
  for (const double step : steps()) {
    Cell made = cell(system.name, contender.name, step, "grasp");
    if (fails(system, contender, step)) {
      made.outcome = Outcome::kDiverged;
      made.reason = "by 1.3 s: a state that is not finite";
      made.values = {{"grasp_held", "1", 0, {}, {}}};
    } else if (contender.name == "havok" && step > 8) {
      fail(store, made, Outcome::kTimeout, "no end after 1800 s");
      continue;
    } else if (holds(contender, step)) {
      made.values = {{"grasp_held", "1", 1, {}, {}}, {"grasp_slip", "m", 0.004 * (1 + step), {}, {}}};
    } else {
      made.values = {
          {"grasp_held", "1", 0, {}, {}}, {"grasp_slip", "m", 1.4, {}, {}}, {"drop_time", "s", 3 / (1 + step), {}, {}}};
    }
    if (step == largest) made.values.push_back({"largest_stable_timestep", "ms", largest, {}, {}});
    if (step == without_hole) made.values.push_back({"stable_up_to_timestep", "ms", without_hole, {}, {}});
    store.put_cell(made);
  }
}

// Those of one kind of coordinates agree for long, the others part early.
void put_agreement(Store& store, const System& system) {
  constexpr int kTimes = 64;
  std::vector<double> times;
  times.reserve(kTimes);
  for (int i = 0; i < kTimes; ++i) times.push_back(system.duration_s * i / (kTimes - 1));
  for (const Made& own : made()) {
    std::vector<SampleSeries> series = {{"time_s", times}};
    std::vector<double> ends, partings;
    for (const Made& other : made()) {
      if (own.name == other.name) continue;
      const bool alike = own.joint == other.joint && own.single == other.single;
      const double floor = alike ? 1e-9 : 1e-5, rate = alike ? 1.2 : 2.2;
      std::vector<double> apart;
      double parting = system.duration_s;
      for (const double time : times) {
        apart.push_back(std::min(0.8, floor * std::expm1(rate * time)));
        if (apart.back() > 1e-3) parting = std::min(parting, time);
      }
      ends.push_back(apart.back());
      partings.push_back(parting);
      series.push_back({"distance_m " + other.name, apart});
      series.push_back({"parting_time_s " + other.name, {parting}});
    }
    std::ranges::sort(ends);
    std::ranges::sort(partings);
    Cell made = cell(system.name, own.name, kReference, "agreement");
    made.values = {{"agreement", "m", ends[ends.size() / 2], {}, {}},
                   {"parting_time", "s", partings[partings.size() / 2], {}, {}}};
    store.put_cell(made, series);
  }
}

bool scales(const Made& contender) {
  return contender.engine == "mujoco" || contender.engine == "physx" || contender.engine == "ode" ||
         contender.engine == "havok" || contender.engine == "jolt" || contender.engine == "dart" ||
         contender.name == "bullet-si-f64" || contender.name == "rapier-impulse-f64";
}

void put_scaling(Store& store, bool contacts) {
  const std::string ending = contacts ? "" : "-free";
  for (const Made& contender : made()) {
    if (!scales(contender)) continue;
    const bool dense = contender.name == "mujoco-euler-dense";
    const double sparse = contacts ? 1.15 : 1.0;
    const double exponent = (dense ? 2.6 : sparse) + 0.1 * chance(contender.name + ending);
    for (const int size : sizes()) {
      const double seconds = (contacts ? 0.4 : 0.1) * 100 / contender.kilohertz * std::pow(size / 25.0, exponent) *
                             (1 + 0.05 * chance(fmt::format("{}{}", contender.name, size)));
      Cell made = cell(fmt::format("capsules-{}{}", size, ending), contender.name, 10, "scaling");
      if (dense && size == 250 && contacts) {
        fail(store, made, Outcome::kTimeout, "no end after 1800 s");
        continue;
      }
      made.values = {{"run_time", "s", seconds, seconds * 0.97, seconds * 1.04},
                     {"steps_per_second", "1/s", 1000 / seconds, 1000 / seconds / 1.04, 1000 / seconds / 0.97}};
      if (size == (dense && contacts ? 225 : 250)) {
        made.values.push_back({"scaling_exponent", "1", exponent, exponent - 0.06, exponent + 0.08});
      }
      store.put_cell(made, {{"run_time_s", {seconds * 0.97, seconds, seconds * 1.04}}});
    }
  }
}

json facts_of(const Model& model, const std::string& model_name, double duration_s) {
  json facts = model_facts(model);
  facts.update({{"model", model_name + ".xml"},
                {"contacts", true},
                {"control", model.actuators.empty() ? "passive" : fmt::format("{} actuators", model.actuators.size())},
                {"duration_s", duration_s},
                {"sample_ms", 32},
                {"reference_ms", kReference}});
  return facts;
}

std::string forces_of(const std::string& engine) {
  if (engine == "havok") return "not given: its makers know why";
  return engine == "physx" ? "along the normal, no friction" : "normal and friction";
}

void describe(Store& store) {
  std::vector<ContenderRow> contenders;
  for (const Made& contender : made()) {
    const json capabilities = {{"precision", contender.single ? "single" : "double"},
                               {"coordinates", contender.joint ? "joint" : "maximal"},
                               {"integrator", contender.order == 4 ? "Runge-Kutta 4" : "semi-implicit Euler"},
                               {"order", contender.order},
                               {"contact", true},
                               {"contact_forces", forces_of(contender.engine)},
                               {"deviations", json::array()}};
    contenders.push_back({contender.name, contender.engine, "1.2.3", contender.name, "", capabilities.dump(),
                          json{{"version", "1.2.3"}, {"source", "fixture"}, {"flags", "-O3"}}.dump()});
    store.set_conformance(contender.name, {{contender.name, "free-fall", "pass", 1e-7, 1e-3, "m", ""}});
  }
  store.set_contenders(contenders);

  std::vector<SystemRow> rows;
  std::vector<SceneRow> scenes;
  const std::string folder = ASSAY_MODELS;
  for (const System& system : systems()) {
    const Model model = load_model(fmt::format("{}/{}.xml", folder, system.model));
    json facts = facts_of(model, system.model, system.duration_s);
    if (system.name == "grasp") facts["grasp"] = {{"object", "capsule"}, {"hand", "palm"}, {"drop_m", 0.1}};
    rows.push_back({system.name, facts.dump()});
    scenes.push_back({system.name, scene_text(scene_of(model))});
  }
  for (const bool contacts : {true, false}) {
    for (const int size : sizes()) {
      const std::string model_name = fmt::format("capsules-{}", size);
      const Model model = load_model(fmt::format("{}/{}.xml", folder, model_name));
      json facts = facts_of(model, model_name, 10);
      facts["contacts"] = contacts;
      facts["family"] = contacts ? "capsules" : "capsules-free";
      rows.push_back({model_name + (contacts ? "" : "-free"), facts.dump()});
      if (size == sizes().back()) scenes.push_back({rows.back().name, scene_text(scene_of(model))});
    }
  }
  store.set_systems(rows);
  store.set_scenes(scenes);
  store.set_manifest({{"campaign", "programme"},
                      {"campaign_title", "The paper's programme, made up"},
                      {"commit", "0123456789abcdef0123456789abcdef01234567"},
                      {"cpu", "Example CPU @ 2.50GHz"},
                      {"assay_version", "0.1.0"}});
}

}  // namespace

void put_programme(Store& store) {
  describe(store);
  for (const System& system : systems()) {
    for (const Made& contender : made()) {
      for (const double step : steps()) {
        if (system.name != "astronaut-energy") put_speed(store, system, contender, step);
        if (system.name == "planar-chain") put_truth(store, system, contender, step);
        if (system.name != "astronaut-energy") put_consistency(store, system, contender, step);
        if (system.name == "planar-chain" || system.name.starts_with("astronaut")) {
          put_drift(store, system, contender, step);
        }
        put_violation(store, system, contender, step);
      }
      if (system.name == "grasp") put_grasp(store, system, contender);
    }
    if (system.name == "planar-chain" || system.name == "astronaut-energy") put_agreement(store, system);
  }
  put_scaling(store, true);
  put_scaling(store, false);
}

}  // namespace assay
