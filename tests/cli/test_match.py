"""`assay match`: parameters that are known are found, those that the logs do not determine are named, a killed fit goes on to the
same result, and what cannot be used is refused."""

import json
import math
import os
import pathlib
import random
import subprocess
import time
import unittest

from harness import SOURCE, AssayTest, main

CACHE = os.environ.get("ASSAY_TEST_CACHE", os.path.expanduser("~/.cache/assay"))  # of the machine, not the test's

PENDULUM = """<mujoco model="pendulum">
  <worldbody>
    <body name="link" pos="0 0 1">
      <joint name="hinge" axis="0 1 0" damping="{damping}"/>
      <inertial pos="0 0 -0.4" mass="{mass}" diaginertia="{inertia} {inertia} 0.001"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.01" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""
CENTRE, INERTIA_OF_MASS, GRAVITY = 0.4, 0.02, 9.81  # the inertia about the centre scales with the mass, as in a fit

CUBE = """<mujoco model="cube">
  <worldbody>
    <geom name="table" type="plane" size="2 2 0.1" friction="{friction} 0 0"/>
    <body name="cube" pos="0 0 {height}" quat="{quat}">
      <freejoint/>
      <geom type="box" size="0.05 0.05 0.05" mass="0.4" friction="{friction} 0 0"/>
    </body>
  </worldbody>
  <keyframe><key qpos="0 0 {height} {quat}" qvel="{velocity}"/></keyframe>
