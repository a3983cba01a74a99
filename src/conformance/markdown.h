#pragma once

#include <string>

#include "base/console.h"

namespace assay {

// "3.10 µm of 12.0 µm": the figure of one result and its tolerance.
std::string figure_text(const Json& result);

// Results as a document: a row a contender with how many tests ended how, a column for each test that not all passed,
// and below the table the others and what is not a plain pass. `contenders` is the array of `assay conformance --json`.
std::string conformance_markdown(const Json& contenders);

}  // namespace assay
