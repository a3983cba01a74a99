// b3ManifoldPoint::totalNormalImpulse, "the total normal impulse applied during sub-stepping", of a ball at rest is
// twice what carries it: each sub-step adds the accumulated impulse after its sweep with position correction, and again
// after the one without. Friction has no total at all. So an adapter cannot read the forces of contacts from steps of
// several sub-steps. Status 0 while Box3D behaves so.
#include <cmath>
#include <cstdio>

#include "world.h"

namespace {

// Of a ball of 1 kg at rest, relative to its weight times the step.
struct Impulses {
  double last = 0, total = 0;
};

Impulses of_ball_at_rest(int sub_steps) {
  constexpr float kStep = 0.004f, kGravity = 9.81f;
  const finding::World world(kGravity);
  const b3BodyId ball = world.add_ball(1, 0.1f, {0, 0, 0.1f});
  for (int i = 0; i < 250; ++i) b3World_Step(world.id(), kStep, sub_steps);
  b3ContactData contact;
  if (b3Body_GetContactData(ball, &contact, 1) != 1 || contact.manifoldCount != 1) return {};
  const b3ManifoldPoint& point = contact.manifolds[0].points[0];
  return {point.normalImpulse / (kGravity * kStep), point.totalNormalImpulse / (kGravity * kStep)};
}

}  // namespace

int main() {
  bool as_found = true;
  for (const int sub_steps : {1, 2, 4, 8}) {
    const Impulses found = of_ball_at_rest(sub_steps);
    std::printf("%d sub-steps: last %.4f, total %.4f of the weight's impulse\n", sub_steps, found.last, found.total);
    as_found = as_found && std::abs(found.last * sub_steps - 1) < 1e-3 && std::abs(found.total - 2) < 1e-3;
  }
  return as_found ? 0 : 1;
}
