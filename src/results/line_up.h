// The paper (paper.toml, compiled in): its contenders by their names of today, what its figures show, and whom a
// picture shows when nobody is named.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace assay {

// An engine or group of engines of the paper and today's contenders for it, the preferred one first.
using StandIns = std::pair<std::string, std::vector<std::string>>;
const std::vector<StandIns>& paper_line_up();

struct PaperFigures {
  // A row of figure 3.
  struct Comparison {
    std::string system, title;
  };
  // A plot of figure 4, of the first of the systems that has the value.
  struct Drift {
    std::vector<std::string> systems;
    std::string value, title, axis;
  };
  std::vector<Comparison> comparisons;
  std::vector<Drift> drifts;
  std::vector<StandIns> solvers;  // figure 5: titles, and who stands in
};
const PaperFigures& paper_figures();

// The contender of each engine of the paper that a figure shows: the first that is `present`, each once. With `solvers`
// MuJoCo's dense solver too, which the paper has in its figure of scaling only.
std::vector<std::string> papers_among(const std::vector<std::string>& present, bool solvers = false);

// At most `most` of `present` for a movie or a replay: the paper's first, then one of each other engine and
// formulation, then the rest as they come.
std::vector<std::string> line_up(const std::vector<std::string>& present, size_t most);

// Whom a plot of `present` shows when it opens: all, or the paper's where there are too many to read.
std::vector<std::string> shown_first(const std::vector<std::string>& present);

}  // namespace assay
