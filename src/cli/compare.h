// Options that every comparison of results takes.
#pragma once

#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "results/compare/compare.h"

namespace assay::cli {

struct CompareFlags {
  std::optional<std::string> threshold;  // as given
  std::string control;
  bool across_machines = false, across_programs = false;
};

// Adds --threshold, --control, --across-machines and --across-programs.
void add_compare_flags(CLI::App& command, CompareFlags& flags);

// Throws InputError.
CompareOptions compare_options(const CompareFlags& flags);

}  // namespace assay::cli
