// Plugins that assay has to refuse by name: FAULT says which one this is.
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <stdexcept>
#include <sys/stat.h>
#include <unistd.h>

#include "engines/engine.h"

namespace {

enum Fault {
  kNoEntryPoint,
  kOtherVersion,
  kThrows,
  kMakesNothing,
  kOtherName,
  // these end the process that uses them
  kAbortsWhenLoaded,
  kExitsWhenLoaded,
  kAbortsInName,
  kExitsInContenders,
  kThrowsInCapabilities,
  // these hold it up
  kForksWhenLoaded,
  kHangsWhenLoaded,
  // somebody else ends it
  kKilledWhenLoaded,
};

// A process of its own session that holds all descriptors for minutes.
[[maybe_unused]] void leave_a_process() {
  constexpr unsigned kSeconds = 300;
  if (::fork() != 0) return;
  ::setsid();
  ::sleep(kSeconds);
  ::_exit(0);
}

[[maybe_unused]] void hang() {
  std::signal(SIGALRM, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  while (true) ::pause();
}

// SIGKILL, as the kernel sends it when memory runs out, as often in all processes together as the environment says.
[[maybe_unused]] void be_killed() {
  const char* const mark = std::getenv("ASSAY_MISHAP_MARK");
  const char* const times = std::getenv("ASSAY_MISHAP_KILLS");
  if (mark == nullptr || times == nullptr) return;
  const int file = ::open(mark, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  struct stat facts{};
  if (file < 0 || ::fstat(file, &facts) != 0) return;
  if (facts.st_size < std::strtol(times, nullptr, 10) && ::write(file, "k", 1) == 1) ::kill(::getpid(), SIGKILL);
  ::close(file);
}

[[maybe_unused]] const bool kLoaded = [] {
  if (FAULT == kAbortsWhenLoaded) std::abort();
  if (FAULT == kExitsWhenLoaded) std::exit(0);
  if (FAULT == kForksWhenLoaded) leave_a_process();
  if (FAULT == kHangsWhenLoaded) hang();
  if (FAULT == kKilledWhenLoaded) be_killed();
  return true;
}();

class Nameless : public assay::Engine {
 public:
  std::string name() const override {
    if (FAULT == kAbortsInName) std::abort();
    return FAULT == kExitsInContenders ? "exitlister" : FAULT == kThrowsInCapabilities ? "unable" : "somebody-else";
  }
  assay::BuildFacts build() const override { return {}; }
  std::vector<assay::Setting> settings() const override { return {}; }
  std::vector<assay::Contender> contenders() const override {
    if (FAULT == kExitsInContenders) std::exit(0);
    return {{"intruder", "must not be listed", {}}};
  }
  assay::Capabilities capabilities(const assay::Settings& /*settings*/) const override {
    if (FAULT == kThrowsInCapabilities) throw std::logic_error("nothing is known");
    return {};
  }
  std::vector<assay::Limitation> check(const assay::Model& /*model*/,
                                       const assay::Settings& /*settings*/) const override {
    return {};
  }
  std::unique_ptr<assay::Simulation> create(const assay::Model& /*model*/, const assay::State& /*state*/,
                                            const assay::Settings& /*settings*/) const override {
    return nullptr;
  }
};

[[maybe_unused]] assay::Engine* make() {
  if (FAULT == kThrows) throw std::runtime_error("no licence found");
  if (FAULT == kMakesNothing) return nullptr;
  return new Nameless;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) assay::PluginEntry ENTRY_POINT() {
  return {FAULT == kOtherVersion ? assay::kPluginVersion - 1 : assay::kPluginVersion, make};
}
