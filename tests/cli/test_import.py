"""`assay import`: what Isaac Lab or unitree_rl_lab wrote as a policy's configuration, files that are none, and hostile ones."""

import os
import pathlib
import tomllib

import onnx_file
from harness import SOURCE, AssayTest, main, read_csv

CART_POLE = SOURCE / "examples/cart-pole-policy/cart_pole.xml"

# In the words of Isaac Lab's dump, by hand: tuples, slices, nulls.
CART_ENV = """viewer:
  eye: !!python/tuple
  - 7.5
  - 7.5
  - 7.5
sim:
  dt: 0.005
  gravity: !!python/tuple
  - 0.0
  - 0.0
  - -9.81
decimation: 4
scene:
  robot:
    init_state:
      joint_pos:
        slider: 0.0
        hinge: 0.0
    actuators:
      cart:
        class_type: isaaclab.actuators.actuator_pd:ImplicitActuator
        joint_names_expr:
        - slider
        effort_limit_sim: 10.0
        stiffness: 0.0
        damping: 0.0
      pole:
        class_type: isaaclab.actuators.actuator_pd:ImplicitActuator
        joint_names_expr:
        - hin.*
        stiffness: 0.0
        damping: 0.0
observations:
  policy:
    concatenate_terms: true
    enable_corruption: false
    history_length: null
    joint_pos_rel:
      func: isaaclab.envs.mdp.observations:joint_pos_rel
      params: {}
      noise: null
      clip: null
      scale: null
      history_length: 0
    joint_vel_rel:
      func: isaaclab.envs.mdp.observations:joint_vel_rel
      params: {}
      scale: 5.0e-02
actions:
  joint_effort:
    class_type: isaaclab.envs.mdp.actions.joint_actions:JointEffortAction
    asset_name: robot
    clip: null
    joint_names:
    - slider
    scale: 10.0
    offset: 0.0
    preserve_order: false
events:
  reset_cart_position:
    func: isaaclab.envs.mdp.events:reset_joints_by_offset
    params:
      asset_cfg: &id001
        name: robot
        joint_ids: !!python/object/apply:builtins.slice
        - null
        - null
        - null
    mode: reset
terminations:
  time_out:
    func: isaaclab.envs.mdp.terminations:time_out
    params: {}
  cart_out_of_bounds:
    func: isaaclab.envs.mdp.terminations:joint_pos_out_of_manual_limit
    params:
      asset_cfg:
        name: robot
        joint_names:
        - slider
      bounds: !!python/tuple
      - -2.4
      - 2.4
"""

# Two legs on a free base: depth first hip, knee of one leg, then those of the other.
LEGS = """<mujoco model="legs">
  <compiler angle="radian"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="base" pos="0 0 0.5">
      <freejoint/>
      <geom name="trunk" type="box" size="0.2 0.1 0.05" mass="5" pos="0.03 0 0"/>
      <body name="left_thigh" pos="0 0.1 0">
        <joint name="left_hip" axis="0 1 0" armature="0.01"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.5"/>
        <body name="left_shank" pos="0 0 -0.2">
          <joint name="left_knee" axis="0 1 0" armature="0.01"/>
          <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.3"/>
        </body>
      </body>
      <body name="right_thigh" pos="0 -0.1 0">
        <joint name="right_hip" axis="0 1 0" armature="0.01"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.5"/>
        <body name="right_shank" pos="0 0 -0.2">
          <joint name="right_knee" axis="0 1 0" armature="0.01"/>
          <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.3"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="left_hip"/><motor joint="left_knee"/><motor joint="right_hip"/><motor joint="right_knee"/>
  </actuator>
</mujoco>
"""

