// The measure 'template': how far the bodies travel.
//
// A measure of a run is this file as src/measures/template.cc, in the list of src/measures/CMakeLists.txt, declared and
// listed in src/measures/run_measures.cc. Each of its values has a row in src/results/values.cc, and its formula stands
// in docs/methodology.md.
#include "measures/run_measures.h"

namespace assay {
namespace {

// Why a model has no such values, as the end of a sentence about the system; "" when it has some.
std::string template_obstacle(const Model& model, bool /*passive*/) {
  return model.bodies.empty() ? "has no bodies that could travel" : "";
}

// Mean over the bodies of the distance from sample to sample, m.
std::vector<RunValue> template_values(const MeasuredRun& run) {
  double path = 0;
  for (size_t i = 1; i < run.states.size(); ++i) {
    for (size_t b = 0; b < run.model.bodies.size(); ++b) {
      path += (run.states[i].bodies[b].p_WBcm - run.states[i - 1].bodies[b].p_WBcm).norm();
    }
  }
  return {{"template_path", "m", path / static_cast<double>(run.model.bodies.size()), {}, {}}};
}

}  // namespace

RunMeasure template_measure() { return {"template", template_obstacle, template_values}; }

}  // namespace assay
