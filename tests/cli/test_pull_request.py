"""setup/pull_request.sh, which action.yml runs: what it comments, what fails, and that the action gives it what it takes."""

import json
import re
import subprocess
import sys

from harness import BALL, PROGRAM, SOURCE, AssayTest, main
from test_check import ROBOT
from test_kubernetes import read_yaml

sys.path.insert(0, str(SOURCE / "benchmarks"))
import compare_power  # noqa: E402

SCRIPT = SOURCE / "setup/pull_request.sh"


class PullRequest(AssayTest):
    with_verdicts = False

    def examine(self, *options, status=0, out="out", **environment):
        done = subprocess.run(["bash", SCRIPT, "--out", out, *options], cwd=self.dir, env={**self.env, "ASSAY": PROGRAM, **environment},
                              capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=500)
        self.assertEqual(done.returncode, status, done.stderr)
        return done.stderr

    def comment(self):
        return (self.dir / "out/comment.md").read_text(encoding="utf-8")

    def test_a_folder_with_a_baseline(self):
        self.write("models/arms/robot.xml", ROBOT)
        self.write("models/ball.xml", BALL)
        self.examine("--folder", "models", "--fail-on", "mend", status=1, GITHUB_OUTPUT=str(self.dir / "outputs"),
                     GITHUB_STEP_SUMMARY=str(self.dir / "summary"))
        text = self.comment()
        self.assertIn("## Robots\n\n### `models`: 2 robots, 1 ok, 1 to mend, 0 refused", text)
        self.assertEqual((self.dir / "summary").read_text(encoding="utf-8"), text)
        self.assertEqual((self.dir / "outputs").read_text(), "comment=out/comment.md\nsarif=out/robots.sarif\n")
        self.assertTrue((self.dir / "out/robots.junit.xml").exists())
        results = json.loads((self.dir / "out/robots.sarif").read_text(encoding="utf-8"))["runs"][0]["results"]
        self.assertEqual({result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for result in results},
                         {"models/arms/robot.xml"})  # of the repository
        self.assay("check", "models", "--write-baseline", "known.json")
        self.examine("--folder", "models", "--fail-on", "know", "--baseline", "known.json")
        self.assertIn("0 findings new", self.comment())

    def test_options_of_the_check(self):
        self.write("kite.xml", BALL.replace('name="ball"', 'name="ball" gravcomp="0.5"'))
        self.examine(status=1)
        self.examine("--", "--drop-unsupported")

    def test_a_folder_without_robots_is_said(self):
        (self.dir / "empty").mkdir()
        sentence = self.examine("--folder", "empty", status=2)
        self.check_sentence(sentence, ["no robot", "'empty'"])
        self.assertIn("there is no robot", self.comment())
        self.assertFalse((self.dir / "out/robots.sarif").exists())

    def test_pairs(self):
        self.write("a.xml", BALL)
        self.write("b.xml", BALL.replace('mass="2"', 'mass="2.1"'))
        self.write("pairs.txt", "# of one robot\na.xml a.xml\n\n  a.xml b.xml --samples 2")
        self.examine("--pairs", "pairs.txt", status=1)
        same, other = self.comment().split("## Pair ")[1:]
        self.assertIn("one robot", same)
        self.assertIn("2.1 instead of 2 kg", other)
        self.examine("--pairs", "pairs.txt", "--fail-above", "20%")
        self.write("pairs.txt", "a.xml\n")
        self.assertIn("'a.xml' on a line: write two files", self.examine("--pairs", "pairs.txt", status=2))

    def test_results(self):
        self.write("a.xml", BALL)
        for name, slower in (("before", 0.0), ("after", 0.2)):
            compare_power.write_run(self.dir / name, [-0.01, -0.005, 0, 0.005, 0.01], (3, 6, 6), slower, 0.0, 0, f"{name}0")
        self.examine("--before", "before", "--after", "after", status=1)
        self.assertIn("## Results", self.comment())
        self.assertIn("worse by at least 5 %", self.comment())
        self.examine("--before", "before", "--after", "after", "--fail-on-regression", "50%")

    def test_text_of_strangers_stays_in_its_fence(self):
        self.write("a.xml", BALL.replace('name="ball"', 'name="~~~~~~~~"'))
        self.write("b.xml", BALL.replace('name="ball"', 'name="~~~~~~~~"').replace('mass="2"', 'mass="3"'))
        self.write("pairs.txt", "a.xml b.xml\n")
        self.examine("--pairs", "pairs.txt", status=1)
        pair = self.comment().split("## Pair 1")[1]
        self.assertEqual(len(re.findall("~{8,}", pair)), 2)

    def test_wrong_calls(self):
        for options, words in ((("--before", "x"), "--before and --after go together"), (("--pairs", "none"), "'none' cannot be read"),
                               (("--oops", "1"), "no option '--oops'"), (("--folder",), "--folder needs a value")):
            self.assertIn(words, self.examine(*options, status=2))
        self.assertIn("no program 'nowhere'", self.examine(status=2, ASSAY="nowhere"))
        self.assertFalse((self.dir / "out").exists())


