// MuJoCo's parser and its messages, as the loader needs them: owners of its objects, and errors as exceptions.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <mujoco/mujoco.h>

namespace assay {

struct SpecDeleter {
  void operator()(mjSpec* spec) const { mj_deleteSpec(spec); }
};
struct CompiledDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
using SpecPtr = std::unique_ptr<mjSpec, SpecDeleter>;
using CompiledPtr = std::unique_ptr<mjModel, CompiledDeleter>;

// MuJoCo's own handler prints to the console, writes a log file and ends the process on an error. While a guard lives,
// warnings are collected and errors thrown as InputError instead. Only one may exist: the handler belongs to the
// process, and other threads wait.
class MessageGuard {
 public:
  MessageGuard();
  ~MessageGuard();
  MessageGuard(const MessageGuard&) = delete;
  MessageGuard& operator=(const MessageGuard&) = delete;

  // Those of the guard that lives, as MuJoCo wrote them.
  static std::vector<std::string>& warnings();

 private:
  std::lock_guard<std::mutex> lock_;
  mjfLogHandler previous_;
};

// MuJoCo's messages have several lines; ours have one, without a full stop at the end.
std::string one_line(std::string_view message);

// Nothing reaches standard error while it lives: where MuJoCo's parser ends the process, its C++ library writes the
// exception there, and who waits for the process says what happened (isolate/contained.h).
class Silence {
 public:
  Silence();
  ~Silence();
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  int before_;
};

}  // namespace assay
