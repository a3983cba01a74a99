#include "isolate/interruption.h"

#include <csignal>
#include <cstdint>
#include <ctime>

namespace assay {
namespace {

volatile std::sig_atomic_t interruption = 0;
volatile bool second_ends = false;
volatile std::int64_t interrupted_at_ms = 0;

// A signal to a whole process group comes twice: to this process, and from the parent that passes its own on.
constexpr std::int64_t kTwinMs = 200;

void note_interruption(int signal) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const std::int64_t now_ms = 1000 * static_cast<std::int64_t>(now.tv_sec) + now.tv_nsec / 1'000'000;
  if (interruption != 0 && second_ends && now_ms - interrupted_at_ms > kTwinMs) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  if (interruption == 0) interrupted_at_ms = now_ms;
  interruption = 1;
}

}  // namespace

void watch_for_interruption(bool once) {
  struct sigaction action = {};
  action.sa_handler = note_interruption;
  sigemptyset(&action.sa_mask);
  second_ends = once;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return interruption != 0; }

}  // namespace assay
