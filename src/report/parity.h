// Certificates of parity (docs/guide.md) that stand beside results.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace assay {

// Where the results of `dir` keep the certificate of a model: DIR/parity/NAME.json, with what a file's name cannot hold
// replaced.
std::string parity_file(const std::string& dir, const std::string& model);

// The certificates of `dir` by their files' names, each as `assay parity --json` prints it: {"model", "hash",
// "samples", "seed", "certificates": see check/parity/certificate.h}, or of two files as check/pairing/pairing_text.h
// has it. Files that are none are left out. Throws InputError for more than 16 MiB of files.
nlohmann::json parity_data(const std::string& dir);

}  // namespace assay
