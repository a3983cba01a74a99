"""Policies as control: the example's cart-pole in the engines, and files that do not fit or are hostile."""

import json
import math
import os
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import unittest

import onnx_file
from harness import SOURCE, AssayTest, campaign, main, read_csv

EXAMPLE = SOURCE / "examples/cart-pole-policy"
LIBRARIES = pathlib.Path(os.environ.get("ASSAY_TEST_CACHE", "/nowhere")) / "libraries"
# of the example's observation: it pulls the cart against the pole's fall
BALANCING = onnx_file.linear(4, 1, [0.05, 3.0, 0.1, 0.6])
RUN = ["--engine", "mujoco-euler", "--timestep", "5", "--duration", "0.1", "--out", "-"]


@unittest.skipUnless(list(LIBRARIES.glob("onnxruntime-*")), "needs ONNX Runtime, which setup/setup.sh fetches")
class Policy(AssayTest):
    def setUp(self):
        super().setUp()
        cache = self.dir / "cache/assay"
        cache.mkdir(parents=True, exist_ok=True)
        (cache / "libraries").symlink_to(LIBRARIES)
        self.write("cart_pole.xml", (EXAMPLE / "cart_pole.xml").read_text())
        self.write("policy.toml", (EXAMPLE / "policy.toml").read_text())

    def network(self, content, name="policy.onnx"):
        (self.dir / name).write_bytes(content)

    def simulate(self, *more):
        return ["simulate", "cart_pole.xml", "--policy-config", "policy.toml", *more, *RUN]


