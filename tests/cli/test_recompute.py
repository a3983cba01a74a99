"""Published figures against tests/recompute.py, which computes them from databases and stored states by the documentation."""

import contextlib
import csv
import json
import pathlib
import re
import resource
import shutil
import sqlite3
import sys
import time
import unittest.mock

from harness import BALL, BALL_CAMPAIGN, SOURCE, AssayTest, main

sys.path.insert(0, str(SOURCE / "tests"))
import recompute  # noqa: E402
import statements  # noqa: E402

sys.path.insert(0, str(SOURCE / "results"))
import publish  # noqa: E402

PAGE = SOURCE / "docs/lab/claims.md"
# The committed run that the page is written from.
FULL = SOURCE / "results" / re.search(r"results/([\w.-]+)/assay\.sqlite\.xz", PAGE.read_text("utf-8")).group(1)

SMALL = """
name = "small"
contenders = ["mujoco-euler", "mujoco-rk4", "ode-quick"]
timesteps_ms = ["1/4", 1, 4]
reference_ms = "1/4"
[timing]
rounds = 6
processes = 2
batch_ms = 1
twins = ["mujoco-euler"]
[[system]]
name = "planar-chain"
measures = ["raw_speed", "consistency", "truth", "drift", "agreement"]
duration_s = 0.32
pieces = 4
piece_ms = [64, 32]
initial_states = 2
[[system]]
name = "humanoid"
measures = ["consistency", "violation", "agreement"]
control = "actuators"
duration_s = 0.128
pieces = 2
piece_ms = 64
[[system]]
name = "grasp"
measures = ["consistency", "grasp", "agreement"]
control = "actuators"
duration_s = 0.064
pieces = 2
piece_ms = 32
grasp = {object = "object", hand = "palm"}
"""


