"""conformance: the suite by hand."""

import os
import pathlib
import re
import signal
import time

from harness import AssayTest, main

STATUSES = {"pass", "fail", "deviation", "not-applicable"}


class Conformance(AssayTest):
    def names(self):
        return [test["test"] for test in self.assay_json("conformance", "--list", "--json")["tests"]]

    def failing(self, *arguments):
        """Results by test of one contender that does not conform."""
        done = self.run_assay("conformance", *arguments)
        self.assertEqual(done.returncode, 1)
        self.check_sentence(done.stderr, ["does not conform", arguments[0]])
        return done.stdout

    def test_list_says_what_each_test_means(self):
        tests = self.assay_json("conformance", "--list", "--json")["tests"]
        self.assertIn("free-fall", [test["test"] for test in tests])
        self.assertTrue(all(test["meaning"] for test in tests))
        lines = self.assay("conformance", "--list").splitlines()[1:]
        self.assertEqual([line.split()[0] for line in lines], [test["test"] for test in tests])

    def test_sound_contender_passes_every_test(self):
        report = self.assay_json("conformance", "mujoco-rk4", "--json")["contenders"]
        self.assertEqual([(row["contender"], row["conforms"]) for row in report], [("mujoco-rk4", True)])
        results = report[0]["results"]
        self.assertEqual([result["test"] for result in results], self.names())
        for result in results:
            self.assertIn(result["status"], STATUSES - {"fail"})
            if result["status"] == "pass":
                self.assertLessEqual(result["figure"], result["tolerance"])

    def test_text_shows_figure_and_tolerance(self):
        text = self.assay("conformance", "mujoco-euler", "--test", "free-fall")
        self.assertRegex(text, r"(?m)^mujoco-euler\n  pass +free-fall +\S+ \S*m of \S+ \S*m allowed\b")
        self.assertIn("conforms: 1 pass, 0 fail", text)
        self.assertEqual(self.assay("conformance", "--engine", "mujoco-euler", "--test", "free-fall"), text)

    def test_engine_stands_for_all_its_contenders(self):
        report = self.assay_json("conformance", "mujoco", "--test", "free-fall", "--test", "readback", "--json")
        names = [row["contender"] for row in report["contenders"]]
        listed = self.assay_json("engines", "--json")["contenders"]
        self.assertEqual(names, [row["contender"] for row in listed if row["engine"] == "mujoco"])
        for row in report["contenders"]:
            self.assertEqual(sorted(result["test"] for result in row["results"]), ["free-fall", "readback"])

    def test_all_contenders_but_the_one_that_does_nothing(self):
        report = self.assay_json("conformance", "--test", "free-fall", "--json")["contenders"]
        self.assertEqual([row["contender"] for row in report], [name for name in self.contenders() if name != "null"])

    def test_engine_that_does_nothing_does_not_fall(self):
        self.assertRegex(self.failing("null", "--test", "free-fall"), r"(?m)^  fail +free-fall .*\n  does not conform: 0 pass, 1 fail")

    def test_every_deviation_has_its_proof(self):
        """A declared deviation names a program that runs as a test, or the adapter approximates the feature that it tests."""
        root = pathlib.Path(__file__).resolve().parents[2]
        tested = {(engine, finding)
                  for engine, findings in re.findall(r"(?m)^assay_add_findings\((\w+) \S+ (?!FOLDER)([^)]*)\)",
                                                     (root / "findings/CMakeLists.txt").read_text())
                  for finding in findings.split()}
        listed = (root / "findings/README.md").read_text()
        groups = self.assay_json("engines", "--features", "--json")["groups"]
        support = {contender: group["support"] for group in groups for contender in group["contenders"]}
        needs = {"ellipsoid-rocks": "ellipsoid", "planar-root": "massless", "massless-joints": "massless",
                 "random-massless-trees": "massless", "coupling-distances": "coupling", "weld-distances": "weld",
                 "connect-distances": "connect", "rolling-slows": "rolling-friction", "height-field-edges": "height-field",
                 "cylinder-rolls": "cylinder", "cylinders-at-rest": "cylinder", "cylinders-on-field": "cylinder"}
        for row in self.assay_json("engines", "--json")["contenders"]:
            for deviation in row["capabilities"]["deviations"]:
                with self.subTest(contender=row["contender"], test=deviation["test"]):
                    named = re.findall(r"findings/([\w-]+)/(\w+)\.(cc|py)", deviation["reason"])
                    for engine, program, language in named:
                        if language == "cc":  # those in Python run where their engine is set up
                            self.assertIn((engine, program), tested)
                        self.assertTrue((root / "findings" / engine / f"{program}.{language}").is_file())
                        self.assertIn(f"({engine}/{program}.{language})", listed)
                    if not named:
                        self.assertIn(deviation["test"], needs, deviation["reason"])
                        self.assertEqual(support[row["contender"]][needs[deviation["test"]]]["fidelity"], "approximated")

    def test_verdicts_of_the_long_series_are_kept(self):
        self.forget_verdicts()

        def run(*arguments):
            rows = self.assay_json("conformance", "mujoco-euler", "--long", "--json", *arguments)["contenders"][0]["results"]
            return [row.pop("kept", False) for row in rows], rows

        kept, first = run("--test", "near-equilibrium")
        self.assertEqual(kept, [False])
        self.assertEqual(len(first[0]["timesteps"]), 9)
        kept, rows = run("--test", "near-equilibrium", "--test", "free-fall")
        self.assertEqual(dict(zip((row["test"] for row in rows), kept)), {"near-equilibrium": True, "free-fall": False})
        self.assertEqual([row for row in rows if row["test"] == "near-equilibrium"], first)
        text = self.assay("conformance", "mujoco-euler", "--long", "--test", "free-fall")
        self.assertRegex(text, r"(?m)^  pass +free-fall .*\(kept\)")
        self.assertEqual(run("--again", "--test", "free-fall")[0], [False])
        self.assertNotIn("kept", self.assay("conformance", "mujoco-euler", "--test", "free-fall"))
        # a damaged file counts for nothing
        file, = (self.dir / "cache/assay/conformance").glob("*.json")
        file.write_text(file.read_text().replace("pass", "fail"))
        self.assertEqual(run("--test", "free-fall")[0], [False])

    def test_crash_is_a_failed_test(self):
        self.use_mishap_engine()
        self.assertRegex(self.failing("mishap-abort"), r"(?m)^  fail +\S+ .*SIGABRT")
        self.assertRegex(self.failing("mishap-exit-at-once"), r"(?m)^  fail +\S+ .*ended early")

    def test_each_test_has_a_limit_of_time(self):
        self.use_mishap_engine()
        self.assertRegex(self.failing("mishap-hang", "--test", "free-fall", "--time-limit", "1"),
                         r"(?m)^  fail +free-fall .*not done after 1 s")
        self.refused("conformance", "mishap-hang", "--time-limit", "never", naming=["--time-limit", "'never'", "seconds"])

    def test_a_test_is_not_blamed_for_what_somebody_else_ended(self):
        self.use_mishap_engine()
        # each time: nothing can be said
        done = self.run_assay("conformance", "mishap-killed")
        self.assertEqual(done.returncode, 1)
        self.check_sentence(done.stderr, ["of mishap-killed was ended from outside (SIGKILL)", "start the same command again"])
        self.assertNotIn("SIGKILL", done.stdout)
        # once: that test is run again, and the others
        self.env |= {"ASSAY_MISHAP_MARK": str(self.dir / "mark"), "ASSAY_SANDBOX": "off"}  # it may not write there
        text = self.failing("mishap-killed")
        self.assertEqual((self.dir / "mark").stat().st_size, 1)
        self.assertNotIn("SIGKILL", text)
        self.assertEqual(re.findall(r"(?m)^  (?:pass|fail|deviation|not-applicable) +(\S+)", text), self.names())

    def test_interruption(self):
        self.use_mishap_engine()
        process = self.start_assay("conformance", "mishap-hang", start_new_session=True)
        self.assertIn("mishap-hang", process.stdout.readline(), "its heading, before its first test")
        time.sleep(1)
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1)
        self.check_sentence(err, ["interrupted"])


if __name__ == "__main__":
    main()