LEGS_ENV = """sim:
  dt: 0.005
  physx:
    solver_type: 1
decimation: 4
scene:
  robot:
    init_state:
      pos: !!python/tuple [0.0, 0.0, 0.4]
      joint_pos:
        .*_hip: 0.4
        left_knee: -0.8
        right_knee: -0.9
      joint_vel:
        .*: 0.0
    actuators:
      legs:
        class_type: isaaclab.actuators.actuator_pd:DCMotor
        joint_names_expr: [.*]
        effort_limit: 23.5
        saturation_effort: 23.5
        velocity_limit: 30.0
        stiffness:
          .*_hip: 25.0
          .*_knee: 40.0
        damping: 0.5
        armature: 0.01
  terrain:
    terrain_type: plane
observations:
  policy:
    concatenate_terms: true
    enable_corruption: true
    history_length: 3
    flatten_history_dim: true
    base_lin_vel:
      func: isaaclab.envs.mdp.observations:base_lin_vel
      params: {}
      noise: {func: isaaclab.utils.noise.noise_model:uniform_noise, n_min: -0.1, n_max: 0.1}
    base_ang_vel:
      func: isaaclab.envs.mdp.observations:base_ang_vel
      params: {}
      scale: !!python/tuple [0.25, 0.25, 0.5]
      clip: !!python/tuple [-10.0, 10.0]
    velocity_commands:
      func: isaaclab.envs.mdp.observations:generated_commands
      params: {command_name: base_velocity}
    knees:
      func: isaaclab.envs.mdp.observations:joint_pos_rel
      params:
        asset_cfg: {name: robot, joint_names: [right_knee, left_knee], preserve_order: true}
    actions:
      func: isaaclab.envs.mdp.observations:last_action
      params: {}
actions:
  joint_pos:
    class_type: isaaclab.envs.mdp.actions.joint_actions:JointPositionAction
    asset_name: robot
    clip: null
    joint_names: [.*]
    scale: {.*_hip: 0.25, .*_knee: 0.5}
    use_default_offset: true
commands:
  base_velocity:
    class_type: isaaclab.envs.mdp.commands.velocity_command:UniformVelocityCommand
    heading_command: false
    ranges:
      lin_vel_x: !!python/tuple [-1.0, 1.0]
      lin_vel_y: !!python/tuple [-0.5, 0.5]
      ang_vel_z: !!python/tuple [-1.0, 1.0]
events:
  push_robot:
    func: isaaclab.envs.mdp.events:push_by_setting_velocity
    params: {}
terminations:
  fallen:
    func: isaaclab.envs.mdp.terminations:root_height_below_minimum
    params: {minimum_height: 0.2}
  tilted:
    func: isaaclab.envs.mdp.terminations:bad_orientation
    params: {limit_angle: 0.7}
  base_contact:
    func: isaaclab.envs.mdp.terminations:illegal_contact
    params: {threshold: 1.0}
"""


class Import(AssayTest):
    def setUp(self):
        super().setUp()
        self.write("cart_pole.xml", CART_POLE.read_text())
        self.write("legs.xml", LEGS)

    def imported(self, text, robot, *more):
        """The configuration as a dictionary, and what was left out by path."""
        self.write("env.yaml", text)
        told = self.assay_json("import", "env.yaml", robot, "--out", "policy.toml", "--json", *more)
        return tomllib.loads((self.dir / "policy.toml").read_text()), {each["path"]: each["meaning"] for each in told["left_out"]}

    def is_refused(self, text, robot, *more, naming):
        self.write("env.yaml", text)
        sentence = self.refused("import", "env.yaml", robot, "--out", "policy.toml", *more, naming=naming)
        self.assertFalse((self.dir / "policy.toml").exists())
        return sentence


