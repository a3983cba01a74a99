#include "campaign/shards.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"

namespace assay {
namespace {

// Microseconds of a step.
struct StepCosts {
  std::map<std::string, std::array<double, 2>> per_body;            // without and with contact pairs; 0: unknown
  std::map<std::pair<std::string, std::string>, double> of_system;  // by system and contender
};
constexpr std::string_view kStepCosts =
#include "step_costs.inc"
    ;

const StepCosts& step_costs() {
  static const StepCosts known = [] {
    StepCosts read;
    std::istringstream lines{std::string(kStepCosts)};
    std::vector<std::string> columns;
    for (std::string line; std::getline(lines, line);) {
      if (line.empty() || line.starts_with('#')) continue;
      std::istringstream cells(line);
      std::vector<std::string> row;
      for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
      if (columns.empty()) {
        columns = row;
        continue;
      }
      const auto us = [&](size_t column) { return column < row.size() ? parse_number(row[column]).value_or(0) : 0; };
      read.per_body[row.front()] = {us(1), us(2)};
      for (size_t i = 3; i < columns.size(); ++i) {
        if (us(i) > 0) read.of_system[{columns[i], row.front()}] = us(i);
      }
    }
    return read;
  }();
  return known;
}

constexpr double kLargeShare = 0.25;                        // of a shard's mean
constexpr double kRunStart = 0.05, kSolutionSeconds = 0.3;  // of a run, and of a reference solution, as far as known

double step_us_per_body(const CampaignContender& contender, bool contacts) {
  constexpr std::array kUsual = {2.0, 4.0};
  const size_t column = contacts ? 1 : 0;
  for (const std::string& name : {contender.resolved.name, contender.resolved.base}) {
    const auto found = step_costs().per_body.find(name);
    if (found != step_costs().per_body.end() && found->second.at(column) > 0) return found->second.at(column);
  }
  return kUsual.at(column);
}

// What stays together: (system, contender), or (system, one of the constants); a family's first system stands for it.
// Of a group that was taken apart, the timestep, negative for what stands alone beside what reads a run; else 0.
using Group = std::tuple<int, int, double>;
constexpr int kTimingOfAll = -1, kAgreementOfAll = -2, kScalingOfFamily = -3, kBatchOfAll = -4;

Group group_of(const Campaign& campaign, const PlannedCell& cell) {
  if (cell.reads == Reads::kSteps) return {cell.system, kTimingOfAll, 0};
  if (cell.reads == Reads::kFineRuns) return {cell.system, kAgreementOfAll, 0};
  if (cell.reads == Reads::kWorlds) return {cell.system, kBatchOfAll, 0};
  if (cell.reads != Reads::kWholeRuns) return {cell.system, cell.contender, 0};
  const std::string& family = campaign.systems[static_cast<size_t>(cell.system)].family;
  const auto first = std::ranges::find(campaign.systems, family, &CampaignSystem::family);
  return {static_cast<int>(first - campaign.systems.begin()), kScalingOfFamily, 0};
}

bool takes_part(const PlannedCell& cell, ShardCells cells) {
  switch (cells) {
    case ShardCells::kAll:
      return true;
    case ShardCells::kTiming:
      return is_timed(cell);
    case ShardCells::kAccuracy:
    case ShardCells::kAfterRuns:
      return !is_timed(cell);
    case ShardCells::kRuns:
      break;
  }
  return false;
}

// Fine-step runs that a group reads and does not measure: a timing makes those of all contenders again, unless they lie
// in a folder that machines share (--references).
std::vector<PlannedCell> runs_made_again(const std::map<std::string, const PlannedCell*>& references,
                                         const std::vector<PlannedCell>& group) {
  std::set<std::string> read;
  for (const PlannedCell& cell : group) {
    if (cell.reads == Reads::kSteps || cell.reads == Reads::kFineRuns) read.insert(cell.trajectory);
  }
  std::vector<PlannedCell> runs;
  for (const std::string& trajectory : read) {
    const auto made = references.find(trajectory);
    if (made != references.end()) runs.push_back(*made->second);
  }
  return runs;
}

// Shards of these costs in their order, from 1, none of which has more than `most` unless it is of one.
std::vector<int> packed(const std::vector<long long>& costs, long long most) {
  std::vector<int> shards;
  shards.reserve(costs.size());
  int shard = 1;
  long long load = 0;
  for (const long long cost : costs) {
    if (load > 0 && load + cost > most) {
      load = 0;
      ++shard;
    }
    load += cost;
    shards.push_back(shard);
  }
  return shards;
}

// In their order, so that a part has few contenders, and so that the longest part is as short as that allows. The
// longest parts come first, as a scheduler takes them in turn.
void divide_runs(const Campaign& campaign, Plan& plan, int shards) {
  for (PlannedCell& cell : plan.cells) cell.shard = 0;
  plan.runs = runs_of(campaign, plan.cells);
  if (plan.runs.empty()) return;
  const auto step_us = expected_step_us(campaign);
  std::vector<long long> costs;  // us, whole ones: all machines find the same division
  costs.reserve(plan.runs.size());
  for (const PlannedRun& run : plan.runs) costs.push_back(std::llround(1e6 * run_seconds(plan, run, step_us)));
  long long least = *std::ranges::max_element(costs), most = std::accumulate(costs.begin(), costs.end(), 0LL);
  while (least < most) {
    const long long middle = least + (most - least) / 2;
    if (packed(costs, middle).back() <= shards) {
      most = middle;
    } else {
      least = middle + 1;
    }
  }
  const std::vector<int> parts = packed(costs, most);
  std::map<int, long long> loads;  // negative, so that the longest sorts first
  for (size_t i = 0; i < parts.size(); ++i) loads[parts[i]] -= costs[i];
  std::vector<std::pair<long long, int>> order;
  order.reserve(loads.size());
  for (const auto& [part, load] : loads) order.emplace_back(load, part);
  std::ranges::sort(order);
  std::map<int, int> number;
  for (const auto& [load, part] : order) number.emplace(part, static_cast<int>(number.size()) + 1);
  for (size_t i = 0; i < parts.size(); ++i) plan.runs[i].shard = number.at(parts[i]);
}

std::optional<std::string> variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr || *value == '\0' ? std::nullopt : std::optional<std::string>(value);
}

// Of a scheduler's array of jobs.
struct ArrayVariables {
  const char* index;
  int first;          // the index of the first part
  const char* begin;  // variable with the index at which the array begins, "" for none
  const char* last;   // variable with the index of the last part, "" for none
  const char* count;  // variable with the number of parts, "" for none
};
constexpr auto kArrays = std::to_array<ArrayVariables>({{"JOB_COMPLETION_INDEX", 0, "", "", ""},
                                                        {"PBS_ARRAY_INDEX", 1, "", "", "PBS_ARRAY_COUNT"},
                                                        {"LSB_JOBINDEX", 1, "", "LSB_JOBINDEX_END", ""},
                                                        {"SGE_TASK_ID", 1, "SGE_TASK_FIRST", "SGE_TASK_LAST", ""},
                                                        {"AWS_BATCH_JOB_ARRAY_INDEX", 0, "", "", ""}});

long long number_in(const char* name, const std::string& text) {
  const auto number = parse_integer(text);
  if (!number) throw InputError(fmt::format("the environment's {} is '{}', which is no whole number", name, text));
  return *number;
}

// `told` is the length of an array. It is the number of parts only where the array is whole, and one that measures some
// parts again need not tell that it is not.
Shard checked(long long index, std::optional<long long> told, std::optional<long long> given, const std::string& from) {
  if (told && given && *told > *given) {
    throw InputError(
        fmt::format("{} tells of {} parts, and --shard of {}: give the number into which the campaign is "
                    "divided",
                    from, *told, *given));
  }
  const std::optional<long long> count = given ? given : told;
  if (!given && told && *told == 1) {
    throw InputError(fmt::format(
        "{} is of an array of one job, which may be a part of more: give --shard auto/N, with N parts in all", from));
  }
  if (!count) throw InputError(fmt::format("{} does not tell the number of parts: give --shard auto/N", from));
  if (index < 1 || index > *count || *count > kMostShards) {
    throw InputError(
        fmt::format("{} names part {} of {}: parts count from 1 to N, at most {}", from, index, *count, kMostShards));
  }
  return {static_cast<int>(index), static_cast<int>(*count)};
}

std::optional<long long> number_in(const char* name) {
  const auto text = *name == '\0' ? std::nullopt : variable(name);
  return text && *text != "undefined" ? std::optional(number_in(name, *text)) : std::nullopt;
}

Shard slurm_shard(const std::string& task, std::optional<long long> given) {
  const auto first = number_in("SLURM_ARRAY_TASK_MIN"), last = number_in("SLURM_ARRAY_TASK_MAX"),
             count = number_in("SLURM_ARRAY_TASK_COUNT");
  const long long index = number_in("SLURM_ARRAY_TASK_ID", task);
  // An array that counts from 0 does so where some of its numbers are repeated, if 0 is one of these.
  const long long part = first && *first == 0 ? index + 1 : index;
  // An array of some numbers, such as one that repeats lost parts, does not tell how many parts there are.
  const bool whole = first && last && count && *count == *last - *first + 1 && (*first == 0 || *first == 1);
  return checked(part, whole ? count : std::nullopt, given, "SLURM_ARRAY_TASK_ID");
}

Shard shard_of_environment(std::optional<long long> count) {
  if (const auto text = variable("ASSAY_SHARD")) {
    if (text->starts_with("auto")) throw InputError(fmt::format("ASSAY_SHARD is '{}': give I/N", *text));
    const Shard shard = parse_shard(*text);
    if (count && *count != shard.count) {
      throw InputError(
          fmt::format("ASSAY_SHARD tells of {} parts, and --shard of {}: give the same number", shard.count, *count));
    }
    return shard;
  }
  if (const auto task = variable("SLURM_ARRAY_TASK_ID")) return slurm_shard(*task, count);
  for (const ArrayVariables& array : kArrays) {
    const auto index = variable(array.index);
    // Grid Engine sets the variable to 'undefined' outside of an array
    if (!index || *index == "undefined") continue;
    std::optional<long long> told = number_in(array.last);
    if (!told) told = number_in(array.count);
    const auto begin = number_in(array.begin);
    if (begin && *begin != array.first) told = std::nullopt;
    return checked(number_in(array.index, *index) - array.first + 1, told, count, array.index);
  }
  throw InputError(
      "--shard auto finds no scheduler's variable (ASSAY_SHARD, SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX, ...): give "
      "I/N, such as 1/4");
}

}  // namespace

