// What a model itself gives reason to mend or to know, before any engine runs it.
#pragma once

#include <string>
#include <vector>

#include "check/step_bounds.h"
#include "load/file_facts.h"
#include "model/model.h"

namespace assay {

enum class Level {
  kMend,  // most likely a mistake of the file or of its start; engines will still run it
  kKnow,  // explains what engines do with it
};

// One element that a finding is about.
struct Place {
  std::string element = {};  // "joint 'knee'", "geoms 'foot' and 'shin'"
  int line = 0;              // 0 when it is not known
  std::string file = {};     // the included file that has the line; empty for the model's own
  double value = 0;          // in Finding::unit; 0 where it has none
  std::string text = {};     // the value in words; may be empty
};

// Places that have the same in common, worst first.
struct Finding {
  Level level = Level::kKnow;
  std::string kind = {};           // key in JSON, docs/guide.md lists them
  std::string title = {};          // "start beyond the joint limits"
  std::vector<Place> places = {};  // at least one
  std::string unit = {};           // of their values; "" for none
  std::string advice = {};         // what it means and what to do
  bool all = false;                // the places are all elements of their sort
};

// Every finding, those to mend first. `bounds` are the model's (step_bounds.h).
std::vector<Finding> check_model(const Model& model, const FileFacts& facts, const StepBounds& bounds);

// The parts of check_model().
namespace findings {

// mass-ratio, mass-range, inertia-far, inertia-near
void add_masses(const Model& model, const FileFacts& facts, std::vector<Finding>& out);
// damping-negative, joint-unlimited, joint-locked, effort-missing, damping-missing, actuator-unstable
void add_joints(const Model& model, const FileFacts& facts, std::vector<Finding>& out);
// start-beyond-limits, start-overlap, start-below-ground
void add_start(const Model& model, const FileFacts& facts, std::vector<Finding>& out);
// mesh-open, mesh-huge, mesh-concave
void add_meshes(const Model& model, const FileFacts& facts, std::vector<Finding>& out);

// A place at an element of the file, "joint 'knee'", with its line.
Place place_at(const FileFacts& facts, const std::string& element, double value = 0, std::string text = {});

// Largest first.
void sort_by_value(Finding& finding);
// Adds a finding that has places.
void add(Finding finding, std::vector<Finding>& out);

}  // namespace findings
}  // namespace assay
