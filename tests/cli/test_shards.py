"""Campaigns in parts: shards, their union, and how far they are."""

import contextlib
import json
import os
import random
import re
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import time

from harness import SOURCE, AssayTest, main, reliability
from test_campaign import CampaignTest, tiny

sys.path.insert(0, str(SOURCE / "results"))
import packed  # noqa: E402


class Shards(CampaignTest):
    def run_parts(self, count=2, **environment):
        for i in range(1, count + 1):
            self.env.update({key: value.format(i=i) for key, value in environment.items()})
            self.run_tiny(f"parts/{i}", "--shard", f"{i}/{count}")
        return [f"parts/{i}" for i in range(1, count + 1)]

    def test_union_of_shards_is_the_whole(self):
        self.run_tiny("whole")
        parts = self.run_parts(3, ASSAY_NODE="node-{i}")
        text = self.assay("merge", *parts, "--out", "merged")
        self.assertRegex(text, r"^29 cells from 3 directories")
        self.assertNotIn("missing", text)
        self.assertEqual(self.table("merged"), self.table("whole"))
        before = self.assay("export", "merged", "--format", "csv")
        self.assertRegex(self.assay("merge", "parts", "--out", "merged"), r"^0 cells from 3 directories \(29 were there")
        self.assertEqual(self.assay("export", "merged", "--format", "csv"), before)
        self.assertNotIn("left out", self.assay("report", "merged", "--systems", "planar-chain"))
        self.refused("report", "merged", "--systems", "planar-chian", naming=["planar-chian", "planar-chain"])

    def test_each_result_names_the_machine_it_was_measured_on(self):
        self.run_parts(2, ASSAY_NODE="node-{i}")
        self.assay("merge", "parts", "--out", "merged")
        with contextlib.closing(sqlite3.connect(self.dir / "merged/assay.sqlite")) as db:
            nodes = dict(db.execute("SELECT id, json FROM nodes"))
            names = {json.loads(text)["name"] for text in nodes.values()}
            self.assertEqual(names, {"node-1", "node-2"})
            measured = db.execute("SELECT count(*) FROM cells JOIN nodes ON nodes.id = cells.node").fetchone()[0]
            self.assertEqual(measured, db.execute("SELECT count(*) FROM cells").fetchone()[0])
            timed = {nodes[node] for (node,) in db.execute(
                "SELECT node FROM cells WHERE measure = 'raw_speed'")}
            self.assertEqual(len(timed), 1, "all timings of a system are of one machine")

    def test_status_counts_what_is_there_and_names_what_is_missing(self):
        self.run_tiny("parts/1", "--shard", "1/3")
        status = self.assay_json("status", "parts", "--json")
        self.assertEqual(status["missing"], ["parts 2, 3 of 3"])
        self.assertEqual([part["state"] for part in status["parts"]], ["complete"])
        self.assertEqual(status["planned"], status["done"])
        self.assertRegex(self.assay("merge", "parts", "--out", "merged"), r"(?m)^missing: parts 2, 3 of 3$")
        self.assertIn("missing: parts 2, 3 of 3", self.assay("status", "merged"))

    def test_a_part_beside_the_whole_lacks_nothing(self):
        self.run_tiny("whole")
        self.run_tiny("part", "--shard", "1/3")
        for dirs in (["part", "whole"], ["whole", "part"]):
            status = self.assay_json("status", *dirs, "--json")
            self.assertEqual(status["missing"], [])
            self.assertEqual(status["done"], status["planned"])
        text = self.assay("status", "part", "whole")
        self.assertIn(f"{status['done']} of {status['planned']} cells", text)
        self.assertNotIn("missing", text)
        # a part of another division still is one, and a merge counts as the status does
        alone = self.assay_json("status", "part", "--json")
        self.assertEqual(alone["missing"], ["parts 2, 3 of 3"])
        text = self.assay("merge", "part", "--out", "merged")
        stored = int(re.match(r"(\d+) cells? from 1 directory", text).group(1))
        said = re.search(r"(?m)^the union has (\d+) of (\d+) planned cells(?:, and (\d+) that no plan counts.*)?$", text)
        self.assertEqual((int(said.group(1)), int(said.group(2))), (alone["done"], alone["planned"]))
        self.assertEqual(int(said.group(3) or 0), stored - alone["done"])

    def test_status_of_an_interrupted_part_tells_the_time_left(self):
        self.write("tiny.toml", tiny().replace("rounds = 3", "rounds = 300"))
        run = self.start_assay("run", "tiny.toml", "--out", "part")
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            done = self.run_assay("status", "part", "--json")
            if done.returncode == 0 and json.loads(done.stdout)["done"] > 3:
                break
            time.sleep(0.05)
        state = self.assay_json("status", "part", "--json")["parts"][0]["state"]
        self.assertEqual(state, "running")
        run.send_signal(signal.SIGINT)
        run.communicate(timeout=60)
        status = self.assay_json("status", "part", "--json")
        self.assertEqual(status["parts"][0]["state"], "stopped")
        self.assertLess(status["done"], status["planned"])
        self.assertGreater(status["left_s"], 0)
        self.assertIn("left where all parts run side by side", self.assay("status", "part"))

    def test_kinds_of_cells_divide_apart(self):
        self.run_tiny("whole")
        for i in [1, 2]:
            self.run_tiny(f"parts/a{i}", "--shard", f"{i}/2", "--cells", "accuracy")
        self.run_tiny("parts/t1", "--shard", "1/1", "--cells", "timing")
        with contextlib.closing(sqlite3.connect(self.dir / "parts/t1/assay.sqlite")) as db:
            self.assertEqual({row[0] for row in db.execute("SELECT DISTINCT measure FROM cells")}, {"raw_speed"})
        self.assertNotIn("missing", self.assay("merge", "parts", "--out", "merged"))
        self.assertEqual(self.table("merged"), self.table("whole"))

    def test_runs_that_were_made_before_are_read(self):
        self.write("tiny.toml", tiny().replace('"raw_speed", ', '"agreement", "raw_speed", ').replace("pieces = 2", "pieces = 3\ninitial_states = 3"))
        self.run_tiny("whole", "--references", "off")
        made = {}
        for i in [1, 2, 3]:
            told = self.run_tiny(f"runs/{i}", "--shard", f"{i}/3", "--cells", "runs", "--references", "made")
            made[i] = int(re.search(r"^runs that other parts read: (\d+) of", told)[1])
            self.assertEqual(self.assay_json("status", f"runs/{i}", "--json")["planned"], 0)
        # of two contenders from three states, and one reference solution
        self.assertEqual(sum(made.values()), 2 * 3 + 1)
        self.assertGreater(min(made.values()), 0, made)
        self.assertEqual(len(list((self.dir / "made").glob("*.bin"))), 7)
        # again: they are there
        self.assertIn(f"read: {made[1]} of", self.run_tiny("runs/1", "--shard", "1/3", "--cells", "runs", "--references", "made"))
        for i in [1, 2, 3]:
            self.run_tiny(f"parts/a{i}", "--shard", f"{i}/3", "--cells", "after-runs", "--references", "made")
        self.run_tiny("parts/t1", "--shard", "1/1", "--cells", "timing", "--references", "made")
        self.assertNotIn("missing", self.assay("merge", "parts", "--out", "merged"))
        self.assertEqual(self.table("merged"), self.table("whole"))
        # they are these files and not made again: a sign in their last number is found in the parts
        signed = {}
        for file in (self.dir / "made").glob("*.bin"):
            content = file.read_bytes()[:-32]
            content = content[:-8] + struct.pack("<d", struct.unpack("<d", content[-8:])[0] + 1e-12)
            signed[file.name] = content + packed.content_hash(content).encode()
            file.write_bytes(signed[file.name])
        shutil.rmtree(self.dir / "parts")
        for i in [1, 2, 3]:
            self.run_tiny(f"parts/a{i}", "--shard", f"{i}/3", "--cells", "after-runs", "--references", "made")
        read = {file.name: file.read_bytes() for file in (self.dir / "parts").glob("*/trajectories/*.bin") if file.name in signed}
        self.assertEqual(read, signed)
        # without them these parts make their own
        shutil.rmtree(self.dir / "parts")
        for i in [1, 2, 3]:
            self.run_tiny(f"parts/a{i}", "--shard", f"{i}/3", "--cells", "after-runs", "--references", "off")
        self.run_tiny("parts/t1", "--shard", "1/1", "--cells", "timing")
        self.assay("merge", "parts", "--out", "again")
        self.assertEqual(self.table("again"), self.table("whole"))

    def test_runs_need_a_folder_that_others_see(self):
        self.refused("run", "tiny.toml", "--out", "runs", "--cells", "runs", "--references", "off", naming=["--references", "'off'"])
        self.refused("run", "tiny.toml", "--out", "runs", "--cells", "run", naming=["'run'", "after-runs"])
        self.run_tiny("runs", "--shard", "1/2", "--cells", "runs", "--references", "made")
        self.refused("run", "tiny.toml", "--out", "runs", "--shard", "1/2", "--cells", "after-runs", "--references", "made",
                     naming=["part 1/2 of the runs that others read"])

    def test_runs_that_lay_in_the_results_are_not_kept_for_other_campaigns(self):
        # the results may be a stranger's, and a checksum tells nothing of who made a run
        self.run_tiny("r", "--cells", "timing", "--references", "off")

        def names(folder):
            return {file.name for file in (self.dir / folder).glob("*.bin")}

        there = names("r/trajectories")
        self.assertTrue(there)
        self.run_tiny("r", "--references", "kept")
        self.assertTrue(names("kept"))
        self.assertEqual(names("kept") & there, set())
        # nor does a part that makes runs for others count one as made that only its own folder has
        self.run_tiny("runs", "--cells", "runs", "--references", "first")
        made = names("first")
        self.run_tiny("runs", "--cells", "runs", "--references", "second")
        self.assertEqual(names("second"), made)
        for name in made:
            self.assertNotEqual((self.dir / "second" / name).stat().st_ino, (self.dir / "first" / name).stat().st_ino)

    def test_shard_from_the_environment(self):
        def part(**variables):
            env = {key: str(value) for key, value in variables.items()}
            self.env = {**self.plain_env, **env}
            done = self.run_assay("run", "tiny.toml", "--out", "part", "--shard", self.shard)
            shutil.rmtree(self.dir / "part", ignore_errors=True)
            return done

        self.plain_env, self.shard = self.env, "auto"
        array = {"SLURM_ARRAY_TASK_MIN": 1, "SLURM_ARRAY_TASK_MAX": 2, "SLURM_ARRAY_TASK_COUNT": 2}
        cells = {}
        for name, variables in [("first", {"ASSAY_SHARD": "1/2"}), ("slurm", {"SLURM_ARRAY_TASK_ID": 1, **array})]:
            done = part(**variables)
            self.assertEqual(done.returncode, 0, done.stderr)
            cells[name] = done.stdout.split(" ")[0]
        self.assertEqual(cells["first"], cells["slurm"])
        self.shard = "auto/2"
        done = part(JOB_COMPLETION_INDEX=0)
        self.assertEqual((done.returncode, done.stdout.split(" ")[0]), (0, cells["first"]), done.stderr)
        done = part(SLURM_ARRAY_TASK_ID=1, SLURM_ARRAY_TASK_MIN=1, SLURM_ARRAY_TASK_MAX=1, SLURM_ARRAY_TASK_COUNT=1)
        self.assertEqual((done.returncode, done.stdout.split(" ")[0]), (0, cells["first"]), done.stderr)
        for shard, variables, words in [
                ("auto", {}, ["--shard auto", "I/N"]),
                # one index of a larger array again: it looks like a whole array of one
                ("auto", {"SLURM_ARRAY_TASK_ID": 1, "SLURM_ARRAY_TASK_MIN": 1, "SLURM_ARRAY_TASK_MAX": 1,
                          "SLURM_ARRAY_TASK_COUNT": 1}, ["SLURM_ARRAY_TASK_ID", "array of one", "auto/N"]),
                ("auto", {"SGE_TASK_ID": 3, "SGE_TASK_FIRST": 3, "SGE_TASK_LAST": 3}, ["SGE_TASK_ID", "auto/N"]),
                ("auto/2", {"SLURM_ARRAY_TASK_ID": 1, "SLURM_ARRAY_TASK_MIN": 1, "SLURM_ARRAY_TASK_MAX": 3,
                            "SLURM_ARRAY_TASK_COUNT": 3}, ["3 parts", "of 2"]),
                ("auto", {"JOB_COMPLETION_INDEX": 0}, ["JOB_COMPLETION_INDEX", "auto/N"]),
                ("auto", {"SLURM_ARRAY_TASK_ID": 3, "SLURM_ARRAY_TASK_MIN": 3, "SLURM_ARRAY_TASK_MAX": 7,
                          "SLURM_ARRAY_TASK_COUNT": 2}, ["SLURM_ARRAY_TASK_ID", "auto/N"]),
                ("auto/2", {"JOB_COMPLETION_INDEX": 2}, ["part 3 of 2"]),
                ("auto/3", {"ASSAY_SHARD": "1/2"}, ["2 parts", "of 3"]),
                ("auto/2", {"JOB_COMPLETION_INDEX": "x"}, ["'x'", "JOB_COMPLETION_INDEX"])]:
            self.shard = shard
            done = part(**variables)
            self.assertEqual(done.returncode, 2, (shard, variables, done.stdout))
            self.check_sentence(done.stderr, words)

    def test_a_directory_goes_on_only_as_the_part_that_it_was_begun_as(self):
        self.run_tiny("part", "--shard", "1/2")
        before = self.content("part")
        self.refused("run", "tiny.toml", "--out", "part", "--shard", "2/2",
                     naming=["'part'", "part 1/2", "part 2/2", "assay merge"])
        self.refused("run", "tiny.toml", "--out", "part", "--shard", "1/2", "--cells", "timing",
                     naming=["part 1/2 of the timing cells"])
        # what repeats parts 1 of 1 of an array of two
        self.env["ASSAY_SHARD"] = "1/1"
        self.refused("run", "tiny.toml", "--out", "part", "--shard", "auto", naming=["the whole campaign"])
        self.assertEqual(self.content("part"), before)
        self.assertIn("(0 now", self.run_tiny("part", "--shard", "1/2"))
        # all cells are no part: what is missing is added, and then nothing is
        self.run_tiny("part")
        self.assertNotIn("missing", self.assay("status", "part"))

    def test_parts_that_are_ahead_of_their_union_count(self):
        self.run_tiny("out/shards/one", "--shard", "1/3")
        self.assay("merge", "out/shards", "--out", "out")
        united = self.assay_json("status", "out", "--json")
        self.assertEqual([part["dir"] for part in united["parts"]], ["out"])
        self.run_tiny("out/shards/two", "--shard", "2/3")
        status = self.assay_json("status", "out", "--json")
        self.assertEqual([part["dir"] for part in status["parts"]], ["out/shards/one", "out/shards/two"])
        self.assertGreater(status["done"], united["done"])
        self.assertEqual(status["done"], status["planned"])
        self.assertEqual(status["missing"], ["part 3 of 3"])
        # cells that only the union has are not lost, and none counts twice
        shutil.rmtree(self.dir / "out/shards/one")
        again = self.assay_json("status", "out", "--json")
        self.assertEqual([part["dir"] for part in again["parts"]], ["out", "out/shards/two"])
        self.assertEqual((again["done"], again["missing"]), (status["done"], status["missing"]))
        self.assertEqual(self.assay_json("status", "out", "out/shards/two", "--json")["done"], status["done"])

    def test_status_does_not_add_up_two_campaigns(self):
        self.run_tiny("one", "--shard", "1/3")
        self.write("tiny.toml", tiny(name="other"))
        self.run_tiny("two", "--shard", "2/3")
        self.refused("status", "one", "two", naming=["'one'", "'tiny'", "'two'", "'other'"])
        self.write("tiny.toml", tiny().replace("duration_s = 0.16", "duration_s = 0.32"))
        self.run_tiny("three", "--shard", "2/3")
        self.refused("status", "one", "three", naming=["'one'", "'three'", "two states"])

    def test_a_part_that_moves_to_another_machine_times_its_systems_again(self):
        self.env["ASSAY_NODE"] = "one"
        self.run_tiny("part")
        with contextlib.closing(sqlite3.connect(self.dir / "part/assay.sqlite")) as db, db:
            db.execute("PRAGMA foreign_keys = ON")
            db.execute("DELETE FROM cells WHERE measure = 'raw_speed' AND timestep_ms = 1")
        self.env["ASSAY_NODE"] = "other"
        done = self.run_assay("run", "tiny.toml", "--out", "part")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("planar-chain was timed on 'one'", done.stderr)
        with contextlib.closing(sqlite3.connect(self.dir / "part/assay.sqlite")) as db:
            names = {json.loads(text)["name"] for (text,) in db.execute(
                "SELECT DISTINCT n.json FROM cells c JOIN nodes n ON n.id = c.node "
                "WHERE c.measure = 'raw_speed'")}
        self.assertEqual(names, {"other"})
        # nothing is missing: nothing is measured again
        self.env["ASSAY_NODE"] = "third"
        self.assertRegex(self.run_tiny("part"), r"26 ok \(0 now, 26 before\)")


