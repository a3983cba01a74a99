#include "check/pairing/motion.h"

#include <algorithm>
#include <csignal>
#include <memory>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/exit_status.h"
#include "base/json.h"
#include "check/pairing/match_trees.h"
#include "check/pairing/surfaces.h"
#include "controls/control.h"
#include "controls/engine_actuators.h"
#include "engines/engine_files.h"
#include "isolate/guarded_child.h"
#include "isolate/interruption.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"
#include "model/kinematics.h"
#include "model/shape.h"
#include "model/state_faults.h"

namespace assay::pairing {
namespace {

constexpr double kTimestep = 1e-3;
constexpr int kSteps = 1000, kEvery = 50;

void drop_contacts_of_world(Model& model) {
  std::erase_if(model.contacts, [&](const ContactPair& pair) {
    return model.shapes[static_cast<size_t>(pair.shape_a)].body == kWorld ||
           model.shapes[static_cast<size_t>(pair.shape_b)].body == kWorld;
  });
}

// B's state for A's: joints where A's are, free bodies where A's lie.
State as_in_a(const Trees& trees, const Model& a, const Model& b) {
  State state = b.initial;
  for (const BodyMatch& match : trees.matches) {
    const Body &of_a = a.bodies[static_cast<size_t>(match.a)], &of_b = b.bodies[static_cast<size_t>(match.b)];
    const auto locked = static_cast<size_t>(trees.a.index[static_cast<size_t>(match.a)]);
    if (of_a.joint >= 0) {
      const double sign = trees.placement.reversed[locked] ? -1 : 1;
      state.position[static_cast<size_t>(of_b.joint)] = sign * a.initial.position[static_cast<size_t>(of_a.joint)];
      state.velocity[static_cast<size_t>(of_b.joint)] = sign * a.initial.velocity[static_cast<size_t>(of_a.joint)];
    } else if (of_a.is_free()) {
      const BodyState& from = a.initial.bodies[static_cast<size_t>(match.a)];
      const Pose X_WB = body_pose(of_a, from) * trees.placement.X_AB[locked];
      BodyState& to = state.bodies[static_cast<size_t>(match.b)];
      to.q_WB = X_WB.q.normalized();
      to.p_WBcm = X_WB * of_b.p_BBcm;
      to.v_WBcm = from.v_WBcm, to.w_WB = from.w_WB;
    }
  }
  bodies_from_joints(b, state);
  return state;
}

// Centres of mass each kEvery steps, one after the other.
std::vector<double> track(Model model, const ResolvedContender& contender, bool drives) {
  Settings settings = contender.settings;
  settings.timestep = kTimestep;
  const auto control = drives ? actuator_control(model) : passive_control();
  const bool engine_drives = equip_for(contender.engine->capabilities(settings).actuators, *control, model);
  const auto simulation = contender.engine->create(model, model.initial, settings);
  const auto run = control->start(kTimestep);
  std::vector<double> torques(model.joints.size()), places;
  State state;
  simulation->read_state(state);
  for (int step = 0; step <= kSteps; ++step) {
    if (step > 0) {
      if (!engine_drives) run->torques(state, torques);
      simulation->set_torques(torques);
      simulation->advance(1);
      simulation->read_state(state);
      std::string fault = state_shape_fault(state, model.bodies.size(), model.joints.size());
      if (fault.empty()) fault = state_value_fault(state, &model);
      if (!fault.empty()) throw EngineError(fmt::format("the engine gave {}", fault));
    }
    if (step % kEvery != 0) continue;
    for (const BodyState& body : state.bodies) {
      for (int axis = 0; axis < 3; ++axis) places.push_back(body.p_WBcm[axis]);
    }
  }
  return places;
}

}  // namespace

Motion one_second(const Side& side_a, const Side& side_b, const Options& options, const ResolvedContender& contender) {
  Comparison unused;
  const Trees trees = match_trees(side_a, side_b, options, unused);
  Motion motion{.contender = contender.name};
  Model a = trees.whole_a, b = trees.whole_b;
  b.initial = as_in_a(trees, a, b);
  const bool drives = side_a.format.drives && side_b.format.drives;
  std::vector<std::string> without;
  if (!drives) without.emplace_back("without actuators, which one file does not have");
  if (has_ground(a) != has_ground(b)) {
    drop_contacts_of_world(a), drop_contacts_of_world(b);
    without.emplace_back("without the ground, which one file does not have");
  }
  for (const std::string& each : without) motion.note += (motion.note.empty() ? "" : ", ") + each;

  std::vector<std::vector<double>> tracks;
  std::string failure;
  const ChildEnd end = run_in_child(
      [&](const Send& send) {
        std::signal(SIGINT, SIG_DFL);
        std::signal(SIGTERM, SIG_DFL);
        enter_sandbox({.readable = engine_files(), .writable = engine_caches()});
        for (const Model* model : {&a, &b}) {
          try {
            send(dump_json(Json(track(*model, contender, drives))));
          } catch (const std::exception& error) {
            send(dump_json(Json(fmt::format("{}: {}", model == &a ? "A" : "B", error.what()))));
            return exits::kDone;
          }
        }
        return exits::kDone;
      },
      [&](const std::string& line) {
        const Json sent = Json::parse(line);
        if (sent.is_string()) {
          failure = sent.get<std::string>();
        } else {
          tracks.push_back(sent.get<std::vector<double>>());
        }
      });
  if (interrupted()) throw SystemError("interrupted: nothing was written");
  if (tracks.size() < 2) {
    if (failure.empty() && end.from_outside())
      throw EndedFromOutside(fmt::format("running {}", contender.name), end.signal);
    motion.failure = !failure.empty()  ? failure
                     : end.signal != 0 ? "it crashed with " + end.signal_text()
                                       : "its process ended early";
    return motion;
  }
  const auto place = [](const std::vector<double>& places, size_t bodies, size_t sample, size_t body) {
    const double* p = places.data() + 3 * (sample * bodies + body);
    return Vec3(p[0], p[1], p[2]);
  };
  for (const BodyMatch& match : trees.matches) {
    const auto i = static_cast<size_t>(match.a), j = static_cast<size_t>(match.b);
    if (a.bodies[i].mass == 0 || b.bodies[j].mass == 0) continue;
    // a point of both: A's centre of mass, as B's body would carry it, is known only where centres agree
    for (size_t sample = 0; sample <= kSteps / kEvery; ++sample) {
      const Vec3 p_a = place(tracks[0], a.bodies.size(), sample, i);
      const Vec3 p_b = trees.placement.X_world * place(tracks[1], b.bodies.size(), sample, j);
      if (const double apart = (p_a - p_b).norm(); apart > motion.distance) {
        motion.distance = apart;
        motion.body = a.bodies[i].name;
        motion.travelled = 0;
        for (size_t k = 1; k <= sample; ++k)
          motion.travelled +=
              (place(tracks[0], a.bodies.size(), k, i) - place(tracks[0], a.bodies.size(), k - 1, i)).norm();
      }
    }
  }
  return motion;
}

}  // namespace assay::pairing
