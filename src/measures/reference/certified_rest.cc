// What rests on one another, or is held: boxes in a stack, and a box between two fingers, which slips where they press
// too little.
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "measures/reference/certified_parts.h"
#include "model/kinematics.h"
#include "model/shape.h"

namespace assay::reference {
namespace {

constexpr const char* kBoxStack = "box-stack";
constexpr const char* kGrip = "two-finger-grip";

struct Block {
  const Shape* shape = nullptr;
  Vec3 centre;  // of the shape, world
  Quat q;       // of the shape
  // Half of its extent along a direction of its faces.
  double half(const Vec3& direction) const { return (q.conjugate() * direction).cwiseAbs().dot(shape->half_size); }
  bool faces(const Vec3& direction) const { return (q.conjugate() * direction).cwiseAbs().maxCoeff() > 1 - kParallel; }
  // Whether the way from the centre, across `normal`, stays over the face.
  bool covers(const Vec3& way, const Vec3& normal) const {
    const Vec3 off = (q.conjugate() * Vec3(way - way.dot(normal) * normal)).cwiseAbs();
    return (off.array() < shape->half_size.array()).all();
  }
};

Block block_of(const Model& model, const char* solution, int body) {
  const auto shapes = shapes_of(model, body);
  const std::string& name = model.bodies[static_cast<size_t>(body)].name;
  if (shapes.size() != 1 || shapes.front()->type != ShapeType::kBox) {
    misfit(model, solution, fmt::format("body '{}' is no box", name));
  }
  const BodyState& state = model.initial.bodies[static_cast<size_t>(body)];
  if (state.v_WBcm.norm() > kParallel || state.w_WB.norm() > kParallel) {
    misfit(model, solution, fmt::format("body '{}' moves at the start", name));
  }
  const Shape& shape = *shapes.front();
  return {&shape, state.p_WBcm + state.q_WB * (shape.X_BS.p - model.bodies[static_cast<size_t>(body)].p_BBcm),
          state.q_WB * shape.X_BS.q};
}

// The same state at every time.
CertifiedMotion at_rest(const Model& model, const std::vector<double>& times) {
  CertifiedMotion motion;
  for (const double time : times) {
    motion.states.push_back(model.initial);
    motion.states.back().time = time;
  }
  return motion;
}

}  // namespace

CertifiedMotion box_stack(const Model& model, const std::vector<double>& times) {
  require_plain(model, kBoxStack);
  const auto refuse = [&](const std::string& why) { misfit(model, kBoxStack, why); };
  const Vec3 up = -model.gravity.normalized();
  if (!(model.gravity.norm() > 0)) refuse("it has no gravity");
  std::vector<Block> blocks;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    blocks.push_back(block_of(model, kBoxStack, static_cast<int>(i)));
    if (!model.bodies[i].is_free()) refuse(fmt::format("body '{}' has a joint", model.bodies[i].name));
    if (!blocks[i].faces(up)) refuse(fmt::format("body '{}' does not lie flat", model.bodies[i].name));
  }
  std::vector<size_t> order(blocks.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, std::greater(), [&](size_t i) { return blocks[i].centre.dot(up); });
  // From the top: what a block carries, itself included, and where.
  std::vector<std::vector<size_t>> carried(blocks.size());
  for (size_t i = 0; i < blocks.size(); ++i) carried[i] = {i};
  std::vector<double> mass(blocks.size(), 0);
  std::vector<Vec3> moment(blocks.size(), Vec3::Zero());
  for (const size_t i : order) {
    const std::string& name = model.bodies[i].name;
    const Block& block = blocks[i];
    mass[i] += model.bodies[i].mass;
    moment[i] += model.bodies[i].mass * model.initial.bodies[i].p_WBcm;
    const Vec3 load = moment[i] / mass[i];
    if (!block.covers(load - block.centre, up)) refuse(fmt::format("what lies on body '{}' tips over", name));
    int supports = 0;
    for (const ContactPair& pair : model.contacts) {
      const Shape* other = &model.shapes[static_cast<size_t>(pair.shape_a)];
      const Shape* own = &model.shapes[static_cast<size_t>(pair.shape_b)];
      if (own != block.shape) std::swap(own, other);
      if (own != block.shape) continue;
      const double bottom = block.centre.dot(up) - block.half(up);
      if (is_plane(*other)) {
        if ((other->X_BS.q * Vec3::UnitZ()).dot(up) < 1 - kParallel) refuse("the plane is not level");
        const double gap = bottom - other->X_BS.p.dot(up);
        if (gap < -kTouching) refuse(fmt::format("body '{}' is in the ground", name));
        if (gap < kTouching) ++supports;
        continue;
      }
      if (other->body == kWorld || blocks[static_cast<size_t>(other->body)].centre.dot(up) > block.centre.dot(up)) {
        continue;
      }
      const auto below = static_cast<size_t>(other->body);
      const double gap = bottom - blocks[below].centre.dot(up) - blocks[below].half(up);
      const Vec3 apart = block.centre - blocks[below].centre, flat = apart - apart.dot(up) * up;
      const bool beside = flat.norm() > block.shape->half_size.norm() + blocks[below].shape->half_size.norm();
      if (gap < -kTouching && !beside) refuse(fmt::format("body '{}' overlaps another at the start", name));
      if (gap > kTouching || beside) continue;
      if (!blocks[below].covers(load - blocks[below].centre, up)) {
        refuse(fmt::format("what lies on body '{}' tips over", model.bodies[below].name));
      }
      carried[below].insert(carried[below].end(), carried[i].begin(), carried[i].end());
      mass[below] += mass[i];
      moment[below] += moment[i];
      ++supports;
    }
    if (supports != 1) refuse(fmt::format("body '{}' lies on {} others, not on one", name, supports));
  }
  CertifiedMotion motion = at_rest(model, times);
  if (times.empty()) return motion;
  for (const size_t i : order) {
    motion.impulses.push_back(impulse_on(model, carried[i], up, equal_marks(model.initial.time, times.back()),
                                         fmt::format("under body '{}'", model.bodies[i].name)));
  }
  return motion;
}

