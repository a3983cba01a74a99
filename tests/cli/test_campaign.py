"""run, paper, report, export: real campaigns, made small."""

import contextlib
import csv
import hashlib
import io
import json
import math
import os
import pathlib
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time

from harness import BALL, BALL_CAMPAIGN, PROGRAM, REFUSED_PLUGINS, SOURCE, AssayTest, campaign, data_folder, main, obey_permissions, reliability

sys.path.insert(0, str(SOURCE / "results"))
import packed  # noqa: E402

CONTENDERS = ["mujoco-euler", "ode-step"]
EXPORT_HEADER = ["system", "contender", "timestep_ms", "measure", "value", "unit", "outcome", "low", "high"]


def tiny(name="tiny", contenders=None):
    return campaign(name, ["1/4", 1, 4], ["raw_speed", "consistency", "truth", "drift"], contenders=contenders or CONTENDERS,
                    timing={"rounds": 3, "batch_ms": 1}, duration_s=0.16, pieces=2, piece_ms=32)


class CampaignTest(AssayTest):
    def setUp(self):
        super().setUp()
        self.write("tiny.toml", tiny())

    def run_tiny(self, out="results", *more):
        return self.assay("run", "tiny.toml", "--out", out, *more)

    def rows(self, out="results"):
        return list(csv.DictReader(io.StringIO(self.assay("export", out, "--format", "csv"))))

    def table(self, out="results"):
        """Every row that has to be the same in every run; of timings, which depend on the machine's mood, that they are
        there."""
        with contextlib.closing(sqlite3.connect(self.dir / out / "assay.sqlite")) as db:
            timed = {row[0] for row in db.execute(
                """SELECT DISTINCT name FROM "values" JOIN cells ON cells.id = cell_id WHERE measure = 'raw_speed'""")}
        table = []
        for row in self.rows(out):
            if row["measure"] in timed:
                row = {**row, "value": "timed", "low": "", "high": ""}
            table.append(tuple(row.values()))
        return sorted(table)

    def content(self, out):
        """What every file of a directory holds."""
        folder = self.dir / out
        return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
                for path in folder.rglob("*") if path.is_file() and not path.name.endswith(("-shm", "-wal", ".lock"))}


