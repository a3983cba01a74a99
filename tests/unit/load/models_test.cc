// The systems agree with their comments: degrees of freedom, figures of the sources, derived figures, and the hand that
// holds its capsule.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "base/errors.h"
#include "base/paths.h"
#include "controls/engine_actuators.h"
#include "engines/registry.h"
#include "load/capsules.h"
#include "load/mjcf.h"
#include "measures/mechanics.h"
#include "measures/reference/smooth.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::string file_of(const std::string& system) { return fmt::format("{}/{}.xml", ASSAY_MODELS, system); }
Model papers_system(const std::string& name) { return load_model(file_of(name)); }

const Body& body(const Model& model, const std::string& name) {
  return *std::ranges::find(model.bodies, name, &Body::name);
}
int index_of(const Model& model, const std::string& name) {
  return static_cast<int>(std::ranges::find(model.bodies, name, &Body::name) - model.bodies.begin());
}

struct Raw {
  std::unique_ptr<mjModel, void (*)(mjModel*)> model{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, void (*)(mjData*)> data{nullptr, mj_deleteData};
};

// MuJoCo's own view of the file, in its first keyframe.
Raw raw(const std::string& name) {
  Raw result;
  std::array<char, 1000> error = {};
  result.model.reset(mj_loadXML(file_of(name).c_str(), nullptr, error.data(), static_cast<int>(error.size())));
  EXPECT_NE(result.model, nullptr) << error.data();
  result.data.reset(mj_makeData(result.model.get()));
  if (result.model->nkey > 0) mj_resetDataKeyframe(result.model.get(), result.data.get(), 0);
  return result;
}

TEST(Models, DegreesOfFreedomAreMuJoCosAndThePapers) {
  for (const auto& [name, dof, hinges] :
       {std::tuple{"planar-chain", 5, 5}, std::tuple{"humanoid", 25, 19}, std::tuple{"astronaut", 25, 19},
        std::tuple{"astronaut-energy", 25, 19}, std::tuple{"grasp", 35, 29}, std::tuple{"capsules-27", 162, 0}}) {
    const Model model = papers_system(name);
    EXPECT_EQ(model.dof(), dof) << name;
    EXPECT_EQ(raw(name).model->nv, dof) << name;
    EXPECT_THAT(model.joints, SizeIs(hinges)) << name;
  }
}

// ---- human figure ---------------------------------------------------------------------------------------------------

// Mass and centre of mass of bodies in the reference configuration.
struct Lump {
  double mass = 0;
  Vec3 p = Vec3::Zero();
};
Lump lump(const Model& model, const std::vector<std::string>& names) {
  const State state = reference_state(model);
  Lump sum;
  for (const std::string& name : names) {
    const int i = index_of(model, name);
    sum.mass += model.bodies[i].mass;
    sum.p += model.bodies[i].mass * state.bodies[i].p_WBcm;
  }
  sum.p /= sum.mass;
  return sum;
}

// De Leva (1996), table 4, men: share of the body's mass, and the centre's distance from the proximal end as a share of
// the segment's length.
TEST(Models, HumanSegmentsHaveDeLevasMassesAndCentres) {
  constexpr double kMass = 73.0;
  const Model model = papers_system("humanoid");
  EXPECT_NEAR(model.total_mass(), kMass, 0.001);
  const State state = reference_state(model);
  const auto joint_z = [&](const std::string& child) {
    const int hinge = body(model, child).joint;
    return joint_frames(model, state, hinge).p_WJ_child.z();
  };
  for (const std::string side : {"left_", "right_"}) {
    const Lump thigh = lump(model, {side + "hip_inner", side + "hip_outer", side + "thigh"});
    EXPECT_NEAR(thigh.mass, 0.1416 * kMass, 0.001);
    EXPECT_NEAR(joint_z(side + "thigh") - thigh.p.z(), 0.4095 * 0.4222, 0.001);
    EXPECT_NEAR(joint_z(side + "thigh") - joint_z(side + "shank"), 0.4222, 1e-6);
    const Lump shank = lump(model, {side + "shank"});
    EXPECT_NEAR(shank.mass, 0.0433 * kMass, 0.001);
    EXPECT_NEAR(joint_z(side + "shank") - shank.p.z(), 0.4395 * 0.4403, 0.001);
    EXPECT_NEAR(lump(model, {side + "foot"}).mass, 0.0137 * kMass, 0.001);
    const Lump arm = lump(model, {side + "shoulder", side + "upper_arm"});
    EXPECT_NEAR(arm.mass, 0.0271 * kMass, 0.001);
    EXPECT_NEAR(joint_z(side + "upper_arm") - arm.p.z(), 0.5772 * 0.2817, 0.001);
    EXPECT_NEAR(lump(model, {side + "forearm"}).mass, (0.0162 + 0.0061) * kMass, 0.001);
  }
  EXPECT_NEAR(lump(model, {"pelvis"}).mass, 0.1117 * kMass, 0.001);
  EXPECT_NEAR(lump(model, {"lower_waist", "upper_waist", "torso"}).mass, (0.1633 + 0.1596 + 0.0694) * kMass, 0.001);
}

TEST(Models, HumanoidIsSymmetricAndClearOfItselfAtTheStart) {
  const Model model = papers_system("humanoid");
  const State state = reference_state(model);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const std::string& name = model.bodies[i].name;
    if (!name.starts_with("left_")) continue;
    const int other = index_of(model, "right_" + name.substr(5));
    const Vec3 p = state.bodies[i].p_WBcm, q = state.bodies[other].p_WBcm;
    EXPECT_LT((Vec3(p.x(), -p.y(), p.z()) - q).norm(), 1e-12) << name;
    EXPECT_EQ(model.bodies[i].mass, model.bodies[other].mass) << name;
    const Joint &left = model.joints[model.bodies[i].joint], &right = model.joints[model.bodies[other].joint];
    EXPECT_EQ(left.axis_B, Vec3(-right.axis_B.x(), right.axis_B.y(), -right.axis_B.z())) << name;
    EXPECT_EQ(left.lower, right.lower) << name;
    EXPECT_EQ(left.upper, right.upper) << name;
  }
  const Raw start = raw("humanoid");
  mj_forward(start.model.get(), start.data.get());
  EXPECT_EQ(start.data->ncon, 0);
  for (size_t j = 0; j < model.joints.size(); ++j) {
    EXPECT_TRUE(model.joints[j].limited);
    EXPECT_GE(model.initial.position[j], model.joints[j].lower) << model.joints[j].name;
    EXPECT_LE(model.initial.position[j], model.joints[j].upper) << model.joints[j].name;
  }
}

