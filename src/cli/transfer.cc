// `assay transfer`: in which engines a policy works as in training, from a results directory.
#include <memory>

#include "cli/commands.h"
#include "cli/report_parts.h"
#include "results/transfer_text.h"

namespace assay::cli {
namespace {

struct TransferOptions {
  std::string dir;
  std::optional<std::string> system;
  bool json = false;
};

}  // namespace

void print_transfer(const std::string& dir, const std::optional<std::string>& system, bool json) {
  const std::vector<TransferMatrix> found = transfer_matrices(dir, system);
  if (!json) {
    for (const TransferMatrix& matrix : found) print(transfer_text(matrix));
    return;
  }
  Json systems = Json::array();
  for (const TransferMatrix& matrix : found) systems.push_back(transfer_json(matrix));
  print_json({{"systems", systems}});
}

void add_transfer(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "transfer",
      "Tell in which engines a policy works as it did in training: until 1.0 another name of 'assay report --transfer'",
      {{"assay transfer cart_pole-results", "after assay run cart_pole.xml --policy-config policy.toml"},
       {"assay transfer results walk --json", "of one system, for programs"}});
  const auto options = std::make_shared<TransferOptions>();
  command->add_option("DIR", options->dir, "Results directory")->required()->type_name("");
  command->add_option("SYSTEM", options->system, "One system (default: all that have a policy)")->type_name("");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] {
    action = [options] {
      print_transfer(options->dir, options->system, options->json);
      return kDone;
    };
  });
}

}  // namespace assay::cli
