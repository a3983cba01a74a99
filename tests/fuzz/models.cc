// Models, and what lies beside them.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "base/errors.h"
#include "check/model_check.h"
#include "check/step_bounds.h"
#include "controls/isaac_env.h"
#include "controls/policy_config.h"
#include "controls/recorded_actions.h"
#include "controls/torque_file.h"
#include "load/mesh_file.h"
#include "load/mjcf.h"
#include "load/repair.h"
#include "load/start.h"
#include "results/store/scene.h"
#include "targets.h"

namespace assay::fuzz {
namespace {

constexpr size_t kMostBodies = 30;  // the check's cost grows with their cube

void read_model(std::string_view bytes, const std::string& name) {
  const std::string path = write_file(name, bytes);
  FileFacts facts;
  LoadOptions options;
  options.drop_unsupported = true;
  const LoadReport report = inspect_model(path, options, &facts);
  if (!report.model || report.model->bodies.size() > kMostBodies) return;
  const Model& model = *report.model;
  const StepBounds bounds = step_bounds(model, model.initial);
  check_model(model, facts, bounds);
  parse_scene(scene_text(scene_of(model)));
}

// A slide and a free body, for files that go with a model.
const Model& small_model() {
  static const Model model = load_model_text(
      R"(<mujoco><worldbody><body name="cart"><joint name="rail" type="slide"/><geom size=".1"/>
      <body name="pole"><joint name="knee" axis="0 1 0"/><geom size=".1" pos="0 0 1"/></body></body>
      <body name="ball" pos="1 0 0"><freejoint/><geom size=".1"/></body></worldbody></mujoco>)",
      "small");
  return model;
}

}  // namespace

void read_mjcf(std::string_view bytes) {
  try {
    read_model(bytes, "robot.xml");
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch): a refusal
  }
}

void read_urdf(std::string_view bytes) {
  try {
    read_model(bytes, "robot.urdf");
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch)
  }
  try {
    std::vector<Mend> mends;
    mended_model(std::string(bytes), scratch() + "/robot.urdf", scratch() + "/mended.urdf", mends);
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch)
  }
}

// The upper half of the first byte's values: through MuJoCo's reader, as in MJCF files.
void read_mesh(std::string_view bytes) {
  constexpr std::array kEndings = {".stl", ".obj", ".dae", ".msh", ".ply", ".glb"};
  constexpr unsigned kThroughMujoco = 0x80;
  if (bytes.empty()) return;
  const auto which = static_cast<unsigned char>(bytes.front());
  const std::string name = std::string("mesh") + kEndings.at((which % kThroughMujoco) % kEndings.size());
  const std::string path = write_file(name, bytes.substr(1));
  try {
    if (which >= kThroughMujoco) {
      load_model(write_file("holder.xml", "<mujoco><asset><mesh name='m' file='" + name +
                                              "'/></asset><worldbody><body><freejoint/><geom type='mesh' mesh='m'/>"
                                              "</body></worldbody></mujoco>"));
    } else {
      const MeshData mesh = assay::read_mesh(path);
      static_cast<void>(mesh.flatness());
    }
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch)
  }
}

void read_csv(std::string_view bytes) {
  if (bytes.empty()) return;
  const bool torques = (bytes.front() & 1) != 0;
  const Model& model = small_model();
  try {
    if (torques) {
      const auto control = file_control(model, write_file("torques.csv", bytes.substr(1)));
      std::vector<double> values(model.joints.size());
      State state = model.initial;
      for (const double time : {-1.0, 0.0, 0.5, 1e9}) {
        state.time = time;
        control->torques(state, values);
      }
      static_cast<void>(control->description());
    } else {
      Model moved = model;
      start_from(moved, std::string(bytes.substr(1)), "pose.txt");
      static_cast<void>(lowest_point(moved));
    }
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch)
  }
}

constexpr std::string_view kPolicy = R"(joints = ["rail", "knee"]
[control]
timestep_ms = 5
decimation = 4
[actions]
type = "joint_position"
[pd]
stiffness = 20
effort_limit = 20
damping = 0.5
[observations]
[[observations.terms]]
term = "joint_pos_rel"
)";

void read_policy(std::string_view bytes) {
  if (bytes.empty()) return;
  const bool actions = (bytes.front() & 1) != 0;
  const std::string text(bytes.substr(1));
  try {
    if (!actions) {
      static_cast<void>(parse_policy_config(small_model(), text, scratch() + "/policy.toml"));
    } else {
      static const PolicyConfig config = parse_policy_config(small_model(), kPolicy, scratch() + "/policy.toml");
      const RecordedActions recorded = parse_recorded_actions(text, "actions.csv", config, small_model());
      if (recorded.actions.size() != recorded.steps * config.joints.size()) std::abort();
    }
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch)
  }
}

// What is written has to be read back.
void read_environment(std::string_view bytes) {
  std::string toml;
  try {
    toml = import_isaac_env(small_model(), bytes, "env.yaml", {}).toml;
  } catch (const InputError&) {
    return;
  }
  try {
    static_cast<void>(parse_policy_config(small_model(), toml, scratch() + "/policy.toml"));
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch)
  }
}

}  // namespace assay::fuzz