TEST(Models, AstronautsAreTheHumanoidWithLess) {
  const Model humanoid = papers_system("humanoid"), astronaut = papers_system("astronaut"),
              energy = papers_system("astronaut-energy");
  for (const Model* derived : {&astronaut, &energy}) {
    ASSERT_EQ(derived->bodies.size(), humanoid.bodies.size());
    for (size_t i = 0; i < humanoid.bodies.size(); ++i) {
      const Body &a = derived->bodies[i], &b = humanoid.bodies[i];
      EXPECT_EQ(a.name, b.name);
      EXPECT_EQ(a.mass, b.mass);
      EXPECT_EQ(a.I_BBcm_B, b.I_BBcm_B);
      EXPECT_EQ(a.X_PB.p, b.X_PB.p);
    }
    EXPECT_EQ(derived->gravity, Vec3(Vec3::Zero()));
    EXPECT_TRUE(std::ranges::none_of(derived->shapes, [](const Shape& s) { return s.type == ShapeType::kPlane; }));
  }
  const auto with_floor = std::ranges::count_if(humanoid.contacts, [&](const ContactPair& pair) {
    return humanoid.shapes[pair.shape_a].type == ShapeType::kPlane ||
           humanoid.shapes[pair.shape_b].type == ShapeType::kPlane;
  });
  EXPECT_GT(with_floor, 10);
  EXPECT_EQ(astronaut.contacts.size(), humanoid.contacts.size() - static_cast<size_t>(with_floor));
  EXPECT_EQ(astronaut.actuators.size(), humanoid.actuators.size());
  EXPECT_TRUE(astronaut.has_limits());

  EXPECT_THAT(energy.contacts, IsEmpty());
  EXPECT_THAT(energy.actuators, IsEmpty());
  EXPECT_FALSE(energy.has_limits());
  EXPECT_TRUE(std::ranges::all_of(energy.initial.velocity, [](double rate) { return rate != 0; }));
  EXPECT_TRUE(conserved_quantities(energy).any());
  EXPECT_EQ(smooth_obstacle(energy), "");
}

