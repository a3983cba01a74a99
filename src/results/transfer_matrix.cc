#include "results/transfer_matrix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "measures/measure.h"
#include "measures/rank_test.h"
#include "measures/statistics.h"
#include "measures/transfer.h"
#include "results/store/facts.h"
#include "results/store/scene.h"
#include "results/values.h"

namespace assay {
namespace {

// The number that most of `numbers` are, and how many.
std::pair<int, size_t> most_frequent(const std::vector<double>& numbers) {
  std::map<int, size_t> counts;
  for (const double number : numbers) ++counts[static_cast<int>(number)];
  std::pair<int, size_t> most = {-1, 0};
  for (const auto& [number, count] : counts) {
    if (count > most.second) most = {number, count};
  }
  return most;
}

TransferParting parting_of(const std::vector<SampleSeries>& samples, const Scene* scene, size_t shown) {
  const auto series = [&](const char* name) -> std::vector<double> {
    const auto found = std::ranges::find(samples, name, &SampleSeries::name);
    return found == samples.end() ? std::vector<double>() : found->values;
  };
  const std::vector<double> times = series(kPartingTimes), bodies = series(kPartingBodies),
                            joints = series(kPartingJoints), contacts = series(kPartingContacts);
  TransferParting parting;
  if (bodies.size() != times.size() || joints.size() != times.size() || contacts.size() != times.size()) return parting;
  std::vector<double> when, first_bodies, first_joints;
  for (size_t i = 0; i < times.size(); ++i) {
    if (times[i] == kNotCompared) continue;
    ++parting.starts;
    if (times[i] == kNeverParted) continue;
    ++parting.parted;
    when.push_back(times[i]);
    first_bodies.push_back(bodies[i]);
    first_joints.push_back(joints[i]);
    if (contacts[i] == 1) ++parting.contact;
  }
  if (when.empty()) return parting;
  parting.first_s = std::ranges::min(when);
  parting.median_s = median(when);
  if (shown < times.size() && times[shown] >= 0) parting.shown_s = times[shown];
  const auto [body, same_body] = most_frequent(first_bodies);
  const auto [joint, same_joint] = most_frequent(first_joints);
  parting.same_body = same_body;
  parting.same_joint = same_joint;
  if (scene == nullptr) return parting;
  if (body >= 0 && std::cmp_less(body, scene->bodies.size())) {
    parting.body = scene->bodies[static_cast<size_t>(body)].name;
  }
  if (joint >= 0 && std::cmp_less(joint, scene->joints.size())) {
    parting.joint = scene->joints[static_cast<size_t>(joint)];
  }
  return parting;
}

// What more of a value means, after the contender's name.
struct ExcessWords {
  std::string_view value, before, after;
};
constexpr std::array<ExcessWords, 4> kExcessWords = {{{"velocity_error", "is ", " times as far from the velocity"},
                                                      {"turning_error", "is ", " times as far from the turning rate"},
                                                      {"foot_slip", "slips ", " times as much"},
                                                      {"joint_power", "takes ", " times as much power"}}};

// "a, b and c".
std::string list(const std::vector<std::string>& parts) {
  if (parts.size() < 2) return join(parts, "");
  return join({parts.begin(), parts.end() - 1}, ", ") + " and " + parts.back();
}

std::string place_of(const TransferRow& row) {
  return fmt::format("{} at {} ms", row.contender, timestep_label(row.timestep_ms));
}

// Fills in what the rows are against the run of training.
void compare_with_training(TransferMatrix& matrix) {
  const TransferRow* trained = matrix.trained();
  if (trained == nullptr || trained->runs() == 0) return;
  std::vector<TransferRow*> compared;
  std::vector<double> p;
  for (TransferRow& row : matrix.rows) {
    if (&row == trained || row.runs() == 0) continue;
    row.excesses = excesses(row, *trained);
    compared.push_back(&row);
    p.push_back(rank_test(row.falls, trained->falls));
  }
  const std::vector<double> corrected = corrected_for_number(p);
  for (size_t i = 0; i < compared.size(); ++i) compared[i]->falls_p = corrected[i];
}

nlohmann::ordered_json number_json(const std::optional<double>& number) {
  return number && std::isfinite(*number) ? nlohmann::ordered_json(*number) : nlohmann::ordered_json(nullptr);
}

// "5 ms", "5 and 10 ms", "all 7 timesteps from 1/4 to 16 ms"
std::string timesteps_text(const std::vector<double>& sorted) {
  constexpr size_t kMostNamed = 4;
  std::vector<std::string> labels;
  for (const double timestep_ms : sorted) labels.push_back(timestep_label(timestep_ms));
  if (labels.size() <= kMostNamed) return list(labels) + " ms";
  return fmt::format("all {} timesteps from {} to {} ms", labels.size(), labels.front(), labels.back());
}

}  // namespace

const Value* TransferRow::value(const std::string& name) const {
  const auto found = values.find(name);
  return found == values.end() || !found->second.value ? nullptr : &found->second;
}

std::string_view TransferRow::verdict() const {
  const Value* found = value("fall_rate");
  if (found == nullptr) return "no run";
  const Interval rate = interval_of(*found);
  if (rate.high <= kUp) return excesses.empty() ? "stays up" : "stays up, but worse";
  return rate.low >= kDown ? "falls" : "not settled";
}

std::vector<TransferExcess> excesses(const TransferRow& row, const TransferRow& trained) {
  std::vector<TransferExcess> found;
  for (const ExcessWords& words : kExcessWords) {
    const Value *own = row.value(std::string(words.value)), *then = trained.value(std::string(words.value));
    if (own == nullptr || then == nullptr || !own->low || !then->high || *then->high <= 0) continue;
    if (*own->low >= kManyTimes * *then->high) {
      found.push_back({std::string(words.value), *own->value / *then->value});
    }
  }
  std::ranges::stable_sort(found, std::greater(), &TransferExcess::times);
  return found;
}

std::string excess_text(const std::vector<TransferExcess>& excesses) {
  std::vector<std::string> parts;
  for (const TransferExcess& excess : excesses) {
    const auto words = std::ranges::find(kExcessWords, excess.value, &ExcessWords::value);
    parts.push_back(fmt::format("{}{:.2g}{}", words->before, excess.times, words->after));
  }
  return list(parts);
}

const TransferRow* TransferMatrix::trained() const {
  const auto found = std::ranges::find(rows, true, &TransferRow::trained);
  return found == rows.end() ? nullptr : &*found;
}

std::string_view TransferMatrix::against_training(const TransferRow& row) const {
  if (!row.falls_p) return "";
  if (*row.falls_p > kToldApart) return "not told apart";
  const double now = *row.value("fall_rate")->value, then = *trained()->value("fall_rate")->value;
  return now > then ? "falls more often" : "falls less often";
}

std::optional<TransferMatrix> transfer_matrix(const Results& results, const std::string& system) {
  TransferMatrix matrix;
  matrix.system = system;
  const nlohmann::json& facts = results.facts(system);
  matrix.policy = text_fact(facts, "control");
  matrix.trained_in = text_fact(facts, "trained_in");
  matrix.duration_s = results.fact(system, "duration_s");
  matrix.trained_ms = results.fact(system, "trained_ms");
  if (const auto push = facts.find("push"); push != facts.end() && push->is_object()) {
    const std::string joint = text_fact(*push, "joint");
    matrix.pushes = fmt::format("pushes of {}{} every {} s", shortest(number_fact(*push, "velocity")),
                                joint.empty() ? " m/s" : fmt::format(" of the joint '{}'", joint),
                                shortest(number_fact(*push, "every_s")));
  }
  const Scene* scene = results.scene(system);
  const auto shown = static_cast<size_t>(std::max(0.0, results.fact(system, "shown_state")));
  for (const Cell& cell : results.cells()) {
    if (cell.system != system || !reads(cell.measure, Reads::kRunPairs)) continue;
    TransferRow& row = matrix.rows.emplace_back();
    row.contender = cell.contender;
    row.timestep_ms = cell.timestep_ms;
    row.outcome = cell.outcome;
    row.reason = cell.reason;
    row.trained = cell.contender == matrix.trained_in && same_timestep(cell.timestep_ms, matrix.trained_ms);
    for (const Value& value : cell.values) row.values.emplace(value.name, value);
    const Value* rate = row.value("fall_rate");
    if (rate == nullptr) continue;
    row.falls = {*rate->value};
    const std::vector<SampleSeries> samples = results.store().samples(cell.id);
    for (const SampleSeries& series : samples) {
      if (series.name == "fall_rate of states") row.falls = series.values;
    }
    row.parting = parting_of(samples, scene, shown);
  }
  if (matrix.rows.empty()) return std::nullopt;
  const auto order = [](const TransferRow& row) {
    const Value* falls = row.value("fall_rate");
    return std::tuple(falls == nullptr ? std::numeric_limits<double>::infinity() : *falls->value, row.contender,
                      row.timestep_ms);
  };
  std::ranges::stable_sort(matrix.rows, std::less(), order);
  compare_with_training(matrix);
  return matrix;
}

std::vector<std::string> transfer_answer(const TransferMatrix& matrix) {
  std::map<std::string, std::map<std::string_view, std::vector<std::string>>> timesteps;  // by contender and verdict
  std::vector<double> tried;
  for (const TransferRow& row : matrix.rows) {
    timesteps[row.contender][row.verdict()].push_back(timestep_label(row.timestep_ms));
    tried.push_back(row.timestep_ms);
  }
  std::ranges::sort(tried);
  const auto same = std::ranges::unique(tried, same_timestep);
  tried.erase(same.begin(), same.end());
  std::map<std::string_view, std::vector<std::string>> found;
  std::vector<std::string> always;
  for (const auto& [contender, verdicts] : timesteps) {
    for (const auto& [verdict, at] : verdicts) {
      if (verdict == "stays up" && at.size() == tried.size()) {
        always.push_back(contender);
      } else {
        found[verdict].push_back(fmt::format("{} at {} ms", contender, join(at, ", ")));
      }
    }
  }
  const bool all = always.size() == timesteps.size();
  std::vector<std::string> lines = {fmt::format("{} of {} contender{} stay{} up at {}{}{}", always.size(),
                                                timesteps.size(), timesteps.size() == 1 ? "" : "s",
                                                always.size() == 1 ? "s" : "", timesteps_text(tried),
                                                always.empty() || all ? "" : ": ", all ? "" : join(always, ", "))};
  for (const auto& [verdict, where] : found) lines.push_back(fmt::format("{}: {}", verdict, join(where, "; ")));
  const TransferRow* trained = matrix.trained();
  if (trained == nullptr) return lines;
  std::map<std::string_view, std::vector<std::string>> against;
  for (const TransferRow& row : matrix.rows) {
    if (const std::string_view how = matrix.against_training(row); !how.empty()) against[how].push_back(place_of(row));
  }
  for (const auto& [how, rows] : against) {
    lines.push_back(fmt::format("{} {} {}: {}", how, how == "not told apart" ? "from" : "than", place_of(*trained),
                                join(rows, ", ")));
  }
  for (const TransferRow& row : matrix.rows) {
    if (row.excesses.empty()) continue;
    lines.push_back(fmt::format("{} {} as {}", place_of(row), excess_text(row.excesses), place_of(*trained)));
  }
  return lines;
}

nlohmann::ordered_json transfer_json(const TransferMatrix& matrix) {
  const auto text_json = [](const std::string& text) {
    return text.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(text);
  };
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const TransferRow& row : matrix.rows) {
    nlohmann::ordered_json values = nlohmann::ordered_json::object();
    for (const auto& [name, value] : row.values) {
      values[name] = {{"value", number_json(value.value)},
                      {"unit", value.unit},
                      {"low", number_json(value.low)},
                      {"high", number_json(value.high)}};
    }
    nlohmann::ordered_json excesses = nlohmann::ordered_json::array();
    for (const TransferExcess& excess : row.excesses) {
      excesses.push_back({{"value", excess.value}, {"times", number_json(excess.times)}});
    }
    const TransferParting& parting = row.parting;
    rows.push_back({{"contender", row.contender},
                    {"timestep_ms", row.timestep_ms},
                    {"outcome", outcome_text(row.outcome)},
                    {"reason", text_json(row.reason)},
                    {"runs", row.runs()},
                    {"trained", row.trained},
                    {"verdict", row.verdict()},
                    {"against_training", text_json(std::string(matrix.against_training(row)))},
                    {"falls_p", number_json(row.falls_p)},
                    {"excesses", std::move(excesses)},
                    {"excess", text_json(excess_text(row.excesses))},
                    {"values", std::move(values)},
                    {"parting",
                     {{"starts", parting.starts},
                      {"parted", parting.parted},
                      {"body", text_json(parting.body)},
                      {"same_body", parting.same_body},
                      {"joint", text_json(parting.joint)},
                      {"same_joint", parting.same_joint},
                      {"contact", parting.contact},
                      {"first_s", number_json(parting.first_s)},
                      {"median_s", number_json(parting.median_s)},
                      {"shown_s", number_json(parting.shown_s)}}}});
  }
  return {{"system", matrix.system},
          {"policy", matrix.policy},
          {"trained_in", text_json(matrix.trained_in)},
          {"trained_ms", matrix.trained_ms > 0 ? nlohmann::ordered_json(matrix.trained_ms) : nlohmann::ordered_json()},
          {"duration_s", matrix.duration_s},
          {"pushes", text_json(matrix.pushes)},
          {"many_times", kManyTimes},
          {"told_apart", kToldApart},
          {"answer", transfer_answer(matrix)},
          {"rows", std::move(rows)}};
}

}  // namespace assay