class Run(CampaignTest):
    def test_a_motion_without_a_reference_solution_does_not_end_the_campaign(self):
        self.write("locked.xml", """<mujoco model="locked"><worldbody><body><joint type="slide" axis="1 0 0" damping="1e11"/>
            <geom size="0.1"/><body pos="0 0 1"><joint axis="0 1 0"/><geom size="0.1" pos="1 0 0"/></body></body></worldbody></mujoco>""")
        self.write("tiny.toml", tiny(contenders=["mujoco-euler"]) + """
[[system]]
name = "locked"
model = "locked.xml"
smooth = true
measures = ["truth"]
timesteps_ms = [1]
sample_ms = 16
duration_s = 0.16
""")
        self.run_tiny()
        with contextlib.closing(sqlite3.connect(self.dir / "results/assay.sqlite")) as db:
            ended, reason = db.execute("SELECT outcome, reason FROM cells WHERE system = 'locked'").fetchone()
            others = {outcome for outcome, in db.execute("SELECT outcome FROM cells WHERE system != 'locked'")}
        self.assertEqual((ended, others), ("unsupported", {"ok"}))
        self.assertIn("springs or dampers are stiff", reason)

    def test_every_cell_has_a_value(self):
        text = self.run_tiny()
        self.assertRegex(text, r"^26 cells in .*: 26 ok \(26 now, 0 before\)\n")
        found = {(row["contender"], float(row["timestep_ms"]), row["measure"]) for row in self.rows()}
        for contender in CONTENDERS:
            for timestep in [0.25, 1, 4]:
                for measure in ["raw_speed", "realtime_factor", "consistency", "truth_error", "energy_drift",
                                "angular_momentum_drift"]:
                    self.assertIn((contender, timestep, measure), found)

    def test_progress_for_programs(self):
        self.write("ball.xml", BALL)
        self.write("ball.toml", BALL_CAMPAIGN.replace('["null"]', '["mujoco-euler"]'))
        done = self.run_assay("run", "ball.toml", "--out", "ball", "--progress", "json")
        self.assertEqual(done.returncode, 0, done.stderr)
        events = [json.loads(line) for line in done.stderr.splitlines() if line.startswith("{")]
        kinds = [event["event"] for event in events]
        self.assertLess(kinds.index("begin"), kinds.index("finished"))
        self.assertEqual(kinds[-1], "end")
        cells = events[kinds.index("begin")]["cells"]
        finished = [event for event in events if event["event"] == "finished"]
        self.assertEqual([event["done"] for event in finished], list(range(1, cells + 1)))
        self.assertEqual({(event["system"], event["contender"], event["outcome"]) for event in finished}, {("ball", "mujoco-euler", "ok")})
        # the same command in text tells nothing as JSON
        again = self.run_assay("run", "ball.toml", "--out", "ball", "--progress", "text")
        self.assertIn("are there already", again.stderr)
        self.refused("run", "ball.toml", "--out", "ball", "--progress", "loud", naming=["--progress", "loud", "text or json"])
        self.refused("paper", "--out", "paper", "--progress", "loud", naming=["--progress", "loud", "text or json"])

    def test_runs_that_are_no_cells_move_the_progress(self):
        self.write("states.toml", """
name = "states"
contenders = ["mujoco-euler"]
timesteps_ms = [1]
reference_ms = "1/4"
measures = ["consistency"]
[[system]]
name = "planar-chain"
duration_s = 0.128
initial_states = 4
pieces = 4
piece_ms = 32
""")
        done = self.run_assay("run", "states.toml", "--out", "states", "--references", "off", "--progress", "json")
        self.assertEqual(done.returncode, 0, done.stderr)
        events = [json.loads(line) for line in done.stderr.splitlines() if line.startswith("{")]
        made = [event for event in events if event["event"] == "made"]
        self.assertEqual(sorted(event["text"] for event in made),
                         [f"reference planar-chain mujoco-euler, initial state {state}" for state in (2, 3, 4)])
        told = [event for event in events if "left_s" in event]
        self.assertTrue(all(event["left_s"] > 0 for event in made), told)
        self.assertEqual(told[-1]["left_s"], 0)

    def test_the_suites_tests_move_the_progress(self):
        self.forget_verdicts()
        self.write("suite.toml", """
name = "suite"
contenders = ["mujoco-euler", "mujoco-rk4"]
timesteps_ms = [1]
measures = ["raw_speed"]
[[system]]
name = "planar-chain"
duration_s = 0.128
""")
        done = self.run_assay("run", "suite.toml", "--out", "suite", "--progress", "json")
        self.assertEqual(done.returncode, 0, done.stderr)
        events = [json.loads(line) for line in done.stderr.splitlines() if line.startswith("{")]
        tested = [event for event in events if event["event"] == "tested"]
        tests = self.run_assay("conformance", "--list").stdout
        self.assertEqual([event["tests_done"] for event in tested], list(range(1, len(tested) + 1)))
        self.assertEqual({event["tests"] for event in tested}, {len(tested)})
        for contender in ("mujoco-euler", "mujoco-rk4"):
            mine = [event["text"].split()[1] for event in tested if event["text"].split()[0] == contender]
            self.assertEqual(len(mine), len(tested) // 2)
            self.assertTrue(all(test in tests for test in mine))
        # each suite's verdicts are kept when it ends
        self.assertEqual(len(list((self.dir / "cache/assay/conformance").glob("*.json"))), 2)

    # A changed verdict would leave a contender out; another type, a pipe or a large file would end or stop the run.
    def test_kept_verdicts_that_are_not_what_was_written(self):
        self.forget_verdicts()
        self.write("ball.xml", BALL)
        self.write("suite.toml", BALL_CAMPAIGN.replace('["null"]', '["mujoco-euler"]'))

        def tested(name):
            done = self.run_assay("run", "suite.toml", "--out", name, "--progress", "json")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(",ok,", self.assay("export", name, "--format", "csv"))
            return done.stderr.count('"tested"')

        tests = tested("first")
        self.assertGreater(tests, 10)
        self.assertEqual(tested("second"), 0, "the verdicts are taken over")
        kept, = (self.dir / "cache/assay/conformance").glob("*.json")
        whole = kept.read_text("utf-8")
        rows = whole.split("\n")[1]

        def instead(make):
            kept.unlink()
            make(kept)

        def forged(content, name=kept.name):
            kept.write_text(packed.content_hash((name + content).encode()) + "\n" + content, "utf-8")

        for what, change in (("a changed verdict", lambda: kept.write_text(whole.replace('"pass"', '"fail"', 1), "utf-8")),
                             ("no hash", lambda: kept.write_text(rows, "utf-8")),
                             ("8 GiB", lambda: os.truncate(kept, 8 << 30)),
                             ("a pipe", lambda: instead(os.mkfifo)),
                             ("those of another contender", lambda: forged(rows, "0" * 32 + ".json")),
                             ("other types", lambda: forged("[[1, 2, 3, 4, 5, 6]]")),
                             ("another status", lambda: forged('[["free-fall", "passed", 1, 1, "m", ""]]'))):
            with self.subTest(what):
                change()
                self.assertEqual(tested(what), tests)
                self.assertRegex(kept.read_text("utf-8"), r"^[0-9a-f]{32}\n\[\[", "and kept again")
                shutil.rmtree(self.dir / what)

    def test_what_the_page_shows_as_json(self):
        self.run_tiny("tiny")
        data = self.assay_json("report", "tiny", "--json")
        self.assertEqual(set(data["papers"]) - set(CONTENDERS), set())
        self.assertEqual({cell["contender"] for cell in data["cells"]} - {"null"}, set(CONTENDERS))
        self.assertFalse({"pictures", "replays"} & set(data))
        self.assertFalse(any("samples" in cell for cell in data["cells"]))
        self.assertFalse((self.dir / "tiny/report.html").exists())
        self.refused("report", "tiny", "--json", "--replays", "1", naming=["--json", "--replays"])

    def test_a_report_of_a_given_size(self):
        self.run_tiny()
        self.assertNotIn("left out", self.assay("report", "results"))
        page = self.dir / "results/report.html"
        size = page.stat().st_size
        told = self.assay("report", "results", "--size", "0.1")  # less than the page's script has
        self.assertRegex(" ".join(told.split()), r"left out of it, to keep it small: distributions of samples.*--size makes room")
        self.assertLess(page.stat().st_size, size)
        self.refused("report", "results", "--size", "0", naming=["--size", "0", "MB"])
        self.refused("report", "results", "--size", "big", naming=["--size", "big", "MB"])

    # Of a soft contact that is critically damped it has a closed form, whatever the timestep.
    def test_rebound_beside_penetration(self):
        self.write("falls.toml", tiny(contenders=["mujoco-euler", "physx-d6-pgs"]).replace(
            "planar-chain", "capsules-2").replace('["raw_speed", "consistency", "truth", "drift"]', '["violation"]'))
        self.assay("run", "falls.toml", "--out", "falls")
        rebound = {(row["contender"], float(row["timestep_ms"])): float(row["value"])
                   for row in self.rows("falls") if row["measure"] == "rebound"}
        self.assertEqual(len(rebound), 6)
        for (contender, timestep), value in rebound.items():
            with self.subTest(contender=contender, timestep=timestep):
                if contender == "mujoco-euler":
                    self.assertLess(abs(value - math.exp(-2)), 0.02)
                else:
                    self.assertLess(value, 0.01)

    # ODE's friction is a pyramid along the world's axes: at 45 degrees to them it is sqrt(2) times too strong.
    def test_contact_forces_against_the_laws_of_contact(self):
        self.write("slider.xml", """<mujoco model="slider"><worldbody>
          <geom type="plane" size="0 0 1" friction="0.5"/>
          <body pos="0 0 0.05"><freejoint/>
            <geom type="capsule" fromto="-0.1 -0.1 0 0.1 0.1 0" size="0.05" mass="2" friction="0.5"/></body>
        </worldbody><keyframe><key qpos="0 0 0.05 1 0 0 0" qvel="2 2 0 0 0 0"/></keyframe></mujoco>""")
        self.write("slides.toml", """
name = "slides"
contenders = ["ode-quick", "bullet-si-f64", "mujoco-euler-elliptic", "physx-d6-pgs"]
timesteps_ms = ["1/4", 1]
reference_ms = "1/4"
measures = ["violation"]
[[system]]
name = "slider"
model = "slider.xml"
duration_s = 0.16
""")
        self.assay("run", "slides.toml", "--out", "slides")
        found = {}
        for row in self.rows("slides"):
            found.setdefault((row["contender"], float(row["timestep_ms"])), {})[row["measure"]] = row["value"]
        self.assertEqual(len(found), 8)
        for (contender, timestep), values in found.items():
            with self.subTest(contender=contender, timestep=timestep):
                if contender == "physx-d6-pgs":
                    self.assertNotIn("cone_violation", values, "it gives no friction forces")
                    continue
                cone = 0.5 * (math.sqrt(2) - 1) if contender == "ode-quick" else 0
                self.assertAlmostEqual(float(values["cone_violation"]), cone, delta=0.01)
                # friction acts against the slip, with all that the cone allows, of 2.8 to 2 m/s
                self.assertLess(float(values["dissipation_residual"]), 0.05)
                # soft contacts still settle while it slides, by more than rigid ones
                self.assertLess(float(values["signorini_residual"]), 0.2 if contender.startswith("mujoco") else 0.02)

    def test_same_command_again_measures_nothing(self):
        self.run_tiny()
        before = self.assay("export", "results", "--format", "csv")
        self.assertRegex(self.run_tiny(), r"26 ok \(0 now, 26 before\)")
        self.assertEqual(self.assay("export", "results", "--format", "csv"), before)

    def test_two_runs_and_any_number_of_jobs_give_the_same_table(self):
        self.run_tiny("a", "--jobs", "1")
        self.run_tiny("b", "--jobs", "3")
        self.assertEqual(self.table("a"), self.table("b"))

    def test_error_falls_with_the_timestep(self):
        self.run_tiny()
        for contender in CONTENDERS:
            errors = {float(row["timestep_ms"]): float(row["value"]) for row in self.rows()
                      if row["contender"] == contender and row["measure"] == "truth_error"}
            self.assertTrue(0 < errors[0.25] < errors[1] < errors[4])
            # first order at least: a quarter of the timestep, a quarter of the error
            self.assertGreater(errors[1] / errors[0.25], 3.5)

    def test_shards_are_parts_of_the_whole(self):
        self.run_tiny("whole")
        parts = []
        for i in [1, 2]:
            self.run_tiny(f"part{i}", "--shard", f"{i}/2")
            with sqlite3.connect(self.dir / f"part{i}/assay.sqlite") as db:
                parts.append({row[0] for row in db.execute("SELECT key FROM cells")})
        with sqlite3.connect(self.dir / "whole/assay.sqlite") as db:
            whole = {row[0] for row in db.execute("SELECT key FROM cells")}
        self.assertEqual(parts[0] | parts[1], whole)
        self.assertFalse(parts[0] & parts[1])

    def test_failing_engines_are_results(self):
        self.use_mishap_engine()
        failing = [f"mishap-{fault}" for fault in
                   ["abort", "exit-at-once", "exit-as-if-done", "throw", "throw-number", "terminate", "free-twice",
                    "write-beyond", "overflow", "nan"]]
        self.write("tiny.toml", tiny(contenders=[*failing, "mujoco-euler"]))
        text = self.run_tiny()
        for contender in failing:
            self.assertRegex(text, rf"(?m)^not scored: {contender}\b")
        rows = self.rows()
        for contender in failing:
            outcomes = {row["outcome"] for row in rows if row["contender"] == contender}
            self.assertTrue(outcomes and "ok" not in outcomes, outcomes)
        self.write("tiny.toml", tiny(contenders=["mujoco-euler"]))
        self.run_tiny("alone")
        sound = [row for row in self.table() if row[1] == "mujoco-euler"]
        self.assertEqual(sound, [row for row in self.table("alone") if row[1] == "mujoco-euler"])

    def test_engine_that_never_returns_costs_its_time_limit(self):
        self.use_mishap_engine()
        self.write("tiny.toml", "time_limit_s = 2\n" + tiny(contenders=["mishap-hang", "mujoco-euler"]))
        self.assertRegex(self.run_tiny(), r"(?m)^not scored: mishap-hang\b")
        outcomes = {name: {row["outcome"] for row in self.rows() if row["contender"] == name}
                    for name in ["mishap-hang", "mujoco-euler"]}
        self.assertEqual(outcomes["mujoco-euler"], {"ok"})
        self.assertTrue(outcomes["mishap-hang"] and "ok" not in outcomes["mishap-hang"], outcomes)

    def test_refused_plugin_is_named_and_left_out(self):
        self.env["ASSAY_ENGINE_PATH"] = REFUSED_PLUGINS
        self.write("tiny.toml", tiny(contenders=["outdated-fast", "noentry-slow", "mujoco-euler"]))
        done = self.run_assay("run", "tiny.toml", "--out", "results")
        self.assertEqual(done.returncode, 0, done.stderr)
        for contender, reason in [("outdated-fast", "plugin version"), ("noentry-slow", "no entry point")]:
            self.assertRegex(done.stdout + done.stderr, rf"contender '{contender}' is left out: .*{reason}")
        self.assertEqual({row["outcome"] for row in self.rows() if row["contender"] == "mujoco-euler"}, {"ok"})

    def test_plain_lines_without_a_terminal(self):
        done = self.run_assay("run", "tiny.toml", "--out", "results")
        self.assertEqual(done.returncode, 0)
        self.assertNotIn("\x1b", done.stderr + done.stdout)
        self.assertNotIn("\r", done.stderr + done.stdout)

    def test_relative_model_and_named_campaign(self):
        folder = data_folder(self.dir / "lab", [("mine", tiny("mine"))])
        self.env["ASSAY_DATA"] = str(folder)
        self.assertIn("26 ok", self.assay("run", "mine", "--out", "results"))


class Interrupted(CampaignTest):
    """However a run ends, finished cells stay and the same command goes on to the same table."""

    def stored(self):
        """Every cell with its values, while somebody may be writing."""
        path = self.dir / "results/assay.sqlite"
        if not path.exists():
            return {}
        with sqlite3.connect(path) as db:
            if not db.execute("SELECT count(*) FROM sqlite_master WHERE name = 'cells'").fetchone()[0]:
                return {}
            cells = {row[0]: row[1:] for row in db.execute("SELECT key, id, outcome, started, finished FROM cells")}
            # derived values change while cells arrive: the raw ones may not
            return {key: (*cell[1:], tuple(db.execute(
                "SELECT name, idx, value FROM samples WHERE cell_id = ? ORDER BY name, idx", cell[:1])))
                for key, cell in cells.items()}

    def test_kill_at_any_moment(self):
        start = time.monotonic()
        self.run_tiny("clean")
        duration = time.monotonic() - start
        seed = random.randrange(1 << 32)
        chance = random.Random(seed)
        kept, kills = {}, 0
        for _ in range(40):
            process = self.start_assay("run", "tiny.toml", "--out", "results", start_new_session=True)
            try:
                process.communicate(timeout=chance.uniform(0.02, 0.7) * duration)
            except subprocess.TimeoutExpired:
                # the parent alone, as the kernel does when memory runs out
                os.kill(process.pid, signal.SIGKILL)
                process.communicate()
                kills += 1
            else:
                self.assertEqual(process.returncode, 0, f"seed {seed}")
            now = self.stored()
            for key, cell in kept.items():
                self.assertEqual(now.get(key), cell, f"seed {seed}: a finished cell was lost or measured again")
            kept = now
            if process.returncode == 0:
                if kills > 0:
                    break
                # The machine was busier while the clean run was timed.
                shutil.rmtree(self.dir / "results")
                kept, duration = {}, duration / 2
        self.assertGreater(kills, 0, f"seed {seed}: no run was killed")
        self.run_tiny()
        self.assertEqual(self.table(), self.table("clean"), f"seed {seed}")
        reliability("SIGKILL of `assay run` at random moments", kills, "the same command goes on; the same values",
                    "running cells")

    def test_no_worker_outlives_a_killed_run(self):
        process = self.start_assay("run", "tiny.toml", "--out", "results", start_new_session=True)
        time.sleep(0.7)
        process.kill()
        process.communicate()
        for _ in range(1000):
            try:
                os.killpg(process.pid, 0)
            except ProcessLookupError:
                return
            time.sleep(0.01)
        self.fail("a worker is still there after 10 s")

    @staticmethod
    def catches(process, number):
        """Whether the process has a handler for the signal."""
        caught = re.search(r"^SigCgt:\s*([0-9a-f]+)", pathlib.Path(f"/proc/{process}/status").read_text(), re.MULTILINE)
        return bool(caught and int(caught[1], 16) >> (number - 1) & 1)

    def test_ctrl_c(self):
        self.run_tiny("clean")
        for number, pause in [(signal.SIGINT, 0.5), (signal.SIGTERM, 1.5)]:
            process = self.start_assay("run", "tiny.toml", "--out", "results", start_new_session=True)
            while not self.catches(process.pid, number) and process.poll() is None:
                time.sleep(0.01)  # it reads the campaign
            time.sleep(pause)
            with contextlib.suppress(ProcessLookupError):  # it was done before
                os.killpg(process.pid, number)
            out, err = process.communicate(timeout=60)
            if process.returncode == 0 or (process.returncode == -number and len(self.stored()) >= 26):
                continue  # it was done before, and at its last words
            self.assertEqual((process.returncode, out), (1, ""), err)
            last = err.splitlines()[-1]
            self.assertRegex(last, r"^assay: stopped by (Interrupt|Terminated): \d+ of 26 cells are stored in 'results'; "
                                   r"'assay run tiny.toml --out results' resumes$")
            with sqlite3.connect(self.dir / "results/assay.sqlite") as db:
                # the harness is measured beside the campaign's contenders and is none of them
                cells = db.execute("SELECT count(*) FROM cells WHERE contender <> 'null'").fetchone()[0]
            self.assertEqual(cells, int(re.search(r"(\d+) of 26", last)[1]))
        self.run_tiny()
        self.assertEqual(self.table(), self.table("clean"))

    def test_hangups_at_random_moments(self):
        self.run_tiny("suites")  # the verdicts of the conformance suite are kept: the other runs are without it
        start = time.monotonic()
        self.run_tiny("clean")
        duration = time.monotonic() - start
        seed = random.randrange(1 << 32)
        chance = random.Random(seed)
        hangups, done = 0, False
        for attempt in range(40):
            # one under nohup would not notice
            process = self.start_assay("run", "tiny.toml", "--out", "results",
                                       preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL))
            try:
                # the later, the more time: it has to come to its end
                process.communicate(timeout=chance.uniform(0.02, 0.7 + 0.1 * attempt) * duration)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGHUP)
                _, err = process.communicate(timeout=60)
                hangups += 1
                if process.returncode == 1:
                    self.assertRegex(err.splitlines()[-1], "^assay: stopped by Hangup: ", f"seed {seed}")
            self.assertIn(process.returncode, (0, 1, -signal.SIGHUP), f"seed {seed}")
            done = process.returncode == 0
            if done and hangups > 0:
                break
            if done:  # it was faster than the clean run
                shutil.rmtree(self.dir / "results")
                duration /= 2
        self.assertGreater(hangups, 0, f"seed {seed}: it was never interrupted")
        self.run_tiny()
        self.assertEqual(self.table(), self.table("clean"), f"seed {seed}")
        reliability("SIGHUP of the parent at random moments", hangups, "the same command goes on; the same values", "running cells")

    @staticmethod
    def workers_of(process):
        def children(parent):
            try:
                return [int(child) for child in pathlib.Path(f"/proc/{parent}/task/{parent}/children").read_text().split()]
            except OSError:
                return []

        def is_worker(child):
            try:
                return pathlib.Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")[1:2] == [b"worker"]
            except OSError:
                return False

        return [worker for guard in children(process) if is_worker(guard) for worker in children(guard)]

    def test_workers_that_are_interrupted_and_hung_up(self):
        self.run_tiny("clean")
        seed = random.randrange(1 << 32)
        chance = random.Random(seed)
        ended = 0
        # rarely enough that no job is lost three times; where one is, the next start measures it
        for _ in range(5):
            process = self.start_assay("run", "tiny.toml", "--out", "results")
            while process.poll() is None:
                time.sleep(chance.uniform(0.05, 0.3))
                workers = self.workers_of(process.pid)
                if workers and ended < 20:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(chance.choice(workers), chance.choice([signal.SIGINT, signal.SIGHUP]))
                        ended += 1
            err = process.communicate()[1]
            if process.returncode == 0:
                break
            self.assertIn("ended from outside", err, f"seed {seed}")
        self.assertGreater(ended, 0)
        self.run_tiny()
        self.assertEqual(self.table(), self.table("clean"), f"seed {seed}")
        reliability("SIGINT and SIGHUP of workers at random moments", ended, "measured by other workers; the same values",
                    "the time of these workers")

    def test_a_guard_that_is_late_to_say_how_its_worker_ended(self):
        self.run_tiny("clean")
        process = self.start_assay("run", "tiny.toml", "--out", "results")
        workers = []
        while not workers:
            self.assertIsNone(process.poll(), "it has ended before a worker was seen")
            time.sleep(0.05)
            workers = self.workers_of(process.pid)
        stat = pathlib.Path(f"/proc/{workers[0]}/stat").read_text()
        guard = int(stat.rpartition(")")[2].split()[1])
        os.kill(guard, signal.SIGSTOP)
        try:
            os.kill(workers[0], signal.SIGKILL)
            time.sleep(3)  # a busy machine's
        finally:
            os.kill(guard, signal.SIGCONT)
        err = process.communicate()[1]
        self.assertEqual(process.returncode, 0, err)
        self.assertEqual(self.table(), self.table("clean"))

    def test_one_writer_at_a_time(self):
        first = self.start_assay("run", "tiny.toml", "--out", "results")
        while not (self.dir / "results/assay.sqlite").exists():
            self.assertIsNone(first.poll())
            time.sleep(0.01)
        os.kill(first.pid, signal.SIGSTOP)  # else it might end before the second one looks
        try:
            self.assertIsNone(first.poll(), "the first one has ended too early")
            second = self.run_assay("run", "tiny.toml", "--out", "results")
        finally:
            os.kill(first.pid, signal.SIGCONT)
        self.assertEqual(second.returncode, 2, second.stderr)
        self.check_sentence(second.stderr, ["another assay is writing to 'results'"])
        first.communicate()
        self.assertEqual(first.returncode, 0)
        reliability("two runs write into one directory", 1, "the second one is refused, the first one goes on", "nothing")


