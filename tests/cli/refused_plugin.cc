// Plugins that assay has to refuse by name: FAULT says which one this is.
#include <cstdlib>
#include <stdexcept>

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
};

[[maybe_unused]] const bool kLoaded = [] {
  if (FAULT == kAbortsWhenLoaded) std::abort();
  if (FAULT == kExitsWhenLoaded) std::exit(0);
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
