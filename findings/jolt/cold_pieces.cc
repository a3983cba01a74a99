// Jolt 5.6.0 keeps contact impulses from step to step and starts its solver with them. A world that is made anew in the
// middle of a motion lacks them; one whose whole state is put back (PhysicsSystem::RestoreState) has them. This program
// measures what that does to the comparison of short pieces at a coarse timestep with a fine one:
//
//   cold      made anew at both timesteps, as assay's self-consistency error has it
//   restored  with the whole state of the fine motion at both
//
// 27 capsules fall into a pile within 2.56 s, at 1/8 ms; pieces of 128 ms start evenly over it.
//
// Ends with status 0 while the two mean errors agree within their intervals at each timestep, 1 when they do not: then
// cold pieces measure the start, not the timestep.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "world.h"

// clang-format off: after Jolt's first header
#include <Jolt/Physics/StateRecorderImpl.h>
// clang-format on

namespace {

constexpr int kBodies = 27, kPieces = 20;
constexpr float kRadius = 0.05f, kHalf = 0.1f;
constexpr double kFine = 0.125e-3, kPiece = 0.128, kBetween = 0.128;

struct Pile {
  finding::World world;
  std::vector<JPH::Body*> bodies;

  Pile() : world(JPH::Vec3(0, 0, -9.81f), settings(), kBodies + 1) {
    world.add(finding::fixed_body(new JPH::PlaneShape(JPH::Plane(JPH::Vec3::sAxisZ(), 0))));
    std::mt19937 random(1);
    std::uniform_real_distribution<float> turn(-1, 1);
    const float across = (3 * kRadius * kRadius + 4 * kHalf * kHalf) / 12;
    for (int i = 0; i < kBodies; ++i) {
      const JPH::RVec3 place(0.25f * static_cast<float>(i % 3 - 1), 0.25f * static_cast<float>(i / 3 % 3 - 1),
                             0.2f + 0.3f * static_cast<float>(i / 9));
      const JPH::Quat turned = JPH::Quat(turn(random), turn(random), turn(random), turn(random)).Normalized();
      bodies.push_back(world.add(finding::free_body(new JPH::CapsuleShape(kHalf, kRadius), place, turned, 1,
                                                    JPH::Vec3(across, kRadius * kRadius / 2, across))));
    }
  }

  static JPH::PhysicsSettings settings() {
    JPH::PhysicsSettings made;
    made.mUseBodyPairContactCache = false;
    return made;
  }
};

struct Motion {
  std::vector<JPH::RVec3> position;
  std::vector<JPH::Quat> rotation;
  std::vector<JPH::Vec3> velocity, spin;
};

Motion read(const Pile& pile) {
  Motion out;
  for (const JPH::Body* body : pile.bodies) {
    out.position.push_back(body->GetPosition());
    out.rotation.push_back(body->GetRotation());
    out.velocity.push_back(body->GetLinearVelocity());
    out.spin.push_back(body->GetAngularVelocity());
  }
  return out;
}

struct Start {
  Motion motion;
  std::string whole;  // Jolt's own record of everything
};

Motion piece(const Start& start, double timestep, bool restored) {
  Pile pile;
  if (restored) {
    JPH::StateRecorderImpl recorder;
    recorder.WriteBytes(start.whole.data(), start.whole.size());
    if (!pile.world.system().RestoreState(recorder)) std::puts("Jolt does not restore its state");
  } else {
    JPH::BodyInterface& interface = pile.world.system().GetBodyInterfaceNoLock();
    for (size_t b = 0; b < pile.bodies.size(); ++b) {
      const JPH::BodyID id = pile.bodies[b]->GetID();
      interface.SetPositionAndRotation(id, start.motion.position[b], start.motion.rotation[b],
                                       JPH::EActivation::Activate);
      interface.SetLinearAndAngularVelocity(id, start.motion.velocity[b], start.motion.spin[b]);
    }
  }
  pile.world.run(timestep, std::lround(kPiece / timestep));
  return read(pile);
}

double distance(const Motion& a, const Motion& b) {
  double sum = 0;
  for (size_t i = 0; i < a.position.size(); ++i) sum += double{(a.position[i] - b.position[i]).Length()};
  return sum / static_cast<double>(a.position.size());
}

struct Mean {
  double value = 0, half = 0;  // mean and half of its 95 % interval over the pieces
};

Mean mean_of(const std::vector<double>& errors) {
  const auto count = static_cast<double>(errors.size());
  Mean out;
  for (const double each : errors) out.value += each / count;
  double square = 0;
  for (const double each : errors) square += (each - out.value) * (each - out.value) / (count - 1);
  out.half = 2.09 * std::sqrt(square / count);  // Student's factor for 20 pieces
  return out;
}

}  // namespace

int main() {
  finding::begin();
  Pile fine;
  std::vector<Start> starts;
  for (int k = 0; k < kPieces; ++k) {
    JPH::StateRecorderImpl recorder;
    fine.world.system().SaveState(recorder);
    starts.push_back({read(fine), recorder.GetData()});
    fine.world.run(kFine, std::lround(kBetween / kFine));
  }
  const Motion end = read(fine);

  std::vector<Motion> fine_cold, fine_restored;
  double largest = 0, floor = 0;
  for (size_t k = 0; k < starts.size(); ++k) {
    fine_cold.push_back(piece(starts[k], kFine, false));
    fine_restored.push_back(piece(starts[k], kFine, true));
    const Motion& truly = k + 1 < starts.size() ? starts[k + 1].motion : end;
    largest = std::max(largest, distance(fine_restored.back(), truly));
    floor += distance(fine_cold.back(), truly) / kPieces;
  }
  // Restoring is exact, or the comparison says nothing.
  std::printf("restored pieces end up to %g m from the motion that they are pieces of, cold ones %.3g mm in the mean\n",
              largest, 1e3 * floor);
  bool agree = largest == 0;
  for (const double timestep : {0.25e-3, 1e-3, 4e-3}) {
    std::vector<double> cold, restored, difference;
    for (int k = 0; k < kPieces; ++k) {
      cold.push_back(distance(piece(starts[k], timestep, false), fine_cold[k]));
      restored.push_back(distance(piece(starts[k], timestep, true), fine_restored[k]));
      difference.push_back(cold.back() - restored.back());
    }
    const Mean of_cold = mean_of(cold), of_restored = mean_of(restored), of_difference = mean_of(difference);
    std::printf("%g ms: cold %.2f +- %.2f mm, restored %.2f +- %.2f mm, cold less restored %.2f +- %.2f mm\n",
                1e3 * timestep, 1e3 * of_cold.value, 1e3 * of_cold.half, 1e3 * of_restored.value,
                1e3 * of_restored.half, 1e3 * of_difference.value, 1e3 * of_difference.half);
    agree = agree && std::abs(of_difference.value) <= of_difference.half;
  }
  return agree ? 0 : 1;
}
