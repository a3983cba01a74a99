#include "cli/control_options.h"

#include <fmt/format.h>

#include "base/errors.h"

namespace assay::cli {

void add_policy_options(CLI::App& command, PolicyOptions& options) {
  command
      .add_option(
          "--policy", options.network,
          "Network that drives the robot: an ONNX file, or a CSV file of recorded actions (default: the one that "
          "--policy-config names)")
      ->type_name("FILE");
  command
      .add_option("--policy-config", options.config,
                  "The policy's conventions: control period, observations, actions, gains (docs/guide.md)")
      ->type_name("FILE.toml");
}

std::optional<ControlSpec> control_given(const std::optional<std::string>& control, const PolicyOptions& policy) {
  if (!policy.any()) return control ? std::optional(parse_control(*control)) : std::nullopt;
  if (control) {
    throw InputError(fmt::format("--control {} and --policy both drive the robot: give one of them", *control));
  }
  if (!policy.config) {
    throw InputError(
        fmt::format("--policy {} needs --policy-config: the order of observations and joints, gains and "
                    "the control period are not in a network",
                    policy.network.value_or("")));
  }
  ControlSpec spec;
  spec.kind = "policy";
  spec.policy = *policy.config;
  spec.network = policy.network.value_or("");
  return spec;
}

}  // namespace assay::cli
