#include "check/pairing/match_trees.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/model_urdf.h"
#include "model/joint.h"

namespace assay::pairing {
namespace {

constexpr double kPair = 0.7;  // share of the smaller file's joints that have a match where two files are a pair

std::vector<std::string> names_in(const Model& model) {
  std::vector<std::string> names;
  each_joint(model, [&](const auto& joint) { names.push_back(joint.name); });
  for (const Body& body : model.bodies) names.push_back(body.name);
  for (const Actuator& actuator : model.actuators) names.push_back(actuator.name);
  return names;
}

void check_names(const Model& model, const std::string& file, const std::string& name) {
  const std::vector<std::string> names = names_in(model);
  if (std::ranges::find(names, name) != names.end()) return;
  throw InputError(fmt::format("--map names '{}', and '{}' has no such joint, body or actuator{}", name, file,
                               did_you_mean(name, names)));
}

size_t joints_of(const Model& model) { return joint_count(model); }

std::string type_of(const Model& model, int body) {
  const Body& b = model.bodies[static_cast<size_t>(body)];
  if (b.is_free()) return "free";
  if (b.ball >= 0) return "a ball joint";
  return slides(model, b) ? "a slide" : "a hinge";
}

// What `model` alone has, and with what it is compared.
void tell_alone(const Model& model, const Model& other, const std::vector<bool>& matched, const char* where,
                Comparison& out) {
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    if (matched[i]) continue;
    const auto index = static_cast<int>(i);
    const std::string name = name_of(model, index);
    std::string as = model.bodies[i].is_free() ? "left out" : "compared with it locked at 0";
    if (model.bodies[i].is_free()) {
      for (size_t k = 0; k < model.bodies.size(); ++k) {
        if (k != i && matched[k] && is_descendant(model, static_cast<int>(k), index))
          as = "compared with it fixed to the world";
      }
    }
    std::string words = fmt::format("only in {}: {}", where, as);
    for (size_t k = 0; k < other.bodies.size(); ++k) {
      if (name_of(other, static_cast<int>(k)) == name && type_of(other, static_cast<int>(k)) != type_of(model, index)) {
        words = fmt::format("{} in {} and {} in the other file: {}", type_of(model, index), where,
                            type_of(other, static_cast<int>(k)), as);
      }
    }
    out.findings.push_back({element_of(model, index), words});
  }
}

}  // namespace

Trees match_trees(const Side& side_a, const Side& side_b, const Options& options, Comparison& out) {
  for (const auto& [name_a, name_b] : options.map) {
    check_names(side_a.model, side_a.file, name_a);
    check_names(side_b.model, side_b.file, name_b);
  }
  Trees trees;
  trees.whole_a = from_zero(side_a.model), trees.whole_b = from_zero(side_b.model);
  const Model &a = trees.whole_a, &b = trees.whole_b;
  trees.matches = match_bodies(a, b, options.map);

  std::vector<bool> matched_a(a.bodies.size()), matched_b(b.bodies.size());
  out.joints_a = joints_of(a), out.joints_b = joints_of(b);
  for (const BodyMatch& match : trees.matches) {
    matched_a[static_cast<size_t>(match.a)] = matched_b[static_cast<size_t>(match.b)] = true;
    if (!a.bodies[static_cast<size_t>(match.a)].is_free()) ++out.joints_matched;
  }
  const size_t fewer = std::min(out.joints_a, out.joints_b);
  if (options.map.empty() ? static_cast<double>(out.joints_matched) < kPair * static_cast<double>(fewer)
                          : trees.matches.empty()) {
    throw InputError(
        fmt::format("{} of {} joints match: give --map A_NAME=B_NAME for the others, or compare files of one robot",
                    out.joints_matched, fewer));
  }
  if (trees.matches.empty() || (fewer == 0 && std::max(out.joints_a, out.joints_b) > 0)) {
    throw InputError(fmt::format("nothing of '{}' ({} joints) matches '{}' ({} joints): compare files of one robot",
                                 side_a.file, out.joints_a, side_b.file, out.joints_b));
  }

  for (const auto& [side, where, other] : {std::tuple(&side_a, "A", "B"), std::tuple(&side_b, "B", "A")}) {
    if (side->base_changed) {
      out.findings.push_back(
          {"base", fmt::format("fixed to the world in {} and free in {}: compared with both free", where, other)});
    }
  }
  tell_alone(a, b, matched_a, "A", out);
  tell_alone(b, a, matched_b, "B", out);
  std::set<int> alone_a, alone_b;
  for (size_t i = 0; i < matched_a.size(); ++i) {
    if (!matched_a[i]) alone_a.insert(static_cast<int>(i));
  }
  for (size_t i = 0; i < matched_b.size(); ++i) {
    if (!matched_b[i]) alone_b.insert(static_cast<int>(i));
  }
  trees.a = locked(a, alone_a), trees.b = locked(b, alone_b);
  std::vector<int> b_of(trees.a.model.bodies.size(), -1);
  for (const BodyMatch& match : trees.matches) {
    b_of[static_cast<size_t>(trees.a.index[static_cast<size_t>(match.a)])] =
        trees.b.index[static_cast<size_t>(match.b)];
  }
  trees.placement = placed(trees.a.model, trees.b.model, b_of);
  for (const BodyMatch& match : trees.matches) {
    const Body& body = a.bodies[static_cast<size_t>(match.a)];
    const bool reversed = trees.placement.reversed[static_cast<size_t>(trees.a.index[static_cast<size_t>(match.a)])];
    out.matches.push_back(
        {body.is_free() ? "free body" : "joint", name_of(a, match.a), name_of(b, match.b), match.how, reversed});
    if (reversed) {
      out.findings.push_back(
          {element_of(a, match.a),
           "turns the other way in B: its positions, limits and drives are compared with the opposite sign"});
    }
  }
  for (const Body& body : trees.a.model.bodies) out.mass_a += body.mass;
  for (const Body& body : trees.b.model.bodies) out.mass_b += body.mass;
  const Pose& X = trees.placement.X_world;
  const double turned = angle_of(X.q);
  if (X.p.norm() > kRoundingLength || turned > kRoundingAngle) {
    out.notes.push_back(
        fmt::format("B stands elsewhere in the world, which is no difference: {:.4g} mm away, turned by {:.3g} degrees",
                    1e3 * X.p.norm(), turned * 180 / M_PI));
  }
  return trees;
}

}  // namespace assay::pairing
