"""benchmarks/gpu: many worlds within a limited time, with a stand-in for the engine; packages in parts; the way to a results directory."""

import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

from harness import SOURCE, main

GPU = SOURCE / "benchmarks/gpu"


@unittest.skipIf(importlib.util.find_spec("numpy") is None, "this Python has no NumPy, which the stand-in needs")
class GpuScript(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        (self.folder / "models").mkdir()
        (self.folder / "models/humanoid.json").write_text(json.dumps({"torque": [1.0, 2.0]}))

    def measure(self, *options, happens="", contender="stand-in"):
        return subprocess.run(
            [GPU / "run.sh", "--out", self.folder / "out", "--models", self.folder / "models", "--only", contender, "--device", "cpu",
             "--model", "humanoid", "--most", "64", *options],
            env={**os.environ, "PYTHON": sys.executable, "ASSAY_GPU_SCRATCH": str(self.folder / "scratch"), "ASSAY_GPU_STAND_IN": happens},
            capture_output=True, text=True, timeout=60)

    def records(self):
        return {record["worlds"]: record for record in map(json.loads, (self.folder / "out/records.jsonl").read_text().splitlines())}

    def test_goes_on_where_it_stopped(self):
        first = self.measure("--most", "4")
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertEqual(set(self.records()), {1, 4})
        # a run that was killed while it wrote
        with open(self.folder / "out/records.jsonl", "a") as file:
            file.write('{"cell": "stand-')
        second = self.measure()
        self.assertIn("2 cells to measure, 2 are stored", second.stdout)
        lines = (self.folder / "out/records.jsonl").read_text().splitlines()
        cells = [json.loads(line)["cell"] for line in lines if line.endswith("}")]
        self.assertEqual(sorted(cells), sorted(set(cells)))
        self.assertEqual(len(cells), 4)

    def test_failures_are_outcomes_and_other_cells_stay(self):
        answer = self.measure(happens="16:memory,4:crash")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        found = self.records()
        self.assertEqual(found[1]["outcome"], "ok")
        self.assertTrue(found[1]["same_bits"])
        self.assertGreaterEqual(len(found[1]["window_s"]), 3)
        self.assertEqual(found[16]["outcome"], "out-of-memory")
        self.assertIn("RESOURCE_EXHAUSTED", found[16]["reason"])
        self.assertEqual(found[4]["outcome"], "crashed")
        self.assertIn("signal 11", found[4]["reason"])

    def test_a_hang_ends_at_its_limit(self):
        answer = self.measure("--most", "1", "--compile-limit", "2", happens="1:hang")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertEqual(self.records()[1]["outcome"], "timeout")

    def test_says_what_is_missing(self):
        answer = self.measure(contender="newton-steel")
        if importlib.util.find_spec("newton"):
            self.skipTest("this Python has Newton")
        self.assertIn("newton is left out: the Python package", answer.stdout)
        nothing = subprocess.run([sys.executable, GPU / "run.py", "--out", self.folder / "out", "--device", "cuda:0"],
                                 env={**os.environ, "PATH": ""}, capture_output=True, text=True, timeout=60)
        self.assertEqual(nothing.returncode, 1)
        self.assertIn("no NVIDIA GPU answers", nothing.stderr)

    def test_packages_in_parts(self):
        wheel = self.folder / "thing-1-py3-none-any.whl"
        with zipfile.ZipFile(wheel, "w") as file:
            file.writestr("thing/__init__.py", "here = True\n")
            file.writestr("thing/tests/large.bin", os.urandom(1000))

        def parts(*arguments):
            return subprocess.run([sys.executable, GPU / "parts.py", *map(str, arguments)], capture_output=True, text=True, timeout=60)

        kept, site = self.folder / "parts", self.folder / "site"
        self.assertEqual(parts("pack", kept, "thing", wheel, "--leave-out", "*/tests/*").returncode, 0)
        self.assertEqual(parts("join", kept, site, "thing").returncode, 0)
        self.assertTrue((site / "thing/__init__.py").exists())
        self.assertFalse((site / "thing/tests").exists())
        (kept / "thing.000").write_bytes(b"other")
        shutil.rmtree(site)
        self.assertIn("has other bytes than were packed", parts("join", kept, site, "thing").stderr)
        (kept / "thing.000").unlink()
        self.assertIn("parts of thing are missing: thing.000", parts("join", kept, site, "thing").stderr)


if __name__ == "__main__":
    main()
