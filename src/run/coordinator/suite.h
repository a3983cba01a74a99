// The conformance suite by hand: one contender in processes of their own, because an adapter under development may
// crash.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/console.h"
#include "engines/registry.h"

namespace assay {

struct SuiteRequest {
  std::vector<std::string> tests;  // by name; empty: all
  bool long_series = false;        // its verdicts are kept, in verdicts_dir()
  bool again = false;              // runs also what has a kept verdict
  double limit_s = 0;              // of a test
};

// Results in the order in which tests run, as `assay conformance --json` prints them: kept verdicts, then those of
// tests that ran, each given to `on_result` as soon as it is there. It goes on in another process when somebody else
// has ended the first, or its memory is running out; a crash or an orderly end before the last test is a failure of the
// next one. Throws SystemError where it is interrupted (isolate/interruption.h), EndedFromOutside.
Json suite_apart(const ResolvedContender& contender, const SuiteRequest& request,
                 const std::function<void(const Json&)>& on_result);

}  // namespace assay
