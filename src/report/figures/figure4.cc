// Drift of energy and momenta against speed.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/text.h"
#include "report/figures/axes.h"
#include "report/figures/drawing.h"
#include "report/figures/speed_accuracy.h"
#include "results/line_up.h"

namespace assay::figures {
namespace {

std::string system_of(const Results& results, const PaperFigures::Drift& plot) {
  for (const std::string& system : plot.systems) {
    for (const std::string& contender : results.papers()) {
      for (const auto& [step, cell] : results.cells(system, contender, "drift")) {
        if (interval_of(*cell, plot.value)) return system;
      }
    }
  }
  return "";
}

}  // namespace

std::optional<Drawing> figure4(const Results& results) {
  if (std::ranges::none_of(paper_figures().drifts,
                           [&](const PaperFigures::Drift& plot) { return !system_of(results, plot).empty(); })) {
    return std::nullopt;
  }
  constexpr double kRow = 162;
  const double legend = legend_height(results);
  return Drawing{2 * kRow + legend + 6, [&results](Canvas& canvas) {
                   for (size_t i = 0; i < paper_figures().drifts.size(); ++i) {
                     const PaperFigures::Drift& plot = paper_figures().drifts[i];
                     // three of the astronaut, two of the chain below and in the middle
                     const double column = i < 3 ? static_cast<double>(i) : static_cast<double>(i) - 2.5;
                     const double left = 40 + column * 172, top = 20 + (i < 3 ? 0 : kRow);
                     canvas.text(plot.title, {left, top - 6}, kTitle - 0.5, Align::kLeft, kInk, true);
                     speed_accuracy(canvas, results, {left, top, left + 128, top + kRow - 46}, system_of(results, plot),
                                    "drift", plot.value, plot.axis);
                   }
                   draw_legend(canvas, results);
                 }};
}

}  // namespace assay::figures
