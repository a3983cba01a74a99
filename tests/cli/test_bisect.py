"""Releases of MuJoCo as contenders, and `assay bisect` between two of them. The test sets the releases up for this build: half a minute each,
the first time over the network."""

import os
import pathlib
import subprocess
import unittest
import xml.etree.ElementTree

from harness import SOURCE, AssayTest, main

RELEASES = ["3.6.0", "3.7.0"]
CACHE = os.environ.get("ASSAY_TEST_CACHE", "")

# A body with three unequal moments that tumbles.
TUMBLING = """<mujoco model="tumbling">
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="body" pos="0 0 1"><freejoint/><inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.02 0.028"/></body>
  </worldbody>
  <keyframe><key name="spun" qpos="0 0 1 1 0 0 0" qvel="0 0 0 0.2 8 0.2"/></keyframe>
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
                              "--out", "found", "--markdown", "--junit", "found.xml")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("### 3.6.0 to 3.7.0: the motion changed", done.stdout)
        self.assertIn("| 3.7.0 | 1 |", done.stdout)
        case, = xml.etree.ElementTree.parse(self.dir / "found.xml").getroot().iter("testcase")
        self.assertEqual(case.get("name"), "3.6.0 to 3.7.0")
        self.assertIn("free flight (implicitfast)", case.find("failure").text)
        self.assertIn("free flight (implicitfast)", done.stdout)
        self.assertIn("connect (four-bar)", done.stdout)
        self.assertIn("releases/tag/3.7.0", done.stdout)
        self.assertTrue((self.dir / "found/bisect.json").exists())

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
                               (["--engine", "mujoco", "--repeat", "5"], ("--repeat",))]:
            with self.subTest(options=options):
                self.refused("bisect", "tumbling.xml", *options, naming=parts)

    def test_set_up(self):
        for name, parts in [("mujoco@9.9", ("no release 9.9", "3.3.7")), ("ode@1", ("'ode@1'", "mujoco"))]:
            done = set_up(name)
            self.assertEqual(done.returncode, 2)
            self.check_sentence(done.stderr, parts)


if __name__ == "__main__":
    main()
