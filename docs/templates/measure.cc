// The measure 'template': how far the bodies travel.
//
// A measure is this file as src/measures/template.cc, a line of src/measures/measures.cc, and its formula in
// docs/methodology.md.
#include "measures/measure.h"

namespace assay {
namespace {

// Why a system has no such values and what to do, as the end of a sentence about it; "" when it has some.
std::string template_obstacle(const MeasuredSystem& system) {
  return system.model.bodies.empty() ? "has no bodies that could travel: leave 'template' out of its measures" : "";
}

// Mean over the bodies of the distance from sample to sample, m.
Measured template_values(const MeasuredRun& run) {
  double path = 0;
  for (size_t i = 1; i < run.states.size(); ++i) {
    for (size_t b = 0; b < run.model.bodies.size(); ++b) {
      path += (run.states[i].bodies[b].p_WBcm - run.states[i - 1].bodies[b].p_WBcm).norm();
    }
  }
  return {{{"template_path", "m", path / static_cast<double>(run.model.bodies.size())}}};
}

}  // namespace

Measure template_measure() {
  using namespace rows;
  return {.name = "template",
          .reads = Reads::kRun,
          .values = {{"template_path", "m", "Path", "path", kNone, kNo, kNo, "mean distance that the bodies travel"}},
          .obstacle = template_obstacle,
          .of_run = template_values};
}

}  // namespace assay
