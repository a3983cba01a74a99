// Campaigns whose figures are known beforehand: grasps, scaling, agreement, violation; references that outlive a
// campaign.
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "base/paths.h"
#include "campaign/plan.h"
#include "cell_values.h"
#include "measures/clusters.h"
#include "measures/initial_states.h"
#include "results/store/trajectory.h"
#include "run/coordinator/run.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class MeasuresRunTest : public TempFolderTest {
 protected:
  std::string path(const std::string& name) const { return (dir_ / name).string(); }

  void write(const std::string& name, const std::string& text) const {
    fs::create_directories(dir_);
    std::ofstream(path(name)) << text;
  }

  Campaign campaign(const std::string& text) const { return parse_campaign(text, path("campaign.toml")); }

  // The gate is tested on its own; here its verdict is there already.
  RunSummary run(const Campaign& campaign, const std::string& out, const std::string& references = "") const {
    {
      Store store = Store::create(path(out), {campaign.name, campaign.hash()});
      for (const CampaignContender& contender : campaign.contenders) {
        store.set_conformance(contender.resolved.name, {{"", "free-fall", "pass", 0, 1, "", ""}});
      }
    }
    RunOptions options;
    options.out = path(out);
    options.jobs = 2;
    options.program = (fs::path(program_path()).parent_path() / "assay").string();
    options.references = references.empty() ? "" : path(references);
    return run_campaign(campaign, options);
  }

  Cell find(const std::string& out, const std::string& system, const std::string& contender, const std::string& measure,
            double timestep_ms) const {
    for (const Cell& cell : Store::open(path(out)).cells()) {
      if (cell.system == system && cell.contender == contender && cell.measure == measure &&
          cell.timestep_ms == timestep_ms) {
        return cell;
      }
    }
    ADD_FAILURE() << "no cell " << system << " " << contender << " " << measure << " " << timestep_ms;
    return {};
  }

  std::vector<double> samples(const std::string& out, const Cell& cell, const std::string& name) const {
    for (const SampleSeries& series : Store::open(path(out)).samples(cell.id)) {
      if (series.name == name) return series.values;
    }
    ADD_FAILURE() << "no samples " << name;
    return {};
  }
};

// A hand that moves on at 1 m/s and a ball that comes with it or stays where it is; `count` more balls far away.
std::string drifting(double ball_speed, int count = 0) {
  std::string bodies, velocities = "0 1 0 0 0 0 0 " + std::to_string(ball_speed) + " 0 0 0 0", positions;
  positions = "0 0 0 1 0 0 0 0.3 0 0 1 0 0 0";
  for (int i = 0; i < count; ++i) {
    const std::string x = std::to_string(10 + i);
    bodies.append("<body name='b").append(x).append("' pos='").append(x);
    bodies.append(" 0 0'><freejoint/><geom size='0.1' mass='1'/></body>");
    positions.append(" ").append(x).append(" 0 0 1 0 0 0");
    velocities += " 0 0 0 0 0 0";
  }
  return "<mujoco><option gravity=\"0 0 0\"/><worldbody><body name=\"hand\"><freejoint/><geom size=\"0.1\" mass=\"1\" "
         "contype=\"0\" conaffinity=\"0\"/>"
         "</body><body name=\"ball\" pos=\"0.3 0 0\"><freejoint/><geom size=\"0.1\" mass=\"1\" contype=\"0\" "
         "conaffinity=\"0\"/></body>" +
         bodies + "</worldbody><keyframe><key qpos=\"" + positions + "\" qvel=\"" + velocities +
         "\"/></keyframe></mujoco>";
}

