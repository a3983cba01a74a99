// The conformance suite. Every contender has to pass it before its figures are published. Each test sets up a small
// model whose answer is known from mechanics, not from an engine, and names the capability that it needs.
// src/conformance/README.md lists the tests with their formulas and the reason for every tolerance.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "engines/registry.h"

namespace assay {

enum class ConformanceStatus {
  kPass,
  kFail,           // the adapter is wrong, or the engine deviates without a declaration
  kDeviation,      // a failure that Capabilities::deviations declares, within the declared bound
  kNotApplicable,  // the contender lacks the capability that the note names
  kNotRun,         // the machine lacked memory, room or processes, as the note says: no verdict
};

// "pass", "fail", "deviation", "not-applicable", "not-run": as stored; what was not run is not stored.
std::string_view status_text(ConformanceStatus status);
// The status of such a text; kFail for any other.
ConformanceStatus parse_conformance_status(std::string_view text);

// What a test that runs at several timesteps found at one of them.
struct TimestepResult {
  double timestep = 0;  // s
  ConformanceStatus status = ConformanceStatus::kPass;
  double figure = 0, tolerance = 0;
};

struct ConformanceResult {
  std::string test;
  ConformanceStatus status = ConformanceStatus::kPass;
  double figure = 0;     // the largest ratio or difference; finite (0 for a failure without a figure)
  double tolerance = 0;  // passes when figure <= tolerance
  std::string unit;      // of both; "" for ratios
  std::string note;      // one line: the meaning of the figure, the reason of the failure, or the missing capability
  std::vector<TimestepResult> timesteps = {};  // the coarsest first; empty for tests that ask for one figure only
};

struct ConformanceTest {
  std::string name;     // "free-fall"
  std::string meaning;  // one line
  std::string needs;    // the required capability, "" when every contender has to pass
};

// All tests in the order in which they run, the most basic first.
const std::vector<ConformanceTest>& conformance_tests();

// The limit of one test, s (isolate/time_limit.h): of `assay conformance`, and the most in a campaign.
inline constexpr double kMostTestSeconds = 300;
inline constexpr double kMostLongTestSeconds = 3600;  // in the long series

struct ConformanceOptions {
  std::vector<std::string> tests = {};                           // names; empty: all
  std::function<void(const ConformanceResult&)> on_result = {};  // called after each test, in order
  // Minutes instead of a second: what rests does so for 60 s, on everything that it may rest on, at more timesteps.
  bool long_series = false;
};

// Runs the suite; one result per test. Each test chooses its timesteps (Settings::timestep is ignored). An exception
// from the adapter makes a failed test with its message, or one that was not run (isolate/machine_lack.h). Throws
// InputError for an unknown test's name. An adapter that crashes takes the caller with it: `assay run` calls this in a
// worker process.
std::vector<ConformanceResult> run_conformance(const ResolvedContender& contender,
                                               const ConformanceOptions& options = {});

// True when every test was run and no result is a failure, so that the contender may be scored.
bool conforms(const std::vector<ConformanceResult>& results);

}  // namespace assay
