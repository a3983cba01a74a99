// The help of assay and of its subcommands, laid out for the terminal.
#pragma once

#include <string>
#include <vector>

#include "cli/cli.h"

namespace assay::cli {

// Lays out help in lines that fit the terminal, or 80 columns elsewhere.
class HelpFormatter final : public CLI::Formatter {
 public:
  std::string make_description(const CLI::App* app) const override;
  std::string make_usage(const CLI::App* app, std::string name) const override;
  std::string make_group(std::string group, bool is_positional, std::vector<const CLI::Option*> options) const override;
  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode mode) const override;
  std::string make_footer(const CLI::App* app) const override;
};

// The footer of a help, with `note` below the examples. Long command lines go on after a backslash, so that they can be
// copied.
std::string examples_text(const Examples& examples, const std::string& note = "");

}  // namespace assay::cli
