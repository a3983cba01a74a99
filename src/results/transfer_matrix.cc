#include "results/transfer_matrix.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "base/text.h"
#include "results/values.h"
#include "store/facts.h"

namespace assay {
namespace {

nlohmann::ordered_json number_json(const std::optional<double>& number) {
  return number && std::isfinite(*number) ? nlohmann::ordered_json(*number) : nlohmann::ordered_json(nullptr);
}

}  // namespace

const Value* TransferRow::value(const std::string& name) const {
  const auto found = values.find(name);
  return found == values.end() || !found->second.value ? nullptr : &found->second;
}

std::string_view TransferRow::verdict() const {
  const Value* falls = value("fall_rate");
  if (falls == nullptr) return "no run";
  const Interval rate = interval_of(*falls);
  if (rate.high <= kUp) return "stays up";
  return rate.low >= kDown ? "falls" : "not settled";
}

std::optional<TransferMatrix> transfer_matrix(const Results& results, const std::string& system) {
  TransferMatrix matrix;
  matrix.system = system;
  const nlohmann::json& facts = results.facts(system);
  matrix.policy = text_fact(facts, "control");
  matrix.trained_in = text_fact(facts, "trained_in");
  matrix.duration_s = results.fact(system, "duration_s");
  const double trained_ms = results.fact(system, "trained_ms");
  for (const Cell& cell : results.cells()) {
    if (cell.system != system || cell.measure != "transfer") continue;
    TransferRow& row = matrix.rows.emplace_back();
    row.contender = cell.contender;
    row.timestep_ms = cell.timestep_ms;
    row.outcome = cell.outcome;
    row.reason = cell.reason;
    row.trained = cell.contender == matrix.trained_in && same_timestep(cell.timestep_ms, trained_ms);
    for (const Value& value : cell.values) row.values.emplace(value.name, value);
    if (row.value("fall_rate") == nullptr) continue;
    row.runs = 1;
    for (const SampleSeries& series : results.store().samples(cell.id)) {
      if (series.name == "fall_rate of states") row.runs = series.values.size();
    }
  }
  if (matrix.rows.empty()) return std::nullopt;
  const auto order = [](const TransferRow& row) {
    const Value* falls = row.value("fall_rate");
    return std::tuple(falls == nullptr ? std::numeric_limits<double>::infinity() : *falls->value, row.contender,
                      row.timestep_ms);
  };
  std::ranges::stable_sort(matrix.rows, std::less(), order);
  return matrix;
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
    rows.push_back({{"contender", row.contender},
                    {"timestep_ms", row.timestep_ms},
                    {"outcome", outcome_text(row.outcome)},
                    {"reason", text_json(row.reason)},
                    {"runs", row.runs},
                    {"trained", row.trained},
                    {"verdict", row.verdict()},
                    {"values", std::move(values)}});
  }
  return {{"system", matrix.system},
          {"policy", matrix.policy},
          {"trained_in", text_json(matrix.trained_in)},
          {"duration_s", matrix.duration_s},
          {"rows", std::move(rows)}};
}

}  // namespace assay
