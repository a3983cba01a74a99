// One view of a results directory, for everything that reads one: claims, recommendations, figures, the report, export.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "measures/statistics.h"
#include "results/looks.h"
#include "results/speed.h"
#include "results/store/scene.h"
#include "results/store/store.h"

namespace assay {

// A value and its 95 % interval; one of no width where none is stored.
Interval interval_of(const Value& value);
std::optional<Interval> interval_of(const Cell& cell, std::string_view value);
// The upper bound that stands in place of a cell's value near a floor; empty where the value counts. interval_of() then
// goes from 0 to the bound, and its value is the bound.
std::optional<double> bound_of(const Cell& cell, std::string_view value);

// Whether there is a figure.
enum class Found {
  kMissing,  // not measured: `why`
  kFailed,   // the run ended unstable or diverged: `why`
  kThere,
};

struct Figure {
  Found found = Found::kMissing;
  std::string why;
  Interval value;
  bool has_interval = false;
  bool is_bound = false;  // the value is an upper bound (bound_of)
  std::string unit;
  double timestep_ms = 0;
  std::int64_t cell = 0;  // the store's id of where it is from; 0: from no single cell
};

// "iterations 10 instead of 50 (sweeps over all constraints a step)".
std::string change_text(const SettingChange& change);

class Results {
 public:
  // Reads all cells; raw samples are read when they are asked for. The store has to outlive it.
  explicit Results(const Store& store);
  Results(const Results&) = delete;
  Results& operator=(const Results&) = delete;
  ~Results() = default;

  const Store& store() const { return *store_; }
  // In the store's order, without those of many worlds: whatever reads these speaks of one.
  const std::vector<Cell>& cells() const { return cells_; }
  const std::vector<Cell>& batch_cells() const { return batch_cells_; }  // of the measure 'batch'

  // As the campaign lists them; what cells name and no list does, comes last. No contender is the engine that does
  // nothing.
  const std::vector<std::string>& systems() const { return systems_; }
  const std::vector<std::string>& contenders() const { return contenders_; }
  const std::vector<ContenderRow>& rows() const { return rows_; }  // of the listed contenders

  // Facts of a system: "dof", "bodies", "family"; an object without entries for a system without facts.
  const nlohmann::json& facts(const std::string& system) const;
  double fact(const std::string& system, const char* name) const;  // 0 when it is no number
  std::string family(const std::string& system) const;             // "" for none
  bool fact_flag(const std::string& system, const char* name) const;
  std::vector<std::string> family_members(const std::string& family) const;

  // The contender that this one is a setting of: itself, unless a sweep made it (campaign/sweep.h). What has one of
  // these in common is one curve over timesteps and settings, looks alike, and is recommended once.
  const std::string& varied(const std::string& contender) const;
  // What of its settings differs from the adapter's defaults, in the order of their declaration.
  std::vector<SettingChange> changes(const std::string& contender) const;

  // The paper's line-up, as far as it was measured (line_up.h), and how contenders look.
  const std::vector<std::string>& papers() const { return papers_; }
  const std::map<std::string, Look>& looks() const { return looks_; }
  const Look& look(const std::string& contender) const;

  // How a system looks; null where that was not stored.
  const Scene* scene(const std::string& system) const;
  // The last state of the first run of the system that is kept and fits its scene.
  struct End {
    std::string contender;
    State state;
  };
  std::optional<End> end_of(const std::string& system) const;

  // Of a contender on a system, by timestep, then measure; null pointers never.
  const std::vector<const Cell*>& cells(const std::string& system, const std::string& contender) const;
  // Those of one measure by timestep.
  std::map<double, const Cell*> cells(const std::string& system, const std::string& contender,
                                      std::string_view measure) const;

  // Without a timestep: the smallest that was measured.
  Figure figure(const std::string& system, const std::string& contender, const std::string& value,
                std::optional<double> timestep_ms) const;
  // One figure for each timestep, ascending; those of a reference's own timestep are left out with `no_references`.
  std::vector<Figure> figures(const std::string& system, const std::string& contender, const std::string& value,
                              bool no_references = false) const;
  // The same of a measure's cells, whatever their values are.
  std::vector<Figure> outcomes(const std::string& system, const std::string& contender,
                               const std::string& measure) const;
  // Why there is no value, at a timestep if one is given.
  std::string why_missing(const std::string& system, const std::string& contender, const std::string& value,
                          std::optional<double> timestep_ms = {}) const;

  // Whether any contender's speed on it was measured.
  bool timed(const std::string& system) const { return timed_.contains(system); }
  std::optional<Speed> speed(const std::string& system, const std::string& contender, double timestep_ms) const;
  // Whether step times are of version 0.1's estimate (Speed::coverage).
  bool timed_by_pooled_median() const;
  // What of results of older rules of soundness was judged again (soundness.h); "" for results of today's.
  const std::string& judged_note() const { return judged_note_; }

 private:
  const Store* store_;
  std::string judged_note_;
  std::vector<Cell> cells_, batch_cells_;
  std::vector<std::string> systems_, contenders_, papers_;
  std::map<std::string, Look> looks_;
  std::map<std::string, std::string> varied_;    // of contenders that a sweep made
  mutable std::map<std::string, Scene> scenes_;  // read when asked for
  std::vector<ContenderRow> rows_;
  std::map<std::string, nlohmann::json> facts_;
  std::set<std::string> absent_;                                                     // contenders whose engine is
  std::map<std::string, std::set<std::string>> measures_;                            // that a value was found in
  std::map<std::pair<std::string, std::string>, std::vector<const Cell*>> by_pair_;  // system, contender
  std::map<std::pair<std::string, std::string>, SpeedCurve> speeds_;
  std::set<std::string> timed_;
};

// An error says nothing of the timestep where a run was compared with itself: at the fine-step run's own timestep.
bool is_reference(const Cell& cell);

}  // namespace assay