class CartPole(Import):
    def test_its_own_conventions(self):
        """What the example's configuration says by hand follows from the training's environment."""
        config, left_out = self.imported(CART_ENV, "cart_pole.xml")
        self.assertEqual(config["control"], {"timestep_ms": 5, "decimation": 4})
        self.assertEqual(config["joints"], ["slider", "hinge"])
        self.assertEqual(config["observations"]["terms"],
                         [{"term": "joint_pos_rel"}, {"term": "joint_vel_rel", "scale": 0.05}])
        self.assertEqual(config["actions"], {"type": "joint_effort", "joints": ["slider"], "scale": 10, "offset": 0})
        self.assertEqual(config["pd"], {"effort_limit": 10})
        self.assertEqual(config["termination"], {"joint_outside": {"slider": [-2.4, 2.4]}})
        self.assertIn("events.reset_cart_position", left_out)

    def test_terms_of_different_histories(self):
        self.is_refused(CART_ENV.replace("history_length: 0", "history_length: 3\n      flatten_history_dim: true"), "cart_pole.xml",
                        naming=["joint_vel_rel", "a history of 1 steps where others have 3"])

    def test_the_result_drives_the_robot(self):
        self.imported(CART_ENV, "cart_pole.xml")
        self.write("push.csv", "slider\n1\n")
        text = self.assay("simulate", "cart_pole.xml", "--policy-config", "policy.toml", "--policy", "push.csv", "--engine",
                          "mujoco-euler", "--timestep", "5", "--duration", "0.1", "--out", "-")
        self.assertIn("cart", text)

    def test_standard_output_has_the_configuration_alone(self):
        self.write("env.yaml", CART_ENV)
        text = self.assay("import", "env.yaml", "cart_pole.xml", "--out", "-")
        self.assertEqual(tomllib.loads(text)["control"]["decimation"], 4)
        self.assertIn("# left out: events.reset_cart_position", text)

    def test_drives_beside_the_policy_are_the_robots(self):
        env = CART_ENV.replace("damping: 0.0\n      pole", "damping: 3.0\n      pole")
        config, left_out = self.imported(env, "cart_pole.xml")
        self.assertEqual(config["hold"], {"joints": ["slider"], "position": 0, "stiffness": 0, "damping": 3})
        self.assertIn("[hold]", left_out["scene.robot.actuators"])
        (self.dir / "policy.toml").unlink()
        stiff = env.replace("stiffness: 0.0\n        damping: 3.0", "stiffness: 5.0\n        damping: 3.0")
        self.is_refused(stiff, "cart_pole.xml", naming=["'slider'", "stiffness 5", "--ignore scene.robot.actuators.cart"])
        _, left_out = self.imported(stiff, "cart_pole.xml", "--ignore", "actuators.cart")
        self.assertIn("IGNORED", left_out["scene.robot.actuators.cart"])
        self.write("cart_pole.xml", CART_POLE.read_text().replace('name="slider"', 'name="slider" damping="3"'))
        _, left_out = self.imported(env, "cart_pole.xml")
        self.assertNotIn("scene.robot.actuators.cart", left_out)


    def test_joints_without_a_drive(self):
        env = CART_ENV.replace("        - slider\n        effort", "        - hinge\n        effort")
        pole = env.index("      pole:\n")
        env = env[:pole] + env[env.index("observations:\n"):]
        self.is_refused(env, "cart_pole.xml", naming=["no group", "'slider'"])


