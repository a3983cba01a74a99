"""`assay explain`: causes that were put in are named, equal contenders are no difference, and what cannot be asked is refused."""

import json
import re

from harness import AssayTest, main
from test_terminal import columns_of

# The example's robot with a damped hinge that has armature, a stop, and a motor for each joint.
ROBOT = """<mujoco model="cart-pole">
  <compiler autolimits="true" angle="radian"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="cart" pos="0 0 0.5">
      <joint name="slider" type="slide" axis="1 0 0" damping="1"/>
      <geom type="box" size="0.2 0.1 0.08" mass="1"/>
      <body name="pole">
        <joint name="hinge" type="hinge" axis="0 1 0" armature="0.05" damping="0.1" range="-3 3"/>
        <geom type="capsule" fromto="0 0 0 0 0 1" size="0.03" mass="0.1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="slider" ctrlrange="-10 10"/><motor joint="hinge" ctrlrange="-1 1"/></actuator>
</mujoco>
"""
QUICK = ["--control", "random", "--seeds", "4", "--seconds", "0.5", "--timestep", "4"]
POLICY = """joints = ["slider", "hinge"]
trained_in = "mujoco-euler"
[control]
timestep_ms = 5
decimation = 4
[observations]
[[observations.terms]]
term = "joint_pos"
[actions]
type = "joint_effort"
joints = ["slider"]
[termination]
joint_outside = {slider = [-0.5, 0.5]}
"""


class Explain(AssayTest):
    def setUp(self):
        super().setUp()
        self.write("cart_pole.xml", ROBOT)

    def explained(self, *arguments):
        return self.assay_json("explain", "cart_pole.xml", *arguments, *QUICK, "--json")

    def test_seeded_causes_are_named(self):
        for engine, change, cause in [("mujoco-euler", "armature=off", "armature"), ("dart", "gear:slider=-1", "gear"),
                                      ("simbody-euler", "delay=1", "control delay"), ("ode-step", "mass:pole=1.5", "mass")]:
            if engine not in self.contenders():
                continue
            with self.subTest(engine=engine, change=change):
                found = self.explained(engine, engine, "--change-b", change)
                self.assertEqual(found["advice"][0]["cause"], cause, json.dumps(found["causes"][:4], indent=1))
                self.assertEqual(found["verdict"], "explained")
                self.assertEqual(found["system"], "cart-pole")
                self.assertEqual(found["b"], {"contender": engine, "settings": {}, "changes": [change]})
                best = found["causes"][0]
                self.assertLessEqual(best["share"]["low"], best["share"]["value"])
                self.assertGreater(best["share"]["low"], 0.8)
                self.assertLess(found["remaining_m"]["high"], 0.1 * found["gap_m"]["low"])
                self.assertEqual(len(found["gaps_m"]), 4)
                self.assertEqual(found["parity"][0]["verdict"], "same")

    def test_equal_contenders_are_no_difference(self):
        found = self.explained("ode-quick", "ode-quick")
        self.assertEqual((found["verdict"], found["causes"], found["advice"]), ("no difference", [], []))
        text = self.assay("explain", "cart_pole.xml", "ode-quick", "ode-quick", *QUICK)
        self.assertIn("No difference: the runs agree", text)

    def test_two_engines_on_a_terminal(self):
        status, text = self.on_terminal("explain", "cart_pole.xml", "mujoco-euler", "mujoco-euler", *QUICK, "--change-b",
                                        "damping=3", "--jobs", "1")
        self.assertEqual(status, 0, text)
        for line in text.splitlines():
            for shown in re.split(r"\r(?:\x1b\[K)?", line):
                self.assertLessEqual(columns_of(shown), 80, line)
        lines = [line for line in re.sub(r"\x1b\[[0-9;]*[A-Za-z]", "", text).splitlines() if line.strip()]
        self.assertIn("1. Damping", text)
        # the last sentence says what remains
        self.assertRegex(" ".join(" ".join(lines).split())[-400:], r"The advice, checked: with --change-[ab] damping:?\S* .*"
                                                                   r"a gap of .* remains, \d+ % of it$")

    def test_recorded_actions_as_a_policy(self):
        self.write("policy.toml", POLICY)
        self.write("push.csv", "slider\n1\n-1\n1\n1\n")
        options = ["--policy", "push.csv", "--policy-config", "policy.toml", "--seeds", "3", "--seconds", "0.6"]
        found = self.assay_json("explain", "cart_pole.xml", "mujoco-euler", "mujoco-euler", *options, "--change-b", "delay=1",
                                "--json")
        self.assertEqual(found["advice"][0]["cause"], "control delay")
        self.assertEqual(found["timestep_ms"], 5)
        self.assertEqual(found["system"], "cart-pole")
        self.assertEqual((found["fall_rate_a"], found["fall_rate_b"]), (0, 0))

    def test_results_of_a_run(self):
        self.write("policy.toml", POLICY)
        self.write("push.csv", "slider\n1\n-1\n1\n1\n")
        self.assay("run", "cart_pole.xml", "--policy", "push.csv", "--policy-config", "policy.toml", "--contenders",
                   "mujoco-euler,mujoco-rk4", "--seeds", "3", "--seconds", "0.4", "--out", "results")
        found = self.assay_json("explain", "results", "mujoco-euler", "mujoco-rk4", "--seeds", "3", "--json")
        self.assertEqual((found["system"], found["timestep_ms"], found["seconds"]), ("cart-pole", 5, 0.4))
        self.refused("explain", "results", "mujoco-euler", "mujoco-rk5", naming=["'mujoco-rk5'"])
        self.refused("explain", "results", "mujoco-euler", "mujoco-rk4", "--system", "arm", naming=["'arm'", "policy"])
        self.refused("explain", "results", "mujoco-euler", "mujoco-rk4", "--control", "hold", naming=["--control"])
        self.refused("explain", "results", "mujoco-euler", "mujoco-rk4", "--ground", naming=["--ground"])

    def test_a_contender_that_crashes_ends_the_comparison_with_its_reason(self):
        self.use_mishap_engine()
        self.refused("explain", "cart_pole.xml", "mishap-none", "mishap-crash", *QUICK, status=1,
                     naming=["mishap-crash cannot be compared", "crashed", "SIGSEGV"])

    def test_refusals(self):
        ask = ["explain", "cart_pole.xml", "mujoco-euler"]
        self.refused(*ask, "mujoco-eler", naming=["'mujoco-eler'", "'mujoco-euler'"])
        self.refused(*ask, "dart", "--change-b", "armatur=off", naming=["'armatur'", "'armature'"])
        self.refused(*ask, "dart", "--change-b", "gear:knee=-1", naming=["'knee'", "cart-pole"])
        self.refused(*ask, "mujoco-rk4", "--change-b", "set:con=elliptic", naming=["'con'"])
        self.refused(*ask, "mujoco-rk4", "--change-b", "law=engine", naming=["law=engine"])
        self.refused(*ask, "mujoco-rk4", "--change-b", "timestep=0.3", naming=["timestep=0.3"])
        self.refused(*ask, "mujoco-rk4", "--system", "policy", naming=["--system policy"])
        self.refused(*ask, "mujoco-rk4", "--seconds", "0.001", naming=["--seconds"])
        self.refused(*ask, "mujoco-rk4", "--seeds", "0", naming=["--seeds"])
        (self.dir / "empty").mkdir()
        self.refused("explain", "empty", "mujoco-euler", "mujoco-rk4", naming=["empty"])
        self.refused("explain", "nowhere.xml", "mujoco-euler", "mujoco-rk4", naming=["nowhere.xml"])


if __name__ == "__main__":
    main()
