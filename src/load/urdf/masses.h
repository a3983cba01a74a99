// Masses and inertias of links, and of links that are fixed to each other.
#pragma once

#include <array>
#include <cstddef>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <tinyxml2.h>

#include "load/inertia.h"
#include "load/urdf/robot.h"

namespace assay::urdf {

// The attributes of <inertia>, with the entries of the matrix that they give.
inline constexpr std::array<std::pair<const char*, std::pair<int, int>>, 6> kInertiaEntries = {
    {{"ixx", {0, 0}}, {"ixy", {0, 1}}, {"ixz", {0, 2}}, {"iyy", {1, 1}}, {"iyz", {1, 2}}, {"izz", {2, 2}}}};

Mat3 inertia_of(const tinyxml2::XMLElement& inertial);

// Principal moments for messages.
std::string moments_text(const Vec3& e);

class Masses {
 public:
  explicit Masses(Robot& robot) : robot_(robot) {}

  // Link::mass, I and X_LI, as the document writes them or <mujoco><compiler> says.
  void read();
  // settotalmass scales what moves; MuJoCo fuses what does not into the world, and forgets its mass.
  void scale_to_total();
  // Finds joints that move no mass: they have no dynamics.
  void find_idle();
  // Refuses what has no dynamics: joints that move no mass, inertias that no body has.
  void check();
  // MuJoCo compiles links one by one: it gets the whole where a part would be refused, and a placeholder where there is
  // no mass.
  void write();

  // The link that this one is fixed to and that moves.
  int head(int link) const { return head_[static_cast<size_t>(link)]; }
  // A link's frame in its head's.
  const Pose& X_HL(int link) const { return X_HL_[static_cast<size_t>(link)]; }
  // All links that are fixed to a head, in its frame.
  const RigidPart& whole(int head) const { return whole_[static_cast<size_t>(head)]; }
  const std::set<int>& idle() const { return idle_; }

 private:
  bool is_static(int link) const { return head(link) == robot_.order.front(); }
  void take_shapes();
  void take_shapes(Link& link);
  void bound(Link& link) const;
  void update_groups();
  void check_link(int i);

  Robot& robot_;
  std::vector<int> head_;
  std::vector<Pose> X_HL_;
  std::vector<RigidPart> whole_;
  std::set<int> idle_;
};

}  // namespace assay::urdf
