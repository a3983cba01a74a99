#include <utility>

#include "controls/changes/change.h"

namespace assay {
namespace {

class ChangedEngine final : public Engine {
 public:
  ChangedEngine(const Engine& inner, std::vector<RunChange> changes) : inner_(inner), changes_(std::move(changes)) {}

  std::string name() const override { return inner_.name(); }
  BuildFacts build() const override { return inner_.build(); }
  std::vector<Setting> settings() const override { return inner_.settings(); }
  std::vector<Contender> contenders() const override { return inner_.contenders(); }
  Capabilities capabilities(const Settings& settings) const override { return inner_.capabilities(settings); }
  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    return inner_.check(changed_model(model, changes_), settings);
  }
  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    return inner_.create(changed_model(model, changes_), state, settings);
  }

 private:
  const Engine& inner_;
  std::vector<RunChange> changes_;
};

}  // namespace

std::unique_ptr<Engine> changed_engine(const Engine& inner, std::vector<RunChange> changes) {
  return std::make_unique<ChangedEngine>(inner, std::move(changes));
}

}  // namespace assay