class Legs(Import):
    # A second term that holds the knees in a pose, as configurations of robots with an arm have it.
    HELD = (LEGS_ENV.replace("joint_names: [.*]\n", "joint_names: [.*_hip]\n", 1)
            .replace("\nactions:\n", "\nactions:\n  knees:\n    class_type: spot.mdp:ConstantPoseAction\n    asset_name: robot\n"
                     "    joint_names: [.*_knee]\n", 1))

    def test_joints_that_another_term_holds(self):
        self.is_refused(self.HELD, "legs.xml", naming=["'ConstantPoseAction'", "--ignore actions.knees", "held at their default"])
        env = self.HELD.replace("scale: {.*_hip: 0.25, .*_knee: 0.5}", "scale: 0.25")
        config, left_out = self.imported(env, "legs.xml", "--ignore", "actions.knees")
        self.assertIn("IGNORED", left_out["actions.knees"])
        self.assertEqual(config["actions"]["joints"], ["left_hip", "right_hip"])
        self.assertEqual(config["hold"], {"joints": ["left_knee", "right_knee"], "position": [-0.8, -0.9], "stiffness": 40,
                                          "damping": config["hold"]["damping"]})
        # the springs act: from the default pose the knees of a robot without gravity stay there, to rounding
        self.write("legs.xml", LEGS.replace("<compiler", '<option gravity="0 0 0"/><compiler').replace(
            "</mujoco>", '<keyframe><key qpos="0 0 5 1 0 0 0 0.4 -0.8 0.4 -0.9"/></keyframe></mujoco>'))
        self.write("still.csv", "left_hip,right_hip\n0,0\n")
        rows = read_csv(self.assay("simulate", "legs.xml", "--policy-config", "policy.toml", "--policy", "still.csv", "--engine",
                                   "mujoco-euler", "--timestep", "1", "--duration", "1", "--out", "-"))
        heights = [row["z"] for row in rows if row["body"] == "left_shank"]
        self.assertLess(abs(heights[-1] - heights[0]), 1e-9)

    def test_all_problems_at_once(self):
        env = (self.HELD.replace("dt: 0.005", "dt: 0").replace("lin_vel_x: !!python/tuple [-1.0, 1.0]", "lin_vel_x: fast")
               .replace("actuator_pd:DCMotor", "actuator_net:ActuatorNetLSTM"))
        sentence = self.is_refused(env, "legs.xml", naming=["problems:", "sim.dt", "'fast'", "'ActuatorNetLSTM'", "'ConstantPoseAction'"])
        self.assertIn("5 problems", sentence)  # the scale of joints that the other term holds is one

    def test_order_of_joints(self):
        breadth = ["left_hip", "right_hip", "left_knee", "right_knee"]
        config, _ = self.imported(LEGS_ENV, "legs.xml")
        self.assertEqual(config["joints"], breadth)
        self.assertEqual(config["default_joint_pos"], [0.4, 0.4, -0.8, -0.9])
        self.assertEqual(config["pd"]["stiffness"], [25, 25, 40, 40])
        self.assertEqual(config["actions"]["scale"], [0.25, 0.25, 0.5, 0.5])
        text = self.assay("import", "env.yaml", "legs.xml", "--out", "policy.toml")
        self.assertIn("breadth first", text)
        self.assertIn(", ".join(breadth), text)
        for given in ["left_hip,left_knee,right_hip,right_knee", "names.txt"]:
            self.write("names.txt", "left_hip\nleft_knee\nright_hip\nright_knee\n")
            config, _ = self.imported(LEGS_ENV, "legs.xml", "--joints", given)
            self.assertEqual(config["joints"], ["left_hip", "left_knee", "right_hip", "right_knee"])
            self.assertEqual(config["default_joint_pos"], [0.4, -0.8, 0.4, -0.9])
        self.is_refused_joints("left_hip,hip", naming=["'hip'", "'legs'"])
        self.is_refused_joints("left_hip,left_hip", naming=["'left_hip' twice"])

    def is_refused_joints(self, joints, naming):
        self.refused("import", "env.yaml", "legs.xml", "--out", "other.toml", "--joints", joints, naming=naming)

    def test_terms_command_and_falls(self):
        config, left_out = self.imported(LEGS_ENV, "legs.xml")
        observations = config["observations"]
        self.assertEqual((observations["history"], observations["history_layout"], observations["history_start"]),
                         (3, "term", "first"))
        terms = {term["term"]: term for term in observations["terms"]}
        self.assertEqual(list(terms), ["base_lin_vel", "base_ang_vel", "velocity_commands", "joint_pos_rel", "last_action"])
        self.assertEqual(terms["base_ang_vel"], {"term": "base_ang_vel", "scale": [0.25, 0.25, 0.5], "clip": [-10, 10]})
        self.assertEqual(terms["joint_pos_rel"]["joints"], ["right_knee", "left_knee"])  # the order is to be preserved
        self.assertEqual(config["command"]["velocity"], [0.5, 0, 0])
        self.assertEqual(config["termination"], {"base_height_below": 0.2, "base_tilt_above": 0.7})
        self.assertEqual(config["pd"]["law"], "explicit")
        self.assertEqual(config["trained_in"], "physx-art-tgs")
        for path, words in {"observations.policy.*.noise": "base_lin_vel", "commands.base_velocity.ranges": "--command",
                            "scene.robot.actuators.legs": "falls with its speed", "events.push_robot": "--push",
                            "terminations.base_contact": "no fall", "observations.policy.base_lin_vel": "centre of mass",
                            "scene.robot.init_state.joint_pos": "initial state"}.items():
            self.assertIn(words, left_out[path])
        self.assertNotIn("scene.robot.actuators.legs.armature", left_out)  # the robot has the same
        config, _ = self.imported(LEGS_ENV, "legs.xml", "--command", "-0.5,0.1,0.2", "--trained-in", "mujoco-euler")
        self.assertEqual(config["command"]["velocity"], [-0.5, 0.1, 0.2])
        self.assertEqual(config["trained_in"], "mujoco-euler")

    def test_drives_of_the_engine(self):
        implicit = LEGS_ENV.replace("DCMotor", "ImplicitActuator")
        config, left_out = self.imported(implicit, "legs.xml")
        self.assertEqual((config["pd"]["law"], config["pd"]["effort_limit"]), ("explicit", 23.5))
        self.assertIn('law = "engine"', left_out["scene.robot.actuators"])
        config, _ = self.imported(implicit.replace("        effort_limit: 23.5\n", ""), "legs.xml")
        self.assertEqual(config["pd"]["law"], "engine")
        self.assertNotIn("effort_limit", config["pd"])

    def test_observations_that_assay_does_not_have(self):
        scan = LEGS_ENV.replace("    actions:\n      func", "    height_scan:\n"
                                "      func: isaaclab.envs.mdp.observations:height_scan\n      params: {}\n    actions:\n      func")
        self.is_refused(scan, "legs.xml", naming=["'height_scan'", "observations.policy.height_scan", "COUNT"])
        config, left_out = self.imported(scan, "legs.xml", "--ignore", "height_scan=5")
        self.assertIn({"term": "constant", "values": [0] * 5}, config["observations"]["terms"])
        self.assertIn("IGNORED", left_out["observations.policy.height_scan"])
        self.write("env.yaml", LEGS_ENV)
        self.refused("import", "env.yaml", "legs.xml", "--out", "other.toml", "--ignore", "height_scan=5",
                     naming=["--ignore height_scan", "names nothing"])

    def test_what_would_make_another_policy_is_an_error(self):
        for old, new, naming in [
            ("actuator_pd:DCMotor", "actuator_net:ActuatorNetLSTM", ["'ActuatorNetLSTM'", "--ignore"]),
            ("actuator_pd:DCMotor", "actuator_pd:DelayedPDActuator\n        min_delay: 1\n        max_delay: 3", ["1 to 3 engine steps"]),
            ("    clip: null\n    joint_names: [.*]", "    clip: {.*: [-1.0, 1.0]}\n    joint_names: [.*]", ["actions.joint_pos.clip"]),
            ("JointPositionAction", "RelativeJointPositionAction", ["'RelativeJointPositionAction'"]),
            ("stiffness:\n          .*_hip: 25.0\n          .*_knee: 40.0", "stiffness: null", ["stiffness is null", "USD"]),
            ("        .*: 0.0\n", "        .*: 0.5\n", ["joint_vel", "default rates"]),
            ("concatenate_terms: true", "concatenate_terms: false", ["not concatenated"]),
            (".*_hip: 0.4", ".*_ankle: 0.4", ["'.*_ankle' matches no joint of 'legs'", "'left_hip'"]),
            ("left_knee: -0.8", ".*_knee: -0.8", ["two patterns", "'right_knee'"]),
            ("joint_names_expr: [.*]", "joint_names_expr: [.*_hip]", ["'.*_knee' matches no joint", "'right_hip'"]),
            ("joint_names_expr: [.*]", "joint_names_expr: [.*, left_.*]", ["'.*' and 'left_.*' both match", "'left_hip'"]),
            ("lin_vel_x: !!python/tuple [-1.0, 1.0]", "lin_vel_x: fast", ["lin_vel_x", "'fast'"]),
            ("dt: 0.005", "dt: 0", ["sim.dt", "positive"]),
            (".*_hip: 25.0", "'(': 25.0", ["no regular expression"]),
        ]:
            with self.subTest(new):
                self.assertIn(old, LEGS_ENV)
                self.is_refused(LEGS_ENV.replace(old, new), "legs.xml", naming=naming)

    def test_a_delay_of_whole_control_steps(self):
        config, _ = self.imported(
            LEGS_ENV.replace("DCMotor", "DelayedPDActuator\n        min_delay: 8\n        max_delay: 8"), "legs.xml")
        self.assertEqual(config["control"]["delay"], 2)


