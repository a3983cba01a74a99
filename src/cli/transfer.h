// Which contenders a policy transfers to, as text.
#pragma once

#include "results/transfer_matrix.h"

namespace assay::cli {

// A table with a row for each contender and timestep, and what its columns mean.
void print_transfer(const TransferMatrix& matrix);

// Prints the matrix of every system of the results directory that has one. Throws InputError when none has.
void print_transfers(const std::string& dir);

}  // namespace assay::cli
