// The measure 'template_pairs': how far apart the fine-step runs of contenders are. It reads no run of its own: what
// else a measure can read is in src/measures/measure.h, Reads.
//
// Like any measure it is this file as src/measures/template_pairs.cc, a line of src/measures/measures.cc, and its
// formula in docs/methodology.md.
#include <algorithm>

#include "measures/agreement.h"
#include "measures/measure.h"

namespace assay {
namespace {

// The largest distance from the run of any other contender at any time, m.
Measured template_pairs_values(const ComparedRuns& runs) {
  double apart = 0;
  for (const ComparedRuns::Other& other : runs.others) {
    apart = std::max(apart, std::ranges::max(distances(runs.own, other.states)));
  }
  return {{{"template_apart", "m", apart}}};
}

}  // namespace

Measure template_pairs_measure() {
  using namespace rows;
  return {.name = "template_pairs",
          .reads = Reads::kFineRuns,
          .values = {{"template_apart", "m", "Apart", "apart", kNone, kNo, kNo,
                      "largest distance from the fine-step run of another contender"}},
          .of_fine_runs = template_pairs_values};
}

}  // namespace assay