# The same training by unitree_rl_lab: the robot counts its motors leg by leg, the right one first.
DEPLOYED = """joint_ids_map: [2, 0, 3, 1]
step_dt: 0.02
stiffness: [25.0, 41.0, 26.0, 40.0]
damping: [0.5, 0.5, 0.5, 0.5]
default_joint_pos: [0.4, 0.4, -0.8, -0.9]
commands:
  base_velocity:
    ranges:
      lin_vel_x: [-1.0, 1.0]
      lin_vel_y: [-0.5, 0.5]
      ang_vel_z: [-1.0, 1.0]
      heading: null
actions:
  JointPositionAction:
    clip: null
    joint_names: [.*]
    scale: [0.25, 0.25, 0.5, 0.5]
    offset: [0.4, 0.4, -0.8, -0.9]
    joint_ids: !!python/object/apply:builtins.slice [null, null, null]
observations:
  base_ang_vel:
    params: {}
    clip: [-10.0, 10.0]
    scale: [0.25, 0.25, 0.5]
    history_length: 3
  velocity_commands:
    params: {command_name: base_velocity}
    clip: null
    scale: [1.0, 1.0, 1.0]
    history_length: 3
  joint_pos_rel:
    params:
      asset_cfg: {joint_ids: [3, 2]}
    clip: null
    scale: [1.0, 1.0]
    history_length: 3
  gait_phase:
    params: {period: 0.8}
    clip: null
    scale: [1.0, 1.0]
    history_length: 3
"""


