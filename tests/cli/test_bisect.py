"""Releases of engines as contenders, and `assay bisect` between them. The tests of MuJoCo's set these releases up for this build: half a
minute each, the first time over the network. Those of an adapter in Python bring their own engine and make its releases by hand."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import unittest
import xml.etree.ElementTree

from harness import SOURCE, AssayTest, main

RELEASES = ["3.6.0", "3.7.0", "3.8.1", "3.9.0"]
CACHE = os.environ.get("ASSAY_TEST_CACHE", "")
ENVIRONMENT = os.environ.get("ASSAY_TEST_PYTHON", "")

# A body with three unequal moments that tumbles.
TUMBLING = """<mujoco model="tumbling">
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="body" pos="0 0 1"><freejoint/><inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.02 0.028"/></body>
  </worldbody>
  <keyframe><key name="spun" qpos="0 0 1 1 0 0 0" qvel="0 0 0 0.2 8 0.2"/></keyframe>
</mujoco>
"""
# Boxes on each other, no two alike, that settle.
BOXES = """<mujoco model="boxes">
  <worldbody>
    <geom type="plane" size="5 5 1"/>
    <body name="low" pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1"/></body>
    <body name="middle" pos="0.01 0 0.301"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="2"/></body>
    <body name="high" pos="0.03 0.01 0.502"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="3"/></body>
  </worldbody>
