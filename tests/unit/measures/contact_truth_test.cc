// Event times and impulses of runs that are known: the certified solution itself, late, early, scaled, or stopped; and
// numbers by hand.
#include "measures/contact_truth.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "load/mjcf.h"
#include "measures/measure.h"
#include "measures/reference/certified.h"

namespace assay {
namespace {

struct Case {
  std::string model, solution;
  double duration;  // s, as in campaigns/contacts.toml
  int events;
  bool normal, tangential;  // which impulses there are
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {"sliding-box", "slide-and-roll", 0.48, 1, true, true},
      {"incline-boxes", "slide-and-roll", 1.2, 2, true, true},
      {"sphere-to-rolling", "slide-and-roll", 0.8, 1, true, true},
      {"rolling", "slide-and-roll", 0.8, 0, true, true},
      {"rod-strike-sticks", "rod-strike", 0.2, 1, true, true},
      {"rod-strike-slips", "rod-strike", 0.2, 1, true, true},
      {"ball-row", "ball-row", 0.8, 4, true, false},
      {"tipping-box", "tipping-box", 0.32, 0, true, true},
      {"rimless-wheel", "rimless-wheel", 2, 6, true, true},
      {"joint-stops", "dry-joints", 2, 12, true, true},
      {"box-stack", "box-stack", 2, 0, true, false},
      {"grip-holds", "two-finger-grip", 2, 0, true, true},
      {"grip-slips", "two-finger-grip", 0.24, 1, true, true},
  };
  return all;
}

Model model_of_case(const Case& of) { return load_model(std::string(ASSAY_MODELS) + "/" + of.model + ".xml"); }

CertifiedMotion motion_of(const Case& of, const Model& model, const std::vector<double>& times) {
  return find_certified_solution(of.solution)->solve(model, times);
}

std::vector<double> instants(double duration, double step = 1e-3, double late = 0) {
  std::vector<double> times;
  for (int i = 0; i <= std::lround(duration / step); ++i) times.push_back(std::max(0.0, i * step - late));
  return times;
}

// The solution, `late` seconds behind its clock.
std::vector<State> shifted(const Case& of, const Model& model, double late, double step = 1e-3) {
  std::vector<State> states = motion_of(of, model, instants(of.duration, step, late)).states;
  for (size_t i = 0; i < states.size(); ++i) states[i].time = static_cast<double>(i) * step;
  return states;
}

TEST(ContactTruth, ASolutionIsRightAgainstItself) {
  for (const Case& of : cases()) {
    SCOPED_TRACE(of.model);
    const Model model = model_of_case(of);
    const CertifiedMotion truth = motion_of(of, model, instants(of.duration));
    EXPECT_EQ(truth.events.size(), static_cast<size_t>(of.events));
    const EventErrors events = event_errors(truth.events, truth.states);
    EXPECT_EQ(events.found, of.events);
    EXPECT_EQ(events.missed, 0);
    EXPECT_LT(events.largest, 5e-3) << "ms: over 1 ms numbers are nearly straight";
    const ImpulseErrors impulses = impulse_errors(truth.impulses, truth.states, truth.states);
    EXPECT_EQ(impulses.normal, of.normal ? std::optional(0.0) : std::nullopt);
    EXPECT_EQ(impulses.tangential, of.tangential ? std::optional(0.0) : std::nullopt);
  }
}

TEST(ContactTruth, ALateRunIsLateByThatMuch) {
  for (const Case& of : cases()) {
    if (of.events == 0) continue;
    SCOPED_TRACE(of.model);
    const Model model = model_of_case(of);
    const CertifiedMotion truth = motion_of(of, model, instants(of.duration));
    for (const double late_ms : {0.3, 2.7}) {
      const EventErrors errors = event_errors(truth.events, shifted(of, model, 1e-3 * late_ms));
      EXPECT_EQ(errors.missed, 0);
      EXPECT_NEAR(errors.largest, late_ms, 5e-3);
      EXPECT_NEAR(errors.mean, late_ms, 5e-3);
    }
  }
}

TEST(ContactTruth, CoarserStatesTellTheSameTimes) {
  for (const Case& of : cases()) {
    if (of.events == 0) continue;
    SCOPED_TRACE(of.model);
    const Model model = model_of_case(of);
    const CertifiedMotion truth = motion_of(of, model, instants(of.duration));
    const EventErrors errors = event_errors(truth.events, shifted(of, model, 0.3e-3, 4e-3));
    EXPECT_EQ(errors.missed, 0);
    EXPECT_NEAR(errors.mean, 0.3, 0.25);
    EXPECT_LT(errors.largest, 1) << "a quarter of the distance of the states";
  }
}

TEST(ContactTruth, ScaledVelocitiesScaleImpulses) {
  constexpr double kTooFast = 1.02;
  for (const Case& of : cases()) {
    const Model model = model_of_case(of);
    if (model.gravity.norm() > 0) continue;
    SCOPED_TRACE(of.model);
    const CertifiedMotion truth = motion_of(of, model, instants(of.duration));
    std::vector<State> fast = truth.states;
    for (State& state : fast) {
      for (BodyState& body : state.bodies) body.v_WBcm *= kTooFast;
    }
    const ImpulseErrors errors = impulse_errors(truth.impulses, truth.states, fast);
    EXPECT_NEAR(errors.normal.value(), kTooFast - 1, 1e-12);
    if (of.tangential) {
      EXPECT_NEAR(errors.tangential.value(), kTooFast - 1, 1e-12);
    }
  }
}

// Without contact there is no impulse at all: all of it is missing. With a tenth of the friction nine tenths are.
TEST(ContactTruth, WhatIsMissingOfAnImpulseIsItsError) {
  const Case& of = cases().front();
  const Model model = model_of_case(of);
  // until it stops, so that friction is the same in every interval
  const std::vector<double> times = instants(0.3);
  const CertifiedMotion truth = motion_of(of, model, times);
  const auto run = [&](double friction, double fall) {
    std::vector<State> states = truth.states;
    const Vec3 along = model.initial.bodies[0].v_WBcm.normalized();
    for (State& state : states) {
      state.bodies[0].v_WBcm = model.initial.bodies[0].v_WBcm - friction * 0.5 * 9.81 * state.time * along +
                               fall * state.time * model.gravity;
    }
    return impulse_errors(truth.impulses, truth.states, states);
  };
  EXPECT_NEAR(run(1, 0).tangential.value(), 0, 1e-9);
  EXPECT_NEAR(run(0.1, 0).tangential.value(), 0.9, 1e-9);
  EXPECT_NEAR(run(0.1, 0).normal.value(), 0, 1e-9);
  EXPECT_NEAR(run(0, 1).normal.value(), 1, 1e-9);
  // as much friction across the slip as against it
  std::vector<State> aslant = truth.states;
  const Vec3 across = Vec3::UnitZ().cross(model.initial.bodies[0].v_WBcm).normalized();
  for (State& state : aslant) state.bodies[0].v_WBcm += 0.5 * 9.81 * state.time * across;
  EXPECT_NEAR(impulse_errors(truth.impulses, truth.states, aslant).tangential.value(), 1, 1e-9);
}

TEST(ContactTruth, WhatNeverHappensIsCountedAndHasNoTime) {
  for (const Case& of : cases()) {
    if (of.events == 0) continue;
    SCOPED_TRACE(of.model);
    const Model model = model_of_case(of);
    const CertifiedMotion truth = motion_of(of, model, instants(of.duration));
    // goes on as it starts
    std::vector<State> states = truth.states;
    for (State& state : states) {
      const double time = state.time;
      state = model.initial;
      state.time = time;
    }
    const EventErrors errors = event_errors(truth.events, states);
    EXPECT_GT(errors.missed, 0);
    EXPECT_EQ(errors.found + errors.missed, of.events);
    if (errors.found == 0) {
      EXPECT_EQ(errors.largest, 0);
    }
  }
}

// An event of a chain is looked for after the one before; where that is missing, after when it should have been.
TEST(ContactTruth, EventsOfAChainComeOneAfterTheOther) {
  std::vector<State> states;
  for (int i = 0; i <= 400; ++i) {
    State state;
    state.time = 1e-2 * i;
    state.position = {std::cos(M_PI * state.time + 0.3)};
    states.push_back(state);
  }
  const auto number = [](const State& state) { return state.position[0]; };
  const double first = 0.5 - 0.3 / M_PI;
  const std::vector<SolutionEvent> chained = {{first, "", {number, 0, first, {}, false, 0}},
                                              {first + 2, "", {number, 0, first + 2, {}, false, 0}}};
  EXPECT_LT(event_errors(chained, states).largest, 0.2);
  std::vector<SolutionEvent> apart = chained;
  for (SolutionEvent& event : apart) event.watch.chain = -1;
  EXPECT_NEAR(event_errors(apart, states).largest, 2000, 0.2);
  std::vector<SolutionEvent> never = chained;
  never[0].watch.level = -2;
  const EventErrors errors = event_errors(never, states);
  EXPECT_EQ(errors.missed, 1);
  EXPECT_LT(errors.largest, 0.2);
  std::vector<SolutionEvent> good = {{first + 2, "", {number, 0, first + 2, {}, true, -1}}};
  EXPECT_EQ(event_errors(good, states).missed, 1) << "it is above the level at the end";
  states.resize(340);
  EXPECT_EQ(event_errors(good, states).found, 1);
}

TEST(ContactTruth, ValuesAreThoseOfTheMeasure) {
  const Case& of = cases().front();
  const Model model = model_of_case(of);
  const CertifiedMotion truth = motion_of(of, model, instants(of.duration));
  const std::vector<State> late = shifted(of, model, 1e-3);
  MeasuredRun run = {model, late};
  run.steps = 480;
  run.other = &truth.states;
  const Measure* measure = find_measure("truth");
  const auto names = [&] {
    std::vector<std::string> found;
    for (const Value& value : measure->of_run(run).values) found.push_back(value.name);
    return found;
  };
  EXPECT_THAT(names(), testing::Not(testing::Contains("event_time_error"))) << "smooth systems have no events";
  run.certified = &truth;
  run.instants = &late;
  EXPECT_THAT(names(), testing::IsSupersetOf({"truth_error_rms", "event_time_error", "event_lag", "missed_events",
                                              "normal_impulse_error", "tangential_impulse_error"}));
  for (const Value& value : measure->of_run(run).values) {
    const auto row = std::ranges::find(measure->values, value.name, &ValueInfo::name);
    ASSERT_NE(row, measure->values.end()) << value.name;
    EXPECT_EQ(row->unit, value.unit);
    if (value.name == "event_time_error" || value.name == "event_lag") {
      EXPECT_NEAR(value.value.value(), 1, 5e-3);
    }
    if (value.name == "missed_events") {
      EXPECT_EQ(value.value, 0);
    }
  }
}

}  // namespace
}  // namespace assay