class Refusals(CampaignTest):
    def test_what_does_not_fit_is_refused_in_one_sentence(self):
        self.run_tiny("a", "--shard", "1/2")
        self.run_tiny("b", "--shard", "2/2")
        self.write("tiny.toml", tiny().replace("duration_s = 0.16", "duration_s = 0.32"))
        self.run_tiny("longer", "--shard", "2/2")
        before = self.content("a")
        self.refused("merge", "a", "longer", "--out", "merged", naming=["duration_s", "0.16", "0.32", "one campaign"])
        self.assertFalse((self.dir / "merged").exists())
        self.refused("merge", "a", "nowhere", "--out", "merged", naming=["'nowhere'"])
        (self.dir / "empty").mkdir()
        self.refused("merge", "a", "empty", "--out", "merged", naming=["'empty'", "holds no results"])
        self.refused("status", "nowhere", naming=["'nowhere'"])
        shutil.copytree(self.dir / "a", self.dir / "changed")
        with contextlib.closing(sqlite3.connect(self.dir / "changed/assay.sqlite")) as db, db:
            db.execute("""UPDATE "values" SET value = 2 * value""")
        self.refused("merge", "a", "changed", "--out", "merged", naming=["changed", "damaged"])
        self.assertEqual(self.content("a"), before)
        reliability("merging: a campaign that changed between parts, a part that is missing, empty or was changed", 4,
                    "one sentence that names it, exit status 2", "nothing")

    def test_a_merge_that_was_killed_is_finished_by_the_same_command(self):
        self.run_tiny("a", "--shard", "1/2")
        self.run_tiny("b", "--shard", "2/2")
        start = time.monotonic()
        self.assay("merge", "a", "b", "--out", "whole")
        duration = time.monotonic() - start
        values = self.assay("export", "whole", "--format", "csv")
        seed = random.randrange(1 << 32)
        chance = random.Random(seed)
        kills = half_done = 0
        for _ in range(60):
            for folder in ("killed", "copy"):
                shutil.rmtree(self.dir / folder, ignore_errors=True)
            merge = self.start_assay("merge", "a", "b", "--out", "killed")
            try:
                merge.communicate(timeout=chance.uniform(0, 1.1) * duration)
            except subprocess.TimeoutExpired:
                merge.kill()
                merge.communicate()
            if merge.returncode != -signal.SIGKILL:  # it has ended before
                continue
            kills += 1
            if (self.dir / "killed").exists():
                shutil.copytree(self.dir / "killed", self.dir / "copy")
                half_done += self.run_assay("export", "copy", "--format", "csv").stdout != values
            self.assay("merge", "a", "b", "--out", "killed")
            self.assertEqual(self.assay("export", "killed", "--format", "csv"), values, f"seed {seed}")
            if kills >= 6 and half_done >= 2:
                break
        self.assertGreaterEqual(kills, 6, f"seed {seed}: kills that came before the end of a merge of {duration:.3f} s")
        self.assertGreaterEqual(half_done, 1, f"seed {seed}: merges that had begun to write in {kills} kills")
        reliability("SIGKILL of `assay merge` at random moments", kills, "the same command finishes it; the same values", "nothing")

    def test_what_a_killed_merge_left_half_written_is_rolled_back(self):
        self.run_tiny("a", "--shard", "1/2")
        self.run_tiny("b", "--shard", "2/2")
        self.assay("merge", "a", "b", "--out", "whole")
        for command in [("merge", "a", "b", "--out", "killed"), ("export", "killed", "--format", "csv"), ("status", "killed")]:
            shutil.rmtree(self.dir / "killed", ignore_errors=True)
            (self.dir / "killed").mkdir()
            with contextlib.closing(sqlite3.connect(self.dir / "whole/assay.sqlite")) as whole:
                whole.execute("VACUUM INTO ?", (str(self.dir / "part.sqlite"),))
            with contextlib.closing(sqlite3.connect(self.dir / "part.sqlite", isolation_level=None)) as db:
                # without a write-ahead log, as in a database whose first transaction has not ended
                db.execute("PRAGMA journal_mode = DELETE")
                db.execute("PRAGMA cache_size = 1")
                db.execute("BEGIN")
                db.execute("DELETE FROM samples")
                db.execute('DELETE FROM "values"')
                shutil.copy(self.dir / "part.sqlite", self.dir / "killed/assay.sqlite")
                shutil.copy(self.dir / "part.sqlite-journal", self.dir / "killed/assay.sqlite-journal")
                db.execute("ROLLBACK")
            (self.dir / "part.sqlite").unlink()
            with self.subTest(command=command):
                self.assay(*command)
                self.assertEqual(self.assay("export", "killed", "--format", "csv"),
                                 self.assay("export", "whole", "--format", "csv"))


if __name__ == "__main__":
    main()
