// `assay check DIR`: all robots of a folder.
#pragma once

#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "load/load_options.h"

namespace assay::cli {

// Options of a folder alone, as they are given.
struct FolderFlags {
  std::optional<std::string> sarif, junit, baseline, write_baseline, fail_on, time_limit, jobs;
  bool markdown = false;

  // The first that was given, "--sarif"; empty for none.
  std::string given() const;
};

// Adds them to `command`; --markdown excludes `json`. `flags` has to live as long as `command`.
void add_folder_flags(CLI::App& command, FolderFlags& flags, CLI::Option* json);

struct FolderCheck {
  std::string folder;  // as its user named it
  LoadOptions load;
  std::string repair_into;  // empty: no repaired files are written
  bool json = false;
  FolderFlags flags;
};

// The status: 1 where a finding fails. Throws InputError and SystemError.
int check_folder(const FolderCheck& check);

}  // namespace assay::cli