TEST(Models, EveryJointOfTheHumanoidFollowsItsOwnSine) {
  const Model model = papers_system("humanoid");
  const auto control = actuator_control(model);
  EXPECT_EQ(control->input(), ControlInput::kTime);
  EXPECT_FALSE(control->is_zero());
  State state = reference_state(model);
  state.time = 0.35;
  std::vector<double> torques(model.joints.size());
  control->torques(state, torques);
  ASSERT_EQ(model.actuators.size(), model.joints.size());
  for (const Actuator& actuator : model.actuators) {
    EXPECT_GT(actuator.sine.amplitude, 0) << actuator.name;
    EXPECT_NEAR(
        torques[actuator.terms.at(0).joint],
        actuator.sine.amplitude * std::sin(2 * std::numbers::pi * actuator.sine.frequency * 0.35 + actuator.sine.phase),
        1e-12)
        << actuator.name;
  }
}

// Ends the run in MuJoCo with the model's own control; every state of it goes to `see`.
template <typename See>
void run(const Model& model, double timestep_s, double duration_s, See see) {
  ResolvedContender contender = Registry::instance().resolve("mujoco-euler");
  contender.settings.timestep = timestep_s;
  const auto control = actuator_control(model);
  Model driven = model;
  equip_for(/*engine_actuators=*/false, *control, driven);
  const auto simulation = contender.engine->create(driven, model.initial, contender.settings);
  std::vector<double> torques(model.joints.size());
  State state;
  for (long long step = 0; step < std::llround(duration_s / timestep_s); ++step) {
    simulation->read_state(state);
    see(state);
    control->torques(state, torques);
    simulation->step(torques);
  }
}

TEST(Models, HumanoidFallsAndGoesOnWiggling) {
  const Model model = papers_system("humanoid");
  const int pelvis = index_of(model, "pelvis");
  double height = 0, slowest = 1e9, window = 0;
  run(model, 0.002, 6, [&](const State& state) {
    height = state.bodies[pelvis].p_WBcm.z();
    double fastest = 0;
    for (const BodyState& each : state.bodies) fastest = std::max(fastest, each.w_WB.norm());
    window = std::max(window, fastest);
    if (std::fmod(state.time, 1) > 0.997) {  // the fastest turn of each second
      slowest = std::min(slowest, window);
      window = 0;
    }
  });
  EXPECT_LT(height, 0.5) << "it stands at about 1 m";
  EXPECT_GT(slowest, 1) << "rad/s";
}

// ---- grasp ----------------------------------------------------------------------------------------------------------

TEST(Models, FingersHaveThePapersSprings) {
  const Model model = papers_system("grasp");
  int sprung = 0;
  for (const Joint& hinge : model.joints) {
    if (hinge.stiffness == 0) continue;
    ++sprung;
    EXPECT_EQ(hinge.stiffness, 0.4) << hinge.name;
    EXPECT_EQ(hinge.damping, 0.005) << hinge.name;
    EXPECT_TRUE(hinge.name.find('J') != std::string::npos) << hinge.name;
  }
  EXPECT_EQ(sprung, 22);
  EXPECT_THAT(model.actuators, SizeIs(7));
  for (const Actuator& actuator : model.actuators) {
    EXPECT_EQ(actuator.bias[1], -actuator.gain);
    const Joint& driven = model.joints[actuator.terms.at(0).joint];
    EXPECT_EQ(driven.stiffness, 0) << actuator.name;
    EXPECT_GT(driven.damping, 0) << actuator.name;
    EXPECT_GT(actuator.sine.amplitude, 0);
  }
  const auto [light, heavy] = std::ranges::minmax_element(model.bodies, {}, &Body::mass);
  EXPECT_GE(heavy->mass / light->mass, 500);
}

TEST(Models, TheGraspStartsInMoreThanTenTouchesAndWithoutPenetration) {
  const Raw start = raw("grasp");
  const mjModel* m = start.model.get();
  for (int g = 0; g < m->ngeom; ++g) m->geom_margin[g] = 2e-6;  // sees what just does not touch, too
  mj_forward(m, start.data.get());
  EXPECT_GT(start.data->ncon, 10);
  const int object = mj_name2id(m, mjOBJ_GEOM, "object");
  for (int c = 0; c < start.data->ncon; ++c) {
    const mjContact& contact = start.data->contact[c];
    EXPECT_GT(contact.dist, -2e-6);
    EXPECT_TRUE(contact.geom[0] == object || contact.geom[1] == object);
  }
}