Shard parse_shard(const std::string& text) {
  const size_t slash = text.find('/');
  const std::string before = text.substr(0, slash);
  const auto count = slash == std::string::npos ? std::optional<long long>() : parse_integer(text.substr(slash + 1));
  if (before == "auto" && (slash == std::string::npos || count)) return shard_of_environment(count);
  const auto index = parse_integer(before);
  if (index && count && 1 <= *index && *index <= *count && *count <= kMostShards) {
    return {static_cast<int>(*index), static_cast<int>(*count)};
  }
  throw InputError(fmt::format(
      "'{}' is no shard: give I/N, such as 1/4 for the first of four, or auto for that of a scheduler's array", text));
}

ShardCells parse_shard_cells(const std::string& text) {
  for (const ShardCells cells :
       {ShardCells::kAll, ShardCells::kAccuracy, ShardCells::kTiming, ShardCells::kRuns, ShardCells::kAfterRuns}) {
    if (text == shard_cells_text(cells)) return cells;
  }
  throw InputError(fmt::format("--cells is '{}': use all, accuracy, timing, runs or after-runs", text));
}

std::string shard_text(const Shard& shard) { return fmt::format("{}/{}", shard.index, shard.count); }

std::string_view shard_cells_text(ShardCells cells) {
  switch (cells) {
    case ShardCells::kAccuracy:
      return "accuracy";
    case ShardCells::kTiming:
      return "timing";
    case ShardCells::kRuns:
      return "runs";
    case ShardCells::kAfterRuns:
      return "after-runs";
    case ShardCells::kAll:
      break;
  }
  return "all";
}

