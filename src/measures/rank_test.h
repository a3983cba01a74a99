// Tests of whether two sets of samples differ, and what many of them say together.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace assay {

// Two-sided p-value of the Mann-Whitney U test (Mann, Whitney 1947): how likely samples of one distribution would be as
// unevenly ranked. Exact for up to 400 pairs without ties, else the normal approximation with corrections for ties and
// continuity. 1 when either has no sample.
double rank_test(std::span<const double> a, std::span<const double> b);

// The smallest p-value that so many samples can give.
double smallest_rank_p(size_t a, size_t b);

// p-values corrected for their number after Benjamini and Hochberg (1995), in the order given: those of at most q are
// discoveries of which a share of at most q is false in the mean. When nothing differs, the chance of any is at most q.
std::vector<double> corrected_for_number(const std::vector<double>& p);

// The same in two levels. First which families differ at all: the p-value of a family is Simes' (1986) of its own, and
// Holm (1979) corrects it for the number of families, so that the chance that any family is named in which nothing
// differs is at most q, however much others differ. Then which of a family's own do: Benjamini and Hochberg within it.
// What is returned is the larger of the two. `family` has one name for each p-value.
std::vector<double> corrected_by_family(const std::vector<double>& p, const std::vector<std::string>& family);

}  // namespace assay
