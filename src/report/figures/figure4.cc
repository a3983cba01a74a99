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

namespace assay::figures {
namespace {

struct DriftPlot {
  std::vector<const char*> systems;  // the first that has it
  const char *value, *system_title, *title, *axis;
};

const std::vector<DriftPlot>& drift_plots() {
  static const std::vector<DriftPlot> kPlots = {
      {{"astronaut-energy", "astronaut"}, "energy_drift", "Astronaut", "energy", "energy drift (J)"},
      {{"astronaut"}, "angular_momentum_drift", "Astronaut", "angular momentum", "drift (kg m²/s)"},
      {{"astronaut"}, "linear_momentum_drift", "Astronaut", "linear momentum", "drift (kg m/s)"},
      {{"planar-chain"}, "energy_drift", "Planar chain", "energy", "energy drift (J)"},
      {{"planar-chain"}, "angular_momentum_drift", "Planar chain", "angular momentum", "drift (kg m²/s)"}};
  return kPlots;
}

std::string system_of(const Results& results, const DriftPlot& plot) {
  for (const char* system : plot.systems) {
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
  if (std::ranges::none_of(drift_plots(), [&](const DriftPlot& plot) { return !system_of(results, plot).empty(); })) {
    return std::nullopt;
  }
  constexpr double kRow = 162;
  const double legend = legend_height(results);
  return Drawing{2 * kRow + legend + 6, [&results](Canvas& canvas) {
                   for (size_t i = 0; i < drift_plots().size(); ++i) {
                     const DriftPlot& plot = drift_plots()[i];
                     // three of the astronaut, two of the chain below and in the middle
                     const double column = i < 3 ? static_cast<double>(i) : static_cast<double>(i) - 2.5;
                     const double left = 40 + column * 172, top = 20 + (i < 3 ? 0 : kRow);
                     canvas.text(fmt::format("{}: {}", plot.system_title, plot.title), {left, top - 6}, kTitle - 0.5,
                                 Align::kLeft, kInk, true);
                     speed_accuracy(canvas, results, {left, top, left + 128, top + kRow - 46}, system_of(results, plot),
                                    "drift", plot.value, plot.axis);
                   }
                   draw_legend(canvas, results);
                 }};
}

}  // namespace assay::figures