PlannedCell after_runs(PlannedCell cell) {
  if (cell.reads == Reads::kFineRun) cell.steps = 0;
  return cell;
}

bool stands_alone(const PlannedCell& cell) {
  return cell.trajectory.empty() && cell.other_states.empty() && !is_timed(cell) && cell.reads != Reads::kFineRuns;
}

std::map<std::pair<int, int>, double> expected_step_us(const Campaign& campaign) {
  const auto& known = step_costs().of_system;
  std::map<std::pair<int, int>, double> found;
  for (size_t s = 0; s < campaign.systems.size(); ++s) {
    const CampaignSystem& system = campaign.systems[s];
    for (const int c : system.contenders) {
      const CampaignContender& contender = campaign.contenders[static_cast<size_t>(c)];
      double us = 0;
      for (const std::string& name : {contender.resolved.base, contender.resolved.name}) {
        const auto measured = known.find({system.name, name});
        if (measured != known.end()) us = measured->second;
      }
      if (us == 0) {
        us = static_cast<double>(system.model.bodies.size()) *
             step_us_per_body(contender, !system.model.contacts.empty());
      }
      found[{static_cast<int>(s), c}] = us;
    }
  }
  return found;
}

std::vector<PlannedRun> runs_of(const Campaign& campaign, const std::vector<PlannedCell>& cells) {
  std::map<std::string, PlannedRun> runs;  // by address
  const auto add = [&](const std::string& address, size_t cell, int contender, int state) {
    const CampaignSystem& system = campaign.systems[static_cast<size_t>(cells[cell].system)];
    const double timestep_ms = system.reference_of(campaign.contenders[static_cast<size_t>(contender)]);
    runs.try_emplace(
        address, PlannedRun{address, cell, contender, state, std::llround(1000 * system.duration_s / timestep_ms), 1});
  };
  std::vector<PlannedRun> found;
  std::set<std::tuple<std::string, double, double>> solved;  // reference solutions, by model, duration and samples
  for (size_t i = 0; i < cells.size(); ++i) {
    const PlannedCell& cell = cells[i];
    const CampaignSystem& system = campaign.systems[static_cast<size_t>(cell.system)];
    if (cell.reads == Reads::kSolution &&
        solved.insert({system.model.hash, system.duration_s, system.sample_ms}).second) {
      found.push_back({"", i, -1, 0, 0, 1});
    }
    if (cell.reads == Reads::kFineRun) add(cell.trajectory, i, cell.contender, 0);
    for (size_t k = 0; k < cell.other_states.size(); ++k) {
      add(cell.other_states[k], i, cell.contender, static_cast<int>(k) + 1);
    }
    for (size_t k = 0; k < cell.against.size(); ++k) add(cell.against[k], i, system.trained_in, static_cast<int>(k));
  }
  for (const auto& [address, run] : runs) found.push_back(run);
  std::ranges::sort(found, {}, [&](const PlannedRun& run) {
    return std::tuple(run.contender, cells[run.cell].system, run.state, run.cell);
  });
  return found;
}

