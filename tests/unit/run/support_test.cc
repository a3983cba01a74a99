// Which robots of URDF files are taken to have a free base.
#include "run/search/support.h"

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "load/mjcf.h"

namespace assay {
namespace {

std::string inertial(double mass, const std::string& xyz = "0 0 0") {
  return fmt::format(
      "<inertial><origin xyz='{}'/><mass value='{}'/><inertia ixx='{}' ixy='0' ixz='0' iyy='{}' iyz='0' "
      "izz='{}'/></inertial>",
      xyz, mass, mass / 100, mass / 100, mass / 100);
}
std::string collision(const std::string& shape, const std::string& xyz = "0 0 0", const std::string& rpy = "0 0 0") {
  return fmt::format("<collision><origin xyz='{}' rpy='{}'/><geometry><{}/></geometry></collision>", xyz, rpy, shape);
}
std::string link(const std::string& name, const std::string& inside) {
  return fmt::format("<link name='{}'>{}</link>", name, inside);
}
std::string joint(const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
                  const std::string& origin, const std::string& axis, const std::string& rpy = "0 0 0") {
  return fmt::format(
      "<joint name='{}' type='{}'><parent link='{}'/><child link='{}'/><origin xyz='{}' rpy='{}'/><axis "
      "xyz='{}'/><limit lower='-2' upper='2' effort='10' velocity='5'/></joint>",
      name, type, parent, child, origin, rpy, axis);
}

// "" for a base that stays fixed.
std::string support(const std::string& robot) {
  const Model model = load_model_text("<robot name='r'>" + robot + "</robot>", "r.urdf",
                                      {.root_joint = RootJoint::kFloating, .ground = Ground::kPlane});
  return support_of(model);
}

std::string wheel(const std::string& name, double x, double y, double radius = 0.05) {
  return link(name, inertial(0.3) + collision(fmt::format("cylinder radius='{}' length='0.02'", radius))) +
         joint("turn_" + name, "continuous", "base", name, fmt::format("{} {} {}", x, y, radius), "0 0 1",
               "-1.5708 0 0");
}

TEST(Support, Wheels) {
  const std::string cart = inertial(5, "0 0 0.06") + collision("box size='0.3 0.25 0.06'", "0 0 0.08");
  // the caster is a part of the base, as high as the wheels, higher, lower, or missing
  for (const char* caster : {"0.02", "0.019", "0.021", "0.025", "0.005"}) {
    const std::string base = link("base", cart + collision(fmt::format("sphere radius='{}'", caster), "-0.1 0 0.02"));
    EXPECT_EQ(support(base + wheel("l", 0.05, 0.15) + wheel("r", 0.05, -0.15)), "stands on 2 of its wheels") << caster;
  }
  EXPECT_EQ(support(link("base", cart) + wheel("a", 0.1, 0.1) + wheel("b", 0.1, -0.1) + wheel("c", -0.1, 0.1) +
                    wheel("d", -0.1, -0.1)),
            "stands on 4 of its wheels");
  // a turntable and a pendulum are no wheels
  EXPECT_EQ(support(link("base", cart + collision("box size='1 1 0.02'")) + link("table", inertial(1)) +
                    joint("j", "continuous", "base", "table", "0 0 0.2", "0 0 1")),
            "");
  const auto swing = [&](const std::string& name, const std::string& y) {
    return link(name, inertial(1, "0 0 -0.2") + collision("sphere radius='0.02'", "0 0 -0.2")) +
           joint("j" + name, "continuous", "base", name, "0 " + y + " 0", "0 1 0");
  };
  EXPECT_EQ(support(link("base", inertial(5)) + swing("a", "0.1") + swing("b", "-0.1")), "");
}

// `count` limbs of `joints` joints each that hang from a platform to one height.
std::string hanging(size_t count, size_t joints, double base_mass, const std::string& name,
                    const std::string& type = "revolute") {
  std::string text = link("base", inertial(base_mass) + collision("cylinder radius='0.2' length='0.05'"));
  for (size_t i = 0; i < count; ++i) {
    const double angle = 2 * EIGEN_PI * static_cast<double>(i) / static_cast<double>(count);
    std::string parent = "base";
    for (size_t k = 0; k < joints; ++k) {
      const std::string own = fmt::format("{}{}_{}", name, i, k);
      const bool last = k + 1 == joints;
      text += link(own, inertial(0.3, "0 0 -0.08") + (last ? collision("sphere radius='0.01'", "0 0 -0.16") : "")) +
              joint("j" + own, type, parent, own,
                    k == 0 ? fmt::format("{} {} -0.05", 0.1 * std::cos(angle), 0.1 * std::sin(angle)) : "0 0 -0.16",
                    k % 2 == 0 ? "0 1 0" : "1 0 0");
      parent = own;
    }
  }
  return text;
}

TEST(Support, Limbs) {
  EXPECT_EQ(support(hanging(4, 3, 5, "x")), "stands on 4 of its limbs");
  EXPECT_EQ(support(hanging(4, 2, 2, "x")), "stands on 4 of its limbs");
  EXPECT_EQ(support(hanging(6, 3, 8, "x")), "stands on 6 of its limbs");
  EXPECT_EQ(support(hanging(2, 5, 6, "x")), "stands on 2 of its limbs");
  EXPECT_EQ(support(hanging(3, 2, 6, "leg")), "stands on 3 of its limbs");
  EXPECT_EQ(support(hanging(2, 1, 6, "foot")), "stands on 2 of its limbs");
}

TEST(Support, WhatHangsFromAPlatformIsNoLeg) {
  EXPECT_EQ(support(hanging(3, 2, 10, "x")), "") << "three fingers";
  EXPECT_EQ(support(hanging(3, 3, 1, "x")), "") << "a light platform";
  EXPECT_EQ(support(hanging(4, 2, 50, "x")), "") << "a heavy one";
  EXPECT_EQ(support(hanging(4, 3, 1, "finger")), "");
  EXPECT_EQ(support(hanging(2, 1, 1, "x")), "") << "a gripper";
  EXPECT_EQ(support(hanging(6, 2, 5, "x", "prismatic")), "") << "a parallel robot";
  EXPECT_EQ(support(hanging(1, 6, 5, "x")), "") << "an arm";
  // an arm on a pedestal, whose tip reaches the floor too
  EXPECT_EQ(support(link("base", inertial(5) + collision("box size='0.2 0.2 0.4'")) +
                    link("arm", inertial(1) + collision("box size='0.1 0.1 0.4'")) +
                    joint("j", "revolute", "base", "arm", "0.3 0 0", "0 1 0")),
            "");
}

TEST(Support, Rotors) {
  const auto rotor = [](const std::string& name, const std::string& at) {
    return link(name, inertial(0.01)) + joint("j" + name, "continuous", "base", name, at, "0 0 1");
  };
  const std::string base = link("base", inertial(1) + collision("box size='0.2 0.2 0.05'"));
  EXPECT_EQ(support(base + rotor("a", "0.1 0.1 0") + rotor("b", "-0.1 0.1 0") + rotor("c", "0.1 -0.1 0") +
                    rotor("d", "-0.1 -0.1 0")),
            "flies with 4 rotors");
  EXPECT_EQ(support(base + rotor("a", "0 0 0.1")), "");
}

}  // namespace
}  // namespace assay