TEST_F(MeasuresRunTest, AGraspIsHeldOrDroppedWhenItHasToBe) {
  write("held.xml", drifting(1));
  write("lost.xml", drifting(0));
  const std::string grasp = "grasp = {object = \"ball\", hand = \"hand\", drop_m = 0.25}\nduration_s = 0.512\n";
  const Campaign both = campaign(
      "name = \"grasp\"\ncontenders = [\"mujoco-euler\", \"broken\"]\ntimesteps_ms = [1, 4, 16]\nmeasures = "
      "[\"grasp\"]\n"
      "[[contender]]\nname = \"broken\"\nbase = \"mishap\"\nset = {fault = \"nan\"}\n"
      "[[system]]\nname = \"held\"\nmodel = \"./held.xml\"\n" +
      grasp + "[[system]]\nname = \"lost\"\nmodel = \"./lost.xml\"\n" + grasp);
  const RunSummary summary = run(both, "out");
  EXPECT_EQ(summary.done_now, 12);
  for (const double timestep : {1.0, 4.0, 16.0}) {
    const Cell held = find("out", "held", "mujoco-euler", "grasp", timestep);
    EXPECT_EQ(number(held, "grasp_held"), 1);
    EXPECT_NEAR(number(held, "grasp_slip"), 0, 1e-12);
    EXPECT_FALSE(value(held, "drop_time"));
    const Cell lost = find("out", "lost", "mujoco-euler", "grasp", timestep);
    EXPECT_EQ(lost.outcome, Outcome::kOk) << "a drop is a result";
    EXPECT_EQ(number(lost, "grasp_held"), 0);
    EXPECT_NEAR(number(lost, "grasp_slip"), 0.512, 1e-9);
    // whatever the campaign stores: the first instant beyond 0.25 s, and not the first sample
    EXPECT_NEAR(number(lost, "drop_time"), timestep > 4 ? 0.256 : 0.25, 1.001e-3 * timestep);
  }
  // Nobody holds what he has made explode.
  for (const double timestep : {1.0, 4.0, 16.0}) {
    const Cell broken = find("out", "held", "broken", "grasp", timestep);
    EXPECT_EQ(outcome_text(broken.outcome), "diverged");
    EXPECT_EQ(number(broken, "grasp_held"), 0);
    EXPECT_FALSE(value(broken, "largest_stable_timestep"));
  }
  EXPECT_EQ(number(find("out", "held", "mujoco-euler", "grasp", 16), "largest_stable_timestep"), 16);
  EXPECT_EQ(number(find("out", "held", "mujoco-euler", "grasp", 16), "stable_up_to_timestep"), 16);
  for (const double timestep : {1.0, 4.0, 16.0}) {
    EXPECT_FALSE(value(find("out", "lost", "mujoco-euler", "grasp", timestep), "largest_stable_timestep"));
  }
}

// The ball and the hand fly apart with the difference of their perturbed velocities.
TEST_F(MeasuresRunTest, AGraspFromSeveralInitialStatesIsAProbability) {
  write("held.xml", drifting(1));
  const Campaign many = campaign(
      "name = \"grasp\"\ncontenders = [\"mujoco-euler\"]\ntimesteps_ms = [1, 16]\nmeasures = [\"grasp\"]\n"
      "[[system]]\nname = \"held\"\nmodel = \"./held.xml\"\ninitial_states = 12\nduration_s = 0.512\n"
      "perturbation = {velocity = 0.5, spin = 0, rotation = 0, position = 0}\n"
      "grasp = {object = \"ball\", hand = \"hand\", drop_m = 0.25}\n");
  run(many, "out");
  const CampaignSystem& system = many.systems.front();
  int held = 0;
  for (int i = 0; i < 12; ++i) {
    const State start = initial_state(system.model, system.initial_states, i);
    const Vec3 apart = start.bodies[1].v_WBcm - start.bodies[0].v_WBcm;
    if (0.512 * apart.norm() < 0.25) ++held;
  }
  ASSERT_TRUE(0 < held && held < 12) << held;
  const Cell cell = find("out", "held", "mujoco-euler", "grasp", 16);
  EXPECT_EQ(cell.outcome, Outcome::kOk);
  EXPECT_DOUBLE_EQ(number(cell, "grasp_held"), held / 12.0);
  const Interval expected = probability(held, 12);
  const Value* share = find_value(cell, "grasp_held");
  ASSERT_NE(share, nullptr);
  EXPECT_EQ(share->low, expected.low);
  EXPECT_EQ(share->high, expected.high);
  EXPECT_EQ(samples("out", cell, "grasp_held of states").size(), 12U);
  EXPECT_EQ(samples("out", cell, "grasp_held of states").front(), 1) << "the model's own state";
  EXPECT_FALSE(value(cell, "largest_stable_timestep")) << "it did not hold from all of them";
}

