// The gate: one suite that every contender has to pass before any figure of it is believed. Each test sets up a small
// model of its own whose answer is known from mechanics and not from any engine, and asks for the capability it needs.
// docs/conformance.md lists the tests with their formulas and the reason of every tolerance.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "engines/registry.h"

namespace assay {

enum class ConformanceStatus {
  kPass,
  kFail,           // the adapter is wrong, or the engine is and nobody has declared it
  kDeviation,      // would fail; declared in Capabilities::deviations, and within the declared bound
  kNotApplicable,  // the contender lacks the capability that the note names
};

// "pass", "fail", "deviation", "not-applicable": as stored.
std::string_view status_text(ConformanceStatus status);

struct ConformanceResult {
  std::string test;
  ConformanceStatus status = ConformanceStatus::kPass;
  double figure = 0;     // what was measured: the worst ratio or difference; finite (a failure without a figure has 0)
  double tolerance = 0;  // passes when figure <= tolerance
  std::string unit;      // of both; "" for ratios
  std::string note;      // one line: what the figure is, or why it failed, or which capability is missing
};

struct ConformanceTest {
  std::string name;     // "free-fall"
  std::string meaning;  // one line
  std::string needs;    // the capability asked for, "" when every contender has to pass
};

// All tests in the order in which they run, the most basic first.
const std::vector<ConformanceTest>& conformance_tests();

struct ConformanceOptions {
  std::vector<std::string> tests = {};                           // names; empty: all
  std::function<void(const ConformanceResult&)> on_result = {};  // called after each test, in order
};

// Runs the suite; one result a test. Timesteps are the tests' own (Settings::timestep is ignored). An exception out of
// the adapter is a failed test with its message. Throws InputError for an unknown test's name. An adapter that crashes
// takes the caller with it: `assay run` calls this in a worker process.
std::vector<ConformanceResult> run_conformance(const ResolvedContender& contender,
                                               const ConformanceOptions& options = {});

// True when no result is a failure: the contender may be scored.
bool conforms(const std::vector<ConformanceResult>& results);

}  // namespace assay