class FullDisk(CampaignTest):
    def make_disk(self, size):
        self.disk = self.dir / "disk"
        self.disk.mkdir()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "assay-test", str(self.disk)],
                                 capture_output=True)
        if mounted.returncode != 0:
            self.skipTest("a small file system cannot be mounted here: needs root")
        self.addCleanup(subprocess.run, ["umount", "-l", str(self.disk)], check=True)

    def test_full_disk_keeps_what_is_there(self):
        self.make_disk("96k")
        done = self.run_assay("run", "tiny.toml", "--out", "disk/results")
        self.assertEqual((done.returncode, done.stdout), (1, ""), done.stderr)
        sentence = done.stderr.splitlines()[-1]
        self.assertRegex(sentence, "^assay: ")
        self.assertRegex(sentence, "(?i)disk|space|full")
        subprocess.run(["mount", "-o", "remount,size=64m", str(self.disk)], check=True)
        self.assay("run", "tiny.toml", "--out", "disk/results")
        self.run_tiny("clean")
        self.assertEqual(self.table("disk/results"), self.table("clean"))
        reliability("a full disk (tmpfs of 96 kB)", 1, "one sentence, exit status 1; with room again it goes on",
                    "running cells")

    def test_report_and_export_are_whole_or_not_at_all(self):
        self.make_disk("1m")
        self.run_tiny()
        shutil.copytree(self.dir / "results", self.disk / "results")
        with open(self.disk / "filler", "wb", buffering=0) as filler:
            try:
                while True:
                    filler.write(b"x" * 4096)
            except OSError:
                pass
        self.refused("report", "disk/results", status=1, naming=["disk/results", "No space left"])
        self.assertFalse((self.disk / "results/report.html").exists())
        (self.disk / "values.csv").touch()
        self.refused("export", "results", "--format", "csv", "--out", "disk/values.csv", status=1, naming=["values.csv"])
        self.assertEqual((self.disk / "values.csv").stat().st_size, 0)


