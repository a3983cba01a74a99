// Speed against an error, and the legend of such plots.
#pragma once

#include <string>

#include "report/figures/axes.h"
#include "results/results.h"

namespace assay::figures {

// A curve for each contender in logarithms, with a cross at the first timestep that gave nothing. On a system that was
// not timed the timesteps stand for the realtime factors. `name` is the value, `title` the error axis's.
void speed_accuracy(Canvas& canvas, const Results& results, const Box& box, const std::string& system,
                    const std::string& measure, const std::string& name, const std::string& title);

// Every contender with its line and mark, in as many rows as it takes, at the foot of the canvas.
double legend_height(const Results& results);
void draw_legend(Canvas& canvas, const Results& results);

}  // namespace assay::figures
