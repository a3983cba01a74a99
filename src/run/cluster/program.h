// A program that is run to its end, with what it says.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace assay {

struct ProgramEnd {
  int status = 0;  // its exit status; 128 and the signal's number when one ended it
  std::string out, error;
};

// Runs `words[0]`, found in PATH, without a shell. Empty when there is no such program. Throws SystemError.
std::optional<ProgramEnd> run_program(const std::vector<std::string>& words);

// `text` as one word of a shell's command line.
std::string shell_word(const std::string& text);

}  // namespace assay
