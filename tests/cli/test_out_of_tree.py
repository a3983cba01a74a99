"""An adapter outside the tree: built against the installed headers and found through ASSAY_ENGINE_PATH."""

import csv
import io
import pathlib
import shutil
import subprocess

from harness import BALL, PROGRAM, AssayTest, main

BUILD = pathlib.Path(PROGRAM).parent.parent


class OutOfTree(AssayTest):
    def do(self, *command):
        done = subprocess.run([str(part) for part in command], cwd=self.dir, env=self.env, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, f"{command}: {done.stdout[-3000:]}{done.stderr[-3000:]}")

    def test_skeleton_is_a_project_of_its_own(self):
        self.do("cmake", "--install", BUILD, "--prefix", self.dir / "installed")
        # The installed program, with the installed engines: the source tree must not be needed.
        self.program = str(self.dir / "installed/bin/assay")
        project = self.dir / "myengine"
        shutil.copytree(self.dir / "installed/share/assay/skeleton", project)
        self.do("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.dir / 'installed'}")
        self.do("cmake", "--build", project / "build")
        self.assertNotIn("myengine", self.engine_names())
        self.env["ASSAY_ENGINE_PATH"] = str(project / "build/engines")
        self.assertIn("myengine", self.engine_names())
        report = self.assay_json("conformance", "skeleton", "--test", "free-fall", "--test", "torque-free-top", "--json")
        self.assertEqual({result["test"]: result["status"] for result in report["contenders"][0]["results"]},
                         {"free-fall": "pass", "torque-free-top": "pass"})
        model = self.write("ball.xml", BALL)
        text = self.assay("simulate", model, "--engine", "skeleton", "--contacts", "off", "--timestep", "1",
                          "--duration", "0.5", "--sample", "500", "--out", "-")
        # thrown up at 3 m/s from 10 m: semi-implicit Euler is g h t / 2 below the parabola
        self.assertAlmostEqual(float(list(csv.DictReader(io.StringIO(text)))[-1]["z"]),
                               10 + 3 * 0.5 - 9.81 * 0.5**2 / 2 - 9.81 * 1e-3 * 0.5 / 2, places=9)

    def engine_names(self):
        return {row["engine"] for row in self.assay_json("engines", "--json")["contenders"]}


if __name__ == "__main__":
    main()
