// `assay transfer`: which contenders a policy transfers to, from a results directory.
#include "cli/transfer.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/quantity.h"
#include "base/text.h"
#include "cli/cli.h"
#include "store/store.h"

namespace assay::cli {
namespace {

struct Options {
  std::string dir;
  std::optional<std::string> system;
  bool json = false;
};

// "0.05 (0.01 to 0.24)", "1.24 m/s".
std::string cell_text(const TransferRow& row, const std::string& name) {
  const Value* value = row.value(name);
  if (value == nullptr) return "";
  const double number = value->value.value_or(0);
  if (name != "fall_rate") return quantity_text(number, value->unit);
  if (!value->low || !value->high) return fmt::format("{:.2g}", number);
  return fmt::format("{:.2g} ({:.2g} to {:.2g})", number, *value->low, *value->high);
}

std::vector<TransferMatrix> matrices(const std::string& dir, const std::optional<std::string>& system) {
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

// The answer: which contenders keep the robot up at every timestep, and where others do not.
void print_verdicts(const TransferMatrix& matrix) {
  std::map<std::string, std::map<std::string_view, std::vector<std::string>>> timesteps;  // by contender and verdict
  for (const TransferRow& row : matrix.rows) {
    timesteps[row.contender][row.verdict()].push_back(timestep_label(row.timestep_ms));
  }
  std::map<std::string_view, std::vector<std::string>> found;
  std::vector<std::string> always;
  for (const auto& [contender, verdicts] : timesteps) {
    for (const auto& [verdict, at] : verdicts) {
      if (verdict == "stays up" && verdicts.size() == 1) {
        always.push_back(contender);
      } else {
        found[verdict].push_back(fmt::format("{} at {} ms", contender, join(at, ", ")));
      }
    }
  }
  const auto line = [](const std::string& text) { print(paragraph(text, 2)); };
  line(fmt::format("stays up at every timestep: {} of {}{}{}", always.size(),
                   counted(timesteps.size(), "contender"),
                   always.empty() || always.size() == timesteps.size() ? "" : ": ",
                   always.size() == timesteps.size() ? "" : join(always, ", ")));
  for (const auto& [verdict, where] : found) line(fmt::format("{}: {}", verdict, join(where, "; ")));
  print("\n");
}

int show(const Options& options) {
  const std::vector<TransferMatrix> found = matrices(options.dir, options.system);
  if (!options.json) {
    for (const TransferMatrix& matrix : found) print_transfer(matrix);
    return kDone;
  }
  Json systems = Json::array();
  for (const TransferMatrix& matrix : found) systems.push_back(transfer_json(matrix));
  print_json({{"systems", systems}});
  return kDone;
}

}  // namespace

void print_transfer(const TransferMatrix& matrix) {
  const std::vector<std::pair<std::string, std::string>> columns = {{"fall_rate", "falls"},
                                                                    {"time_up", "up for"},
                                                                    {"velocity_error", "velocity error"},
                                                                    {"turning_error", "turning error"},
                                                                    {"foot_slip", "foot slip"},
                                                                    {"joint_power", "power"},
                                                                    {"policy_parting_time", "parts after"}};
  std::vector<std::string> headings = {"contender", "timestep", "verdict"};
  std::vector<size_t> right = {1};
  std::vector<std::string> shown;
  for (const auto& [name, heading] : columns) {
    if (std::ranges::none_of(matrix.rows, [&](const TransferRow& row) { return row.value(name) != nullptr; })) continue;
    right.push_back(headings.size());
    headings.push_back(heading);
    shown.push_back(name);
  }
  std::vector<std::vector<std::string>> rows;
  std::set<size_t> runs;
  std::vector<std::string> reasons;
  double policy_us = 0;
  for (const TransferRow& row : matrix.rows) {
    if (row.runs > 0) runs.insert(row.runs);
    std::vector<std::string> cells = {row.contender + (row.trained ? " *" : ""),
                                      timestep_label(row.timestep_ms) + " ms", std::string(row.verdict())};
    for (const std::string& name : shown) cells.push_back(cell_text(row, name));
    rows.push_back(std::move(cells));
    if (const Value* time = row.value("policy_time")) policy_us = std::max(policy_us, time->value.value_or(0));
    if (row.outcome != Outcome::kOk) {
      reasons.push_back(fmt::format("{} at {} ms: {}: {}", row.contender, timestep_label(row.timestep_ms),
                                    outcome_text(row.outcome), row.reason));
    }
  }
  print(heading(fmt::format("{}: {}, {} s", matrix.system, matrix.policy, shortest(matrix.duration_s))) + "\n\n");
  print_verdicts(matrix);
  print(table(headings, rows, right));
  print("\n");
  const auto line = [](const std::string& text) { print(paragraph(text, 2)); };
  line(
      fmt::format("each row: {} runs from perturbed starts; falls: the share of them with its 95 % interval; \"stays "
                  "up\" and \"falls\" where that interval ends at or below {} or begins at or above {}",
                  runs.size() == 1 ? std::to_string(*runs.begin()) : "its", shortest(TransferRow::kUp),
                  shortest(TransferRow::kDown)));
  if (!matrix.trained_in.empty()) {
    const bool took_part =
        std::ranges::any_of(matrix.rows, [&](const TransferRow& row) { return row.contender == matrix.trained_in; });
    line(took_part
             ? fmt::format("trained in {} (*: with the timestep of training); parts after: time until a run is "
                           "more than 1 mm from that of {}, the whole run where it never is",
                           matrix.trained_in, matrix.trained_in)
             : fmt::format("trained in {}, which takes no part here: there is no time of parting", matrix.trained_in));
  }
  if (policy_us > 0)
    line(fmt::format("the policy: at most {:.3g} us a control step, outside the engines' clock", policy_us));
  for (const std::string& reason : reasons) line(reason);
}

void print_transfers(const std::string& dir) {
  for (const TransferMatrix& matrix : matrices(dir, std::nullopt)) print_transfer(matrix);
}

void add_transfer(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "transfer", "Tell in which engines a policy works as it did in training",
                  {{"assay transfer cart_pole-results", "after assay run cart_pole.xml --policy-config policy.toml"},
                   {"assay transfer results walk --json", "of one system, for programs"}});
  const auto options = std::make_shared<Options>();
  command->add_option("DIR", options->dir, "Results directory")->required()->type_name("");
  command->add_option("SYSTEM", options->system, "One system (default: all that have a policy)")->type_name("");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return show(*options); }; });
}

}  // namespace assay::cli
