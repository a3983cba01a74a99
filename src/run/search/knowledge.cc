#include "run/search/knowledge.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/text.h"

namespace assay {
namespace {

CellGroup group_of(const PlannedCell& cell) {
  if (is_timed(cell)) return CellGroup::kTimes;
  return cell.reads == Reads::kPieces || cell.reads == Reads::kFineRuns ? CellGroup::kPieces : CellGroup::kRuns;
}

constexpr std::array<CellGroup, 3> kGroups = {CellGroup::kRuns, CellGroup::kPieces, CellGroup::kTimes};

}  // namespace

Knowledge::Knowledge(const Campaign& campaign, const Plan& plan) : campaign_(campaign) {
  for (const PlannedCell& cell : plan.cells) {
    if (cell.reads == Reads::kSteps) timesteps_ms_.push_back(cell.timestep_ms);
  }
  std::ranges::sort(timesteps_ms_);
  const auto repeated = std::ranges::unique(timesteps_ms_, same_timestep);
  timesteps_ms_.erase(repeated.begin(), repeated.end());
  for (const PlannedCell& cell : plan.cells) {
    if (cell.reads == Reads::kFineRun) {
      references_[{cell.system, cell.contender}] = &cell;
      continue;
    }
    const auto at =
        std::ranges::find_if(timesteps_ms_, [&](double step) { return same_timestep(step, cell.timestep_ms); });
    if (at == timesteps_ms_.end()) continue;
    const auto step = static_cast<size_t>(at - timesteps_ms_.begin());
    points_[{cell.contender, step}][static_cast<size_t>(group_of(cell))].cells.push_back(&cell);
  }
}

void Knowledge::update(const Store& store) {
  stored_.clear();
  for (Cell& cell : store.cells()) {
    std::string key = cell.key;
    stored_.emplace(std::move(key), std::move(cell));
  }
}

bool Knowledge::counts(const PlannedCell& cell) const {
  const std::string& system = campaign_.systems[static_cast<size_t>(cell.system)].name;
  return cell.reads != Reads::kSolution || std::ranges::find(without_truth_, system) == without_truth_.end();
}

std::vector<const PlannedCell*> Knowledge::missing(const PointAt& point, CellGroup group) const {
  std::vector<const PlannedCell*> cells;
  const auto found = points_.find({point.contender, point.step});
  if (found == points_.end()) return cells;
  for (const PlannedCell* cell : found->second[static_cast<size_t>(group)].cells) {
    if (!counts(*cell) || stored_.contains(cell->key)) continue;
    const auto reference = references_.find({cell->system, cell->contender});
    const bool needs = !cell->trajectory.empty() && reference != references_.end();
    if (needs && !stored_.contains(reference->second->key) &&
        std::ranges::find(cells, reference->second) == cells.end()) {
      cells.push_back(reference->second);
    }
    cells.push_back(cell);
  }
  return cells;
}

Verdict Knowledge::verdict(const PointAt& point, const Limits& limits) const {
  bool whole = true;
  std::map<std::string, bool> seen;
  for (size_t step = 0; step <= point.step; ++step) {
    const auto found = points_.find({point.contender, step});
    if (found == points_.end()) continue;
    for (const CellGroup group : kGroups) {
      for (const PlannedCell* cell : found->second[static_cast<size_t>(group)].cells) {
        if (!counts(*cell)) continue;
        const auto stored = stored_.find(cell->key);
        if (stored == stored_.end()) {
          whole = whole && step < point.step;
          continue;
        }
        if (stored->second.outcome != Outcome::kOk) return Verdict::kOut;
        for (const auto& [name, largest] : limits.largest) {
          const Value* value = find_value(stored->second, name);
          if (value == nullptr || !value->value) continue;
          if (exceeds(*value->value, largest)) return Verdict::kOut;
          if (step == point.step) seen[name] = true;
        }
      }
    }
  }
  if (!whole) return Verdict::kOpen;
  if (!std::ranges::all_of(limits.largest, [&](const auto& limit) { return seen.contains(limit.first); })) {
    return Verdict::kOut;  // a limited value that has no figure here
  }
  if (limits.realtime && speed(point).value_or(0) < *limits.realtime) return Verdict::kOut;
  return Verdict::kFeasible;
}

bool Knowledge::timed(const PointAt& point) const {
  const auto found = points_.find({point.contender, point.step});
  if (found == points_.end()) return false;
  const auto& cells = found->second[static_cast<size_t>(CellGroup::kTimes)].cells;
  return !cells.empty() && std::ranges::all_of(cells, [&](const PlannedCell* cell) {
    const auto stored = stored_.find(cell->key);
    return stored != stored_.end() && stored->second.outcome == Outcome::kOk;
  });
}

// Of one step: from the cells at the timestep nearest to 1 ms that has any.
std::optional<double> Knowledge::step_s(int system, int contender) const {
  std::optional<double> best;
  double nearest = HUGE_VAL;
  for (size_t step = 0; step < timesteps_ms_.size(); ++step) {
    const auto found = points_.find({contender, step});
    if (found == points_.end()) continue;
    double engine_s = 0, steps = 0;
    for (const CellGroup group : {CellGroup::kRuns, CellGroup::kPieces}) {
      for (const PlannedCell* cell : found->second[static_cast<size_t>(group)].cells) {
        const auto stored = stored_.find(cell->key);
        if (cell->system != system || stored == stored_.end() || stored->second.engine_s <= 0) continue;
        // cells that share a run share its time, and the first has its steps
        engine_s += stored->second.engine_s;
        steps += static_cast<double>(cell->steps);
      }
    }
    const double distance = std::abs(std::log(timesteps_ms_[step]));
    if (steps == 0 || distance >= nearest) continue;
    nearest = distance;
    best = engine_s / steps;
  }
  return best;
}

std::optional<double> Knowledge::speed(const PointAt& point) const {
  const auto found = points_.find({point.contender, point.step});
  if (found == points_.end()) return std::nullopt;
  std::optional<double> slowest;
  const auto add = [&](double factor) { slowest = std::min(slowest.value_or(HUGE_VAL), factor); };
  for (const PlannedCell* cell : found->second[static_cast<size_t>(CellGroup::kTimes)].cells) {
    const auto stored = stored_.find(cell->key);
    const Value* factor = stored == stored_.end() ? nullptr : find_value(stored->second, "realtime_factor");
    if (factor != nullptr && factor->value) {
      add(*factor->value);
    } else if (const auto step = step_s(cell->system, cell->contender)) {
      add(1e-3 * timesteps_ms_[point.step] / *step);
    }
  }
  return slowest;
}

double Knowledge::expected_error(const PointAt& point) const {
  const auto& contender = campaign_.contenders[static_cast<size_t>(point.contender)].resolved;
  if (contender.engine == nullptr) return 0;
  const double order = contender.engine->capabilities(contender.settings).order;
  std::map<int, std::vector<std::pair<double, double>>> errors;  // by system: timestep and error, ascending
  for (size_t step = 0; step <= point.step; ++step) {
    const auto found = points_.find({point.contender, step});
    if (found == points_.end()) continue;
    for (const PlannedCell* cell : found->second[static_cast<size_t>(CellGroup::kRuns)].cells) {
      const auto stored = stored_.find(cell->key);
      if (cell->reads != Reads::kSolution || stored == stored_.end()) continue;
      const Value* error = find_value(stored->second, kTruthError);
      if (error != nullptr && error->value) errors[cell->system].emplace_back(timesteps_ms_[step], *error->value);
    }
  }
  double expected = 0;
  for (const auto& [system, known] : errors) {
    const auto& [last_ms, last] = known.back();
    // A part of the error may not depend on the timestep, so one figure alone is not followed by a high order.
    double slope = std::min(order, 1.0);
    if (known.size() > 1) {
      const auto& [before_ms, before] = known[known.size() - 2];
      const bool grows = before > 0 && last > before;
      slope = grows ? std::min(order, std::log(last / before) / std::log(last_ms / before_ms)) : 0;
    }
    expected = std::max(expected, last * std::pow(timesteps_ms_[point.step] / last_ms, slope));
  }
  return expected;
}

std::optional<double> Knowledge::error_excess(const PointAt& point, const Limits& limits) const {
  std::optional<double> most;
  for (size_t step = 0; step <= point.step; ++step) {
    const auto found = points_.find({point.contender, step});
    if (found == points_.end()) continue;
    for (const CellGroup group : kGroups) {
      for (const PlannedCell* cell : found->second[static_cast<size_t>(group)].cells) {
        const auto stored = stored_.find(cell->key);
        if (!counts(*cell) || stored == stored_.end()) continue;
        if (stored->second.outcome != Outcome::kOk) return std::nullopt;
        for (const auto& [name, largest] : limits.largest) {
          const Value* value = find_value(stored->second, name);
          if (value == nullptr || !value->value) continue;
          if (usual_option(name).empty()) {
            most = std::max(most.value_or(0), exceeds(*value->value, largest) ? *value->value / largest : 0);
          } else if (exceeds(*value->value, largest)) {
            return std::nullopt;
          }
        }
      }
    }
  }
  return most;
}

double Knowledge::cost_s(const std::vector<const PlannedCell*>& cells) const {
  constexpr double kProcess = 0.1, kTiming = 1;
  double seconds = 0;
  for (const PlannedCell* cell : cells) {
    seconds += cell->reads == Reads::kSteps ? kTiming : kProcess;
    const auto step = step_s(cell->system, cell->contender);
    seconds += step.value_or(1e-4) * static_cast<double>(cell->steps);
  }
  return seconds;
}

}  // namespace assay
