#include "results/transfer_text.h"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/quantity.h"
#include "base/text.h"
#include "results/store/store.h"

namespace assay {
namespace {

// "0.05 (0.01 to 0.24)", "1.24 m/s".
std::string cell_text(const TransferRow& row, const std::string& name) {
  const Value* value = row.value(name);
  if (value == nullptr) return "";
  const double number = value->value.value_or(0);
  if (name != "fall_rate") return quantity_text(number, value->unit);
  if (!value->low || !value->high) return fmt::format("{:.2g}", number);
  return fmt::format("{:.2g} ({:.2g} to {:.2g})", number, *value->low, *value->high);
}

// "shank by 'knee' (17 of 20), after 0.31 s".
std::string parting_text(const TransferParting& parting) {
  if (parting.parted == 0) return "";
  return fmt::format("{} by {} ({} of {}), after {}{}", parting.body.empty() ? "a body" : parting.body,
                     parting.joint.empty() ? "the base" : fmt::format("'{}'", parting.joint), parting.same_body,
                     parting.starts, quantity_text(parting.median_s.value_or(0), "s"),
                     parting.contact > 0 ? fmt::format(", at a contact in {}", parting.contact) : "");
}

}  // namespace

std::vector<TransferMatrix> transfer_matrices(const std::string& dir, const std::optional<std::string>& system) {
  const Store store = Store::open(dir);
  const Results results(store);
  if (system && std::ranges::find(results.systems(), *system) == results.systems().end()) {
    throw InputError(fmt::format("the results in '{}' have no system '{}'{}", dir, *system,
                                 did_you_mean(*system, results.systems())));
  }
  std::vector<TransferMatrix> found;
  for (const std::string& name : results.systems()) {
    if (system && *system != name) continue;
    if (auto matrix = transfer_matrix(results, name)) found.push_back(std::move(*matrix));
  }
  if (found.empty()) {
    throw InputError(
        fmt::format("the results in '{}' have no runs under a policy{}: make some with 'assay run ROBOT "
                    "--policy-config policy.toml'",
                    dir, system ? " of " + *system : ""));
  }
  return found;
}

std::string transfer_text(const TransferMatrix& matrix) {
  std::string out;
  const std::vector<std::pair<std::string, std::string>> columns = {{"fall_rate", "falls"},
                                                                    {"time_up", "up for"},
                                                                    {"velocity_error", "velocity error"},
                                                                    {"turning_error", "turning error"},
                                                                    {"foot_slip", "foot slip"},
                                                                    {"joint_power", "power"},
                                                                    {"policy_parting_time", "parts after"}};
  const TransferRow* trained = matrix.trained();
  std::vector<std::string> headings = {"contender", "timestep", "verdict"};
  if (trained != nullptr) headings.emplace_back("against training");
  std::vector<size_t> right = {1};
  std::vector<std::string> shown;
  for (const auto& [name, heading] : columns) {
    if (std::ranges::none_of(matrix.rows, [&](const TransferRow& row) { return row.value(name) != nullptr; })) continue;
    right.push_back(headings.size());
    headings.push_back(heading);
    shown.push_back(name);
  }
  const bool told = std::ranges::any_of(matrix.rows, [](const TransferRow& row) { return row.parting.parted > 0; });
  if (told) headings.emplace_back("first to part");
  std::vector<std::vector<std::string>> rows;
  std::set<size_t> runs;
  std::vector<std::string> reasons;
  double policy_us = 0;
  for (const TransferRow& row : matrix.rows) {
    if (row.runs() > 0) runs.insert(row.runs());
    std::vector<std::string> cells = {row.contender + (row.trained ? " *" : ""),
                                      timestep_label(row.timestep_ms) + " ms", std::string(row.verdict())};
    if (trained != nullptr) cells.emplace_back(matrix.against_training(row));
    for (const std::string& name : shown) cells.push_back(cell_text(row, name));
    if (told) cells.push_back(parting_text(row.parting));
    rows.push_back(std::move(cells));
    if (const Value* time = row.value("policy_time")) policy_us = std::max(policy_us, time->value.value_or(0));
    if (row.outcome != Outcome::kOk) {
      reasons.push_back(fmt::format("{} at {} ms: {}: {}", row.contender, timestep_label(row.timestep_ms),
                                    outcome_text(row.outcome), row.reason));
    }
  }
  out += heading(fmt::format("{}: {}, {} s{}", matrix.system, matrix.policy, shortest(matrix.duration_s),
                             matrix.pushes.empty() ? "" : ", " + matrix.pushes)) +
         "\n\n";
  for (const std::string& sentence : transfer_answer(matrix)) out += paragraph(sentence, 2);
  out += "\n";
  out += table(headings, rows, right);
  out += "\n";
  const auto line = [&out](const std::string& text) { out += paragraph(text, 2); };
  line(
      fmt::format("each row: {} runs from perturbed starts; falls: the share of them with its 95 % interval; \"stays "
                  "up\" and \"falls\" where that interval ends at or below {} or begins at or above {}",
                  runs.size() == 1 ? std::to_string(*runs.begin()) : "its", shortest(TransferRow::kUp),
                  shortest(TransferRow::kDown)));
  if (trained != nullptr) {
    line(fmt::format(
        "against training: whether the share of falls is told apart from that of the row with *, by the "
        "rank test at {}, corrected for the number of rows; \"but worse\": an error, the slip or the power is "
        "at least {} times that row's, even by the near ends of their 95 % intervals",
        shortest(kToldApart), shortest(kManyTimes)));
  }
  if (!matrix.trained_in.empty()) {
    const bool took_part =
        std::ranges::any_of(matrix.rows, [&](const TransferRow& row) { return row.contender == matrix.trained_in; });
    line(took_part
             ? fmt::format("trained in {} (*: with the timestep of training); parts after: time until a run is "
                           "more than 1 mm from that of {}, the whole run where it never is",
                           matrix.trained_in, matrix.trained_in)
             : fmt::format("trained in {}, which takes no part here: there is no time of parting", matrix.trained_in));
  }
  if (told) {
    line(
        "first to part: the body that is first more than 1 mm from that of training, the joint that moves it the most "
        "(or the base itself), in how many of the runs it is that body, the median of the times; at a contact: a shape "
        "touches the ground in one of both runs only");
  }
  if (policy_us > 0)
    line(fmt::format("the policy: at most {:.3g} us a control step, outside the engines' clock", policy_us));
  for (const std::string& reason : reasons) line(reason);
  return out;
}

}  // namespace assay