double run_seconds(const Plan& plan, const PlannedRun& run, const std::map<std::pair<int, int>, double>& step_us) {
  if (run.contender < 0) return kSolutionSeconds;
  const auto found = step_us.find({plan.cells[run.cell].system, run.contender});
  return kRunStart + (found == step_us.end() ? 0 : 1e-6 * found->second * static_cast<double>(run.steps));
}

void divide(const Campaign& campaign, Plan& plan, int shards, ShardCells cells) {
  plan.kind = cells;
  if (cells == ShardCells::kRuns) {
    divide_runs(campaign, plan, shards);
    return;
  }
  const bool after = cells == ShardCells::kAfterRuns;
  std::map<Group, std::vector<PlannedCell>> groups;
  for (const PlannedCell& cell : plan.cells) {
    if (takes_part(cell, cells)) groups[group_of(campaign, cell)].push_back(after ? after_runs(cell) : cell);
  }
  std::map<std::string, const PlannedCell*> references;  // by the run that they make: the first one makes it
  for (const PlannedCell& cell : plan.cells) {
    if (cell.reads == Reads::kFineRun) references.emplace(cell.trajectory, &cell);
  }
  const auto step_us = expected_step_us(campaign);
  const auto seconds_of = [&](const std::vector<PlannedCell>& group) {
    double seconds = estimate_seconds(campaign, group, step_us, 1);
    if (shards > 1 && cells == ShardCells::kAll) {
      seconds += estimate_seconds(campaign, runs_made_again(references, group), step_us, 1);
    }
    return seconds;
  };
  double total = 0;
  std::map<Group, double> seconds_of_group;
  for (const auto& [group, of_group] : groups) total += seconds_of_group[group] = seconds_of(of_group);
  // What is a large part of a shard is taken apart where that costs nothing; more than that would have each shard make
  // the reference solutions of more systems again.
  const double large = kLargeShare * total / shards;
  std::map<Group, std::vector<PlannedCell>> parts;
  for (const auto& [group, of_group] : groups) {
    const bool apart = shards > 1 && seconds_of_group.at(group) > large;
    for (const PlannedCell& cell : of_group) {
      Group part = group;
      const bool alone = stands_alone(cell);
      if (apart && (alone || (after && cell.reads != Reads::kFineRuns))) std::get<2>(part) = cell.timestep_ms;
      if (after && alone && shards > 1) std::get<2>(part) = -cell.timestep_ms;  // not with what waits for a run
      parts[part].push_back(cell);
    }
  }
  struct Part {
    const std::vector<PlannedCell>* cells;
    double seconds;
    bool alone;
  };
  std::vector<Part> sorted;
  sorted.reserve(parts.size());
  double alone_seconds = 0, all_seconds = 0;
  for (const auto& [part, of_part] : parts) {
    const bool alone = after && std::ranges::all_of(of_part, stands_alone);
    sorted.push_back({&of_part, seconds_of(of_part), alone});
    all_seconds += sorted.back().seconds;
    if (alone) alone_seconds += sorted.back().seconds;
  }
  std::ranges::stable_sort(sorted, [](const Part& a, const Part& b) { return a.seconds > b.seconds; });
  // as many shards for what stands alone as its share of the work is
  int first = 0;
  if (after && alone_seconds > 0 && shards > 1) {
    const bool all = alone_seconds == all_seconds;
    first =
        std::clamp(static_cast<int>(std::lround(shards * alone_seconds / all_seconds)), 1, all ? shards : shards - 1);
  }
  std::vector<double> loads(static_cast<size_t>(shards), 0);
  std::unordered_map<std::string_view, int> shard_of;  // by the cell's key
  for (const Part& part : sorted) {
    const bool to_first = part.alone && first > 0;
    const auto least =
        std::min_element(loads.begin() + (to_first ? 0 : first), to_first ? loads.begin() + first : loads.end());
    *least += part.seconds;
    for (const PlannedCell& cell : *part.cells) shard_of[cell.key] = static_cast<int>(least - loads.begin()) + 1;
  }
  for (PlannedCell& cell : plan.cells) cell.shard = takes_part(cell, cells) ? shard_of.at(cell.key) : 0;
}

std::map<int, double> shard_seconds(const Campaign& campaign, const Plan& plan) {
  const auto step_us = expected_step_us(campaign);
  std::map<int, double> seconds;
  for (const PlannedRun& run : plan.runs) seconds[run.shard] += run_seconds(plan, run, step_us);
  std::map<std::pair<int, Group>, std::vector<PlannedCell>> groups;
  for (const PlannedCell& cell : plan.cells) {
    if (cell.shard == 0) continue;
    groups[{cell.shard, group_of(campaign, cell)}].push_back(plan.kind == ShardCells::kAfterRuns ? after_runs(cell)
                                                                                                 : cell);
  }
  for (const auto& [at, cells] : groups) seconds[at.first] += estimate_seconds(campaign, cells, step_us, 1);
  return seconds;
}

}  // namespace assay
