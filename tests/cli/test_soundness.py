"""Committed results were judged by older rules of soundness: what they have stored is judged again by today's."""

import lzma
import math
import pathlib

from harness import AssayTest, main

RESULTS = pathlib.Path(__file__).resolve().parents[2] / "results"
# Runs that were stored as ok with a hinge more than a turn beyond its limit.
IMPOSSIBLE = {"intel-xeon-2-cores": {("grasp", "havok", 0.25), ("grasp", "havok", 0.5), ("grasp", "rapier-impulse-f64", 0.5),
                                     ("grasp", "rapier-impulse-f64-native-pd", 16), ("astronaut", "bullet-si-f64", 16),
                                     ("astronaut", "rapier-impulse-f64", 16), ("astronaut", "havok", 16),
                                     ("astronaut", "rapier-impulse-f64", 32), ("astronaut", "havok", 32)},
              "field-2026-11-25": {("humanoid", "havok", 16)}}


class Soundness(AssayTest):
    def test_no_committed_run_passes_its_limit_by_a_turn_and_counts_as_sound(self):
        for name, runs in IMPOSSIBLE.items():
            with self.subTest(name):
                (self.dir / name).mkdir()
                (self.dir / name / "assay.sqlite").write_bytes(lzma.decompress((RESULTS / name / "assay.sqlite.xz").read_bytes()))
                rows = self.assay_json("export", name, "--format", "json")
                for row in rows:
                    if row["measure"] == "limit_violation_max" and row["value"] is not None and row["value"] > 2 * math.pi:
                        self.assertNotEqual(row["outcome"], "ok", row)
                for run in runs:
                    of_run = {row["measure"]: row["outcome"] for row in rows
                              if (row["system"], row["contender"], row["timestep_ms"]) == run}
                    for measure in of_run.keys() & {"limit_violation_max", "grasp_held", "energy_drift"}:
                        self.assertIn(of_run[measure], ("unstable", "withdrawn"), (run, measure))
        done = self.run_assay("recommend", "intel-xeon-2-cores", "astronaut", "--error", "100m", "--measure", "violation")
        self.assertRegex(done.stdout + done.stderr, r"(?s)havok.*judged again: a hinge is 12\.7 rad beyond its limit")


if __name__ == "__main__":
    main()
