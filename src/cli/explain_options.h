// What `assay explain` and `assay bisect` ask alike: a robot, what drives it, how long, how often.
#pragma once

#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "cli/control_options.h"
#include "cli/model_options.h"
#include "explain/question.h"

namespace assay::cli {

// As given on the command line.
struct ExplainOptions {
  ExplainRequest request;
  ModelOptions model;  // or a results directory
  std::optional<std::string> control;
  PolicyOptions policy;
  bool json = false;
  const CLI::App* command = nullptr;
};

// Adds the required argument `robot`, then, after the command's own, the other options. `options` has to live as long
// as `command`.
void add_robot(CLI::App& command, ExplainOptions& options, const std::string& robot);
void add_run_options(CLI::App& command, ExplainOptions& options);

// Throws InputError.
ExplainRequest request_of(const ExplainOptions& options);

// Reads everything, first in a process of its own, and tells the model's notes. Throws InputError.
ExplainQuestion read_question(const ExplainRequest& request);

}  // namespace assay::cli