// The object's distance from the palm, at the start and at most.
std::pair<double, double> hold(const Model& model) {
  const int palm = index_of(model, "palm"), object = index_of(model, "object");
  double first = -1, most = 0, path = 0;
  Vec3 last = Vec3::Zero();
  run(model, 0.001, 5, [&](const State& state) {
    const Vec3 p = state.bodies[palm].p_WBcm;
    const double distance = (state.bodies[object].p_WBcm - p).norm();
    if (first < 0) {
      first = distance;
      last = p;
    }
    most = std::max(most, distance);
    path += (p - last).norm();
    last = p;
  });
  EXPECT_GT(path, 2) << "m: the arm swings";
  return {first, most};
}

TEST(Models, TheHandHoldsTheCapsuleAndWithoutItsSpringsDropsIt) {
  Model model = papers_system("grasp");
  const auto [first, most] = hold(model);
  EXPECT_LT(most, first + 0.02);
  for (Joint& hinge : model.joints) hinge.stiffness = 0;
  EXPECT_GT(hold(model).second, first + 0.2);
}

// ---- capsules -------------------------------------------------------------------------------------------------------

TEST(Models, CapsulesNeedNoFile) {
  std::ifstream file(file_of("capsules-27"), std::ios::binary);
  EXPECT_EQ(capsules_mjcf({27}), std::string(std::istreambuf_iterator<char>(file), {}));

  const Model model = load_model(find_model("capsules-250"));
  EXPECT_EQ(model.name, "capsules-250");
  EXPECT_EQ(model.dof(), 1500);
  EXPECT_EQ(model.hash, load_model(file_of("capsules-250")).hash);
  double nearest = 1e9;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      nearest = std::min(nearest, (model.initial.bodies[i].p_WBcm - model.initial.bodies[j].p_WBcm).norm());
    }
  }
  EXPECT_GT(nearest, 0.3) << "a capsule is 0.3 m long, so none touches another";
}

// Wider, not higher, with more capsules; another seed turns them otherwise and leaves them where they are.
TEST(Models, CapsulesInLayers) {
  const auto height = [](const Model& model) {
    double highest = 0;
    for (const BodyState& body : model.initial.bodies) highest = std::max(highest, body.p_WBcm.z());
    return highest;
  };
  const Model few = load_model(find_model("capsules-25-layers-3")),
              many = load_model(find_model("capsules-250-layers-3"));
  EXPECT_EQ(many.bodies.size(), 250);
  EXPECT_DOUBLE_EQ(height(few), height(many));
  EXPECT_LT(height(load_model(find_model("capsules-25"))), height(load_model(find_model("capsules-250"))));
  const Model other = load_model(find_model("capsules-25-layers-3-seed-2"));
  EXPECT_EQ(other.name, "capsules-25-layers-3-seed-2");
  EXPECT_EQ(other.initial.bodies[7].p_WBcm, few.initial.bodies[7].p_WBcm);
  EXPECT_GT(other.initial.bodies[7].q_WB.angularDistance(few.initial.bodies[7].q_WB), 0.01);
}

TEST(Models, CapsulesThatAreNone) {
  const auto count = [](const char* name) { return capsules_named(name).value_or(CapsulesName()).count; };
  EXPECT_EQ(count("capsules-1"), 1);
  EXPECT_EQ(count("capsules-10000"), 10000);
  for (const char* name :
       {"capsules-0", "capsules-", "capsules", "capsules-07", "capsules--3", "capsules-10001", "capsules-5x",
        "capsules-99999999999", "spheres-5", "capsules-5-layers-0", "capsules-5-seed-", "capsules-5-seed-2-layers-3",
        "capsules-5-layers-3x", "capsules-5-layers-1001"}) {
    EXPECT_FALSE(capsules_named(name).has_value()) << name;
  }
  EXPECT_THROW(find_model("capsules-0"), InputError);
}

// ---- sines in a file ------------------------------------------------------------------------------------------------