</mujoco>
"""
STEPS = ["--timestep", "5", "--duration", "1", "--out", "-"]
RUN = ["--keyframe", "spun", "--timestep", "5", "--seconds", "5", "--seeds", "1"]


def set_up(*names, **environment):
    build = pathlib.Path(os.environ["ASSAY_PROGRAM"]).resolve().parents[1]
    env = {**os.environ, "ASSAY_RELEASES_OF": str(build), "ASSAY_SKIP_APT": "1", **({"ASSAY_CACHE": CACHE} if CACHE else {}), **environment}
    return subprocess.run([SOURCE / "setup/setup.sh", "--engines", *names], env=env, capture_output=True, text=True, timeout=900)


class Releases(AssayTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        if not (pathlib.Path(os.environ["ASSAY_PROGRAM"]).resolve().parents[1] / "releases/mujoco.key").exists():
            raise unittest.SkipTest("this build has no releases (sanitizers, or no MuJoCo)")
        done = set_up(*[f"mujoco@{release}" for release in RELEASES])
        if "the registry does not answer" in done.stderr:
            raise unittest.SkipTest("the package registry does not answer")
        if done.returncode != 0:
            raise AssertionError(done.stderr)

    def setUp(self):
        super().setUp()
        if CACHE:
            self.env["ASSAY_CACHE"] = CACHE
        self.write("tumbling.xml", TUMBLING)

    def states(self, contender):
        return self.assay("simulate", "tumbling.xml", "--engine", contender, "--keyframe", "spun", "--timestep", "5", "--duration", "1",
                          "--out", "-")

    def test_each_release_runs_its_own_library(self):
        """The program has MuJoCo's newest in itself; a plugin whose symbols came from there would end in the same bits."""
        newest, before, after = (self.states(f"mujoco-implicitfast{release}") for release in ("", "@3.6.0", "@3.7.0"))
        self.assertNotEqual(before, after)
        self.assertNotEqual(after, newest)
        self.assertEqual(before, self.states("mujoco-implicitfast@3.6.0"))

    def test_a_release_conforms_and_says_its_version(self):
        done = self.assay_json("conformance", "mujoco-euler@3.6.0", "--test", "pendulum-period", "--test", "planar-chain", "--json")
        self.assertEqual({each["status"] for each in done["contenders"][0]["results"]}, {"pass"})
        # whether it is within the limits is not what is asked
        done = self.run_assay("run", "tumbling.xml", "--contenders", "mujoco-euler@3.6.0", "--minutes", "0.3", "--out", "results", "--no-set-up")
        self.assertNotIn("conformance", done.stdout)
        manifest = self.assay("export", "results", "--format", "json")
        self.assertIn("mujoco-euler@3.6.0", manifest)

    def test_the_change_of_implicitfast_is_found_and_explained(self):
        done = self.run_assay("bisect", "tumbling.xml", "--contender", "mujoco-implicitfast", "--from", "3.6.0", "--to", "3.7.0", *RUN,
                              "--set", "iterations=100", "--out", "found", "--markdown", "--junit", "found.xml")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("### 3.6.0 to 3.7.0: the motion changed", done.stdout)
        self.assertIn("| 3.7.0 | 1 |", done.stdout)
        case, = xml.etree.ElementTree.parse(self.dir / "found.xml").getroot().iter("testcase")
        self.assertEqual(case.get("name"), "3.6.0 to 3.7.0")
        self.assertIn("free flight (implicitfast)", case.find("failure").text)
        self.assertIn("free flight (implicitfast)", done.stdout)
        self.assertIn("connect (four-bar)", done.stdout)
        self.assertIn("releases/tag/3.7.0", done.stdout)
        self.assertIn("assay explain tumbling.xml mujoco-implicitfast@3.6.0 mujoco-implicitfast@3.7.0 --change-a set:iterations=100 "
                      "--change-b set:iterations=100 --timestep 5 --seconds 5 --seeds 1 --keyframe spun", done.stdout)
        self.assertTrue((self.dir / "found/bisect.json").exists())

    def test_a_setting_is_that_of_all_releases(self):
        """With it the motion changes where it does not without, and the probes name the solver."""
        self.write("boxes.xml", BOXES)
        asked = ["bisect", "boxes.xml", "--contender", "mujoco-euler", "--from", "3.8.1", "--to", "3.9.0", "--seconds", "0.5", "--seeds", "1", "--json"]
        plain = self.assay_json(*asked)
        self.assertEqual((plain["settings"], plain["changes"]), ({}, []))
        done = self.run_assay(*asked, "--set", "solver=pgs", "--set", "iterations=20")
        found = json.loads(done.stdout)
        self.assertEqual(found["settings"], {"iterations": "20", "solver": "pgs"})
        change, = found["changes"]
        self.assertEqual((change["before"], change["after"]), ("3.8.1", "3.9.0"))
        self.assertIn(("solver", "PGS, 20 iterations"), {(each["probe"], each["condition"]) for each in change["probes"]})

    def test_the_course_of_speed(self):
        found = json.loads(self.run_assay("bisect", "tumbling.xml", "--engine", "mujoco", "--from", "3.6.0", "--to", "3.7.0", "--speed",
                                          *RUN, "--json").stdout)
        first, second = found["step_times"]
        self.assertEqual((first["release"], second["release"]), ("3.6.0", "3.7.0"))
        self.assertIsNone(first["to_the_one_before"])
        for interval in (first["step_us"], second["step_us"], second["to_the_one_before"]):
            self.assertTrue(0 < interval["low"] <= interval["value"] <= interval["high"], interval)

    def test_under_a_policy(self):
        folder = SOURCE / "examples/cart-pole-policy"
        done = self.run_assay("bisect", folder / "cart_pole.xml", "--engine", "mujoco", "--from", "3.6.0", "--to", "3.7.0", "--policy-config",
                              folder / "policy.toml", "--quick", "--seconds", "1", "--seeds", "2", "--json")
        self.assertIn(done.returncode, (0, 1), done.stderr)
        for each in json.loads(done.stdout)["releases"]:
            self.assertTrue(0 <= each["values"]["falls"] <= 1, each)

    def test_repetitions_of_one_release_have_no_change_point(self):
        found = self.assay_json("bisect", "tumbling.xml", "--engine", "mujoco", "--from", "3.7.0", "--to", "3.7.0", "--repeat", "20", *RUN,
                                "--json")
        self.assertEqual(found["changes"], [])
        self.assertEqual(len(found["releases"]), 20)
        self.assertEqual(len(found["groups"]), 1)

    def test_a_release_that_is_not_set_up_is_left_out(self):
        self.env["ASSAY_CACHE"] = str(self.dir / "empty")
        self.refused("simulate", "tumbling.xml", "--engine", "mujoco-euler@3.6.0", *STEPS, naming=("release 3.6.0", "./assay setup mujoco@3.6.0"))
        self.refused("bisect", "tumbling.xml", "--engine", "mujoco", "--from", "3.6.0", "--to", "3.7.0", *RUN,
                     naming=("no release could be run", "not set up"))


