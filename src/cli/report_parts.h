// Parts of what a report shows, printed.
#pragma once

#include <optional>
#include <string>

namespace assay::cli {

// The verdicts on the claims of `file` (default: the paper's). Throws InputError.
void print_verdicts(const std::string& dir, const std::optional<std::string>& file, bool json, bool markdown);

// A line for each of the paper's claims: number, verdict, title, figures. Nothing where assay has no claims.
void print_claims(const std::string& dir);

// In which engines the policies of `system` (default: all) work. Throws InputError where there are none.
void print_transfer(const std::string& dir, const std::optional<std::string>& system, bool json);

}  // namespace assay::cli