class Action(AssayTest):
    with_verdicts = False

    def setUp(self):
        super().setUp()
        self.action = read_yaml(SOURCE / "action.yml")
        self.text = (SOURCE / "action.yml").read_text(encoding="utf-8")

    def test_it_is_composite_and_complete(self):
        self.assertEqual(self.action["runs"]["using"], "composite")
        for step in self.action["runs"]["steps"]:
            self.assertTrue("uses" in step or step["shell"] == "bash", step)
            # a value that is pasted into a script could be one
            self.assertNotIn("${{", step.get("run", ""))
        for name, value in self.action["inputs"].items():
            self.assertTrue(value["description"], name)
            self.assertIn("default", value, name)
        self.assertEqual(set(re.findall(r"inputs\.([\w-]+)", self.text)), set(self.action["inputs"]))

    def test_the_script_takes_what_it_gives(self):
        (examine,) = [step for step in self.action["runs"]["steps"] if step.get("id") == "examine"]
        given = set(re.findall(r" (--[a-z-]+) ", examine["run"]))
        self.assertEqual(given, set(re.findall(r"(?m)^    (--[a-z-]+)\)", SCRIPT.read_text(encoding="utf-8"))))
        self.assertEqual(set(re.findall(r"\$\{([A-Z_]+)\}", examine["run"])) - {"RUNNER_TEMP", "GITHUB_ACTION_PATH"}, set(examine["env"]))

    def test_its_steps_run(self):
        """The step that examines, as GitHub would run it."""
        (examine,) = [step for step in self.action["runs"]["steps"] if step.get("id") == "examine"]
        inputs = {name: value["default"] for name, value in self.action["inputs"].items()}
        inputs["pairs"] = "a.xml a.xml\n"
        self.write("a.xml", BALL)
        self.write("bin/assay", f'#!/bin/sh\nexec "{PROGRAM}" "$@"\n').chmod(0o755)
        env = {**self.env, "RUNNER_TEMP": str(self.dir / "tmp"), "GITHUB_ACTION_PATH": str(SOURCE), "GITHUB_OUTPUT": str(self.dir / "outputs"),
               "PATH": f"{self.dir / 'bin'}:{self.env['PATH']}"}
        (self.dir / "tmp").mkdir()
        for name, value in examine["env"].items():
            env[name] = re.sub(r"\$\{\{ inputs\.([\w-]+) \}\}", lambda found: inputs[found.group(1)], value)
        done = subprocess.run(["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", examine["run"]], cwd=self.dir, env=env,
                              capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=500)
        self.assertEqual(done.returncode, 0, done.stderr)
        comment = (self.dir / "tmp/assay-robots/comment.md").read_text(encoding="utf-8")
        self.assertIn("## Robots", comment)
        self.assertIn("## Pair 1", comment)
        self.assertIn("sarif=", (self.dir / "outputs").read_text())


if __name__ == "__main__":
    main()
