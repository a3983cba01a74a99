#include "results/results.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/text.h"
#include "measures/batch.h"
#include "measures/measure.h"
#include "results/line_up.h"
#include "results/soundness.h"
#include "results/store/facts.h"
#include "results/store/trajectory.h"
#include "results/withdrawn.h"

namespace assay {
namespace {

Figure figure_of(const Cell& cell, const Value* value) {
  Figure figure;
  figure.timestep_ms = cell.timestep_ms;
  figure.cell = cell.id;
  if (cell.outcome == Outcome::kOk && value != nullptr) {
    figure.found = Found::kThere;
    figure.value = interval_of(cell, value->name).value_or(Interval{});
    figure.is_bound = bound_of(cell, value->name).has_value();
    figure.has_interval = figure.is_bound || (value->low && value->high);
    figure.unit = value->unit;
    return figure;
  }
  const bool failed = cell.outcome == Outcome::kUnstable || cell.outcome == Outcome::kDiverged;
  figure.found = failed ? Found::kFailed : Found::kMissing;
  figure.why = fmt::format("{} on {} at {} ms: {}{}", cell.contender, cell.system, timestep_label(cell.timestep_ms),
                           cell.outcome == Outcome::kOk ? "no such value" : outcome_text(cell.outcome),
                           cell.reason.empty() ? "" : fmt::format(" ({})", cell.reason));
  return figure;
}

void add_once(std::vector<std::string>& names, const std::string& name) {
  if (std::ranges::find(names, name) == names.end()) names.push_back(name);
}

// A withdrawn cell has no figure, and says why.
void withdraw(Cell& cell, const nlohmann::json& facts) {
  const std::string why = why_withdrawn(withdrawals(), cell, facts);
  if (why.empty()) return;
  cell.outcome = Outcome::kUnsupported;
  cell.reason = fmt::format("withdrawn until it is measured again: {}", why);
  cell.values.clear();
}

}  // namespace

Interval interval_of(const Value& value) {
  const double middle = value.value.value_or(0);
  return {middle, value.low.value_or(middle), value.high.value_or(middle)};
}

std::optional<double> bound_of(const Cell& cell, std::string_view value) {
  const Value* bound = find_value(cell, std::string(value) + "_bound");
  return bound == nullptr ? std::nullopt : bound->value;
}

std::optional<Interval> interval_of(const Cell& cell, std::string_view value) {
  if (const auto bound = bound_of(cell, value)) return Interval{*bound, 0, *bound};
  const Value* found = find_value(cell, value);
  return found == nullptr ? std::nullopt : std::optional(interval_of(*found));
}

std::string change_text(const SettingChange& change) {
  const auto with_unit = [&](const std::string& value) {
    return change.unit.empty() || change.unit == "1" ? value : value + " " + change.unit;
  };
  std::string text = fmt::format("{} {}", change.setting, with_unit(change.value));
  if (!change.otherwise.empty()) text += " instead of " + with_unit(change.otherwise);
  // what the setting is, without its choices and remarks
  const std::string meaning = change.meaning.substr(0, change.meaning.find_first_of("(:;"));
  const size_t end = meaning.find_last_not_of(' ');
  if (!change.meaning.empty()) text += fmt::format(" ({})", meaning.substr(0, end + 1));
  return text;
}

bool is_reference(const Cell& cell) { return find_value(cell, "restart_floor") != nullptr; }

Results::Results(const Store& store) : store_(&store), rows_(store.contenders()) {
  JudgedCells judged = judged_cells(store);
  judged_note_ = std::move(judged.note);
  for (Cell& cell : judged.cells)
    (reads(cell.measure, Reads::kWorlds) ? batch_cells_ : cells_).push_back(std::move(cell));
  for (const SystemRow& row : store.systems()) {
    systems_.push_back(row.name);
    const auto facts = nlohmann::json::parse(row.json, nullptr, false);
    facts_[row.name] = facts.is_object() ? facts : nlohmann::json::object();
  }
  for (std::vector<Cell>* some : {&cells_, &batch_cells_}) {
    for (Cell& cell : *some) withdraw(cell, facts(cell.system));
  }
  std::erase_if(rows_, [](const ContenderRow& row) { return row.name == kHarness || row.engine == kHarness; });
  for (const ContenderRow& row : rows_) {
    contenders_.push_back(row.name);
    if (std::string of = variant_of(row); !of.empty()) varied_[row.name] = std::move(of);
    if (row.version.empty()) absent_.insert(row.name);
  }
  std::set<std::string> harness = {kHarness};
  for (const ContenderRow& row : store.contenders()) {
    if (row.engine == kHarness) harness.insert(row.name);
  }
  for (const Cell& cell : cells_) {
    add_once(systems_, cell.system);
    for (const Value& value : cell.values) measures_[value.name].insert(cell.measure);
    if (harness.contains(cell.contender)) continue;
    add_once(contenders_, cell.contender);
    by_pair_[{cell.system, cell.contender}].push_back(&cell);
    const auto factor = interval_of(cell, "realtime_factor");
    if (!factor || cell.outcome != Outcome::kOk || !(factor->value > 0)) continue;
    speeds_[{cell.system, cell.contender}][cell.timestep_ms] = *factor;
    timed_.insert(cell.system);
  }
  for (auto& [pair, cells] : by_pair_) std::ranges::stable_sort(cells, {}, &Cell::timestep_ms);
  std::vector<std::string> measured;
  std::ranges::copy_if(contenders_, std::back_inserter(measured), [&](const std::string& contender) {
    return std::ranges::any_of(by_pair_, [&](const auto& pair) { return pair.first.second == contender; });
  });
  papers_ = papers_among(measured);
  std::vector<ContenderRow> drawn = rows_;
  for (const std::string& name : contenders_) {
    if (std::ranges::find(rows_, name, &ContenderRow::name) != rows_.end()) continue;
    drawn.push_back({name, name.substr(0, name.find('-')), "", name, "", "", ""});
  }
  looks_ = looks_of(drawn);
}

const std::string& Results::varied(const std::string& contender) const {
  const auto found = varied_.find(contender);
  return found == varied_.end() ? contender : found->second;
}

std::vector<SettingChange> Results::changes(const std::string& contender) const {
  const auto row = std::ranges::find(rows_, contender, &ContenderRow::name);
  return row == rows_.end() ? std::vector<SettingChange>() : row->changes;
}

const Look& Results::look(const std::string& contender) const {
  static const Look kPlain;
  const auto found = looks_.find(contender);
  return found == looks_.end() ? kPlain : found->second;
}

const Scene* Results::scene(const std::string& system) const {
  if (const auto known = scenes_.find(system); known != scenes_.end()) return &known->second;
  for (const SceneRow& row : store_->scenes()) {
    if (row.system == system) return &scenes_.emplace(system, parse_scene(row.json)).first->second;
  }
  return nullptr;
}

std::optional<Results::End> Results::end_of(const std::string& system) const {
  const Scene* drawn = scene(system);
  for (const RunRow& run : store_->runs()) {
    if (run.system != system || drawn == nullptr) continue;
    auto trajectory = read_run(store_->trajectories_dir(), run.address, drawn->bodies.size());
    if (trajectory) return End{run.contender, std::move(trajectory->states.back())};
  }
  return std::nullopt;
}

const nlohmann::json& Results::facts(const std::string& system) const {
  static const nlohmann::json kNone = nlohmann::json::object();
  const auto found = facts_.find(system);
  return found == facts_.end() ? kNone : found->second;
}

double Results::fact(const std::string& system, const char* name) const {
  const nlohmann::json& all = facts(system);
  return all.contains(name) && all[name].is_number() ? all[name].get<double>() : 0;
}

std::string Results::family(const std::string& system) const {
  const nlohmann::json& all = facts(system);
  return all.contains("family") && all["family"].is_string() ? all["family"].get<std::string>() : "";
}

bool Results::fact_flag(const std::string& system, const char* name) const {
  const nlohmann::json& all = facts(system);
  return all.contains(name) && all[name].is_boolean() && all[name].get<bool>();
}

std::vector<std::string> Results::family_members(const std::string& family) const {
  std::vector<std::string> members;
  std::ranges::copy_if(systems_, std::back_inserter(members),
                       [&](const std::string& system) { return this->family(system) == family; });
  return members;
}

const std::vector<const Cell*>& Results::cells(const std::string& system, const std::string& contender) const {
  static const std::vector<const Cell*> kNone;
  const auto found = by_pair_.find({system, contender});
  return found == by_pair_.end() ? kNone : found->second;
}

std::map<double, const Cell*> Results::cells(const std::string& system, const std::string& contender,
                                             std::string_view measure) const {
  std::map<double, const Cell*> found;
  for (const Cell* cell : cells(system, contender)) {
    if (cell->measure == measure) found.emplace(cell->timestep_ms, cell);
  }
  return found;
}

std::string Results::why_missing(const std::string& system, const std::string& contender, const std::string& value,
                                 std::optional<double> timestep_ms) const {
  if (std::ranges::find(systems_, system) == systems_.end()) {
    return fmt::format("the results have no system '{}'", system);
  }
  if (std::ranges::find(contenders_, contender) == contenders_.end()) {
    return fmt::format("the results have no contender '{}'", contender);
  }
  if (absent_.contains(contender)) return fmt::format("the engine of '{}' is absent", contender);
  return fmt::format("'{}' of {} on {} was not measured{}", value, contender, system,
                     timestep_ms ? fmt::format(" at {} ms", timestep_label(*timestep_ms)) : "");
}

std::vector<Figure> Results::figures(const std::string& system, const std::string& contender, const std::string& value,
                                     bool no_references) const {
  std::vector<Figure> found;
  const auto measures = measures_.find(value);
  if (measures == measures_.end()) return found;
  for (const Cell* cell : cells(system, contender)) {
    if (!measures->second.contains(cell->measure) || (no_references && is_reference(*cell))) continue;
    found.push_back(figure_of(*cell, find_value(*cell, value)));
  }
  return found;
}

std::vector<Figure> Results::outcomes(const std::string& system, const std::string& contender,
                                      const std::string& measure) const {
  const Value none;
  std::vector<Figure> found;
  for (const Cell* cell : cells(system, contender)) {
    if (cell->measure == measure) found.push_back(figure_of(*cell, &none));
  }
  return found;
}

Figure Results::figure(const std::string& system, const std::string& contender, const std::string& value,
                       std::optional<double> timestep_ms) const {
  for (const Figure& figure : figures(system, contender, value)) {
    if (!timestep_ms || same_timestep(figure.timestep_ms, *timestep_ms)) return figure;
  }
  Figure missing;
  missing.why = why_missing(system, contender, value, timestep_ms);
  return missing;
}

std::optional<Speed> Results::speed(const std::string& system, const std::string& contender, double timestep_ms) const {
  const auto found = speeds_.find({system, contender});
  std::optional<Speed> speed = found == speeds_.end() ? std::nullopt : speed_at(found->second, timestep_ms);
  if (!speed) return speed;
  for (const auto& [step, cell] : cells(system, contender, "raw_speed")) {
    if (!same_timestep(step, speed->below_ms) && !same_timestep(step, speed->above_ms)) continue;
    const Value* covered = find_value(*cell, "coverage");
    if (covered == nullptr || !covered->value) {
      speed->coverage = std::nullopt;
      break;
    }
    speed->coverage = std::min(speed->coverage.value_or(*covered->value), *covered->value);
  }
  return speed;
}

bool Results::timed_by_pooled_median() const {
  return std::ranges::any_of(cells_, [](const Cell& cell) {
    return reads(cell.measure, Reads::kSteps) && find_value(cell, "step_time") != nullptr &&
           find_value(cell, "coverage") == nullptr;
  });
}

}  // namespace assay
