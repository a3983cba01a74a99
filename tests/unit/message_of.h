// What an action is refused with.
#pragma once

#include <functional>
#include <string>

#include "base/errors.h"

namespace assay {

// The message of the Error that the action throws; empty when it throws none.
template <typename Error = InputError>
std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace assay