</mujoco>
"""


def pendulum(damping, mass):
    return PENDULUM.format(damping=damping, mass=mass, inertia=mass * INERTIA_OF_MASS)


def swing(damping, mass, seconds, push, noise, seed, rate=200):
    """Position and torque of a driven pendulum by Runge-Kutta 4 of its equation: no engine takes part."""
    inertia = mass * INERTIA_OF_MASS + mass * CENTRE * CENTRE
    torque = lambda t: push * math.sin(2.7 * t) + 0.3 * push * math.sin(7.1 * t + seed)
    def slope(t, q, v):
        return v, (torque(t) - damping * v - mass * GRAVITY * CENTRE * math.sin(q)) / inertia
    rng = random.Random(seed)
    rows, q, v, h = [], 0.4 * math.cos(seed), 0.0, 1.0 / rate / 4
    for i in range(int(seconds * rate) + 1):
        t = i / rate
        rows.append((t, q + rng.gauss(0, noise), torque(t)))
        for k in range(4):
            s = t + k * h
            a = slope(s, q, v)
            b = slope(s + h / 2, q + h / 2 * a[0], v + h / 2 * a[1])
            c = slope(s + h / 2, q + h / 2 * b[0], v + h / 2 * b[1])
            d = slope(s + h, q + h * c[0], v + h * c[1])
            q += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
            v += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
    return rows


class Match(AssayTest):
    def setUp(self):
        super().setUp()
        environments = pathlib.Path(CACHE, "python")
        if not any(environments.glob("match-*/bin/python")):
            self.skipTest("the optimiser is not set up: ./assay setup match")
        (self.dir / "cache/assay").mkdir(parents=True, exist_ok=True)
        (self.dir / "cache/assay/python").symlink_to(environments)

    def swings(self, damping=0.06, mass=0.5, noise=2e-4, count=3):
        names = []
        for seed in range(1, count + 1):
            rows = swing(damping, mass, 4, 1.2, noise, seed)
            names.append(f"swing{seed}.csv")
            self.write(names[-1], "time,hinge,hinge.torque\n" + "".join(f"{t:.6f},{q:.7f},{u:.7f}\n" for t, q, u in rows))
        return names

    def matched(self, *arguments, out="matched"):
        return self.assay_json("match", *arguments, "--out", out, "--json")

    def parameter(self, contender, name):
        return next(p for p in contender["parameters"] if p["name"] == name)

    def test_known_truth_of_a_pendulum(self):
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        logs = self.swings()
        names = [name for name in ("mujoco-rk4", "ode-step") if name in self.contenders()]
        found = self.matched("pendulum.xml", "--log", *logs, "--contenders", ",".join(names), "--fit", "damping", "--fit", "mass")
        for contender in found["contenders"]:
            with self.subTest(contender=contender["contender"]):
                self.assertIsNone(contender["failure"])
                for name, truth in (("damping:hinge", 0.06), ("mass:link", 0.5)):
                    p = self.parameter(contender, name)
                    self.assertEqual(p["status"], "fitted")
                    # a fit that takes noisy first states for exact is off by 1 %
                    self.assertLess(abs(p["value"] - truth), 0.003 * truth, p)
                    self.assertLess(p["low"], truth, p)
                    self.assertGreater(p["high"], truth, p)
                self.assertLess(contender["held_out"]["joints_deg"], 0.3 * contender["untuned"]["joints_deg"])
        # the model that was fitted is one that assay reads
        fitted = self.assay_json("check", f"matched/models/{names[0]}.xml", "--json")
        self.assertTrue(fitted)

    def test_what_logs_do_not_determine_is_named(self):
        # all torques scale with mass, gear and damping: without gravity's own scale nothing tells them apart
        self.write("pendulum.xml", pendulum(damping=0.06, mass=0.5).replace("<worldbody>", '<option gravity="0 0 0"/><worldbody>'))
        names = []
        for seed in (1, 2, 3):
            rows, q, v = [], 0.0, 0.0
            inertia = 0.5 * INERTIA_OF_MASS + 0.5 * CENTRE * CENTRE
            for i in range(801):
                t = i / 200
                u = 0.3 * math.sin(3 * t + seed)
                rows.append(f"{t:.6f},{q:.7f},{u:.7f}\n")
                for _ in range(10):
                    v += (u - 0.06 * v) / inertia / 2000
                    q += v / 2000
            names.append(f"spin{seed}.csv")
            self.write(names[-1], "time,hinge,hinge.torque\n" + "".join(rows))
        found = self.matched("pendulum.xml", "--log", *names, "--contenders", "mujoco-euler",
                             "--fit", "damping", "--fit", "mass", "--fit", "gear")
        contender = found["contenders"][0]
        self.assertEqual(len(contender["not_identified"]), 1, contender["not_identified"])
        self.assertIn("gear:hinge", contender["not_identified"][0]["members"])

    def test_the_same_seed_gives_the_same_answer_and_a_kill_loses_nothing(self):
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        arguments = ["pendulum.xml", "--log", *self.swings(count=2), "--contenders", "mujoco-euler,mujoco-rk4", "--fit", "damping"]
        once = self.matched(*arguments, out="once")
        running = self.start_assay("match", *arguments, "--out", "killed")
        first = self.dir / "killed/contenders/mujoco-euler.json"
        while running.poll() is None and not first.exists():
            time.sleep(0.02)
        running.kill()
        running.communicate()
        again = self.matched(*arguments, out="killed")
        self.assertEqual(json.dumps(once), json.dumps(again))

    def values(self, run, quantity=0):
        return run["values"][quantity]

    def test_motion_is_kept_and_its_errors_are_those_of_the_answer(self):
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        logs = self.swings()
        found = self.matched("pendulum.xml", "--log", *logs, "--contenders", "mujoco-euler,mujoco-rk4", "--fit", "damping", "--fit", "mass")
        self.assertEqual(found["to_do"], [])
        self.assertIn(found["contenders"][0]["contender"], found["answer"])
        kept = json.loads((self.dir / "matched/motion.json").read_text())
        self.assertEqual({role for log in kept["logs"] for role in log["roles"]} - {"separating"}, {"worst", "median"})
        for log in kept["logs"]:
            runs = {(run["contender"], run["fitted"]): run for run in log["runs"]}
            self.assertEqual(log["runs"][0]["contender"], "measured")
            self.assertEqual(len(runs), 5)
            # what is kept as measured is the file's
            source = dict(line.split(",")[:2] for line in (self.dir / f"{log['log']}.csv").read_text().splitlines()[1:])
            for time_s, angle in zip(log["time_s"], self.values(log["runs"][0])):
                self.assertAlmostEqual(angle, float(source[f"{time_s:.6f}"]), places=5)
            for contender in found["contenders"]:
                figures = next(one for one in contender["logs"] if one["log"] == log["log"])
                for fitted, name in ((True, "held_out"), (False, "untuned")):
                    run = runs[(contender["contender"], fitted)]
                    # a sample counts at most 90 degrees
                    off = [min(90, abs(math.degrees(a - b))) for a, b in zip(self.values(run), self.values(log["runs"][0]))]
                    rms = math.sqrt(sum(each * each for each in off) / len(off))
                    self.assertAlmostEqual(rms, figures[name]["joints_deg"], delta=0.02 * rms)
        # again from what is there: the same motion and page data
        first = (self.dir / "matched/motion.json").read_text()
        page = self.assay_json("report", "matched", "--json")
        self.matched("pendulum.xml", "--log", *logs, "--contenders", "mujoco-euler,mujoco-rk4", "--fit", "damping", "--fit", "mass")
        self.assertEqual(first, (self.dir / "matched/motion.json").read_text())
        self.assertEqual(page, self.assay_json("report", "matched", "--json"))
        self.assertEqual(page["match"]["held_out"], found["held_out"])
        for one in page["match"]["logs"]:
            contender = next(each for each in found["contenders"] if each["contender"] == one["contender"])
            for log, error in zip(found["held_out"], one["fitted"]["joints_deg"]):
                figures = next(each for each in contender["logs"] if each["log"] == log)
                self.assertAlmostEqual(error, figures["held_out"]["joints_deg"], delta=1e-3 * error)
        self.assertLess((self.dir / "matched/report.html").stat().st_size, 10_000_000)

    def test_a_report_of_a_match_that_was_stopped_says_what_is_missing(self):
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        arguments = ["pendulum.xml", "--log", *self.swings(count=2), "--contenders", "mujoco-euler,mujoco-rk4", "--fit", "damping"]
        running = self.start_assay("match", *arguments, "--out", "killed")
        first = self.dir / "killed/contenders/mujoco-euler.json"
        while running.poll() is None and not first.exists():
            time.sleep(0.02)
        answer = self.dir / "killed/match.json"
        while running.poll() is None and not json.loads(answer.read_text())["contenders"]:
            time.sleep(0.02)
        running.kill()
        running.communicate()
        page = self.assay_json("report", "killed", "--json")["match"]
        if page["to_do"]:  # else it was done before the signal
            self.assertEqual(page["to_do"], ["mujoco-rk4"])
            self.assertEqual([one["contender"] for one in page["contenders"]], ["mujoco-euler"])
            self.assertTrue(page["answer"].startswith("So far 1 of 2 contenders"), page["answer"])
            self.assertNotIn("motion", page)
        self.assay("report", "killed")
        self.assertTrue((self.dir / "killed/report.html").is_file())

    def test_contenders_that_fail_are_in_the_report(self):
        self.use_mishap_engine()
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        arguments = ["pendulum.xml", "--log", *self.swings(count=2), "--fit", "damping", "--budget", "10"]
        self.matched(*arguments, "--contenders", "mishap-refuse", out="none")
        page = self.assay_json("report", "none", "--json")["match"]
        self.assertIn("give it to somebody else", page["contenders"][0]["failure"])
        self.assertTrue(page["answer"].startswith("No contender could be fitted"), page["answer"])
        self.assertEqual(page["motion"], [])
        self.matched(*arguments, "--contenders", "mishap-refuse,mujoco-euler", out="one")
        page = self.assay_json("report", "one", "--json")["match"]
        self.assertEqual([one["contender"] for one in page["contenders"]], ["mujoco-euler", "mishap-refuse"])
        self.assertEqual({run["contender"] for run in page["motion"][0]["runs"]}, {"measured", "mujoco-euler"})

    def test_what_a_report_of_a_match_cannot_have_is_refused(self):
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        self.matched("pendulum.xml", "--log", *self.swings(count=2), "--contenders", "mujoco-euler", "--fit", "damping", "--budget", "10")
        self.refused("report", "matched", "--replays", "4", naming=["--replays", "assay match"])
        self.refused("draw", "matched", "wurst", "--out", "x.mp4", naming=["wurst", "worst"])
        self.refused("draw", "matched", "worst", "--contenders", "mujoco-eule", "--out", "x.mp4", naming=["mujoco-eule", "mujoco-euler"])
        older = json.loads((self.dir / "matched/match.json").read_text())
        del older["to_do"]
        self.write("matched/motion.json", '{"format": 1}')
        self.refused("report", "matched", naming=["motion.json"])
        self.write("matched/match.json", "[]")
        self.refused("report", "matched", naming=["match.json"])
        self.write("matched/match.json", json.dumps(older))
        self.refused("report", "matched", naming=["match.json", "run the match again"])

    def test_friction_of_a_tossed_box(self):
        logs = []
        throws = [("1 0.2 0.1 0", "0.8 0 0.2 1 2 0.5"), ("0.9 0.1 -0.3 0.2", "-0.6 0.3 0.1 2 -1 1"), ("0.8 -0.3 0.2 0.1", "0.7 -0.5 0.3 -2 1 2")]
        for i, (quat, velocity) in enumerate(throws):
            self.write(f"throw{i}.xml", CUBE.format(friction=0.35, height=0.2, quat=quat, velocity=velocity))
            self.assay("simulate", f"throw{i}.xml", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "0.6",
                       "--sample", "5", "--out", f"run{i}.csv")
            lines = (self.dir / f"run{i}.csv").read_text().splitlines()
            columns = lines[0].split(",")
            keep = [columns.index(c) for c in ("time", "x", "y", "z", "qw", "qx", "qy", "qz")]
            rows = [",".join(line.split(",")[k] for k in keep) for line in lines[1:]]
            self.write(f"toss{i}.csv", "time,cube.x,cube.y,cube.z,cube.qw,cube.qx,cube.qy,cube.qz\n" + "\n".join(rows) + "\n")
            logs.append(f"toss{i}.csv")
        self.write("cube.xml", CUBE.format(friction=0.25, height=0.2, quat="1 0 0 0", velocity="0 0 0 0 0 0"))
        found = self.matched("cube.xml", "--log", *logs, "--contenders", "mujoco-euler", "--fit", "friction", "--budget", "60")
        contender = found["contenders"][0]
        self.assertIsNone(contender["failure"])
        self.assertLess(abs(self.parameter(contender, "friction")["value"] - 0.35), 0.05 * 0.35)
        self.assertLess(contender["held_out"]["position_percent"], 2)

    def test_a_contender_in_place_of_logs(self):
        self.write("pendulum.xml", pendulum(damping=0.06, mass=0.5))
        found = self.matched("pendulum.xml", "--like", "mujoco-rk4", "--contenders", "mujoco-euler", "--fit", "damping=0,0.5", "--budget", "60",
                             "--timestep", "0.5")  # what differs between the two methods goes into the damping, too
        self.assertEqual((found["like"], len(found["training"]), len(found["held_out"])), ("mujoco-rk4", 4, 2))
        contender = found["contenders"][0]
        for start in contender["starts"]:  # wherever they begin
            self.assertLess(abs(start[0] - 0.06), 0.05 * 0.06, contender["starts"])
        self.assertLess(contender["held_out"]["joints_deg"], 0.5)
        # a thrown body; the contender itself does the same from the first states that its samples tell
        self.write("cube.xml", CUBE.format(friction=0.25, height=0.05, quat="1 0 0 0", velocity="0 0 0 0 0 0"))
        found = self.matched("cube.xml", "--like", "mujoco-euler", "--contenders", "mujoco-euler", "--fit", "friction", "--budget", "10", out="thrown")
        self.assertEqual((len(found["training"]), len(found["held_out"])), (16, 8))
        self.assertLess(found["contenders"][0]["untuned"]["position_percent"], 3)

    def test_the_fastest_that_moves_as_measured(self):
        self.write("pendulum.xml", pendulum(damping=0.06, mass=0.5))
        found = self.matched("pendulum.xml", "--log", *self.swings(), "--contenders", "mujoco-euler,mujoco-rk4", "--fit", "damping")
        errors = {}
        for contender in found["contenders"]:
            steps = {at["timestep_ms"]: at["held_out"]["joints_deg"] for at in contender["timesteps"]}
            self.assertEqual(sorted(steps), [0.5, 1, 2, 4, 8])
            self.assertAlmostEqual(steps[1], contender["held_out"]["joints_deg"])
            errors[contender["contender"]] = steps
        # a first-order method is off by its timestep, one of fourth order is not
        self.assertGreater(errors["mujoco-euler"][8], 3 * errors["mujoco-euler"][1])
        self.assertLess(errors["mujoco-rk4"][4], errors["mujoco-euler"][4])
        limit = 1.01 * errors["mujoco-rk4"][4]
        text = self.assay("run", "pendulum.xml", "--like-real", "matched", "--error", f"{limit:.6f}deg", "--out", "fast")
        self.assertIn("pendulum: the fastest that moves as measured", text)
        points = json.loads((self.dir / "fast/like_real.json").read_text())["points"]
        speeds = [point["realtime_factor"]["value"] for point in points]
        self.assertEqual(speeds, sorted(speeds, reverse=True))
        asked = {(point["contender"], point["timestep_ms"]) for point in points}
        self.assertIn(("mujoco-rk4", 4), asked)
        for name, steps in errors.items():
            for timestep in steps:
                largest = max(error for other, error in steps.items() if other <= timestep)
                self.assertEqual((name, timestep) in asked, largest <= limit, (name, timestep))
        # by default as good as the best
        best = found["contenders"][0]["contender"]
        self.assay("run", "pendulum.xml", "--like-real", "matched", "--contenders", best, "--out", "alike")
        self.assertEqual({point["contender"] for point in json.loads((self.dir / "alike/like_real.json").read_text())["points"]}, {best})
        self.write("other.xml", pendulum(damping=0.06, mass=0.6))
        for arguments, words in [
            (["pendulum.xml", "--error", "1e-9deg"], ["1e-9deg", "nearest", "mujoco-"]),
            (["pendulum.xml", "--error", "1mm"], ["1mm", "2deg"]),
            (["pendulum.xml", "--error", "5%"], ["5%", "joints", "2deg"]),
            (["pendulum.xml", "--minutes", "3"], ["--like-real", "--realtime"]),
            (["pendulum.xml", "--contenders", "dart"], ["dart", "mujoco-rk4"]),
            (["other.xml"], ["matched", "other.xml"]),
        ]:
            with self.subTest(arguments=arguments):
                self.refused("run", *arguments, "--like-real", "matched", "--out", "none", naming=words)
        self.refused("run", "pendulum.xml", "--like-real", "fast", naming=["fast", "assay match"])
        self.write("matched/match.json", "{}")
        self.refused("run", "pendulum.xml", "--like-real", "matched", naming=["match.json"])

    def test_another_drive_is_another_question(self):
        self.write("pendulum.xml", pendulum(damping=0.06, mass=0.5))
        logs = self.swings(count=2)
        untuned = []
        for law in ("none", "torque"):
            self.write("match.toml", f'[drive]\nlaw = "{law}"\n')
            found = self.matched("pendulum.xml", "--log", *logs, "--config", "match.toml", "--contenders", "mujoco-euler",
                                 "--fit", "damping", "--budget", "10", out="same")
            untuned.append(found["contenders"][0]["untuned"]["joints_deg"])
        self.assertGreater(untuned[0], 1.5 * untuned[1])

    def test_a_refused_question_leaves_the_answer(self):
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        arguments = ["pendulum.xml", "--log", *self.swings(count=2), "--contenders", "mujoco-euler", "--budget", "10"]
        self.matched(*arguments, "--fit", "damping")
        before = (self.dir / "matched/match.json").read_text()
        self.write("match.toml", '[held_out]\nlogs = ["swing*"]\n')
        for more, words in [
            (["--fit", "friction"], ["friction", "no contacts"]),
            (["--fit", "damping=-1,0.5"], ["damping", "-1", "negative"]),
            (["--fit", "damping", "--contenders", "mujoco-euler"], ["--contenders", "mujoco-euler", "twice"]),
            (["--fit", "damping", "--config", "match.toml"], ["[held_out]"]),
        ]:
            with self.subTest(more=more):
                self.refused("match", *arguments, *more, "--out", "matched", naming=words)
                self.assertEqual(before, (self.dir / "matched/match.json").read_text())

    def test_logs_without_a_usable_stretch_are_refused(self):
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        logs = self.swings(count=1)
        self.write("rest.csv", "time,hinge,hinge.torque\n" + "".join(f"{i / 200:.3f},0,0\n" for i in range(800)))
        for held_out, words in (("swing1", ["to fit to", "rest"]), ("rest", ["held out", "rest"])):
            self.write("match.toml", f'[held_out]\nlogs = ["{held_out}"]\n')
            with self.subTest(held_out=held_out):
                self.refused("match", "pendulum.xml", "--log", *logs, "rest.csv", "--config", "match.toml", "--contenders", "mujoco-euler",
                             "--fit", "damping", "--out", "matched", naming=words)

    def test_what_is_wrong_with_the_logs_is_in_the_answer(self):
        self.write("pendulum.xml", pendulum(damping=0.06, mass=0.5))
        asked = ["match", "pendulum.xml", "--log", *self.swings(count=2), "--contenders", "mujoco-euler", "--fit", "damping", "--budget", "10",
                 "--out", "matched", "--json"]
        for seed in (1, 2):
            rows = swing(0.06, 0.5, 4, 1.2, 2e-4, seed)
            against = [(before[1] - after[1]) / (after[0] - before[0]) for before, after in zip(rows, rows[1:])]
            self.write(f"swing{seed}.csv", "time,hinge,hinge.velocity,hinge.torque\n" +
                       "".join(f"{t:.6f},{q:.7f},{v:.7f},{u:.7f}\n" for (t, q, u), v in zip(rows, against)))
        done = self.run_assay(*asked)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("hinge.velocity", done.stderr)
        self.assertTrue(any("wrong sign" in warning for warning in json.loads(done.stdout)["warnings"]), done.stdout)
        # torques of the wrong sign leave nothing that no hand has pushed
        for seed in (1, 2):
            rows = swing(0.06, 0.5, 4, 1.2, 2e-4, seed)
            self.write(f"swing{seed}.csv", "time,hinge,hinge.torque\n" + "".join(f"{t:.6f},{q:.7f},{-u:.7f}\n" for t, q, u in rows))
        self.refused(*asked, naming=["held out", "hinge.torque", "its sign is wrong"])

    def test_fitted_models_are_those_of_the_question(self):
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        arguments = ["pendulum.xml", "--log", *self.swings(count=2), "--budget", "10"]
        self.matched(*arguments, "--contenders", "mujoco-euler,mujoco-rk4", "--fit", "damping", "--fit", "mass")
        models = self.dir / "matched/models"
        self.assertEqual(sorted(file.name for file in models.iterdir()),
                         ["mujoco-euler.urdf", "mujoco-euler.xml", "mujoco-rk4.urdf", "mujoco-rk4.xml"])
        self.assay("check", "matched/models/mujoco-euler.urdf")
        self.matched(*arguments, "--contenders", "mujoco-rk4", "--fit", "armature")  # which URDF does not have
        self.assertEqual(sorted(file.name for file in models.iterdir()), ["mujoco-rk4.xml"])

    def test_what_a_contender_does_not_have_is_not_fitted_in_it(self):
        if "havok" not in self.contenders():
            self.skipTest("havok is not installed")
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        asked = ["pendulum.xml", "--log", *self.swings(count=2), "--contenders", "havok", "--fit", "armature", "--fit", "damping", "--budget", "60"]
        found = self.matched(*asked)
        contender = found["contenders"][0]
        self.assertEqual([p["name"] for p in contender["parameters"]], ["damping:hinge"])
        self.assertTrue(any("'armature:hinge' is not fitted" in warning for warning in contender["warnings"]), contender["warnings"])
        self.assertLess(contender["score"]["value"], contender["untuned_score"]["value"])
        self.assertEqual(self.matched(*asked), found)  # as kept

    def test_what_cannot_be_fitted_is_refused(self):
        self.write("pendulum.xml", pendulum(damping=0.02, mass=0.4))
        log = self.swings(count=1)[0]
        for arguments, words in [
            (["--fit", "dampin"], ["dampin", "damping"]),
            (["--fit", "damping:hing"], ["hing", "hinge"]),
            (["--fit", "damping=1,0"], ["damping"]),
            (["--contenders", "mujoco-eulr"], ["mujoco-eulr"]),
        ]:
            with self.subTest(arguments=arguments):
                self.refused("match", "pendulum.xml", "--log", log, "--out", "out", *arguments, naming=words)
        for arguments, words in [
            ([], ["--log", "--like"]),
            (["--log", log, "--like", "mujoco-euler"], ["--log", "--like", "exclude"]),
            (["--like", "mujoco-eulr"], ["mujoco-eulr", "mujoco-euler"]),
        ]:
            with self.subTest(arguments=arguments):
                self.refused("match", "pendulum.xml", "--out", "out", *arguments, naming=words)


class Optimiser(unittest.TestCase):
    """What it says of a parameter that the data do not determine, with residuals of a formula in place of an engine."""

    def answer(self, extra, method="least_squares"):
        pythons = list(pathlib.Path(CACHE, "python").glob("match-*/bin/python"))
        if not pythons:
            self.skipTest("the optimiser is not set up: ./assay setup match")
        logs, samples = 8, 10
        task = {"names": ["slope", "other"], "start": [0.0, 1.0], "lower": [-5.0, 0.0], "upper": [5.0, 3.0], "zero": [None, None],
                "size": [None, None], "method": method, "seed": 1, "budget": 300, "starts": 3, "delta": 2.0, "step": 0.02,
                "information_step": 0.05, "widest": 1.0, "equal": 0.02, "resamples": 200, "blocks": [samples] * logs,
                "clusters": list(range(logs)), "first_states": False, "observations": 6 * logs}
        noise = random.Random(3)
        made = [(noise.uniform(-1, 1), noise.gauss(0, 0.05)) for _ in range(logs * samples)]
        residuals = lambda x: [(x[0] - 2) * t + e + extra(x[1]) for t, e in made]
        with subprocess.Popen([pythons[0], SOURCE / "src/match/optimiser.py"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
            say = lambda message: (process.stdin.write(json.dumps(message) + "\n"), process.stdin.flush())
            say(task)
            for line in process.stdout:
                message = json.loads(line)
                if "done" in message:
                    return message["done"]
                found = [residuals(x) for x in message["ask"]]
                say({"costs": [sum(abs(r) for r in each) / len(each) for each in found]} if message.get("costs") else {"residuals": found})
        self.fail("the optimiser ended without an answer")

    def test_one_that_nothing_depends_on_is_the_models(self):
        for method in ("least_squares", "cma"):
            with self.subTest(method):
                found = self.answer(lambda other: 0.0, method)
                self.assertEqual([(c["frozen"], c["as_found"]) for c in found["combinations"]], [("other", False)])
                self.assertEqual(found["values"][1], 1.0)
                self.assertAlmostEqual(found["values"][0], 2.0, delta=0.05)

    def test_one_of_which_only_a_bound_is_known_stays_within_it(self):
        # below 0.3 nothing depends on it, and the model's 1 does not fit
        for method in ("least_squares", "cma"):
            with self.subTest(method):
                found = self.answer(lambda other: 3 * max(0.0, other - 0.3), method)
                self.assertEqual([(c["frozen"], c["as_found"]) for c in found["combinations"]], [("other", True)])
                self.assertLess(found["values"][1], 0.35)
                self.assertIsNone(found["low"][1])
                self.assertAlmostEqual(found["values"][0], 2.0, delta=0.05)


if __name__ == "__main__":
    main()