TEST(Systems, Chains) {
  for (const char* name : {"planar-chain", "falling-chain", "spatial-chain"}) {
    SCOPED_TRACE(name);
    const Model model = papers_system(name);
    EXPECT_EQ(model.name, name);
    EXPECT_EQ(model.dof(), 5);
    EXPECT_EQ(model.bodies.size(), 5U);
    EXPECT_DOUBLE_EQ(model.total_mass(), 5);
    EXPECT_THAT(model.contacts, IsEmpty());
    EXPECT_THAT(model.notes, IsEmpty());
    EXPECT_FALSE(model.has_springs() || model.has_limits() || model.has_armature());
    EXPECT_THAT(model.initial.velocity, ElementsAre(1, 1, 1, 1, 1));
    EXPECT_THAT(model.initial.position, ElementsAre(0, 0, 0, 0, 0));
    EXPECT_EQ(model.gravity, name == std::string("planar-chain") ? Vec3(0, 0, 0) : Vec3(0, 0, -9.81));
    const bool spatial = name == std::string("spatial-chain");
    const Vec3 exact = capsule_inertia(1, 0.05, 0.15);
    for (int i = 0; i < 5; ++i) {
      EXPECT_EQ(model.joints[i].axis_B, spatial && i % 2 == 1 ? Vec3(0, 0, 1) : Vec3(0, 1, 0));
      EXPECT_LT((model.bodies[i].I_BBcm_B - Mat3(Vec3(exact.z(), exact.x(), exact.x()).asDiagonal())).norm(), 1e-16);
      EXPECT_NEAR(model.initial.bodies[i].p_WBcm.x(), 0.3 * i + 0.15, 1e-15);
    }
  }
}

TEST(Systems, PlanarChainCannotTouchItself) {
  const Model model = papers_system("planar-chain");
  for (int i = 1; i < 5; ++i) {
    const double gap = model.initial.bodies[i].p_WBcm.y() - model.initial.bodies[i - 1].p_WBcm.y();
    EXPECT_GT(gap, 2 * model.shapes[0].radius);
  }
}

TEST(Systems, Capsules) {
  const Model model = papers_system("capsules-27");
  EXPECT_EQ(model.dof(), 162);
  EXPECT_EQ(model.contacts.size(), 27U * 26 / 2 + 27);
  EXPECT_DOUBLE_EQ(model.total_mass(), 27);
  EXPECT_THAT(model.notes, IsEmpty());
  for (const ContactPair& pair : model.contacts) EXPECT_EQ(pair.friction, 0.7);
  // no capsules touch at the start: centres are farther apart than two capsules are long, and above the floor
  Vec3 mean_axis = Vec3::Zero();
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    EXPECT_GT(model.initial.bodies[i].p_WBcm.z(), 0.15);
    mean_axis += (model.initial.bodies[i].q_WB * Vec3::UnitZ()).cwiseAbs() / 27;
    for (size_t j = 0; j < i; ++j) {
      EXPECT_GT((model.initial.bodies[i].p_WBcm - model.initial.bodies[j].p_WBcm).norm(), 0.3);
    }
  }
  // uniformly distributed directions have a mean of 1/2 in each axis (standard error 0.056)
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(mean_axis[k], 0.5, 0.17);
}

std::string with_sine(const std::string& numeric) {
  return fmt::format(
      "<mujoco><worldbody><body><joint name='knee'/><geom size='0.1'/></body></worldbody>"
      "<actuator><motor name='pull' joint='knee' gear='2'/></actuator><custom>{}</custom></mujoco>",
      numeric);
}

TEST(Sines, AreReadAndChangeTheHash) {
  const Model plain = load_model_text(with_sine(""), "leg");
  const Model other = load_model_text(with_sine("<numeric name='speed' data='3'/>"), "leg");
  EXPECT_EQ(plain.hash, other.hash) << "a number of somebody else's";
  const Model model = load_model_text(with_sine("<numeric name='assay:sine:pull' data='3 0.5 0.25'/>"), "leg");
  EXPECT_NE(model.hash, plain.hash);
  const auto control = actuator_control(model, {1});
  State state = reference_state(model);
  state.time = 2;
  std::vector<double> torque(1);
  control->torques(state, torque);
  EXPECT_NEAR(torque[0], 2 * (1 + 3 * std::sin(2 * std::numbers::pi + 0.25)), 1e-12);
  EXPECT_EQ(control->description(), "1 actuators, 1 of them with sines");
}

TEST(Sines, ThatCannotBeUsedAreRefused) {
  const std::map<std::string, std::string> cases = {
      {"<numeric name='assay:sine:push' data='3 1 0'/>", "'push'"},
      {"<numeric name='assay:sine:pull' data='3 1'/>", "three numbers"},
      {"<numeric name='assay:sine:pull' data='3 -1 0'/>", "not negative"},
      {"<numeric name='assay:cosine:pull' data='3 1 0'/>", "assay:sine:ACTUATOR"}};
  for (const auto& [numeric, words] : cases) {
    try {
      load_model_text(with_sine(numeric), "leg");
      ADD_FAILURE() << numeric;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  }
}

}  // namespace
}  // namespace assay
