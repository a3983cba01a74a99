// The union of results directories of one campaign, measured in parts or on several machines. Idempotent and
// associative: the union has the same content in whatever order and grouping its sources are added, and however often.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "results/store/store.h"

namespace assay {

struct MergeSummary {
  size_t sources = 0;
  size_t cells = 0;         // that were added
  size_t cells_before = 0;  // of the sources that were there already
  size_t trajectories = 0;  // files that were added
};

// Adds the results of `sources` to those of `out`, which is made when it is not there. One transaction a source, so
// what was interrupted goes on with the same call. Memory does not grow with the sources. A source may be still written
// to; its finished cells are taken. Values named in `derived` follow from several cells: they are neither compared nor
// taken, because the caller computes them anew from the union: in `finish`, which gets it still open, as opening checks
// all of it. `begin` is told each source. `check` gets each source before anything is merged, and may throw.
//
// Throws InputError that names the directories and what differs. Before anything is merged when a source is of another
// campaign, program or schema, when `out` is damaged, or when the timings of one system would come from two machines.
// When a source has a cell, a run or a verdict of the conformance suite with another result, nothing of it is taken;
// what came before it stays, is a whole union after `finish`, and the sentence says so.
MergeSummary merge_results(const std::vector<std::string>& sources, const std::string& out,
                           const std::vector<std::string>& derived,
                           const std::function<void(const std::string& source)>& begin = {},
                           const std::function<void(Store& merged)>& finish = {},
                           const std::function<void(const Store& source)>& check = {});

}  // namespace assay