class Networks(Policy):
    def test_a_network_drives_the_robot_in_closed_loop(self):
        self.network(BALANCING)
        options = ["--qpos", "tilted.txt", "--engine", "mujoco-euler", "--timestep", "5", "--duration", "4", "--sample", "20",
                   "--out", "-"]
        self.write("tilted.txt", "hinge=0.1\n")
        done = self.run_assay("simulate", "cart_pole.xml", "--policy-config", "policy.toml", "--time", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        heights = [row["z"] for row in read_csv(done.stdout) if row["body"] == "pole"]
        self.assertGreater(min(heights), 0.97)  # of the pole's centre, 1 m when it is upright
        self.assertIn("in 200 control steps", done.stderr)
        fallen = [row["z"] for row in read_csv(self.assay("simulate", "cart_pole.xml", "--control", "passive", *options))
                  if row["body"] == "pole"]
        self.assertLess(min(fallen), 0.5)

    def test_the_option_takes_the_place_of_the_files_network(self):
        self.network(BALANCING, "other.onnx")
        self.refused(*self.simulate(), naming=["policy.onnx", "cannot be read"])
        self.assay(*self.simulate("--policy", "other.onnx"))

    def test_recorded_actions(self):
        self.write("push.csv", "slider\n1\n1\n0\n")
        rows = [row for row in read_csv(self.assay(*self.simulate("--policy", "push.csv"))) if row["body"] == "cart"]
        # 10 N for 40 ms on 1.1 kg, of which a part turns the pole: then it coasts
        self.assertGreater(rows[8]["vx"], 0.3)
        self.assertAlmostEqual(rows[20]["vx"], rows[8]["vx"], delta=0.02)
        self.refused(*self.simulate("--policy", "other.csv"), naming=["other.csv", "cannot be read"])
        self.write("push.csv", "hinge\n1\n")
        self.refused(*self.simulate("--policy", "push.csv"), naming=["push.csv:1", "'hinge'", "policy.toml"])

    def test_an_action_that_is_no_number_ends_the_run_with_its_reason(self):
        # the logarithm of a number that is 0 at the start
        self.network(onnx_file.model(onnx_file.graph(
            [onnx_file.node("Log", ["obs"], ["log"]), onnx_file.node("ReduceSum", ["log"], ["actions"])], [],
            [onnx_file.port("obs", [1, 4])], [onnx_file.port("actions", [1, 1])])))
        sentence = self.run_assay(*self.simulate())
        self.assertEqual(sentence.returncode, 1)
        self.assertIn("the policy's action 1 of 1 ('slider') is -inf in control step 1", sentence.stderr)


class Refusals(Policy):
    def test_networks_that_do_not_fit(self):
        for content, naming in [
            (onnx_file.linear(3, 1, [1, 1, 1]), ["'obs'", "float [1, 3]", "3 numbers", "has 4"]),
            (onnx_file.linear(4, 2, [1] * 8), ["'actions'", "2 numbers", "has 1 action:"]),
            (onnx_file.linear(4, 1, [1] * 4, [1, -1]), ["float [1, ?]", "not fixed"]),
            (b"no network", ["policy.onnx", "cannot be used"]),
            (b"", ["policy.onnx", "cannot be used"]),
        ]:
            self.network(content)
            self.refused(*self.simulate(), naming=naming)
            # before anything is written
            self.refused("run", "cart_pole.xml", "--policy-config", "policy.toml", "--out", "results", naming=naming)
            self.assertFalse((self.dir / "results/assay.sqlite").exists())

    def test_options_that_contradict_each_other(self):
        self.network(BALANCING)
        self.refused("simulate", "cart_pole.xml", "--policy", "policy.onnx", *RUN, naming=["--policy-config"])
        self.refused(*self.simulate("--control", "passive"), naming=["--control passive", "--policy"])
        self.refused("run", "cart_pole.xml", "--seeds", "3", naming=["--seeds", "--policy-config"])
        self.refused("run", "cart_pole.xml", "--policy-config", "policy.toml", "--minutes", "1", naming=["--minutes"])

    def test_a_period_that_is_no_whole_number_of_timesteps(self):
        self.network(BALANCING)
        self.refused("simulate", "cart_pole.xml", "--policy-config", "policy.toml", "--engine", "mujoco-euler", "--timestep",
                     "3", "--duration", "0.3", "--out", "-", naming=["20 ms", "3 ms", "policy.toml"])
        self.refused("run", "cart_pole.xml", "--policy-config", "policy.toml", "--timesteps", "5,7", naming=["20 ms", "7 ms"])

    def test_campaigns_do_not_start_policies_in_the_middle(self):
        self.network(BALANCING)

        def cart(measure, control):
            return campaign("cart", [5], [measure], system="cart", model="./cart_pole.xml", control=control, duration_s=0.2, piece_ms=100)

        policy = {"kind": "policy", "config": "policy.toml"}
        self.write("cart.toml", cart("consistency", policy))
        self.refused("run", "cart.toml", "--out", "results", naming=["'consistency'", "middle of runs"])
        self.write("cart.toml", cart("transfer", "passive"))
        self.refused("run", "cart.toml", "--out", "results", naming=["has no policy", "transfer"])
        self.write("cart.toml", cart("transfer", policy))
        self.assay("run", "cart.toml", "--out", "results")


class Programme(Policy):
    def test_its_own_timesteps_are_around_that_of_training(self):
        self.write("policy.toml", (EXAMPLE / "policy.toml").read_text())
        self.network((EXAMPLE / "policy.onnx").read_bytes())
        text = self.assay("run", "cart_pole.xml", "--policy-config", "policy.toml", "--out", "results",
                          "--seconds", "1", "--seeds", "2", "--contenders", "mujoco-euler")
        self.assertIn("not settled: mujoco-euler at 2.5, 5, 10 ms", text)  # two runs settle nothing

    def test_parts_of_the_control_period_where_that_of_training_is_not_known(self):
        config = (EXAMPLE / "policy.toml").read_text()
        self.write("policy.toml", config.replace("timestep_ms = 5\ndecimation = 4", "period_ms = 20"))
        self.network((EXAMPLE / "policy.onnx").read_bytes())
        text = self.assay("run", "cart_pole.xml", "--policy-config", "policy.toml", "--out", "results",
                          "--seconds", "1", "--seeds", "2", "--contenders", "mujoco-euler")
        self.assertIn("not settled: mujoco-euler at 1, 2, 5 ms", text)


class Hostile(Policy):
    def test_a_network_that_never_ends_is_stopped(self):
        self.network(onnx_file.endless())
        self.refused(*self.simulate(), naming=["trying the control", "was stopped: it takes more than"])

    def test_a_network_that_takes_all_memory_is_refused_or_fails(self):
        self.network(onnx_file.huge(1 << 34))  # 64 GiB
        done = self.run_assay(*self.simulate())
        self.assertIn(done.returncode, (1, 2))
        # the address sanitizer ends a process that asks for so much
        self.assertRegex(done.stderr, "the policy's network failed|takes more than 2 GiB|cannot be used|ended the process early")


class OutsideFiles(Policy):
    def test_a_network_outside_the_configurations_folder(self):
        secret = self.write("elsewhere/actions.csv", "slider\n0\n")
        (self.dir / "mine").mkdir()
        for name in ["cart_pole.xml", "policy.toml"]:
            (self.dir / name).rename(self.dir / "mine" / name)
        config = self.dir / "mine/policy.toml"
        own = "\n".join(line for line in config.read_text().splitlines() if not line.startswith("network"))
        (self.dir / "mine/link.csv").symlink_to(secret)
        for network in ["/etc/passwd", "../elsewhere/actions.csv", str(secret), "link.csv"]:
            with self.subTest(network):
                config.write_text(f'network = "{network}"\n{own}\n')
                command = ["simulate", "mine/cart_pole.xml", "--policy-config", "mine/policy.toml", "--engine", "mujoco-euler",
                           "--timestep", 5, "--duration", 0.01, "--out", "-"]
                self.refused(*command, naming=["mine/policy.toml:1", f"'{network}'", "--allow-external-files"])
                if network.endswith(".csv"):  # the switch that the sentence names works
                    self.assertIn("pole", self.assay(*command, "--allow-external-files"))


class Parting(Policy):
    def test_what_parts_first_and_the_runs_that_show_it(self):
        """Without a push the pole falls, and two integrators part at its hinge; recorded actions need no network."""
        self.write("nothing.csv", "slider\n0\n")
        run = ["run", "cart_pole.xml", "--policy-config", "policy.toml", "--policy", "nothing.csv", "--out", "results", "--seeds", "4",
               "--seconds", "2", "--timesteps", "5", "--contenders", "mujoco-euler,mujoco-rk4"]
        text = self.assay(*run)
        self.assertIn("first to part", text)
        matrix = self.assay_json("transfer", "results", "--json")["systems"][0]
        self.assertEqual((matrix["trained_in"], matrix["trained_ms"]), ("mujoco-euler", 5))
        rows = {row["contender"]: row["parting"] for row in matrix["rows"]}
        self.assertEqual((rows["mujoco-euler"]["starts"], rows["mujoco-euler"]["parted"]), (4, 0))
        other = rows["mujoco-rk4"]
        self.assertEqual(other["starts"], 4)
        self.assertGreaterEqual(other["parted"], 3)  # all but the upright start, which may stay
        self.assertIn(other["body"], ("cart", "pole"))
        self.assertIn(other["joint"], ("slider", "hinge"))
        self.assertEqual(other["contact"], 0)  # the robot has none
        self.assertTrue(0 < other["first_s"] <= other["median_s"] < 2)
        with sqlite3.connect(self.dir / "results/assay.sqlite") as db:
            kept = db.execute("SELECT contender, timestep_ms FROM runs").fetchall()
        self.assertEqual(sorted(kept), [("mujoco-euler", 5), ("mujoco-rk4", 5)])
        self.assay("export", "results", "--trajectories", "csv", "--out", "states")
        self.assay("report", "results")
        self.assertIn('"transfer":[{', (self.dir / "results/report.html").read_text())
        done = self.run_assay(*run)
        self.assertIn("(0 now,", done.stdout)  # everything is there
        self.assertNotIn("trained in", done.stderr)

    def test_the_contender_of_training_is_missed(self):
        self.write("nothing.csv", "slider\n0\n")
        done = self.run_assay("run", "cart_pole.xml", "--policy-config", "policy.toml", "--policy", "nothing.csv", "--out", "results",
                              "--seeds", "1", "--seconds", "0.5", "--timesteps", "5", "--contenders", "mujoco-rk4")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(" ".join(done.stderr.split()), r"trained in 'mujoco-euler', which does not take part.*add it to the contenders")


class Pushed(Policy):
    def run_pushed(self, out, *more):
        self.write("nothing.csv", "slider\n0\n")
        return ["run", "cart_pole.xml", "--policy-config", "policy.toml", "--policy", "nothing.csv", "--out", out, "--seeds", "4",
                "--seconds", "2", "--timesteps", "5", "--contenders", "mujoco-euler,mujoco-rk4", *more]

    def test_every_contender_gets_the_same_pushes(self):
        text = self.assay(*self.run_pushed("pushed", "--push", "0.3", "--push-every", "0.5", "--push-joint", "hinge"))
        self.assertIn("pushes of 0.3 of the joint 'hinge' every 0.5 s", text)
        self.assertIn("0 of 2 contenders stay up at 5 ms", text)
        self.assay(*self.run_pushed("still"))
        pushed, still = (self.assay_json("transfer", out, "--json")["systems"][0] for out in ("pushed", "still"))
        rows = [{row["contender"]: row for row in matrix["rows"]} for matrix in (pushed, still)]
        # the run of training that it is compared with has the same pushes
        self.assertEqual(rows[0]["mujoco-euler"]["parting"]["parted"], 0)
        for contender in ("mujoco-euler", "mujoco-rk4"):
            times = [of[contender]["values"]["time_up"]["value"] for of in rows]
            self.assertNotEqual(times[0], times[1])
        # which of the two it is does not change when the pole falls
        self.assertAlmostEqual(*(rows[0][name]["values"]["time_up"]["value"] for name in ("mujoco-euler", "mujoco-rk4")), delta=0.1)
        self.assertIn("push = {velocity = 0.3", (self.dir / "pushed/campaign.toml").read_text())
        self.assertIsNone(still["pushes"])

    def test_pushes_that_cannot_be(self):
        self.refused(*self.run_pushed("r", "--push", "0.3"), naming=["no free body", "--push-joint"])
        self.refused(*self.run_pushed("r", "--push", "0.3", "--push-joint", "slide"), naming=["'slide'", "'slider'"])
        self.refused(*self.run_pushed("r", "--push", "-1"), naming=["--push is -1"])
        self.refused(*self.run_pushed("r", "--push-every", "1"), naming=["--push with"])
        self.refused("run", "cart_pole.xml", "--push", "1", naming=["--policy-config"])


class Transfer(Policy):
    def test_the_example_balances_in_the_engines(self):
        """The policy that was trained in MuJoCo keeps the pole up in every engine that takes the robot."""
        self.write("policy.toml", (EXAMPLE / "policy.toml").read_text())
        self.network((EXAMPLE / "policy.onnx").read_bytes())
        engines = ["mujoco-euler", "bullet-mb", "ode-quick", "dart", "physx-art-tgs", "rapier-f64", "jolt-f64", "simbody-euler", "havok*"]
        known = self.contenders()
        names = [name for name in known if any(pathlib.PurePath(name).match(pattern) for pattern in engines)]
        text = self.assay("run", "cart_pole.xml", "--policy-config", "policy.toml", "--out", "results",
                          "--seconds", "4", "--timesteps", "5", "--contenders", ",".join(names))
        self.assertRegex(text, r"\d+ of \d+ contenders stays? up at 5 ms")
        matrix = self.assay_json("transfer", "results", "--json")["systems"][0]
        self.assertEqual(matrix["trained_in"], "mujoco-euler")
        rows = {row["contender"]: row for row in matrix["rows"]}
        up = {self.engine_of(name) for name, row in rows.items() if row["values"].get("fall_rate", {}).get("value") == 0}
        self.assertGreaterEqual(len(up), 6, json.dumps(matrix["rows"], indent=1)[:3000])
        trained = rows["mujoco-euler"]
        self.assertTrue(trained["trained"])
        self.assertEqual(trained["runs"], 20)
        self.assertEqual(trained["verdict"], "stays up")
        # it does not part from itself
        self.assertEqual(trained["values"]["policy_parting_time"]["value"], 4)
        others = [row["values"]["policy_parting_time"]["value"] for name, row in rows.items()
                  if not name.startswith("mujoco") and "policy_parting_time" in row["values"]]
        self.assertTrue(others)
        for name in ("time_up", "joint_power", "policy_time"):
            self.assertGreater(trained["values"][name]["value"], 0, name)
        # the same command finds everything measured
        again = self.assay("run", "cart_pole.xml", "--policy-config", "policy.toml", "--out", "results",
                           "--seconds", "4", "--timesteps", "5", "--contenders", ",".join(names))
        self.assertIn("(0 now,", again)

    def engine_of(self, contender):
        return contender.split("-")[0]

    def test_a_policy_that_does_nothing_falls(self):
        self.network(onnx_file.linear(4, 1, [0, 0, 0, 0]))
        self.assay("run", "cart_pole.xml", "--policy-config", "policy.toml", "--out", "results", "--seeds", "10", "--seconds",
                   "4", "--timesteps", "5", "--contenders", "mujoco-euler")
        row = self.assay_json("transfer", "results", "--json")["systems"][0]["rows"][0]
        # all but the model's own upright start
        self.assertEqual(row["values"]["fall_rate"]["value"], 0.9)
        self.assertEqual(row["verdict"], "falls")
        self.assertEqual(row["outcome"], "ok")
        with sqlite3.connect(self.dir / "results/assay.sqlite") as db:
            measures = {name for (name,) in db.execute("SELECT measure FROM cells")}
        self.assertIn("transfer", measures)
        self.refused("transfer", "results", "other", naming=["'other'", "policy"])


class AgainstTraining(Policy):
    """The quadruped at twice the timestep of its training, where its drives chatter, and pushed on rough ground: some seconds of
    what docs/guide.md shows."""

    CAMPAIGN = """
name = "short"
contenders = ["mujoco-euler", "ode-quick"]
timesteps_ms = [5, 10]
reference_ms = 5
measures = ["transfer"]
"""
    SYSTEM = """
[[system]]
name = "{}"
model = "./{}.xml"
control = {{kind = "policy", config = "policy.toml"}}
duration_s = 2
sample_ms = 20
initial_states = 24
{}
"""

    def p_of(self, a, b, runs):
        """That two shares of as many runs each are equal: the rank test's normal approximation."""
        fallen = a + b
        if fallen in (0, 2 * runs):
            return 1
        z = max(0, runs * abs(a - b) - 1) * math.sqrt((2 * runs - 1) / (runs * runs * fallen * (2 * runs - fallen)))
        return math.erfc(z / math.sqrt(2))

    def corrected(self, p):
        """After Benjamini and Hochberg."""
        order = sorted(p, key=p.get)
        return {name: min(p[other] * len(p) / (i + 1) for i, other in enumerate(order) if i >= order.index(name)) for name in p}

    def test_falls_and_errors_are_compared_with_those_of_training(self):
        shutil.copytree(SOURCE / "examples/quadruped-policy", self.dir / "robot")
        self.write("robot/short.toml", self.CAMPAIGN + self.SYSTEM.format("walk", "quadruped", "") +
                   self.SYSTEM.format("pushed", "rough", "push = {velocity = 2, every_s = 0.5}"))
        self.assay("run", "robot/short.toml", "--out", "results")
        for matrix in self.assay_json("transfer", "results", "--json")["systems"]:
            rows = {(row["contender"], row["timestep_ms"]): row for row in matrix["rows"]}
            self.assertEqual(len(rows), 4)
            fallen = {name: round(row["runs"] * row["values"]["fall_rate"]["value"]) for name, row in rows.items()}
            trained = rows.pop(("mujoco-euler", 5))
            self.assertIsNone(trained["against_training"])
            self.assertEqual((trained["runs"], trained["excesses"]), (24, []))
            then = fallen.pop(("mujoco-euler", 5))
            p = self.corrected({name: self.p_of(fallen[name], then, 24) for name in rows})
            for name, row in rows.items():
                with self.subTest(system=matrix["system"], row=name):
                    self.assertAlmostEqual(row["falls_p"], p[name], places=9)
                    word = "not told apart" if p[name] > 0.05 else f"falls {'more' if fallen[name] > then else 'less'} often"
                    self.assertEqual(row["against_training"], word)
                    worse = {value for value in ("velocity_error", "turning_error", "foot_slip", "joint_power")
                             if row["values"][value]["low"] >= 2 * trained["values"][value]["high"]}
                    self.assertEqual({each["value"] for each in row["excesses"]}, worse)
                    self.assertEqual(row["verdict"] == "stays up, but worse", bool(worse) and row["values"]["fall_rate"]["high"] <= 0.2)
            if matrix["system"] == "walk":
                self.assertEqual(trained["verdict"], "stays up")
                self.assertEqual(rows["ode-quick", 5]["verdict"], "stays up")
                chatters = rows["ode-quick", 10]
                self.assertEqual(chatters["verdict"], "stays up, but worse")
                self.assertIn("times as much power", chatters["excess"])
                self.assertIn(f"ode-quick at 10 ms {chatters['excess']} as mujoco-euler at 5 ms", matrix["answer"])
            else:
                self.assertGreater(then, 0)
        self.assertRegex(self.assay("transfer", "results", "walk"), r"ode-quick +10 ms +stays up, but worse +not told apart")

    def test_the_rough_ground_follows_from_its_seed(self):
        folder = SOURCE / "examples/quadruped-policy"
        subprocess.run([sys.executable, folder / "rough_ground.py", "--out", self.dir / "rough.xml"], check=True)
        self.assertEqual((self.dir / "rough.xml").read_text(), (folder / "rough.xml").read_text())


if __name__ == "__main__":
    main()
