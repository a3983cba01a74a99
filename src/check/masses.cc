// Masses and inertias: along chains, against what the suite tests, against the shapes.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "base/quantity.h"
#include "check/model_check.h"
#include "model/kinematics.h"
#include "model/shape.h"

namespace assay::findings {
namespace {

// Iterative solvers carry a heavy body on a light one the worse, the larger the ratio of their masses.
// docs/lab/robots.md has the figures behind this threshold.
constexpr double kLargeRatio = 100;

// What the conformance suite tests: src/conformance/README.md.
constexpr double kLightest = 1e-3, kHeaviest = 100;  // kg
constexpr double kSmallest = 5e-3, kLargest = 2;     // m

// A body whose mass lies within its shapes has radii of gyration up to the distance of their farthest point from the
// centre of mass. Shapes that collide often cover only a part of a link, hence the factor.
constexpr double kFar = 2;
// Of a body without shapes only the robot's extent is known.
constexpr double kFarOutside = 10;
// A solid rod has 0.58 of that distance, a solid ball 0.63 of its radius; a tenth is a lump of mass in a large shape.
constexpr double kNear = 0.1;

// The next body with mass towards the world.
int heavy_parent(const Model& model, int body) {
  int parent = model.bodies[body].parent;
  while (parent != kWorld && model.bodies[parent].is_massless()) parent = model.bodies[parent].parent;
  return parent;
}

std::string kilograms(double mass) {
  return mass < 1 ? fmt::format("{:.3g} g", mass * 1000) : fmt::format("{:.3g} kg", mass);
}

// How many times heavier what a joint carries is than the body that carries it, and than its own child.
void add_ratios(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  Finding finding = {.kind = "mass-ratio", .title = "mass ratios of joined bodies", .unit = "1", .advice = ""};
  Place largest;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const int parent = heavy_parent(model, static_cast<int>(i));
    if (body.is_massless() || parent == kWorld) continue;
    const Body& other = model.bodies[parent];
    const double ratio = std::max(body.mass / other.mass, other.mass / body.mass);
    Place place = place_at(
        facts, fmt::format("body '{}'", body.name), ratio,
        fmt::format("{} on '{}' of {}: {:.3g}", kilograms(body.mass), other.name, kilograms(other.mass), ratio));
    if (ratio > largest.value) largest = place;
    if (ratio > kLargeRatio) finding.places.push_back(std::move(place));
  }
  if (finding.places.empty() && largest.value > 0) {
    finding.title = "largest mass ratio of joined bodies";
    finding.places = {largest};
  } else {
    finding.advice = fmt::format(
        "above {:g} iterative solvers need more iterations: prefer joint coordinates, or add armature to light links",
        kLargeRatio);
  }
  sort_by_value(finding);
  add(std::move(finding), out);
}

void add_ranges(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  Finding masses = {.kind = "mass-range",
                    .title = fmt::format("masses outside {:g} g to {:g} kg", kLightest * 1000, kHeaviest),
                    .unit = "kg",
                    .advice = "the conformance suite tests none of them: check their unit"};
  for (const Body& body : model.bodies) {
    if (body.is_massless() || (body.mass >= kLightest && body.mass <= kHeaviest)) continue;
    masses.places.push_back(place_at(facts, fmt::format("body '{}'", body.name), body.mass, kilograms(body.mass)));
  }
  std::ranges::stable_sort(masses.places, {}, &Place::value);
  add(std::move(masses), out);
  Finding sizes = {.kind = "size-range",
                   .title = fmt::format("shapes that collide outside {:g} mm to {:g} m", kSmallest * 1000, kLargest),
                   .unit = "m",
                   .advice = "the conformance suite tests none of them: check their unit"};
  for (const Shape& shape : model.shapes) {
    if (!shape.collides || is_ground(shape) || shape.body == kWorld) continue;
    const double size = box_around(model, shape, {}).sizes().maxCoeff();
    if (size >= kSmallest && size <= kLargest) continue;
    sizes.places.push_back(place_at(facts, fmt::format("geom '{}'", shape.name), size, quantity_text(size, "m")));
  }
  std::ranges::stable_sort(sizes.places, {}, &Place::value);
  add(std::move(sizes), out);
}

// How far the bodies' centres and joints lie apart at the start, m.
double extent_of(const Model& model) {
  Box box;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (!model.bodies[b].is_massless()) box.extend(model.initial.bodies[b].p_WBcm);
  }
  for (size_t j = 0; j < model.joints.size(); ++j) {
    box.extend(joint_frames(model, model.initial, static_cast<int>(j)).p_WJ_child);
  }
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

void add_inertias(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  // point of the shapes from the centre of mass, m, of all and of those that are not only drawn: a marker or a field of
  // view is no place for mass
  std::vector<double> farthest(model.bodies.size(), 0), farthest_solid(model.bodies.size(), 0);
  for (const Shape& shape : model.shapes) {
    if (shape.body == kWorld || is_ground(shape)) continue;
    const Box box = box_around(model, shape, shape.X_BS);
    const Vec3& centre = model.bodies[shape.body].p_BBcm;
    const Vec3 corner = (box.max() - centre).cwiseAbs().cwiseMax((box.min() - centre).cwiseAbs());
    farthest[shape.body] = std::max(farthest[shape.body], corner.norm());
    if (facts.drawn.contains(shape.name)) continue;
    farthest_solid[shape.body] = std::max(farthest_solid[shape.body], corner.norm());
  }
  Finding far = {.level = Level::kMend,
                 .kind = "inertia-far",
                 .title = "inertia of mass far outside the body's shapes",
                 .unit = "m",
                 .advice = "check the unit and the frame of <inertia>, and the mass"};
  Finding near = {.kind = "inertia-near",
                  .title = "inertia of a small lump in large shapes",
                  .unit = "m",
                  .advice = "check the unit of <inertia>, and the mass"};
  const double extent = extent_of(model);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.is_massless()) continue;
    const double gyration = std::sqrt(principal_inertia(body.I_BBcm_B).diagonal.maxCoeff() / body.mass);
    const auto place = [&](double within, const char* what = "shapes") {
      return place_at(facts, fmt::format("body '{}'", body.name), gyration,
                      fmt::format("radius of gyration {}, {} within {}", quantity_text(gyration, "m"), what,
                                  quantity_text(within, "m")));
    };
    if (farthest[i] == 0) {
      const auto drawn = facts.drawn_reach.find(body.name);
      if (drawn != facts.drawn_reach.end() && gyration > kFar * drawn->second) {
        far.places.push_back(place(drawn->second, "drawn"));
      } else if (drawn == facts.drawn_reach.end() && extent > 0 && gyration > kFarOutside * extent) {
        far.places.push_back(place(extent, "the robot's joints and centres of mass"));
      }
    } else if (gyration > kFar * farthest[i]) {
      far.places.push_back(place(farthest[i]));
    } else if (gyration < kNear * farthest_solid[i]) {
      near.places.push_back(place(farthest_solid[i]));
    }
  }
  sort_by_value(far);
  std::ranges::stable_sort(near.places, {}, &Place::value);
  add(std::move(far), out);
  add(std::move(near), out);
}

}  // namespace

void add_masses(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  add_inertias(model, facts, out);
  add_ratios(model, facts, out);
  add_ranges(model, facts, out);
}

}  // namespace assay::findings
