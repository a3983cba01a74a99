// What engines and their adapters throw, as outcomes: nothing of it may end a campaign.
#pragma once

#include <stdexcept>
#include <string>

#include "base/errors.h"
#include "run/messages/messages.h"

namespace assay::jobs {

// Runs `work`, a call of an engine: an InputError or a SystemError from there is the engine's failure
// (std::runtime_error), not the user's or the machine's.
template <typename Work>
auto engines_own(const Work& work) {
  try {
    return work();
  } catch (const InputError& error) {
    throw std::runtime_error(error.what());
  } catch (const SystemError& error) {
    throw std::runtime_error(error.what());
  }
}

// How a run ended that threw `error`: `unsupported`, or `failed` with its reason behind `words`.
Ending ended_by(const EngineError& error, Outcome failed, const std::string& words = "");
// The same of a run that made no step; `where` names which of several.
Ending failed_to_start(const EngineError& error, const std::string& where = "");

// The answer of a job that threw. Only for a `catch (...)`.
Reply reply_to_exception();

}  // namespace assay::jobs