class Published(AssayTest):
    def unpack(self):
        (self.dir / "full").mkdir()
        return shutil.move(recompute.packed.database(FULL / "assay.sqlite.xz", self.dir), self.dir / "full/assay.sqlite")

    def check_full(self, database):
        return recompute.check_all(pathlib.Path(database), PAGE, FULL / "README.md", FULL / "values.csv")

    def test_figures_of_the_full_run(self):
        report = self.check_full(self.unpack())
        self.assertEqual(report.wrong, [])
        self.assertGreaterEqual(report.counts["page"], 20)
        self.assertGreaterEqual(report.counts["samples"], 1000)
        self.assertGreaterEqual(report.counts["values"], 500)
        self.assertGreaterEqual(report.counts["export"], 10000)

    # What a page says in words follows from the databases.
    def test_sentences_of_the_pages(self):
        report = recompute.Report()
        statements.check(report)
        self.assertEqual(report.wrong, [])
        self.assertGreaterEqual(report.counts["sentences"], 50)

    def test_a_wrong_sentence_is_found(self):
        page = "docs/lab/claims.md"
        (self.dir / "docs").mkdir()
        text = (SOURCE / page).read_text("utf-8")
        self.write(page, text.replace("has the largest figure of these in every column", "has the smallest figure of these"))
        with unittest.mock.patch.object(statements, "PAGES", self.dir):
            report = recompute.Report()
            statements.check(report, [page])
        wrong = "\n".join(report.wrong)
        self.assertIn("docs/lab/claims.md, havok is the largest: Havok has the smallest figure", wrong)
        self.assertEqual(len(report.wrong), 1, wrong)

    # The rule of results/withdrawn.toml is written twice, and so is that of what is recommended.
    def test_the_program_leaves_out_the_same(self):
        with contextlib.closing(statements.Runs()) as runs:
            for name, results in (("full", "intel-xeon-2-cores"), ("field", "field-2026-11-25")):
                recompute.packed.database(SOURCE / "results" / results / "assay.sqlite.xz", self.dir / name)
                exported = csv.DictReader(self.assay("export", name, "--format", "csv").splitlines())
                shown = {(row["system"], row["contender"], float(row["timestep_ms"])) for row in exported if row["outcome"] == "withdrawn"}
                own = set(getattr(runs, name).db.execute(
                    "SELECT c.system, c.contender, c.timestep_ms FROM main.cells c JOIN cells j ON j.id = c.id WHERE j.outcome = 'withdrawn'"
                    " AND (c.outcome <> 'ok' OR c.id IN (SELECT cell_id FROM main.\"values\"))"))
                self.assertEqual(shown, own)
                self.assertGreater(len(shown), 20)
            for system, limit in (("grasp", "consistency"), ("humanoid", "consistency"), ("capsules-27", "consistency"),
                                  ("spatial-chain", "truth_error_max")):
                found = json.loads(self.assay("recommend", "full", system, "--limit", f"{limit}=1mm", "--penetration", "any", "--slip", "any",
                                              "--json"))["contenders"]
                points = runs.full.fastest(system, **{limit: 1e-3})
                self.assertEqual([(each["contender"], each["timestep_ms"]) for each in found],
                                 [(point.contender, point.timestep) for point in points])
                for each, point in zip(found, points):
                    self.assertAlmostEqual(each["realtime_factor"]["value"] / point.speed, 1, 9)
                    self.assertEqual(each["edge"] or "", point.edge, point)

    def test_values_of_other_committed_runs(self):
        others = [path.parent for path in SOURCE.glob("results/*/assay.sqlite.xz") if path.parent != FULL]
        for folder in others:
            with self.subTest(folder=folder.name):
                database = recompute.packed.database(folder / "assay.sqlite.xz", self.dir)
                report = recompute.check_all(database, values=folder / "values.csv")
                self.assertEqual(report.wrong, [])
                rows = len((folder / "values.csv").read_text("utf-8").splitlines()) - 1
                self.assertGreater(rows, 10)
                self.assertGreaterEqual(report.counts["export"], rows)

    # Merging verifies each table and each cell of its source.
    def test_the_program_opens_all_committed_runs(self):
        packed = sorted(SOURCE.glob("results/*/assay.sqlite.xz"))
        self.assertGreater(len(packed), 5)
        for path in packed:
            with self.subTest(folder=path.parent.name):
                name = path.parent.name
                recompute.packed.database(path, self.dir / name)
                self.assay("status", name)
                self.assay("merge", name, "--out", f"{name}-again")
                shutil.rmtree(self.dir / f"{name}-again")

    def test_reading_results_has_limited_memory(self):
        recompute.packed.database(FULL / "assay.sqlite.xz", self.dir / "full")
        # What is printed fills the pipe, so that it waits to be looked at.
        reading = self.start_assay("export", "full", "--format", "csv")
        try:
            deadline = time.monotonic() + 60
            most = "unlimited"
            while most == "unlimited" and time.monotonic() < deadline:
                limits = pathlib.Path(f"/proc/{reading.pid}/limits").read_text("ascii")
                most, = re.search(r"^Max data size +(\S+)", limits, re.M).groups()
                time.sleep(0.01)
            self.assertNotEqual(most, "unlimited")
            self.assertLessEqual(int(most), 4 << 30)
        finally:
            reading.kill()
            reading.communicate()
        few = 12 << 20
        done = self.run_assay("export", "full", "--format", "csv", "--out", "values.csv",
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (few, few)))
        self.assertEqual(done.returncode, 1, done.stderr)
        self.check_sentence(done.stderr, ["out of memory", "'assay export'", "smaller results"])

    def test_the_program_opens_what_is_published(self):
        self.write("ball.xml", BALL)
        self.write("ball.toml", BALL_CAMPAIGN)
        self.assay("run", "ball.toml", "--out", self.dir / "out")  # the command names a folder of this machine
        publish.publish(self.program, self.dir / "out", self.dir / "published", compact=True)
        with contextlib.closing(sqlite3.connect(recompute.packed.database(self.dir / "published", self.dir / "u"))) as db:
            command, = db.execute("SELECT value FROM manifest WHERE key = 'command'").fetchone()
        self.assertNotIn(str(self.dir), command)
        self.assertIn("1 of 1 cells", self.assay("status", "u"))

    # One number that changes is found in everything that follows from it.
    def test_a_wrong_figure_is_found(self):
        database = self.unpack()
        db = sqlite3.connect(database)
        cell, = db.execute("SELECT id FROM cells WHERE system = 'humanoid' AND contender = 'mujoco-rk4'"
                           " AND measure = 'consistency' AND timestep_ms = 1").fetchone()
        db.execute("UPDATE samples SET value = 2 * value WHERE cell_id = ?", [cell])
        db.execute("UPDATE \"values\" SET value = 1.01 * value WHERE name = 'truth_rounding' AND value > 0")
        db.commit()
        db.close()
        wrong = "\n".join(self.check_full(database).wrong)
        self.assertIn("samples: consistency of mujoco-rk4 on humanoid at 1 ms", wrong)
        self.assertRegex(wrong, "page: claim 4: consistency on humanoid")
        self.assertRegex(wrong, r"export: value of planar-chain mujoco-euler [\d.]+ truth_rounding")
        self.assertNotIn("step_time", wrong)
        page = self.write("page.md", PAGE.read_text("utf-8").replace("| Havok | 0.276 |", "| Havok | 0.277 |"))
        if page.read_text("utf-8") != PAGE.read_text("utf-8"):
            self.assertIn("0.277 is given", "\n".join(recompute.check_all(pathlib.Path(database), page).wrong))


class New(AssayTest):
    def test_results_of_today(self):
        self.write("small.toml", SMALL)
        self.assay("run", "small.toml", "--out", "out")
        self.assay("export", "out", "--format", "csv", "--out", "values.csv")
        claims = self.assay("claims", "out", "--markdown")
        page = self.write("page.md", f"<!-- claims: begin -->\n{claims}<!-- claims: end -->\n")
        report = recompute.check_all(self.dir / "out/assay.sqlite", page, values=self.dir / "values.csv")
        self.assertEqual(report.wrong, [])
        for kind in ("samples", "values", "states", "page", "export"):
            self.assertGreater(report.counts[kind], 10 if kind != "page" else 0, kind)
        with contextlib.closing(sqlite3.connect(self.dir / "out/assay.sqlite")) as db:
            names = {name for name, in db.execute('SELECT DISTINCT name FROM "values"')}
        self.assertLessEqual({"aa_ratio", "consistency_32ms", "grasp_slip", "joint_dislocation_max"}, names)


if __name__ == "__main__":
    main()
