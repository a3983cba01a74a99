// `assay import`: the configuration of a policy from what its training wrote.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/output_file.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/model_options.h"
#include "controls/csv_line.h"
#include "controls/isaac_env.h"
#include "controls/onnx_network.h"
#include "controls/policy_config.h"
#include "isolate/activity.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMostEnvironmentBytes = std::uintmax_t{8} << 20;
constexpr std::uintmax_t kMostNamesBytes = std::uintmax_t{1} << 20;
constexpr std::uintmax_t kMostNetworkFileBytes = std::uintmax_t{256} << 20;

struct ImportOptions {
  std::string environment;
  ModelOptions model;
  std::string out;
  std::optional<std::string> network, joints, command, trained_in;
  std::string group = "policy";
  std::vector<std::string> ignore;
  bool json = false;
};

// "a,b,c", or a file with a name on each line.
std::vector<std::string> joints_given(const std::string& text) {
  std::error_code error;
  const bool is_list = text.find(',') != std::string::npos || !fs::exists(text, error);
  if (is_list) return csv_fields(text);
  std::istringstream lines(input_text(text, "the file of joints", "a name on each line", kMostNamesBytes));
  std::vector<std::string> names;
  for (std::string line; std::getline(lines, line);) {
    const std::string name = csv_fields(line).front();
    if (!name.empty() && !name.starts_with('#')) names.push_back(name);
  }
  if (names.empty()) throw InputError(fmt::format("the file of joints '{}' has no name: write one on each line", text));
  return names;
}

std::array<double, 3> command_given(const std::string& text) {
  const std::vector<std::string> fields = csv_fields(text);
  std::array<double, 3> command{};
  for (size_t i = 0; i < command.size(); ++i) {
    const auto number = fields.size() == command.size() ? parse_number(fields[i]) : std::nullopt;
    if (!number) {
      throw InputError(
          fmt::format("--command is '{}': give forward, left and turning in m/s, m/s and rad/s, as in 0.5,0,0", text));
    }
    command.at(i) = *number;
  }
  return command;
}

// As a configuration at `out` names it: from its folder.
std::string network_name(const std::string& network, const std::string& out) {
  std::error_code error;
  const fs::path folder = out == "-" ? fs::current_path() : fs::absolute(out).parent_path();
  const fs::path relative = fs::relative(network, folder, error);
  return error || relative.empty() ? network : relative.string();
}

void print_import(const ImportOptions& options, const PolicyImport& found, const PolicyConfig& config) {
  print(paragraph(fmt::format("{}: {}, {} in {}, a control step of {} ms", options.out,
                              counted(config.joints.size(), "action", "actions"),
                              counted(config.inputs(), "observation", "observations"),
                              counted(config.terms.size(), "term", "terms"), shortest(1e3 * config.period_s)),
                  2));
  print(paragraph(fmt::format("{}: {}", found.joint_order, join(found.joints, ", ")), 2));
  if (found.left_out.empty()) {
    print("everything was taken over\n");
    return;
  }
  print("\n");
  std::vector<std::vector<std::string>> rows;
  rows.reserve(found.left_out.size());
  for (const LeftOut& each : found.left_out) rows.push_back({each.path, each.meaning});
  print(table({"not taken over", "what that means for a run"}, rows));
}

int import_environment(const ImportOptions& options) {
  PolicyImportOptions import;
  import.group = options.group;
  import.ignore = options.ignore;
  if (options.joints) import.joints = joints_given(*options.joints);
  if (options.command) import.command = command_given(*options.command);
  if (options.trained_in) import.trained_in = *options.trained_in;
  if (options.network) import.network = network_name(*options.network, options.out);
  const Model model = load(options.model);
  PolicyImport found;
  PolicyConfig config;
  {
    const Activity reading(fmt::format("reading '{}'", options.environment));
    const std::string text =
        input_file(options.environment, "the environment", "the params/env.yaml of a training", kMostEnvironmentBytes);
    found = import_isaac_env(model, text, options.environment, import);
    config = parse_policy_config(model, found.toml, options.out == "-" ? "policy.toml" : options.out);
  }
  if (options.network && !options.network->ends_with(".csv")) {
    const Activity trying(fmt::format("reading the network '{}'", *options.network));
    onnx_network(input_file(*options.network, "the network", "an ONNX file", kMostNetworkFileBytes), *options.network,
                 config);
  }
  OutputFile file(options.out);
  file.write(found.toml);
  file.finish();
  if (options.json) {
    Json left_out = Json::array();
    for (const LeftOut& each : found.left_out) left_out.push_back({{"path", each.path}, {"meaning", each.meaning}});
    print_json({{"out", options.out},
                {"joints", found.joints},
                {"joint_order", found.joint_order},
                {"observations", config.inputs()},
                {"actions", config.joints.size()},
                {"left_out", left_out}});
  } else if (options.out != "-") {
    print_import(options, found, config);
  }
  return kDone;
}

}  // namespace

void add_import(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "import", "Make a policy's configuration from what its training wrote",
                  {{"assay import params/env.yaml go2.xml --policy exported/policy.onnx --out policy.toml",
                    "what maps one to one; the rest is listed with what it means"},
                   {"assay import params/env.yaml go2.xml --ignore height_scan=187 --out policy.toml",
                    "zeros in place of an observation that assay does not have"}});
  const auto options = std::make_shared<ImportOptions>();
  command->add_option("ENV", options->environment, "The params/env.yaml of a training, or its params/deploy.yaml")
      ->required()
      ->type_name("ENV.yaml");
  add_model_options(*command, options->model);
  command->add_option("--out", options->out, "Configuration to write; '-' is standard output")
      ->required()
      ->type_name("FILE.toml");
  command->add_option("--policy", options->network, "Network that it names, whose inputs and outputs are checked")
      ->type_name("FILE");
  command
      ->add_option("--joints", options->joints,
                   "Order of joints in training: names with commas, or a file with one on each line (default: breadth "
                   "first in the robot's tree)")
      ->type_name("NAMES|FILE");
  command
      ->add_option("--command", options->command,
                   "Commanded velocity: forward, left (m/s), turning (rad/s) (default: half of the largest forward)")
      ->type_name("F,L,T");
  command
      ->add_option("--ignore", options->ignore,
                   "Part of the environment that the policy runs without; PATH=COUNT of an observation: zeros in its "
                   "place")
      ->type_name("PATH");
  command->add_option("--group", options->group, "Group of observations")->type_name("NAME")->capture_default_str();
  command->add_option("--trained-in", options->trained_in, "Contender that others are compared with (default: PhysX)")
      ->type_name("CONTENDER");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return import_environment(*options); }; });
}

}  // namespace assay::cli
