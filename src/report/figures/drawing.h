// The figures, each in a file of its own.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "report/canvas.h"
#include "results/results.h"

namespace assay::figures {

// `draw` fills a canvas of kWidth (axes.h) by `height` points; it refers to the results that it was made of.
struct Drawing {
  double height = 0;
  std::function<void(Canvas&)> draw;
};

// How a contender is drawn.
struct Ink {
  Color color;
  Mark mark = Mark::kCircle;
  std::vector<double> dash;
};
Ink ink_of(const Results& results, const std::string& contender);

// Nothing where the results hold nothing of the figure.
std::optional<Drawing> figure3(const Results& results);
std::optional<Drawing> figure4(const Results& results);
std::optional<Drawing> figure5(const Results& results);
std::optional<Drawing> grasp_table(const Results& results);

}  // namespace assay::figures
