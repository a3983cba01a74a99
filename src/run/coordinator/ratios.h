// The pairs of contenders whose times a campaign asks to compare, as its results keep them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "results/store/store.h"

namespace assay {

// (of, to), by `of`, from the manifest's "ratios": {"of": "to"}. Throws InputError for anything else there.
std::vector<std::pair<std::string, std::string>> asked_ratios(const Store& store);

}  // namespace assay
