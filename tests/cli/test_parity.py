"""`assay parity`: the certificate as a file, in results, and in their report; two files compared."""

import json
import random
import re
import sys

from harness import SOURCE, AssayTest, campaign, main

sys.path.insert(0, str(SOURCE / "benchmarks"))
import parity_pairs  # noqa: E402

ARM = """<mujoco model="arm">
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" axis="0 1 0" damping="0.3" range="-1 2"/>
      <inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.03 0.025"/>
      <body name="fore" pos="0.3 0 0">
        <joint name="elbow" axis="0 1 0" damping="0.2" range="-2 2"/>
        <inertial pos="0.1 0 0" mass="1" diaginertia="0.005 0.012 0.013"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


class Certificate(AssayTest):
    def test_in_results_is_a_section_of_the_report(self):
        self.write("small.toml", campaign("small", [4], ["drift"], duration_s=0.064, sample_ms=32))
        self.assay("run", "small.toml", "--out", "results")
        self.assay("report", "results")
        self.assertEqual(self.in_report(), [])
        done = self.run_assay("parity", "planar-chain", "mujoco-euler", "--samples", "2", "--out", "results")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("assay report results", done.stderr)
        stored = json.loads((self.dir / "results/parity/planar-chain.json").read_text())
        self.assertEqual(stored["model"], "planar-chain")
        self.assay("report", "results")
        self.assertEqual(self.in_report(), [stored])

    def test_is_not_written_through_links(self):
        victim = self.write("victim", "mine")
        (self.dir / "r/parity").mkdir(parents=True)
        file = self.dir / "r/parity/planar-chain.json"
        file.symlink_to(victim)
        command = ["parity", "planar-chain", "mujoco-euler", "--samples", "2", "--out"]
        self.assay(*command, "r")
        self.assertFalse(file.is_symlink())
        self.assertEqual(json.loads(file.read_text())["model"], "planar-chain")
        file.unlink()
        file.parent.rmdir()
        (self.dir / "elsewhere").mkdir()
        file.parent.symlink_to(self.dir / "elsewhere")

        def is_refused(out, naming):
            done = self.run_assay(*command, out)
            self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
            self.check_sentence(done.stderr.splitlines()[-1], naming)  # after the progress

        is_refused("r", ["r/parity'", "a symbolic link"])
        self.assertEqual(list((self.dir / "elsewhere").iterdir()), [])
        (self.dir / "one.json.partial").symlink_to(victim)
        is_refused("one.json", ["'one.json.partial'", "a symbolic link"])
        self.assertEqual(victim.read_text(), "mine")

    def in_report(self):
        page = (self.dir / "results/report.html").read_text()
        data = re.search(r'<script[^>]*id="assay-data"[^>]*>(.*?)</script>', page, re.S).group(1)
        return json.loads(data)["parity"]

    def test_of_a_folder_or_a_file(self):
        folder = self.dir / "certificates"
        folder.mkdir()
        for out, file in (("certificates", "certificates/parity/planar-chain.json"), ("one.json", "one.json")):
            self.assay("parity", "planar-chain", "mujoco-euler", "--samples", "2", "--out", out)
            certificate = json.loads((self.dir / file).read_text())["certificates"][0]
            self.assertEqual(certificate["verdict"], "same")
            for joint in certificate["joints"]:
                self.assertEqual(set(joint) - {"element"}, {"inertia", "Coriolis", "gravity", "springs", "damping", "dry friction",
                                                            "armature", "torque"})
                self.assertLess(joint["armature"]["error"], 1e-6)


class TwoFiles(AssayTest):
    def compared(self, *arguments, status=None):
        done = self.run_assay("parity", *arguments, "--json")
        if status is not None:
            self.assertEqual(done.returncode, status, done.stderr + done.stdout)
        return json.loads(done.stdout)

    def pair(self, kind, seed, changed):
        robot, first, second, difference = parity_pairs.pair(kind, seed, changed)
        of_a, of_b = (".urdf" if each == "urdf" else ".xml" for each in kind.split("-"))
        return robot, parity_pairs.write(first, self.dir / f"a{of_a}"), parity_pairs.write(second, self.dir / f"b{of_b}"), difference

    def test_a_seeded_difference_is_named_first(self):
        for kind in ("mjcf-mjcf", "urdf-mjcf", "urdf-urdf"):
            for seed in range(4):
                with self.subTest(kind=kind, seed=seed):
                    robot, a, b, difference = self.pair(kind, seed, True)
                    result = self.compared(a, b, status=1)
                    named, seen = parity_pairs.named_first(robot, result, difference)
                    self.assertTrue(named, f"{difference}: {seen}")

    def test_one_robot_in_two_formats_gives_no_alarm(self):
        for kind in ("mjcf-mjcf", "urdf-mjcf", "urdf-urdf"):
            for seed in range(100, 103):
                with self.subTest(kind=kind, seed=seed):
                    _, a, b, _ = self.pair(kind, seed, False)
                    result = self.compared(a, b, status=0)
                    self.assertEqual((result["verdict"], result["findings"], result["differences"]), ("same", [], []))
                    self.assertLess(result["motion"]["distance"], 1e-3)

    def test_status_text_and_matches(self):
        self.write("a.xml", ARM)
        self.write("b.xml", ARM.replace('mass="1"', 'mass="1.05"').replace('"elbow"', '"m7"').replace('"fore"', '"link7"'))
        done = self.run_assay("parity", "a.xml", "b.xml")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("2 of 2 and 2 joints match", done.stdout)
        self.assertRegex(done.stdout, r"body 'fore' +mass +1.05 instead of 1 kg \(\+5 %\)")
        self.assertRegex(done.stdout, r"one second in mujoco-euler: bodies are up to \d")
        self.assertEqual(self.run_assay("parity", "a.xml", "b.xml", "--fail-above", "50%").returncode, 0)
        listed = self.run_assay("parity", "a.xml", "b.xml", "--matches").stdout
        self.assertRegex(listed, r"joint +elbow +m7 +kinematics")
        mapped = self.compared("a.xml", "b.xml", "--map", "elbow=m7")
        self.assertIn({"kind": "joint", "a": "elbow", "b": "m7", "how": "map", "reversed": False}, mapped["matches"])

    def test_free_against_fixed_base_is_one_finding(self):
        rng = random.Random(7)
        robot = parity_pairs.Robot(rng, full=False)
        robot.free = False
        fixed = parity_pairs.write(parity_pairs.urdf(robot, rng), self.dir / "fixed.urdf")
        robot.free = True
        free = parity_pairs.write(parity_pairs.mjcf(robot, rng), self.dir / "free.xml")
        result = self.compared(fixed, free, status=1)
        self.assertEqual([finding["element"] for finding in result["findings"]], ["base"])
        self.assertEqual(result["differences"], [])

    def test_what_is_written_is_the_pair(self):
        robot, a, b, _ = self.pair("mjcf-mjcf", 5, True)
        self.run_assay("parity", a, b, "--write", "agreed.xml")
        self.assertEqual(self.compared(a, "agreed.xml", status=0)["verdict"], "same")

    def test_a_converted_file_is_the_pair(self):
        for seed in range(3):
            _, a, b, _ = self.pair("urdf-mjcf", seed, False)
            for source in (a, b):
                for to, ending in (("mjcf", "xml"), ("urdf", "urdf")):
                    with self.subTest(seed=seed, source=source, to=to):
                        self.assay("convert", source, "--to", to, "--out", f"converted.{ending}")
                        self.assertEqual(self.compared(source, f"converted.{ending}", status=0)["verdict"], "same")
        _, a, _, _ = self.pair("mjcf-mjcf", 2, False)
        done = self.run_assay("convert", a, "--to", "urdf", "-o", "full.urdf")
        self.assertIn("URDF has no armature of joints", done.stderr)
        self.assertIn("URDF has no drives but motors", done.stderr)
        parameters = {each["parameter"] for each in self.compared(a, "full.urdf", status=1)["differences"]}
        self.assertEqual(parameters, {"armature"})
        done = self.run_assay("convert", a, "--to", "sdf", "-o", "x")
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.check_sentence(done.stderr, ["--to is 'sdf'", "mjcf or urdf"])

    def test_is_a_section_of_the_report(self):
        self.write("small.toml", campaign("small", [4], ["drift"], duration_s=0.064, sample_ms=32))
        self.assay("run", "small.toml", "--out", "results")
        self.write("a.xml", ARM)
        self.write("b.xml", ARM.replace('mass="1"', 'mass="1.05"'))
        self.assertEqual(self.run_assay("parity", "a.xml", "b.xml", "--out", "results").returncode, 1)
        stored = json.loads((self.dir / "results/parity/arm-arm.json").read_text())
        self.assertEqual(stored["differences"][0]["parameter"], "mass")
        self.assay("report", "results")
        page = (self.dir / "results/report.html").read_text()
        data = re.search(r'<script[^>]*id="assay-data"[^>]*>(.*?)</script>', page, re.S).group(1)
        self.assertEqual(json.loads(data)["parity"], [stored])

    def test_wrong_input(self):
        self.write("a.xml", ARM)
        self.write("b.xml", ARM.replace("elbow", "knee"))
        self.write("still.xml", "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
        self.write("other.xml", """<mujoco><worldbody>
          <body><joint type="slide" axis="0 0 1"/><geom size="0.1" mass="1"/>
            <body pos="0 0 3"><joint type="ball"/><geom size="0.1" mass="1"/></body></body></worldbody></mujoco>""")
        for arguments, naming in ((["b.xml", "--map", "elbow"], ["--map is 'elbow'", "A_NAME=B_NAME"]),
                                  (["b.xml", "--map", "elbo=knee"], ["'elbo'", "did you mean 'elbow'"]),
                                  (["b.xml", "--map", "elbow=kne"], ["'kne'", "did you mean 'knee'"]),
                                  (["b.xml", "--fail-above", "a lot"], ["--fail-above is 'a lot'"]),
                                  (["b.xml", "--contender", "mujoco-eular"], ["mujoco-eular", "did you mean"]),
                                  (["b.xml", "dart"], ["'dart'", "--contender"]),
                                  (["b.xml", "--write", "b.xml"], ["--write 'b.xml'", "give another one"]),
                                  (["b.xml", "--write", "a.xml"], ["--write 'a.xml'", "give another one"]),
                                  (["gone.xml"], ["'gone.xml'"]),
                                  (["still.xml"], ["still.xml", "nothing in it can move"]),
                                  (["other.xml"], ["0 of 2 joints match", "--map A_NAME=B_NAME"]),
                                  (["mujoco-euler", "--matches"], ["--matches is for two files"]),
                                  (["--write", "x.xml"], ["--write is for two files"])):
            with self.subTest(arguments=arguments):
                done = self.run_assay("parity", "a.xml", *arguments)
                self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
                self.check_sentence(done.stderr, naming)


if __name__ == "__main__":
    main()
