// The contenders of the paper by their names of today, and whom a picture shows when nobody is named.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace assay {

// An engine or group of engines of the paper and today's contenders for it, the preferred one first.
using StandIns = std::pair<std::string, std::vector<std::string>>;
const std::vector<StandIns>& paper_line_up();

// The contender of each engine of the paper that a figure shows: the first that is `present`, each once. With `solvers`
// MuJoCo's dense solver too, which the paper has in its figure of scaling only.
std::vector<std::string> papers_among(const std::vector<std::string>& present, bool solvers = false);

// At most `most` of `present` for a movie or a replay: the paper's first, then one of each other engine and
// formulation, then the rest as they come.
std::vector<std::string> line_up(const std::vector<std::string>& present, size_t most);

// Whom a plot of `present` shows when it opens: all, or the paper's where there are too many to read.
std::vector<std::string> shown_first(const std::vector<std::string>& present);

}  // namespace assay
