// Completion of command lines: what the options' own tree says of the next word.
#pragma once

#include <string>
#include <vector>

#include "cli/cli.h"

namespace assay::cli {

// `assay completion bash` prints the script for a shell, which calls `assay completion words WORD...`: a line "files"
// (where a file may be meant) or "words", then the words that fit the last one, a line each. Returns the status.
int completion(const CLI::App& app, const std::vector<std::string>& arguments);

}  // namespace assay::cli