TEST_F(MeasuresRunTest, PiecesOfSeveralLengthsFromSeveralInitialStates) {
  const Campaign pieces = campaign(
      "name = \"pieces\"\ncontenders = [\"mujoco-euler\", \"bullet-si-f32\"]\ntimesteps_ms = [\"1/2\", 1, 4, 16]\n"
      "reference_ms = \"1/2\"\nreference_single_ms = 1\nmeasures = [\"consistency\", \"violation\"]\n"
      "[[system]]\nname = \"planar-chain\"\nduration_s = 0.256\ninitial_states = 3\npieces = 7\n"
      "piece_ms = [64, 8, 128]\n");
  const RunSummary first = run(pieces, "out");
  for (const auto& [outcome, count] : first.outcomes) EXPECT_EQ(outcome, "ok") << count;
  const Cell cell = find("out", "planar-chain", "mujoco-euler", "consistency", 4);
  EXPECT_EQ(samples("out", cell, "piece_error_m").size(), 7U);
  EXPECT_THAT(samples("out", cell, "piece_state"), ::testing::ElementsAre(0, 1, 2, 0, 1, 2, 0));
  EXPECT_EQ(samples("out", cell, "piece_error_m 8 ms").size(), 7U) << "on the way of the main ones";
  EXPECT_EQ(samples("out", cell, "piece_error_m 128 ms").size(), 4U) << "about as much simulated time";
  EXPECT_LT(number(cell, "consistency_8ms"), number(cell, "consistency"));
  EXPECT_LT(number(cell, "consistency"), number(cell, "consistency_128ms"));
  EXPECT_FALSE(value(find("out", "planar-chain", "mujoco-euler", "consistency", 16), "consistency_8ms"))
      << "shorter than a step";
  // The precision's own reference.
  EXPECT_LT(number(find("out", "planar-chain", "mujoco-euler", "consistency", 0.5), "restart_floor"), 1e-12);
  EXPECT_FALSE(value(find("out", "planar-chain", "mujoco-euler", "consistency", 1), "restart_floor"));
  EXPECT_TRUE(value(find("out", "planar-chain", "bullet-si-f32", "consistency", 1), "restart_floor"));
  const Store store = Store::open(path("out"));
  for (const Cell& each : store.cells()) {
    EXPECT_FALSE(each.contender == "bullet-si-f32" && each.measure == "consistency" && each.timestep_ms < 1);
  }
  const Cell violation = find("out", "planar-chain", "bullet-si-f32", "violation", 4);
  EXPECT_EQ(samples("out", violation, "joint_dislocation_max of states").size(), 3U);
  const Value* mean = find_value(violation, "joint_dislocation_max");
  ASSERT_NE(mean, nullptr);
  ASSERT_TRUE(mean->value);
  EXPECT_LE(mean->low.value_or(1), mean->value.value_or(0));
  EXPECT_GE(mean->high.value_or(0), mean->value.value_or(1));
  // Each state's fine-step run is kept, so that what was interrupted goes on from there, what was seen between its
  // samples, and each contender's pieces that start as cold.
  EXPECT_EQ(std::distance(fs::directory_iterator(store.trajectories_dir()), fs::directory_iterator()), 6 + 6 + 2);
  EXPECT_EQ(run(pieces, "out").done_now, 0);
}