class Deployed(Import):
    def setUp(self):
        super().setUp()
        self.write("legs.xml", LEGS.replace('<motor joint="left_hip"/><motor joint="left_knee"/><motor joint="right_hip"/><motor joint="right_knee"/>',
                                            '<motor joint="right_hip"/><motor joint="right_knee"/><motor joint="left_hip"/><motor joint="left_knee"/>'))

    def test_gains_by_motor_and_the_rest_by_the_policys_joints(self):
        config, left_out = self.imported(DEPLOYED, "legs.xml")
        self.assertEqual(config["joints"], ["left_hip", "right_hip", "left_knee", "right_knee"])
        self.assertEqual(config["pd"]["stiffness"], [26, 25, 40, 41])
        self.assertEqual(config["default_joint_pos"], [0.4, 0.4, -0.8, -0.9])
        self.assertEqual(config["actions"]["offset"], [0.4, 0.4, -0.8, -0.9])
        self.assertEqual(config["control"], {"period_ms": 20})
        self.assertEqual(config["command"]["velocity"], [0.5, 0, 0])
        observations = config["observations"]
        self.assertEqual((observations["history"], observations["history_layout"]), (3, "term"))
        self.assertEqual(observations["terms"], [
            {"term": "base_ang_vel", "scale": [0.25, 0.25, 0.5], "clip": [-10, 10]}, {"term": "velocity_commands", "scale": 1},
            {"term": "joint_pos_rel", "joints": ["right_knee", "left_knee"], "scale": 1},
            {"term": "phase", "period_s": 0.8, "scale": 1}])
        self.assertNotIn("joint_ids_map", left_out)  # breadth first in the tree is the same
        self.assertIn("explicit", left_out["stiffness"])

    def test_an_order_that_the_tree_contradicts_is_told(self):
        self.write("legs.xml", LEGS)
        config, left_out = self.imported(DEPLOYED, "legs.xml")
        self.assertEqual(config["joints"], ["right_hip", "left_hip", "right_knee", "left_knee"])
        self.assertIn("--joints", left_out["joint_ids_map"])
        config, _ = self.imported(DEPLOYED, "legs.xml", "--joints", "left_hip,right_hip,left_knee,right_knee")
        self.assertEqual(config["pd"]["stiffness"], [26, 25, 40, 41])

    def test_what_does_not_fit(self):
        self.is_refused(DEPLOYED.replace("[2, 0, 3, 1]", "[2, 0, 3, 3]"), "legs.xml", naming=["joint_ids_map", "no 1"])
        self.is_refused(DEPLOYED.replace("[2, 0, 3, 1]", "[1, 0, 2]"), "legs.xml", naming=["3 joints", "'legs' 4", "--joints"])
        self.is_refused(DEPLOYED.replace("stiffness: [25.0, ", "stiffness: ["), "legs.xml", naming=["stiffness", "3 numbers"])
        self.is_refused(DEPLOYED.replace("step_dt: 0.02\n", ""), "legs.xml", naming=["'step_dt'", "unitree_rl_lab"])
        self.is_refused(DEPLOYED.replace("gait_phase", "foot_forces"), "legs.xml", naming=["'foot_forces'", "COUNT"])
        self.is_refused(DEPLOYED.replace("[3, 2]", "[3, 4]"), "legs.xml", naming=["joint_ids", "from 0 to 3"])
        self.is_refused(DEPLOYED.replace("    clip: null\n    joint_names", "    clip: [[-1.0, 1.0]]\n    joint_names"), "legs.xml",
                        naming=["clip", "--ignore"])
        self.is_refused(DEPLOYED.replace("JointPositionAction", "JointEffortAction"), "legs.xml", naming=["JointPositionAction"])
        last = DEPLOYED[DEPLOYED.index("  gait_phase"):].replace("history_length: 3", "history_length: 2")
        self.is_refused(DEPLOYED[:DEPLOYED.index("  gait_phase")] + last, "legs.xml", naming=["2 steps", "3"])


