"""An adapter outside the tree: built against the installed headers and found through ASSAY_ENGINE_PATH."""

import csv
import io

from harness import BALL, AssayTest, main


class OutOfTree(AssayTest):
    def test_skeleton_is_a_project_of_its_own(self):
        printed = self.follow_example("adapter")
        self.assertIn("free-fall", printed)
        # The installed program, with the installed engines: the source tree must not be needed.
        self.program = str(self.dir / "installed/bin/assay")
        self.assertNotIn("myengine", self.engine_names())
        self.env["ASSAY_ENGINE_PATH"] = str(self.dir / "my_engine/build/engines")
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
