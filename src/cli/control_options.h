// The options that say what drives a robot: --control, --policy, --policy-config.
#pragma once

#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "controls/control.h"

namespace assay::cli {

// As given on the command line.
struct PolicyOptions {
  std::optional<std::string> network, config;
  bool any() const { return network || config; }
};

// Adds the options to `command`. `options` has to live as long as `command`.
void add_policy_options(CLI::App& command, PolicyOptions& options);

// What is asked for; nothing when none of the options is given. Throws InputError for options that contradict each
// other.
std::optional<ControlSpec> control_given(const std::optional<std::string>& control, const PolicyOptions& policy);

}  // namespace assay::cli
