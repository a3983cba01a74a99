#include "check/model_check.h"

#include <algorithm>
#include <utility>

namespace assay {
namespace findings {

Place place_at(const FileFacts& facts, const std::string& element, double value, std::string text) {
  return {element, facts.line_of(element), facts.file_of(element), value, std::move(text)};
}

void sort_by_value(Finding& finding) {
  std::ranges::stable_sort(finding.places, std::ranges::greater(), &Place::value);
}

void add(Finding finding, std::vector<Finding>& out) {
  if (!finding.places.empty()) out.push_back(std::move(finding));
}

}  // namespace findings

std::vector<Finding> check_model(const Model& model, const FileFacts& facts, const StepBounds& bounds) {
  std::vector<Finding> out;
  findings::add_start(model, facts, out);
  findings::add_masses(model, facts, out);
  findings::add_meshes(model, facts, out);
  findings::add_joints(model, facts, out);
  if (bounds.singular) {
    findings::add({.level = Level::kMend,
                   .kind = "start-singular",
                   .title = "singular start pose",
                   .places = {{.element = "the joint-space inertia", .text = "has no inverse"}},
                   .advice = "joints without mass between them line up: start elsewhere with --keyframe or --qpos"},
                  out);
  }
  std::ranges::stable_sort(out, {}, &Finding::level);
  return out;
}

}  // namespace assay
