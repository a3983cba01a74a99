"""`assay compare` and `assay history`: the status that ends a CI, and what makes times compare."""

import sqlite3
import sys

from harness import BALL, SOURCE, AssayTest, campaign, main

sys.path.insert(0, str(SOURCE / "benchmarks"))
import compare_power  # noqa: E402

def windows(batch_ms):
    return campaign("windows", [1], ["raw_speed"], timing={"rounds": 2, "processes": 1, "batch_ms": batch_ms}, duration_s=2.048)


class Compare(AssayTest):
    def results(self, name, slower=0.0, less_accurate=0.0, number=0, timings=6):
        """A run of three contenders with six processes a timing, whose times scatter by 1 %; `changed` is slower."""
        compare_power.write_run(self.dir / name, [-0.01, -0.005, 0, 0.005, 0.01], (3, timings, 6), slower, less_accurate, number,
                                f"{name}{number}")

    def change(self, name, statement):
        with sqlite3.connect(self.dir / name / "assay.sqlite") as db:
            db.execute("PRAGMA foreign_keys = ON")
            db.execute(statement)
        db.close()

    def status(self, *arguments):
        done = self.run_assay("compare", "a", *arguments)
        return done.returncode, done.stderr

    def test_a_regression_ends_with_status_1_and_names_the_first(self):
        self.results("a")
        self.results("b", slower=0.08)
        self.assertEqual(self.status("b")[0], 0, "without the option it only tells")
        status, sentence = self.status("b", "--fail-on-regression", "5%")
        self.assertEqual(status, 1)
        self.check_sentence(sentence, ["6 values are worse by at least 5 %", "step_time of changed on chain"])
        self.results("same")
        self.assertEqual(self.status("same", "--fail-on-regression", "5%"), (0, ""))

    def test_a_limit_below_the_threshold_counts(self):
        self.results("a")
        self.results("b", less_accurate=0.015)
        status, sentence = self.status("b", "--fail-on-regression", "1%")
        self.assertEqual(status, 1)
        self.assertIn("truth_error of changed", sentence)
        self.assertEqual(self.status("b", "--fail-on-regression", "2%"), (0, ""))

    def test_a_share_without_percent_is_below_1(self):
        self.results("a")
        self.results("b", slower=0.08)
        for option in ("--threshold", "--fail-on-regression"):
            self.refused("compare", "a", "b", option, "5", naming=[option, "'5'", "500 %", "as in 5%"])
        self.refused("history", "a", "b", "--threshold", "1", naming=["--threshold", "'1'", "as in 1%"])
        self.assertEqual(self.status("b", "--fail-on-regression", "0.05")[0], 1, "a share of 5 %")
        self.assertEqual(self.status("b", "--fail-on-regression", "100%"), (0, ""))

    def test_missing_cells_end_with_status_2(self):
        self.results("a")
        self.results("b")
        self.change("b", "DELETE FROM cells WHERE contender = 'same-1'")
        status, sentence = self.status("b", "--fail-on-regression", "5%")
        self.assertEqual(status, 2)
        self.check_sentence(sentence, ["12 cells of 'a' are not in 'b'", "same-1", "--allow-gaps"])
        self.assertEqual(self.status("b", "--fail-on-regression", "5%", "--allow-gaps"), (0, ""))

    def test_a_control_that_failed_is_no_success(self):
        self.results("a")
        self.results("b", slower=1)
        self.change("b", "UPDATE cells SET outcome = 'crashed' WHERE contender = 'same-1' AND measure = 'raw_speed'")
        self.change("b", "DELETE FROM samples WHERE cell_id IN (SELECT id FROM cells WHERE outcome = 'crashed')")
        status, sentence = self.status("b", "--control", "same-1", "--fail-on-regression", "5%")
        self.assertEqual(status, 1)
        self.assertIn("ok → crashed", sentence)

    def test_what_the_samples_leave_open_is_told(self):
        self.results("a", timings=1)
        self.results("b", timings=1)
        self.change("b", "UPDATE samples SET value = value * (1 + 0.3 * (idx % 2)) WHERE name = 'round_step_time_us'")
        status, sentence = self.status("b", "--fail-on-regression", "5%")
        self.assertEqual(status, 0)
        self.check_sentence(sentence, ["3 times are undecided", "slower by 5 %", "more processes"])

    def test_a_history_names_the_run(self):
        for number in range(8):
            self.results(f"run{number}", slower=0.08 if number > 4 else 0, number=number)
        dirs = [f"run{number}" for number in range(8)]
        found = self.assay_json("history", *dirs, "--format", "json")
        moved = {(course["contender"], change["run"]) for course in found["courses"] for change in course["changes"]}
        self.assertEqual(moved, {("changed", 5)})
        self.refused("history", "run0", "run1", "./run0", naming=["run0", "are the same results"])

    def test_times_of_the_windows_of_other_results(self):
        self.write("a.toml", windows(20))
        self.write("b.toml", windows(0.2))
        self.assay("run", "a.toml", "--out", "a")
        self.assay("run", "b.toml", "--out", "own")
        self.assay("run", "b.toml", "--out", "as-a", "--windows-of", "a")

        def share(name):
            with sqlite3.connect(self.dir / name / "assay.sqlite") as db:
                return db.execute("SELECT value FROM \"values\" WHERE name = 'window_share'").fetchone()[0]

        self.assertLess(share("own"), share("a"))
        self.assertEqual(share("as-a"), share("a"))
        self.refused("run", "b.toml", "--out", "other", "--windows-of", "nowhere", naming=["nowhere"])
        self.write("ball.xml", BALL)
        self.refused("run", "ball.xml", "--windows-of", "a", naming=["--windows-of", "are for campaigns"])


if __name__ == "__main__":
    main()
