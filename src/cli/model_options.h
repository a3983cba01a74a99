// The argument MODEL and the options that say how it is read: one set for every command that takes a model.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "load/load_options.h"
#include "model/model.h"

namespace assay::cli {

// Of these options, in the help.
inline constexpr const char* kModelGroup = "How the model is read";

// As given on the command line.
struct ModelOptions {
  std::string model;
  LoadOptions load;                                          // flags and texts
  std::map<std::string, bool> choices;                       // by LoadChoice::key
  std::map<std::string, std::vector<std::string>> packages;  // NAME=DIR, by LoadField::key
};

// `assay check` has a --repair of its own, which takes a file.
enum class Repair { kFlag, kOwn };

// Adds the options to `command`. `options` has to live as long as `command`.
void add_load_options(CLI::App& command, ModelOptions& options, Repair repair = Repair::kFlag);

// The same with the required argument MODEL.
void add_model_options(CLI::App& command, ModelOptions& options, Repair repair = Repair::kFlag);

// Checks the options. Throws InputError for two that contradict each other and for a package that is no folder.
LoadOptions load_options(const ModelOptions& options);

// The model that MODEL names, a file or a system, read as the options say. Throws InputError.
Model load(const ModelOptions& options);

}  // namespace assay::cli