class OtherFiles(Import):
    def test_files_that_are_none(self):
        for text, naming in [
            ("", ["env.yaml", "empty"]),
            ("[1, 2]\n", ["a list", "params/env.yaml"]),
            ("policy_path: walk.pt\nkps: [100, 100]\ndefault_angles: [0, 0]\n", ["no environment of Isaac Lab", "'sim'"]),
            ("a: [1, 2\nb: 3\n", ["env.yaml:", "no YAML"]),
            ("sim: {dt: 0.005}\nsim: {dt: 0.01}\n", ["'sim' is there twice"]),
            ("? [a, b]\n: 1\n", ["a key is a list"]),
            ("sim: {dt: 0.005}\ndecimation: 2\nscene: {}\nobservation_space: 48\naction_space: 12\n", ["direct workflow", "by hand"]),
            (CART_ENV.replace("decimation: 4\n", ""), ["no 'decimation'"]),
            (CART_ENV.replace("  policy:", "  critic:"), ["no group 'policy'", "--group"]),
        ]:
            with self.subTest(text[:30]):
                self.is_refused(text, "cart_pole.xml", naming=naming)

    def test_another_group(self):
        env = CART_ENV.replace("  policy:", "  student:")
        config, _ = self.imported(env, "cart_pole.xml", "--group", "student")
        self.assertEqual(len(config["observations"]["terms"]), 2)

    def test_a_network_that_does_not_fit(self):
        libraries = pathlib.Path(os.environ.get("ASSAY_TEST_CACHE", "/nowhere")) / "libraries"
        if not list(libraries.glob("onnxruntime-*")):
            self.skipTest("needs ONNX Runtime, which setup/setup.sh fetches")
        (self.dir / "cache/assay").mkdir(parents=True, exist_ok=True)
        (self.dir / "cache/assay/libraries").symlink_to(libraries)
        (self.dir / "walk.onnx").write_bytes(onnx_file.linear(3, 1, [1, 1, 1]))
        self.is_refused(CART_ENV, "cart_pole.xml", "--policy", "walk.onnx", naming=["walk.onnx", "3 numbers", "has 4"])
        (self.dir / "walk.onnx").write_bytes(onnx_file.linear(4, 1, [1, 1, 1, 1]))
        config, _ = self.imported(CART_ENV, "cart_pole.xml", "--policy", "walk.onnx")
        self.assertEqual(config["network"], "walk.onnx")


