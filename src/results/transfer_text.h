// In which engines a policy works, as text.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "results/transfer_matrix.h"

namespace assay {

// A table with a row for each contender and timestep, and what its columns mean, for standard output.
std::string transfer_text(const TransferMatrix& matrix);

// The matrix of every system of the results directory that has one, or of `system`. Throws InputError when none has.
std::vector<TransferMatrix> transfer_matrices(const std::string& dir, const std::optional<std::string>& system = {});

}  // namespace assay
