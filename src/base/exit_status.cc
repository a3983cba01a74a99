#include "base/exit_status.h"

#include <exception>
#include <new>

#include "base/console.h"
#include "base/errors.h"

namespace assay {

int guarded(const std::function<int()>& work) {
  try {
    return work();
  } catch (const InputError& error) {
    message(error.what());
    return exits::kWrongInput;
  } catch (const std::bad_alloc&) {
    message("out of memory: use a smaller model or fewer jobs");
    return exits::kFailed;
  } catch (const std::exception& error) {
    message(error.what());
    return exits::kFailed;
  } catch (...) {
    message("an engine threw an exception that is not a std::exception");
    return exits::kFailed;
  }
}

}  // namespace assay
