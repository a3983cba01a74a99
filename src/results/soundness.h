// Results that were judged by older rules of soundness, judged again by today's as far as stored values allow.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "results/store/store.h"

namespace assay {

struct JudgedCells {
  std::vector<Cell> cells;  // as Store::cells(), outcomes by today's rules
  size_t changed = 0;       // stored as ok, and unstable by today's rules
  std::string note;         // a sentence for results of older rules: what was judged again and what cannot be; else ""
};

// All cells of the results. A run that went further beyond a joint's limit than a turn is unstable, and with it every
// measure of that run: violation stores how far it went. What lies below the ground by older rules stays unstable, and
// the note says so.
JudgedCells judged_cells(const Store& store);

}  // namespace assay
