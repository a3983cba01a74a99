// The state that a run starts in: joint limits, overlaps, the ground.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/quantity.h"
#include "check/model_check.h"
#include "check/overlaps.h"
#include "model/joint.h"
#include "model/shape.h"

namespace assay::findings {
namespace {

// Contacts of engines carry a resting robot within this depth; and a file's numbers are rounded.
constexpr double kLeastDepth = 1e-5;  // m
// From here on the push out of an overlap is a blow: in 1 ms it is a speed of 1 m/s and more.
constexpr double kBlow = 1e-3;  // m
// As far beyond a limit as soft limits of engines rest, and as far as a file rounds its keyframe.
constexpr double kLeast = 1e-6, kNotable = 1e-3;  // rad or m

void add_start_beyond_limits(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  for (const bool slide : {false, true}) {
    Finding finding = {.level = Level::kMend,
                       .kind = "start-beyond-limits",
                       .title = slide ? "start beyond the limits of slides" : "start beyond the joint limits",
                       .unit = slide ? "m" : "rad",
                       .advice =
                           "engines throw them back: start at the limit (--within-limits) or elsewhere (--keyframe, "
                           "--qpos), or widen the limits"};
    each_joint(model, [&](const auto& joint) {
      const double beyond = beyond_limit(model, model.initial, joint);
      if (is_slide(joint) != slide || beyond <= kLeast) return;
      finding.places.push_back(place_at(facts, fmt::format("joint '{}'", joint.name), beyond,
                                        fmt::format("{} beyond {:.4g}", quantity_text(beyond, finding.unit),
                                                    passed_limit(model, model.initial, joint))));
    });
    sort_by_value(finding);
    if (!finding.places.empty() && finding.places.front().value < kNotable) finding.level = Level::kKnow;
    add(std::move(finding), out);
  }
}

void add_overlaps(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  const std::string apart = facts.is_urdf
                                ? "shrink their collision geometry, or start elsewhere with --qpos (URDF cannot "
                                  "exclude a pair)"
                                : "move them apart, exclude the pair (<exclude>), or start elsewhere (--keyframe, "
                                  "--qpos)";
  Finding shapes = {.kind = "start-overlap",
                    .title = "shapes that overlap at the start",
                    .unit = "m",
                    .advice = "contacts push them apart in the first steps: " + apart};
  Finding ground = {.level = Level::kMend,
                    .kind = "start-below-ground",
                    .title = "shapes below the ground at the start",
                    .unit = "m",
                    .advice = ""};
  std::vector<Overlap> found;
  try {
    found = overlaps(model, model.initial, kLeastDepth);
  } catch (const InputError& error) {
    add({.kind = "start-overlap-unknown",
         .title = "overlaps at the start were not examined",
         .places = {{.element = "the shapes", .text = error.what()}},
         .advice = "MuJoCo's collision detection does not take the hulls"},
        out);
  }
  for (const Overlap& overlap : found) {
    const ContactPair& pair = model.contacts[overlap.pair];
    const Shape *a = &model.shapes[pair.shape_a], *b = &model.shapes[pair.shape_b];
    if (is_ground(*a)) std::swap(a, b);
    const std::string label = fmt::format("geom '{}'", a->name);
    const std::string depth = quantity_text(overlap.depth, "m");
    if (is_ground(*b)) {
      ground.places.push_back({.element = label,
                               .line = facts.line_of(label),
                               .file = facts.file_of(label),
                               .value = overlap.depth,
                               .text = fmt::format("{} below '{}'", depth, b->name)});
    } else {
      shapes.places.push_back({.element = fmt::format("geoms '{}' and '{}'", a->name, b->name),
                               .line = facts.line_of(label),
                               .file = facts.file_of(label),
                               .value = overlap.depth,
                               .text = depth});
    }
  }
  if (!ground.places.empty()) {
    if (ground.places.front().value < kBlow) ground.level = Level::kKnow;
    ground.advice = fmt::format("contacts throw them up: start {} higher (--keyframe, --qpos), or give --no-ground",
                                quantity_text(ground.places.front().value, "m"));
  }
  if (!shapes.places.empty() && shapes.places.front().value >= kBlow) shapes.level = Level::kMend;
  add(std::move(ground), out);
  add(std::move(shapes), out);
}

}  // namespace

void add_start(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  add_start_beyond_limits(model, facts, out);
  add_overlaps(model, facts, out);
}

}  // namespace assay::findings