# Bodies that fall, a little faster from 1.42.0 on. The program knows the releases of `drake`, and this calls itself that.
FALLING = """
import assay_adapter as assay


class Engine(assay.Engine):
    version = assay.pinned("drake", __file__)

    def contenders(self):
        return [assay.Contender(name="drake-sap", summary="bodies that fall")]

    def capabilities(self, settings):
        return assay.Capabilities(coordinates="maximal", integrator="semi-implicit Euler", order=1, joint_solver="none", torques=True)

    def check(self, model, settings):
        return [assay.Limitation(element=f"joint '{joint.name}'", what=assay.refused("it has no joints")) for joint in model.joints]

    def create(self, model, state, settings):
        import numpy

        return Simulation(numpy, model, state, settings.timestep, 1.001 if self.version >= "1.42" else 1.0)


class Simulation:
    def __init__(self, numpy, model, state, timestep, pull):
        self.rows, self.none, self.timestep = state.bodies.copy(), numpy.zeros(0), timestep
        self.gained = pull * timestep * numpy.array(model.gravity)

    def set_torques(self, torques):
        pass

    def advance(self, count):
        for _ in range(count):
            self.rows[:, 7:10] += self.gained
            self.rows[:, 0:3] += self.timestep * self.rows[:, 7:10]

    def read_state(self):
        return {"position": self.none, "velocity": self.none, "bodies": self.rows}
"""
BALL = """<mujoco model="ball">
  <worldbody><body name="ball" pos="0 0 9"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
</mujoco>
"""


class PythonReleases(AssayTest):
    """An adapter in Python has a release with an environment and pins of its own."""

    def setUp(self):
        super().setUp()
        build = pathlib.Path(self.program).resolve().parents[1]
        if not (build / "engines/assay-python-host.so").exists() or not (pathlib.Path(ENVIRONMENT) / "bin/python").exists():
            self.skipTest("this build has no host of adapters in Python, or no environment for it")
        self.write("ball.xml", BALL)
        made = self.dir / "made"
        for folder in ("bin", "engines", "releases"):
            (made / folder).mkdir(parents=True)
        shutil.copy2(self.program, made / "bin/assay")
        shutil.copytree(build / "engines/python", made / "engines/python")
        shutil.copy2(build / "engines/assay-python-host.so", made / "engines")
        (made / "releases/drake.key").write_text("0123456789ab\n")
        self.program = str(made / "bin/assay")
        self.env["ASSAY_CACHE"] = str(self.dir / "cache")
        self.adapter(made / "engines/assay-engine-drake", "1.58.0")
        for release in ("1.40.0", "1.41.0", "1.42.0"):
            self.release(release)

    def adapter(self, folder, version, code=FALLING):
        folder.mkdir(parents=True)
        (folder / "engine.py").write_text(code)
        (folder / "requirements.txt").write_text(f"drake=={version} --hash=sha256:00\n")
        (folder / "environment.txt").write_text(ENVIRONMENT + "\n")

    def release(self, version, code=FALLING):
        self.adapter(self.dir / f"cache/engines/drake@{version}-0123456789ab/assay-engine-drake@{version}", version, code)

    def test_the_change_is_found_and_explained(self):
        self.release("1.43.0", FALLING.replace("import numpy", "import nothing_of_that_name"))
        done = self.run_assay("bisect", "ball.xml", "--engine", "drake", "--from", "1.40.0", "--to", "1.44.0", "--seeds", "1", "--json")
        self.assertEqual(done.returncode, 1, done.stderr)
        found = json.loads(done.stdout)
        change, = found["changes"]
        self.assertEqual((change["before"], change["after"], change["rounding"]), ("1.41.0", "1.42.0", False))
        self.assertAlmostEqual(change["largest_m"], 0.001 * 9.81 * 2**2 / 2, delta=1e-4)
        self.assertIn(("conformance", "free-fall"), {(each["probe"], each["condition"]) for each in change["probes"]})
        failures = {each["release"]: each["failure"] for each in found["releases"] if not each["run"]}
        self.assertIn("nothing_of_that_name", failures["1.43.0"])
        self.assertIn("./assay setup drake@1.44.0", failures["1.44.0"])

    def test_each_release_is_itself(self):
        def states(contender):
            return self.assay("simulate", "ball.xml", "--engine", contender, "--timestep", "5", "--duration", "1", "--out", "-")

        old, new = states("drake-sap@1.41.0"), states("drake-sap@1.42.0")
        self.assertNotEqual(old, new)
        self.assertEqual(new, states("drake-sap"))
        self.assertIn("set up here: 1.40.0, 1.41.0, 1.42.0", " ".join(self.assay("list", "engines").split()))
        done = self.run_assay("conformance", "drake-sap@1.42.0", "--test", "free-fall")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(self.run_assay("conformance", "drake-sap@1.41.0", "--test", "gravity-direction").returncode, 0)

    def test_a_campaign_leaves_out_what_fails_the_suite(self):
        done = self.run_assay("run", "ball.xml", "--contenders", "drake-sap@1.42.0", "--minutes", "0.2", "--out", "results", "--no-set-up")
        self.assertIn("free-fall", self.assay("export", "results", "--format", "json") + done.stdout + done.stderr)


