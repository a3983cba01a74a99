"""Each example's README: its commands are run as they are written."""

import csv
import math
import os
import pathlib
import re
import unittest
import xml.etree.ElementTree

from harness import SOURCE, AssayTest, main, read_csv

LIBRARIES = pathlib.Path(os.environ.get("ASSAY_TEST_CACHE", "/nowhere")) / "libraries"
needs_onnx_runtime = unittest.skipUnless(list(LIBRARIES.glob("onnxruntime-*")), "needs ONNX Runtime, which setup/setup.sh fetches")


class Examples(AssayTest):
    def test_every_example_is_listed_and_followed(self):
        folders = sorted(path.name for path in (SOURCE / "examples").iterdir() if path.is_dir())
        listed = re.findall(r"^\| \[([\w-]+)\]\(\1/README.md\)", (SOURCE / "examples/README.md").read_text(), re.MULTILINE)
        self.assertEqual(folders, sorted(listed))
        tests = "".join(path.read_text() for path in (SOURCE / "tests/cli").glob("test_*.py"))
        self.assertEqual(folders, sorted(set(re.findall(r"self\.follow_example\(\"([\w-]+)\"[,)]", tests))))

    def test_my_model(self):
        verdicts = self.follow_example("my-model")
        for engine in ("mujoco", "ode"):
            self.assertIn(engine, verdicts)
        ends = []
        for name in ("my_run.csv", "other_run.csv"):
            rows = list(csv.DictReader((self.dir / name).read_text().splitlines()))
            self.assertEqual(len(rows), 3 * 101)
            ends.append({row["body"]: float(row["x"]) for row in rows[-3:]})
        # the arm has pushed the ball, in both engines
        self.assertGreater(abs(ends[0]["ball"] - 0.5), 0.01)
        self.assertGreater(abs(ends[1]["ball"] - 0.5), 0.01)

    def test_my_campaign(self):
        answer = self.follow_example("my-campaign")
        self.assertRegex(answer, r"(mujoco-euler|mujoco-rk4|bullet-si-f64|ode-quick)\b")
        self.assertIn("</html>", (self.dir / "my_results/report.html").read_text(encoding="utf-8"))
        rows = list(csv.DictReader((self.dir / "my_values.csv").read_text().splitlines()))
        self.assertEqual({row["contender"] for row in rows if row["measure"] == "consistency"},
                         {"mujoco-euler", "mujoco-rk4", "bullet-si-f64", "ode-quick"})

    def let_find_libraries(self):
        (self.dir / "cache/assay").mkdir(parents=True, exist_ok=True)
        (self.dir / "cache/assay/libraries").symlink_to(LIBRARIES)

    def run_under(self, example, robot, engine, **changes):
        """Rows of a run of 3 s under the example's policy, with `changes` of its configuration's lines."""
        config = self.dir / "examples" / example / "changed.toml"
        text = (config.parent / "policy.toml").read_text(encoding="utf-8")
        for key, value in changes.items():
            text, count = re.subn(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
            self.assertEqual(count, 1)
        config.write_text(text, encoding="utf-8")
        return read_csv(self.assay("simulate", config.parent / robot, "--policy-config", config, "--engine", engine, "--timestep",
                                   "5", "--duration", "3", "--sample", "20", "--out", "-"))

    @needs_onnx_runtime
    def test_cart_pole_policy(self):
        self.let_find_libraries()
        printed = self.follow_example("cart-pole-policy")
        self.assertEqual(printed.count("4 of 4 contenders stay up at "), 2)
        self.assertEqual(printed.count("stays up"), 2 * (4 + 1))  # in the tables of two answers, and what explains them
        rows = list(csv.DictReader((self.dir / "run.csv").read_text().splitlines()))
        self.assertGreater(min(float(row["z"]) for row in rows if row["body"] == "pole"), 0.95)

    @needs_onnx_runtime
    def test_quadruped_policy(self):
        self.let_find_libraries()
        printed = self.follow_example("quadruped-policy")
        self.assertIn("ode-quick", printed)
        matrix = self.assay_json("transfer", "walked", "--json")["systems"][0]
        self.assertEqual({row["contender"]: row["values"]["fall_rate"]["value"] for row in matrix["rows"]},
                         {"mujoco-euler": 0, "ode-quick": 0, "dart": 0})

        def speed(rows):
            trunk = {round(row["time"], 3): row["x"] for row in rows if row["body"] == "trunk"}
            return (trunk[3] - trunk[1]) / 2

        self.assertAlmostEqual(speed(read_csv((self.dir / "run.csv").read_text())), 0.5, delta=0.15)
        # it obeys: another command, another speed
        slow = speed(self.run_under("quadruped-policy", "quadruped.xml", "mujoco-euler", velocity="[0.3, 0, 0]"))
        fast = speed(self.run_under("quadruped-policy", "quadruped.xml", "mujoco-euler", velocity="[0.7, 0, 0]"))
        self.assertGreater(fast - slow, 0.2)

    @needs_onnx_runtime
    def test_arm_reach_policy(self):
        self.let_find_libraries()
        printed = self.follow_example("arm-reach-policy")
        self.assertIn("3 of 3 contenders stay up at ", printed)

        def hand(rows):
            return [(row["x"], row["y"], row["z"]) for row in rows if row["body"] == "hand"][-1]

        target = (0.35, 0.15, 0.3)
        self.assertLess(math.dist(hand(read_csv((self.dir / "run.csv").read_text())), target), 0.02)
        other = (0.3, -0.1, 0.35)
        rows = self.run_under("arm-reach-policy", "arm.xml", "dart", values=list(other))
        self.assertLess(math.dist(hand(rows), other), 0.02)

    def test_match(self):
        self.assertIn("hinge.torque", self.follow_example("match"))

    def test_read_results(self):
        printed = self.follow_example("read-results")
        rows = [row for row in csv.DictReader((self.dir / "my_results/values.csv").read_text().splitlines())
                if row["measure"] == "realtime_factor"]
        self.assertEqual(len(rows), 12)
        for row in rows:
            self.assertIn(f"{float(row['value']):.3g} x", printed)
        self.assertRegex(printed, r"my_robot, ode-quick: upper_arm moved \d+\.\d+ m")
        plot = xml.etree.ElementTree.parse(self.dir / "my_plot.svg").getroot()
        circles = [each for each in plot if each.tag.endswith("circle")]
        self.assertEqual(len(circles), 12)


if __name__ == "__main__":
    main()