TEST_F(MeasuresRunTest, AGraspNamesItsBodies) {
  write("held.xml", drifting(1));
  const auto message = [&](const std::string& grasp) {
    try {
      campaign(
          "name = \"grasp\"\ncontenders = [\"mujoco-euler\"]\ntimesteps_ms = [1]\nmeasures = [\"grasp\"]\n"
          "[[system]]\nname = \"held\"\nmodel = \"./held.xml\"\nduration_s = 0.5\n" +
          grasp);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(message("grasp = {object = \"ball\", hand = \"hand\"}"), "no error");
  EXPECT_THAT(message(""), HasSubstr("who is to stay in whose hand"));
  EXPECT_THAT(message("grasp = {object = \"bal\", hand = \"hand\"}"), HasSubstr("did you mean 'ball'"));
  EXPECT_THAT(message("grasp = {object = \"ball\"}"), HasSubstr("no 'hand'"));
  EXPECT_THAT(message("grasp = {object = \"ball\", hand = \"ball\"}"), HasSubstr("same body"));
  EXPECT_THAT(message("grasp = {object = \"ball\", hand = \"hand\", drop_m = -1}"), HasSubstr("drop_m"));
  EXPECT_THAT(message("grasp = \"ball\""), HasSubstr("give {object"));
}

TEST_F(MeasuresRunTest, ScalingHasAnExponentForEachFamilyAndContender) {
  std::string text =
      "name = \"scaling\"\ncontenders = [\"mujoco-euler\", \"ode-quick\"]\ntimesteps_ms = [10]\nreference_ms = 10\n"
      "measures = [\"scaling\"]\n";
  for (const int bodies : {10, 40, 160}) {
    const std::string name = "balls-" + std::to_string(bodies);
    write(name + ".xml", drifting(1, bodies - 2));
    text.append("[[system]]\nname = '").append(name).append("'\nmodel = './").append(name);
    text.append(".xml'\nfamily = 'balls'\ncontacts = false\nduration_s = 10\n");
  }
  const Campaign scaled = campaign(text);
  run(scaled, "out");
  for (const char* contender : {"mujoco-euler", "ode-quick"}) {
    EXPECT_LT(number(find("out", "balls-10", contender, "scaling", 10), "run_time"),
              number(find("out", "balls-160", contender, "scaling", 10), "run_time"));
    const Cell largest = find("out", "balls-160", contender, "scaling", 10);
    EXPECT_EQ(samples("out", largest, "run_time_s").size(), 5U);
    EXPECT_NEAR(number(largest, "steps_per_second") * number(largest, "run_time"), 1000, 1e-6);
    const double exponent = number(largest, "scaling_exponent");
    EXPECT_GT(exponent, 0.3);
    EXPECT_LT(exponent, 3);
    EXPECT_FALSE(value(find("out", "balls-40", contender, "scaling", 10), "scaling_exponent")) << "told once";
  }
  // Of each run its last state is kept: without forces every ball has gone straight on for 10 s.
  const Store store = Store::open(path("out"));
  ASSERT_EQ(store.runs().size(), 6U);
  for (const RunRow& row : store.runs()) {
    EXPECT_EQ(row.timestep_ms, 10);
    EXPECT_EQ(count_states(store.trajectories_dir(), row.address), 1U);
    const auto kept = read_trajectory(store.trajectories_dir(), row.address);
    const std::vector<State> states = kept.value_or(Trajectory{}).states;
    ASSERT_EQ(states.size(), 1U) << row.system << " " << row.contender;
    const auto system = std::ranges::find(scaled.systems, row.system, &CampaignSystem::name);
    const State& start = system->model.initial;
    const State& end = states.front();
    EXPECT_NEAR(end.time, 10, 1e-9);
    ASSERT_EQ(end.bodies.size(), start.bodies.size());
    double farthest = 0;
    for (size_t i = 0; i < end.bodies.size(); ++i) {
      const Vec3 straight = start.bodies[i].p_WBcm + 10 * start.bodies[i].v_WBcm;
      EXPECT_LT((end.bodies[i].p_WBcm - straight).norm(), 1e-6) << row.system << " " << row.contender << " " << i;
      farthest = std::max(farthest, (end.bodies[i].p_WBcm - start.bodies[i].p_WBcm).norm());
    }
    EXPECT_GT(farthest, 0.1) << "something has moved";
  }
  // A family is measured on one machine.
  std::set<int> shards;
  for (const PlannedCell& cell : make_plan(scaled, 3).cells) shards.insert(cell.shard);
  EXPECT_EQ(shards.size(), 1U);
}

constexpr const char* kChain = R"(
name = "chain"
timesteps_ms = ["1/4", 1, 4]
reference_ms = "1/4"
measures = ["drift", "violation", "agreement"]
[[contender]]
name = "first"
base = "mujoco-rk4"
[[contender]]
name = "second"
base = "mujoco-rk4"
[[contender]]
name = "cartesian"
base = "ode-quick"
[[system]]
name = "planar-chain"
duration_s = 1.024
)";

TEST_F(MeasuresRunTest, AgreementIsAMatrixOverTime) {
  run(campaign(kChain), "out");
  const Cell first = find("out", "planar-chain", "first", "agreement", 0.25);
  const Cell cartesian = find("out", "planar-chain", "cartesian", "agreement", 0.25);
  const std::vector<double> same = samples("out", first, "distance_m second");
  EXPECT_THAT(same, ::testing::Each(0.0)) << "one contender under two names";
  EXPECT_DOUBLE_EQ(samples("out", first, "parting_time_s second").front(), 1.024) << "they never part";
  const std::vector<double> apart = samples("out", first, "distance_m cartesian"),
                            time = samples("out", first, "time_s");
  EXPECT_EQ(apart, samples("out", cartesian, "distance_m first")) << "it is symmetric";
  ASSERT_EQ(apart.size(), time.size());
  EXPECT_LE(time.size(), 64U);
  EXPECT_LT(apart.front(), 1e-6) << "all start from one state";
  EXPECT_GT(*std::ranges::max_element(apart), 1e-6);
  EXPECT_GT(number(cartesian, "agreement"), 0);
  EXPECT_LE(number(cartesian, "parting_time"), 1.024);
}

TEST_F(MeasuresRunTest, ViolationAndDampingOfTheChain) {
  run(campaign(kChain), "out");
  for (const double timestep : {0.25, 1.0, 4.0}) {
    const Cell joints = find("out", "planar-chain", "first", "violation", timestep);
    EXPECT_LT(number(joints, "joint_dislocation_max"), 1e-12) << "joint coordinates cannot dislocate";
    EXPECT_LT(number(joints, "joint_misalignment_max"), 1e-12);
    EXPECT_FALSE(value(joints, "limit_violation_max")) << "it has no limits";
    EXPECT_FALSE(value(joints, "penetration_max")) << "nor contacts";
    const Cell bodies = find("out", "planar-chain", "cartesian", "violation", timestep);
    EXPECT_GT(number(bodies, "joint_dislocation_max"), 1e-9);
    EXPECT_LE(number(bodies, "joint_dislocation_rms"), number(bodies, "joint_dislocation_max"));
    // What damps shows in energy and rate alike: E(T) = E(0) exp(-2 c T).
    const Cell drift = find("out", "planar-chain", "cartesian", "drift", timestep);
    const double lost = number(drift, "energy_drift_relative"), rate = number(drift, "damping_rate");
    EXPECT_LT(std::abs(2 * rate * 1.024), 3 * lost);
  }
  EXPECT_LT(std::abs(number(find("out", "planar-chain", "first", "drift", 0.25), "damping_rate")), 1e-8);
}

TEST_F(MeasuresRunTest, ReferencesServeLaterCampaigns) {
  run(campaign(kChain), "one", "kept");
  EXPECT_EQ(std::distance(fs::directory_iterator(path("kept")), fs::directory_iterator()), 2 * 2)
      << "two contenders are one; each run and what was seen between its samples";
  // Another campaign of the same system: its references are there already.
  std::string text = kChain;
  const auto change = [&](const std::string& before, const std::string& after) {
    text.replace(text.find(before), before.size(), after);
  };
  change("\"chain\"", "\"again\"");
  change("\"drift\", ", "");
  run(campaign(text), "two", "kept");
  for (const char* contender : {"first", "second", "cartesian"}) {
    EXPECT_GT(find("one", "planar-chain", contender, "reference", 0.25).engine_s, 0);
    EXPECT_EQ(find("two", "planar-chain", contender, "reference", 0.25).engine_s, 0) << "no step was taken";
    EXPECT_EQ(find("two", "planar-chain", contender, "reference", 0.25).outcome, Outcome::kOk);
    EXPECT_EQ(value(find("one", "planar-chain", contender, "agreement", 0.25), "agreement"),
              value(find("two", "planar-chain", contender, "agreement", 0.25), "agreement"));
    EXPECT_EQ(value(find("one", "planar-chain", contender, "violation", 0.25), "joint_dislocation_max"),
              value(find("two", "planar-chain", contender, "violation", 0.25), "joint_dislocation_max"));
  }
}

// One whose reference fails is missing from the others' comparison and no more than that.
TEST_F(MeasuresRunTest, AgreementDoesWithoutAContenderThatFails) {
  run(campaign("name = \"fails\"\ncontenders = [\"mujoco-euler\", \"ode-quick\", \"broken\"]\ntimesteps_ms = [1]\n"
               "reference_ms = 1\nmeasures = [\"agreement\"]\n[[contender]]\nname = \"broken\"\nbase = \"mishap\"\n"
               "set = {fault = \"crash\"}\n[[system]]\nname = \"planar-chain\"\nduration_s = 0.1\n"),
      "out");
  const Cell broken = find("out", "planar-chain", "broken", "agreement", 1);
  EXPECT_EQ(outcome_text(broken.outcome), "crashed");
  EXPECT_THAT(broken.reason, HasSubstr("its reference run"));
  const Cell sound = find("out", "planar-chain", "mujoco-euler", "agreement", 1);
  EXPECT_EQ(outcome_text(sound.outcome), "ok") << sound.reason;
  std::vector<std::string> names;
  for (const SampleSeries& series : Store::open(path("out")).samples(sound.id)) names.push_back(series.name);
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("distance_m ode-quick", "parting_time_s ode-quick", "time_s"));
}

// Torques that start a motion from rest are no instability.
TEST_F(MeasuresRunTest, AControlledMotionIsNotUnstable) {
  write("arm.xml", R"(<mujoco><option gravity="0 0 0"/><default><geom contype="0" conaffinity="0"/></default><worldbody>
    <body name="upper"><joint name="shoulder" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02"/>
      <body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02"/></body></body></worldbody></mujoco>)");
  run(campaign("name = \"driven\"\ncontenders = [\"mujoco-rk4\"]\ntimesteps_ms = [1, 4]\nmeasures = [\"violation\"]\n"
               "[[system]]\nname = \"arm\"\nmodel = \"./arm.xml\"\nduration_s = 0.512\n"
               "control = {kind = \"sine\", amplitude = 0.2, frequency = 2}\n"),
      "out");
  for (const double timestep : {1.0, 4.0}) {
    const Cell cell = find("out", "arm", "mujoco-rk4", "violation", timestep);
    EXPECT_EQ(outcome_text(cell.outcome), "ok") << cell.reason;
  }
}

}  // namespace
}  // namespace assay