class Hostile(Import):
    def test_aliases_that_would_expand(self):
        """Each level ten aliases of the one before: 10^30 nodes if they were copied."""
        levels = "".join(f"l{i}: &l{i} [{', '.join([f'*l{i - 1}'] * 10)}]\n" for i in range(1, 30))
        config, _ = self.imported("l0: &l0 [1]\n" + levels + CART_ENV, "cart_pole.xml")
        self.assertEqual(config["control"]["decimation"], 4)

    def test_a_node_that_contains_itself(self):
        self.is_refused("&a\nsim: *a\ndecimation: 4\nscene: *a\nobservations: *a\nactions: *a\n", "cart_pole.xml", naming=["env.yaml"])

    def test_bytes(self):
        for content in [bytes(range(256)) * 8, b"\xff\xfe\x00\x01", b"sim: \x00\n", b"\x80abc: 1"]:
            (self.dir / "env.yaml").write_bytes(content)
            self.refused("import", "env.yaml", "cart_pole.xml", "--out", "policy.toml", naming=["env.yaml"])

    def test_depth_and_size(self):
        self.is_refused("[" * 200_000, "cart_pole.xml", naming=["env.yaml:1", "nested deeper than 100 levels"])
        self.is_refused("{a: " * 100_000, "cart_pole.xml", naming=["env.yaml:1", "nested deeper than 100 levels"])
        (self.dir / "env.yaml").write_bytes(b"a: b\n" * (2 << 20))
        self.refused("import", "env.yaml", "cart_pole.xml", "--out", "policy.toml", naming=["env.yaml", "at most 8 MiB"])
        self.refused("import", str(self.dir), "cart_pole.xml", "--out", "policy.toml", naming=["not a regular file"])
        self.refused("import", "missing.yaml", "cart_pole.xml", "--out", "policy.toml", naming=["missing.yaml", "cannot be read"])

    def test_a_pattern_that_takes_too_long_is_refused(self):
        self.is_refused(LEGS_ENV.replace("joint_names_expr: [.*]", "joint_names_expr: ['" + "([a-z_]*)*" * 12 + "[0-9]']"), "legs.xml",
                        naming=["env.yaml", "match limit exceeded", "simpler"])

    def test_nothing_is_constructed(self):
        self.is_refused(CART_ENV.replace("dt: 0.005", "dt: !!python/object/apply:os.system ['touch made']"), "cart_pole.xml",
                        naming=["sim.dt", "a Python object"])
        self.assertFalse((self.dir / "made").exists())


if __name__ == "__main__":
    main()
