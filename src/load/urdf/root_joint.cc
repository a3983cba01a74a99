#include "load/urdf/root_joint.h"

#include <algorithm>

#include <tinyxml2.h>

namespace assay::urdf {
namespace {

namespace xml = tinyxml2;

// A joint without mass moves nothing; where it is fixed, the rest may be an object.
bool anything_moves(const Robot& robot) {
  return std::ranges::any_of(robot.joints, [&](const Joint& joint) {
    return joint.type != "fixed" && (!robot.options.drop_unsupported || robot.carried_mass(joint.child) > 0);
  });
}

// The root is fixed, so what floats on it floats in the world; MuJoCo frees only what hangs on a link of that name.
void take_root_for_world(Robot& robot) {
  Link& root = robot.links[robot.order.front()];
  if (root.name == "world") return;
  const auto taken = std::ranges::find(robot.links, "world", &Link::name);
  if (taken != robot.links.end()) {
    robot.refuse("link 'world'", taken->element->GetLineNum(), "is not the root, and the robot floats",
                 "give it another name");
    return;
  }
  root.name = "world";
  root.element->SetAttribute("name", "world");
  for (const int j : root.children) {
    robot.joints[j].element->FirstChildElement("parent")->SetAttribute("link", "world");
  }
}

}  // namespace

void apply_root_joint(Robot& robot) {
  Link& root = robot.links[robot.order.front()];
  const auto floats = [&robot](int j) { return robot.joints[j].type == "floating"; };
  const bool is_object = robot.options.root_joint == RootJoint::kAsInFile && root.name != "world" &&
                         !anything_moves(robot) && !robot.link_of.contains("world") &&
                         robot.carried_mass(robot.order.front()) > 0;
  if (is_object) {
    robot.note(kFreeObject);
  }
  if (robot.options.root_joint == RootJoint::kFixed) {
    for (const int j : root.children) {
      if (floats(j)) set_type(robot.joints[j], "fixed");
    }
  }
  if (std::ranges::any_of(root.children, floats)) {
    take_root_for_world(robot);
    return;
  }
  if (robot.options.root_joint != RootJoint::kFloating && !is_object) return;
  if (root.name == "world") {
    for (const int j : root.children) {
      if (robot.joints[j].type == "fixed" && root.children.size() == 1) set_type(robot.joints[j], "floating");
    }
    return;
  }
  if (const auto taken = robot.link_of.find("world"); taken != robot.link_of.end()) {
    robot.refuse("link 'world'", robot.links[taken->second].element->GetLineNum(),
                 "is not the root, and the robot floats", "give it another name");
    return;
  }
  xml::XMLElement* world = robot.document.NewElement("link");
  world->SetAttribute("name", "world");
  robot.element->InsertEndChild(world);
  xml::XMLElement* joint = robot.document.NewElement("joint");
  joint->SetAttribute("name", "floating_base");
  joint->SetAttribute("type", "floating");
  joint->InsertNewChildElement("parent")->SetAttribute("link", "world");
  joint->InsertNewChildElement("child")->SetAttribute("link", root.name.c_str());
  robot.element->InsertEndChild(joint);
  const int joint_index = static_cast<int>(robot.joints.size());
  root.joint = joint_index;
  const int world_index = static_cast<int>(robot.links.size());
  robot.joints.push_back({joint, "floating_base", "floating", world_index, robot.order.front()});
  Link& added = robot.links.emplace_back();  // `root` may refer to nothing from here on
  added.element = world;
  added.name = "world";
  added.children = {joint_index};
  robot.order.insert(robot.order.begin(), world_index);
}

}  // namespace assay::urdf
