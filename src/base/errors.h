// The failures that a caller can meet. A bug of assay itself is an assertion, not an exception.
#pragma once

#include <stdexcept>
#include <string>

namespace assay {

// The user gave something that cannot be used: a file, a name, a number. The message is one sentence with the offending
// value and how to mend it; the program ends with status 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The environment failed: a full disk, an unwritable directory, a process that cannot be started. The program ends
// with status 1.
class SystemError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An engine failed while it was created or stepped. It never ends a campaign: the outcome is stored with this reason.
class EngineError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An engine does not do what the model asks for, and says so before any step is taken (outcome `unsupported`).
class UnsupportedError : public EngineError {
 public:
  using EngineError::EngineError;
};

}  // namespace assay
