// Findings as JUnit's XML, which CIs show as tests.
#pragma once

#include <string>

#include "check/dataset/dataset.h"

namespace assay::dataset {

// A test for each file. It fails where a finding fails the command (Report::fails), and is an error where its process
// crashed or was stopped.
std::string junit_text(const Report& report);

}  // namespace assay::dataset
