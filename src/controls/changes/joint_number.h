// The numbers of joints that changes set.
#pragma once

#include "controls/changes/change.h"

namespace assay {

// That of a hinge, slide or ball joint; null for a kind of change that sets none.
template <typename SomeJoint>
auto joint_number(ChangeKind kind, SomeJoint& joint) -> decltype(&joint.armature) {
  switch (kind) {
    case ChangeKind::kArmature:
      return &joint.armature;
    case ChangeKind::kDamping:
      return &joint.damping;
    case ChangeKind::kStiffness:
      return &joint.stiffness;
    case ChangeKind::kDryFriction:
      return &joint.dry_friction;
    default:
      return nullptr;
  }
}

}  // namespace assay