class Lists(unittest.TestCase):
    """src/engines/NAME/releases.txt, whose format setup/releases.sh has."""

    FILES = sorted(SOURCE.glob("src/engines/*/releases.txt"))
    PIN = r"[a-z][a-z0-9-]*==[^ :]+:[0-9a-f]{64}"

    def words(self, file):
        return [line.split(" ") for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]

    def common(self, command):
        script = f'set -euo pipefail; root="{SOURCE}"; source "$root/setup/common.sh"; source "$root/setup/releases.sh"; {command}'
        done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, env={**os.environ, "ASSAY_CACHE": "/nowhere"})
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout.splitlines()

    def test_each_line(self):
        self.assertGreaterEqual({file.parent.name for file in self.FILES}, {"dartpy", "drake", "mujoco", "sapien"})
        for file in self.FILES:
            lines = self.words(file)
            self.assertIn("# changelog: https://", file.read_text(encoding="utf-8"))
            versions = [line[0] for line in lines]
            self.assertEqual(versions, sorted(versions, key=lambda text: [int(part) for part in text.split(".")]), file)
            self.assertEqual(len(set(versions)), len(versions))
            for line in lines:
                with self.subTest(file=file.parent.name, release=line[0]):
                    self.assertRegex(line[2], r"^[0-9a-f]{64}$")
                    for word in line[3:]:
                        self.assertRegex(word, rf"^(python=3\.[0-9]+|{self.PIN}|-[a-z0-9-]+)$")

    def test_the_newest_is_the_one_without_a_release(self):
        for file in self.FILES:
            pins = (file.parent / "requirements.txt" if (file.parent / "requirements.txt").exists() else file.parent / "recipe/pins.txt").read_text()
            version, package, hashed = self.words(file)[-1][:3]
            self.assertIn(f"{package}=={version} --hash=sha256:{hashed}", re.sub(r" *\\\n *", " ", pins), file)

    def test_an_environment_has_the_pins_of_its_release(self):
        newest = self.common("release_requirements drake 1.58.0")
        pins = [line for line in (SOURCE / "src/engines/drake/requirements.txt").read_text().splitlines() if "==" in line]
        self.assertEqual(sorted(line for line in newest if "==" in line), sorted(pins))
        older = [line.split(" ")[0] for line in self.common("release_requirements drake 1.36.0") if "==" in line]
        self.assertEqual(older, ["drake==1.36.0", "numpy==2.4.6"])
        self.assertEqual(self.common("release_python drake 1.36.0; release_python drake 1.58.0"), ["3.11"])
        python, own = self.common("python_of_version 3.11; python_of_version 3.13")
        self.assertTrue(python.endswith("/bin/python3.11") and own.startswith("/nowhere/engines/cpython313-"), (python, own))


class BadInput(AssayTest):
    def setUp(self):
        super().setUp()
        self.write("tumbling.xml", TUMBLING)

    def test_names(self):
        self.refused("simulate", "tumbling.xml", "--engine", "mujoco-euler@3.3.9", *STEPS, naming=("3.3.9", "3.3.7", "4.0.1"))
        self.refused("simulate", "tumbling.xml", "--engine", "ode-quick@0.1", *STEPS, naming=("@0.1",))
        for options, parts in [(["--engine", "ode"], ("'ode'", "mujoco")), ([], ("--engine mujoco",)),
                               (["--engine", "mujoco", "--from", "3.1.0"], ("--from", "3.2.7")),
                               (["--engine", "mujoco", "--from", "3.7.0", "--to", "3.6.0"], ("exchange",)),
                               (["--engine", "mujoco", "--from", "3.7.0", "--to", "3.7.0"], ("--repeat",)),
                               (["--engine", "mujoco", "--repeat", "5"], ("--repeat",)),
                               (["--contender", "mujoco-euler@3.7.0"], ("'mujoco-euler@3.7.0'", "--from")),
                               (["--engine", "mujoco", "--set", "solver=gauss"], ("'gauss'",)),
                               (["--engine", "mujoco", "--set", "tol"], ("'tol'",))]:
            with self.subTest(options=options):
                self.refused("bisect", "tumbling.xml", *options, naming=parts)

    def test_set_up(self):
        for name, parts in [("mujoco@9.9", ("no release 9.9", "3.3.7")), ("ode@1", ("'ode@1'", "mujoco")), ("drake@1.3", ("no release 1.3", "1.58.0"))]:
            done = set_up(name)
            self.assertEqual(done.returncode, 2)
            self.check_sentence(done.stderr, parts)


if __name__ == "__main__":
    main()
