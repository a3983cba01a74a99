#include "run/worker/failures.h"

#include <exception>
#include <new>

#include <fmt/format.h>

#include "run/worker/stepper.h"

namespace assay::jobs {

Ending ended_by(const EngineError& error, Outcome failed, const std::string& words) {
  if (dynamic_cast<const UnsupportedError*>(&error) != nullptr) return {Outcome::kUnsupported, error.what()};
  return {failed, words + error.what()};
}

Ending failed_to_start(const EngineError& error, const std::string& where) {
  return ended_by(error, Outcome::kCrashed, (where.empty() ? "" : where + ": ") + "the engine failed to start: ");
}

Reply reply_to_exception() {
  try {
    throw;
  } catch (const InputError& error) {
    return JobError{error.what(), true};
  } catch (const SystemError& error) {
    return JobError{error.what(), false};
  } catch (const AdapterFault& error) {
    return JobCrash{error.what()};
  } catch (const std::bad_alloc&) {
    return JobCrash{"out of memory: it takes more than a worker may"};
  } catch (const std::exception& error) {
    // An adapter threw what it must not.
    return JobCrash{fmt::format("exception: {}", error.what())};
  } catch (...) {
    return JobCrash{"exception: of a type that is no std::exception"};
  }
}

}  // namespace assay::jobs
