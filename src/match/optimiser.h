// The optimiser as its caller sees it: a Python process of its own (optimiser.py has its protocol), which may read
// files and write none.
#pragma once

#include <string>
#include <sys/types.h>

#include <nlohmann/json.hpp>

#include "isolate/child.h"

namespace assay::match {

class Optimiser {
 public:
  // Throws InputError where its environment is not set up, SystemError where it cannot be started.
  explicit Optimiser(const nlohmann::json& task);
  ~Optimiser();
  Optimiser(const Optimiser&) = delete;
  Optimiser& operator=(const Optimiser&) = delete;

  // What it asks or has found. Throws SystemError with its last words where it has ended.
  nlohmann::json next();
  void answer(const nlohmann::json& answer);

  // Throws InputError with the way to set it up.
  static void require_environment();

 private:
  pid_t process_ = -1;
  Descriptor to_, from_, errors_;
  std::string received_;
};

}  // namespace assay::match