CertifiedMotion two_finger_grip(const Model& model, const std::vector<double>& times) {
  require_plain(model, kGrip, true);
  const auto refuse = [&](const std::string& why) { misfit(model, kGrip, why); };
  if (model.bodies.size() != 3 || model.joints.size() != 2) refuse("it does not have a free body and two slides");
  size_t held = 3;
  for (size_t i = 0; i < 3; ++i) {
    if (model.bodies[i].is_free()) held = i;
  }
  if (held == 3) refuse("no body is free");
  const Block box = block_of(model, kGrip, static_cast<int>(held));
  const Vec3 centre = model.initial.bodies[held].p_WBcm;
  const Vec3 down = model.gravity.normalized();
  const double weight = model.bodies[held].mass * model.gravity.norm();
  if (!(weight > 0)) refuse("it has no gravity");
  if (!box.faces(down)) refuse("the box is not upright");
  double force[2] = {}, friction[2] = {}, room[2] = {};
  Vec3 towards[2];
  for (size_t j = 0; j < 2; ++j) {
    const Joint& joint = model.joints[j];
    const Block finger = block_of(model, kGrip, joint.body);
    const BodyState& state = model.initial.bodies[static_cast<size_t>(joint.body)];
    if (!joint.is_slide() || model.bodies[static_cast<size_t>(joint.body)].parent != kWorld) {
      refuse(fmt::format("joint '{}' is no slide to the world", joint.name));
    }
    if (joint.limited || joint.dry_friction > 0)
      refuse(fmt::format("slide '{}' has limits or dry friction", joint.name));
    const Vec3 axis = state.q_WB * joint.axis_B, gap = box.centre - finger.centre;
    towards[j] = gap.dot(axis) > 0 ? axis : Vec3(-axis);
    if (std::abs(down.dot(axis)) > kParallel) refuse("gravity has a part along a slide");
    if (!box.faces(axis) || !finger.faces(axis)) refuse("a face of a finger or of the box is not across its slide");
    if (std::abs(gap.dot(towards[j]) - box.half(axis) - finger.half(axis)) > kTouching) {
      refuse(fmt::format("the finger of slide '{}' does not touch the box", joint.name));
    }
    const Vec3 across = axis.cross(down);
    if (std::abs((centre - finger.centre).dot(across)) > kTouching ||
        std::abs((centre - box.centre).dot(across)) > 1e-9) {
      refuse("a finger presses beside the box's centre of mass");
    }
    force[j] = -joint.stiffness * (model.initial.position[j] - joint.spring_reference) * (towards[j].dot(axis));
    if (!(force[j] > 0)) refuse(fmt::format("slide '{}' does not press", joint.name));
    // how far the box may slide until its edge comes to the finger's
    room[j] = box.half(down) - finger.half(down) - (box.centre - finger.centre).dot(down);
    friction[j] = -1;
    for (const ContactPair& pair : model.contacts) {
      const int a = model.shapes[static_cast<size_t>(pair.shape_a)].body,
                b = model.shapes[static_cast<size_t>(pair.shape_b)].body;
      const bool grips =
          (a == joint.body && b == static_cast<int>(held)) || (b == joint.body && a == static_cast<int>(held));
      if (grips) friction[j] = pair.friction;
    }
    if (friction[j] < 0) refuse("a finger and the box have no contact pair");
  }
  if (model.contacts.size() != 2) refuse("it has other contact pairs than the two of the fingers");
  if ((towards[0] + towards[1]).norm() > kParallel) refuse("the slides are not opposite");
  if (std::abs(force[0] - force[1]) > 1e-9 * force[0]) refuse("the fingers do not press alike");
  if (friction[0] != friction[1]) refuse("the fingers have different friction");
  const double most = 2 * friction[0] * force[0], start = model.initial.time;
  CertifiedMotion motion;
  if (!times.empty()) {
    // What the fingers give the box together, and what the box gives each finger along its slide.
    const std::vector<double> marks = equal_marks(start, times.back());
    motion.impulses = {impulse_on(model, {held}, towards[0], marks, "of the fingers on the box")};
    for (size_t j = 0; j < 2; ++j) {
      const Joint slide = model.joints[j];
      const double mass = model.bodies[static_cast<size_t>(slide.body)].mass + slide.armature;
      const auto momentum = [j, mass](const State& state) { return Vec3(mass * state.velocity[j], 0, 0); };
      const auto spring = [j, slide](const State& state) {
        return Vec3(spring_torque(slide, state.position[j], state.velocity[j]), 0, 0);
      };
      motion.impulses.push_back(
          {fmt::format("of the box on the finger of slide '{}'", slide.name), momentum, spring, Vec3::UnitX(), marks});
    }
  }
  if (weight <= most) {
    motion.states = at_rest(model, times).states;
    return motion;
  }
  const double fall = (weight - most) / model.bodies[held].mass;
  const auto speed = [held, down](const State& state) { return -state.bodies[held].v_WBcm.dot(down); };
  if (!times.empty() && start + kBegins / fall <= times.back()) {
    motion.events = {{start, "the box begins to slip", {speed, -kBegins, start + kBegins / fall}}};
  }
  for (const double time : times) {
    const double t = time - model.initial.time, way = fall * t * t / 2;
    if (way > std::min(room[0], room[1])) {
      refuse(fmt::format("the box slides out of the fingers' faces before {:.6g} s: let the run end before", time));
    }
    State state = model.initial;
    state.time = time;
    state.bodies[held].p_WBcm += way * down;
    state.bodies[held].v_WBcm = fall * t * down;
    motion.states.push_back(std::move(state));
  }
  return motion;
}

}  // namespace assay::reference
