// Writes the keyframe of grasp.xml: the hand closes around the capsule and comes to rest, with the arm held still.
//
// Usage: settle_grasp models/grasp.xml > keyframe, for the file's <keyframe>. Needs only MuJoCo.
//
// The joints start at the arm's set-points with the hand open, the capsule in front of the palm. Without gravity and
// with the capsule's motion damped, the springs close the hand; then gravity acts without the damping. Contacts are
// much stiffer than MuJoCo's usual ones, so that engines with hard contacts start without penetration too. An armature
// of 1e9 kg m^2 holds the arm still.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>

#include <mujoco/mujoco.h>

namespace {

constexpr double kTimestep = 1.0 / 16000;                     // s
constexpr double kClosing = 1, kYielding = 1, kSettling = 4;  // s
constexpr std::array<const char*, 7> kArm = {"shoulder_swing", "shoulder_lift", "shoulder_turn", "elbow",
                                             "forearm_roll",   "WRJ2",          "WRJ1"};
constexpr std::array<double, 7> kArmAngles = {0.5, 0.3, 0, 1.2, 0, -0.17, -0.1};  // rad; set-points as well
constexpr std::array<const char*, 12> kBent = {"FFJ3", "FFJ2", "FFJ1", "MFJ3", "MFJ2", "MFJ1",
                                               "RFJ3", "RFJ2", "RFJ1", "LFJ3", "LFJ2", "LFJ1"};
constexpr double kOpen = 0.3, kThumb = 1.2;  // rad: the fingers bent a little, the thumb across below the capsule
constexpr std::array<double, 3> kObjectInPalm = {0, -0.035, 0.069};  // m: the capsule's centre in the palm's frame

int address(const mjModel* m, const char* joint, const int* table) { return table[mj_name2id(m, mjOBJ_JOINT, joint)]; }

// MuJoCo's arrays hold rows of `width` values.
template <typename T>
T* row(T* array, std::ptrdiff_t width, int index) {
  return array + width * index;
}

// An attribute of <key>, nine numbers a line.
void print_row(const char* name, const double* values, int count) {
  std::printf(" %s=\"", name);
  for (int i = 0; i < count; ++i) {
    if (i > 0) std::printf(i % 9 == 0 ? "\n      " : " ");
    std::printf("%.10g", std::abs(values[i]) < 1e-12 ? 0.0 : values[i]);
  }
  std::printf("\"");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: settle_grasp models/grasp.xml > keyframe\n");
    return 2;
  }
  std::array<char, 1000> error = {};
  const std::unique_ptr<mjModel, void (*)(mjModel*)> model(mj_loadXML(argv[1], nullptr, error.data(), error.size()),
                                                           mj_deleteModel);
  if (model == nullptr) {
    std::fprintf(stderr, "%s: %s\n", argv[1], error.data());
    return 2;
  }
  mjModel* m = model.get();
  m->opt.timestep = kTimestep;
  m->opt.iterations = 200;
  m->opt.tolerance = 1e-12;
  m->opt.cone = mjCONE_ELLIPTIC;
  m->opt.disableflags |= mjDSBL_ACTUATION;
  for (int g = 0; g < m->ngeom; ++g) {
    std::copy_n(std::array{0.0004, 1.0}.begin(), 2, row(m->geom_solref, mjNREF, g));
    std::copy_n(std::array{0.99, 0.999, 0.0001, 0.5, 2.0}.begin(), 5, row(m->geom_solimp, mjNIMP, g));
  }
  for (int j = 0; j < m->njnt; ++j) std::copy_n(std::array{0.0004, 1.0}.begin(), 2, row(m->jnt_solref, mjNREF, j));
  const std::unique_ptr<mjData, void (*)(mjData*)> data(mj_makeData(m), mj_deleteData);
  mjData* d = data.get();

  // the initial state
  mj_resetData(m, d);
  for (const char* joint : kBent) d->qpos[address(m, joint, m->jnt_qposadr)] = kOpen;
  d->qpos[address(m, "THJ4", m->jnt_qposadr)] = kThumb;
  for (size_t i = 0; i < kArm.size(); ++i) {
    d->qpos[address(m, kArm[i], m->jnt_qposadr)] = kArmAngles[i];
    m->dof_armature[address(m, kArm[i], m->jnt_dofadr)] = 1e9;
    m->dof_damping[address(m, kArm[i], m->jnt_dofadr)] = 0;
  }
  const int palm = mj_name2id(m, mjOBJ_BODY, "palm");
  const int object_q = address(m, "object", m->jnt_qposadr), object_v = address(m, "object", m->jnt_dofadr);
  mj_kinematics(m, d);
  mjtNum across[4] = {std::sqrt(0.5), 0, std::sqrt(0.5), 0};  // the capsule's z axis along the palm's x
  mju_mulQuat(d->qpos + object_q + 3, row(d->xquat, 4, palm), across);
  mju_rotVecQuat(d->qpos + object_q, kObjectInPalm.data(), row(d->xquat, 4, palm));
  mju_addTo3(d->qpos + object_q, row(d->xpos, 3, palm));

  // The capsule is fixed, then damped, then free.
  const std::array<double, 3> gravity = {m->opt.gravity[0], m->opt.gravity[1], m->opt.gravity[2]};
  const auto run = [&](double duration, double damping, double rotational_damping) {  // Ns/m, Nms/rad
    for (int i = 0; i < 6; ++i) m->dof_damping[object_v + i] = i < 3 ? damping : rotational_damping;
    for (const double end = d->time + duration; d->time < end;) mj_step(m, d);
  };
  mju_zero3(m->opt.gravity);
  run(kClosing, 1e6, 1e4);
  run(kYielding, 10, 0.01);
  std::copy_n(gravity.begin(), 3, m->opt.gravity);
  run(kSettling, 0, 0);

  // the remaining motion, and the keyframe
  mj_forward(m, d);
  double depth = 0, speed = 0;
  for (int c = 0; c < d->ncon; ++c) depth = std::min(depth, d->contact[c].dist);
  for (int i = 0; i < m->nv; ++i) speed = std::max(speed, std::abs(d->qvel[i]));
  std::fprintf(stderr, "at rest: fastest coordinate %.3g /s, %d contacts, deepest %.3g mm\n", speed, d->ncon,
               -1000 * depth);
  for (int c = 0; c < d->ncon; ++c) {
    mjtNum f[6];
    mj_contactForce(m, d, c, f);
    std::fprintf(stderr, "  %s - %s: %.2f N\n", mj_id2name(m, mjOBJ_GEOM, d->contact[c].geom[0]),
                 mj_id2name(m, mjOBJ_GEOM, d->contact[c].geom[1]), f[0]);
  }
  for (size_t i = 0; i < kArm.size(); ++i) d->qpos[address(m, kArm[i], m->jnt_qposadr)] = kArmAngles[i];
  std::printf("    <key name=\"held\"");
  print_row("qpos", d->qpos, m->nq);
  std::printf("\n     ");
  print_row("ctrl", kArmAngles.data(), m->nu);
  std::printf("/>\n");
  return 0;
}
