// What was measured of the paper's line-up, as the figures ask for it.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <nlohmann/json.hpp>

#include "report/look.h"
#include "store/scene.h"
#include "store/store.h"

namespace assay::figures {

struct Figure {
  double value = 0, low = 0, high = 0;
};

class Results {
 public:
  // The store has to outlive it.
  explicit Results(const Store& store);

  // The line-up, as far as it was measured.
  const std::vector<std::string>& contenders() const { return contenders_; }
  const std::vector<std::string>& systems() const { return systems_; }
  const Look& look(const std::string& contender) const {
    static const Look kPlain;
    const auto found = looks_.find(contender);
    return found == looks_.end() ? kPlain : found->second;
  }
  double fact(const std::string& system, const char* name) const {
    const auto found = facts_.find(system);
    return found == facts_.end() || !found->second.contains(name) || !found->second[name].is_number()
               ? 0
               : found->second[name].get<double>();
  }
  bool fact_flag(const std::string& system, const char* name) const {
    const auto found = facts_.find(system);
    return found != facts_.end() && found->second.value(name, false);
  }
  std::string family(const std::string& system) const {
    const auto found = facts_.find(system);
    return found == facts_.end() ? "" : found->second.value("family", "");
  }

  // By timestep; empty when nothing was tried.
  const std::map<double, Cell>& cells(const std::string& system, const std::string& contender,
                                      const std::string& measure) const {
    static const std::map<double, Cell> kNone;
    const auto found = cells_.find({system, contender, measure});
    return found == cells_.end() ? kNone : found->second;
  }

  static std::optional<Figure> value(const Cell& cell, const std::string& name);

  // The realtime factor at a timestep, as interpolated for recommendations.
  std::optional<double> speed(const std::string& system, const std::string& contender, double timestep_ms) const;

  bool timed(const std::string& system) const;

  const Scene* scene(const std::string& system) const {
    const auto found = scenes_.find(system);
    return found == scenes_.end() ? nullptr : &found->second;
  }

  struct End {
    std::string contender;
    State state;
  };

  // The last state of the first run of the system that is kept.
  std::optional<End> end_of(const std::string& system) const;

 private:
  const Store* store_;
  std::map<std::string, Look> looks_;
  std::map<std::string, nlohmann::json> facts_;
  std::map<std::string, Scene> scenes_;
  std::vector<std::string> systems_, contenders_;
  std::set<std::string> measured_;
  std::map<std::tuple<std::string, std::string, std::string>, std::map<double, Cell>> cells_;
};

}  // namespace assay::figures