class Paper(CampaignTest):
    def test_quick_runs_and_reports(self):
        self.env["ASSAY_DATA"] = str(data_folder(self.dir / "lab", [("quick", tiny("quick"))]))
        text = self.assay("paper", "--quick", "--out", "results", "--jobs", "2")
        self.assertIn("26 ok", text)
        self.assertTrue(text.endswith("report: results/report.html\nfigures: results/figures\n"), text)
        self.assertTrue((self.dir / "results/figures/figure3.svg").read_text().startswith("<?xml"))
        page = (self.dir / "results/report.html").read_text()
        for part in ["planar-chain", *CONTENDERS]:
            self.assertIn(part, page)
        # nothing is fetched when the page is opened
        self.assertFalse(re.findall(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", page))
        self.assay("report", "results")
        self.assertEqual((self.dir / "results/report.html").read_text(), page)

    def test_replays_are_made_for_its_report(self):
        self.env["ASSAY_DATA"] = str(data_folder(self.dir / "lab", [("quick", tiny("quick"))]))
        self.refused("paper", "--quick", "--out", "results", "--replays", "4,x", naming=["--replays", "'x'"])
        self.assertFalse((self.dir / "results").exists(), "told before anything is measured")
        done = self.run_assay("paper", "--quick", "--out", "results", "--replays", "4")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"planar-chain: \d+ runs at 4 ms")
        page = (self.dir / "results/report.html").read_text()
        self.assertNotIn("runs at", self.run_assay("report", "results", "--replays", "4").stderr, "they are kept")
        self.assertEqual((self.dir / "results/report.html").read_text(), page)

    def test_real_campaigns_can_be_planned(self):
        # loaded and refused for the directory alone: the files that come with assay are sound
        (self.dir / "file").write_text("")
        for arguments in [["paper", "--quick"], ["paper"], ["run", "choices"]]:
            self.refused(*arguments, "--out", "file/results", naming=["file/results"])


class Export(CampaignTest):
    def test_csv_and_json_say_the_same(self):
        self.run_tiny()
        text = self.assay("export", "results", "--format", "csv")
        self.assertEqual(text.splitlines()[0].split(","), EXPORT_HEADER)
        rows = self.rows()
        values = self.assay_json("export", "results", "--format", "json")
        self.assertEqual(len(rows), len(values))
        for row, value in zip(rows, values):
            self.assertEqual([key for key in value if key != "reason"], EXPORT_HEADER)
            self.assertEqual(value["reason"] == "", value["outcome"] == "ok")
            for key in EXPORT_HEADER:
                if value[key] is None:
                    self.assertEqual(row[key], "")
                elif isinstance(value[key], str):
                    self.assertEqual(row[key], value[key])
                else:
                    self.assertEqual(float(row[key]), value[key])
                    self.assertTrue(math.isfinite(value[key]))

    def test_values_without_cell_and_cells_without_value(self):
        self.use_mishap_engine()
        self.write("tiny.toml", tiny(contenders=["mishap-throw"]))
        self.run_tiny()
        rows = self.rows()
        self.assertTrue(rows)
        for row in rows:
            self.assertNotEqual(row["outcome"], "ok")
            self.assertEqual((row["value"], row["low"], row["high"]), ("", "", ""))
            self.assertTrue(row["measure"])
        text = self.assay("export", "results", "--format", "json")
        self.assertNotRegex(text, r"NaN|Infinity")
        self.assertTrue(all(value["reason"] for value in json.loads(text)), text)

    def test_numbers_are_the_stored_ones(self):
        self.run_tiny()
        with sqlite3.connect(self.dir / "results/assay.sqlite") as db:
            stored = sorted(row[0] for row in db.execute('SELECT value FROM "values" WHERE value IS NOT NULL'))
        self.assertEqual(sorted(float(row["value"]) for row in self.rows() if row["value"]), stored)

    def test_to_a_file(self):
        self.run_tiny()
        self.assertEqual(self.assay("export", "results", "--format", "csv", "--out", "values.csv"), "")
        self.assertEqual((self.dir / "values.csv").read_text(), self.assay("export", "results", "--format", "csv"))

    def test_unknown_format(self):
        self.refused("export", "results", "--format", "xml", naming=["'xml'", "csv or json"])


class BadCampaigns(AssayTest):
    def refused_run(self, text, naming):
        self.write("c.toml", text)
        self.refused("run", "c.toml", "--out", "results", naming=naming)
        self.assertFalse((self.dir / "results").exists())

    def test_file(self):
        self.refused("run", "nowhere.toml", "--out", "results", naming=["'nowhere.toml'", "does not exist"])
        self.refused("run", "quik", "--out", "results", naming=["'quik'", "did you mean 'quick'?"])
        self.refused("run", ".", "--out", "results", naming=["'.'", "directory"])
        self.refused_run("name = [", ["c.toml"])
        self.refused_run("", ["c.toml"])

    def test_texts_that_end_early(self):
        def refused(old, new, line):
            self.write("ball.xml", BALL)
            self.assertIn(old, BALL_CAMPAIGN)
            self.refused_run(BALL_CAMPAIGN.replace(old, new), [f"c.toml:{line}:", "NUL", "remove it"])

        refused('model = "./ball.xml"', 'model = "./ball\\u0000.xml"', 8)
        refused('contenders = ["null"]', 'contenders = ["null\\u0000x"]', 2)
        refused("contacts = false", '"a\\u0000b" = 1', 10)
        self.write("torques.csv", "time,a\0b\n")
        self.refused_run(BALL_CAMPAIGN.replace("contacts = false", 'control = {kind = "file", path = "torques.csv"}'),
                         ["torques.csv", "NUL", "line 1"])

    def test_paths_that_are_too_long(self):
        self.refused_run(BALL_CAMPAIGN.replace("./ball.xml", "./" + 5000 * "x" + ".xml"), ["c.toml:8:", "too long"])
        self.refused("run", 5000 * "x" + ".toml", "--out", "results", naming=["too long"])

    def test_names(self):
        self.refused_run(tiny(contenders=["mujoco-eular"]), ["mujoco-eular", "mujoco-euler"])
        self.refused_run(tiny().replace('name = "planar-chain"', 'name = "planar-chian"'), ["planar-chian", "planar-chain"])
        self.refused_run(tiny().replace('"truth"', '"thruth"'), ["thruth", "truth"])
        self.refused_run(tiny().replace("pieces =", "peices ="), ["peices", "pieces"])

    def test_excluded_bodies(self):
        def excluding(pairs):
            return tiny().replace("pieces =", f"exclude = {pairs}\npieces =", 1)

        self.refused_run(excluding('[["link1", "wrld"]]'), ["'wrld'", "did you mean 'world'?"])
        self.refused_run(excluding('[["link1"]]'), ["'exclude'", "pairs of bodies"])
        self.refused_run(excluding('"link1"'), ["exclude"])

    def test_timesteps(self):
        self.refused_run(tiny().replace('["1/4", 1, 4]', '["1/4", -1, 4]'), ["-1"])
        self.refused_run(tiny().replace('["1/4", 1, 4]', '["1/4", 0, 4]'), ["0"])
        self.refused_run(tiny().replace('["1/4", 1, 4]', '["1/4", 1, 3]'), ["3"])
        self.refused_run(tiny().replace('["1/4", 1, 4]', '["1/4", "fast", 4]'), ["fast"])

    def test_options(self):
        self.write("c.toml", tiny())
        for jobs in ["0", "-1", "many", "1.5", "99999999999"]:
            self.refused("run", "c.toml", "--out", "results", "--jobs", jobs, naming=["--jobs", f"'{jobs}'"])
        for shard in ["3/2", "0/2", "half", "1/0"]:
            self.refused("run", "c.toml", "--out", "results", "--shard", shard, naming=[shard])
        self.refused("run", "c.toml", "--out", "", naming=["empty"])
        self.assertFalse((self.dir / "results").exists())


class BadDirectories(CampaignTest):
    def unchanged(self, out, *arguments, naming):
        before = self.content(out)
        self.refused(*arguments, naming=naming)
        self.assertEqual(self.content(out), before)

    def test_results_of_another_campaign(self):
        self.run_tiny()
        self.write("other.toml", tiny("other"))
        self.unchanged("results", "run", "other.toml", "--out", "results", naming=["results", "tiny"])
        # the same name with another content is another campaign too
        self.write("tiny.toml", tiny().replace("pieces = 2", "pieces = 3"))
        self.unchanged("results", "run", "tiny.toml", "--out", "results", naming=["results"])

    def test_results_of_another_version(self):
        self.run_tiny()
        with contextlib.closing(sqlite3.connect(self.dir / "results/assay.sqlite")) as db:
            db.execute("PRAGMA user_version = 999")
        for arguments in [["run", "tiny.toml", "--out", "results"], ["report", "results"],
                          ["export", "results", "--format", "csv"]]:
            self.unchanged("results", *arguments, naming=["results", "999"])

    def test_something_else(self):
        self.write("results/assay.sqlite", "my diary")
        for arguments in [["run", "tiny.toml", "--out", "results"], ["report", "results"],
                          ["export", "results", "--format", "csv"]]:
            self.unchanged("results", *arguments, naming=["results"])

    def test_no_results(self):
        (self.dir / "empty").mkdir()
        for folder in ["empty", "nowhere", "tiny.toml"]:
            for command in [["report", folder], ["export", folder, "--format", "json"]]:
                self.refused(*command, naming=[folder])
        self.assertEqual(list((self.dir / "empty").iterdir()), [])
        self.assertFalse((self.dir / "nowhere").exists())

    def test_place_that_cannot_be(self):
        for out in ["tiny.toml", "tiny.toml/results", "/proc/results"]:
            done = self.run_assay("run", "tiny.toml", "--out", out)
            self.assertIn(done.returncode, (1, 2))
            self.check_sentence(done.stderr, [out])
        self.assertEqual(self.files(), ["tiny.toml"])

    def test_directory_without_permission(self):
        (self.dir / "locked").mkdir()
        (self.dir / "locked").chmod(0o555)
        done = self.run_assay("run", "tiny.toml", "--out", "locked/results", preexec_fn=obey_permissions)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.check_sentence(done.stderr, ["locked/results"])
        reliability("a folder that may not be written", 1, "one sentence, exit status 1", "nothing")


class Workers(AssayTest):
    def test_worker_by_hand_ends_at_once(self):
        done = subprocess.run([PROGRAM, "worker"], capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertNotIn("terminate called", done.stderr)


if __name__ == "__main__":
    main()
