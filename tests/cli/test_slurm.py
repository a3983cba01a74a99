"""`assay submit`: scripts, and a real Slurm of one node on this machine, started and stopped here."""

import contextlib
import fcntl
import json
import os
import re
import shutil
import sqlite3
import subprocess
import time
import unittest

from harness import PROGRAM, AssayTest, main, reliability
from one_node_slurm import Slurm, missing
from test_campaign import CampaignTest, tiny

class Scripts(CampaignTest):
    def test_dry_run_prints_what_would_be_submitted(self):
        text = self.assay("submit", "--slurm", "tiny.toml", "--out", "a folder", "--nodes", "2", "--partition", "fast",
                          "--cpus", "2", "--dry-run")
        self.assertFalse((self.dir / "a folder").exists())
        self.assertEqual(text.count("#SBATCH --partition=fast"), 4)
        timing = text[text.index("timing.sh\n"):]
        self.assertIn("#SBATCH --exclusive", timing)
        self.assertNotIn("--exclusive", text[:text.index("timing.sh\n")])
        for cells, folder in [("runs", "/runs/"), ("after-runs", "/shards/accuracy-"), ("timing", "/shards/timing-")]:
            self.assertRegex(text, f"--cells {cells} --references '[^']*/a folder/references' --out '[^']*/a folder'{folder}\"")
        # what reads no run need not wait for them
        self.assertRegex(text, r"--array=\S+ jobs/accuracy.sh")
        self.assertIn("--dependency=afterany:RUNS jobs/accuracy.sh", text)
        self.assertIn("--dependency=afterany:RUNS:ALONE:ACCURACY jobs/timing.sh", text)
        self.assertIn("--dependency=afterany:RUNS:ALONE:ACCURACY:TIMING jobs/finish.sh", text)
        # the planar chain's timings are one group: a second timing part would be empty
        self.assertRegex(text, r"--array=1%2 ")
        for script in re.findall(r"(?s)(#!/bin/sh\n.*?)\n\n", text):
            self.assertEqual(subprocess.run(["sh", "-n"], input=script, text=True).returncode, 0, script)
            self.assertIn("'", script)  # a folder with a space is one word

    def test_without_slurm_one_sentence(self):
        self.env["PATH"] = str(self.dir)
        self.refused("submit", "--slurm", "tiny.toml", "--out", "out", naming=["no Slurm", "sbatch", "--shard"])
        reliability("a Slurm that is not there", 1, "one sentence with the commands that need none, exit status 2", "nothing")

    def test_a_refusal_of_slurm_is_passed_on_and_nothing_stays_submitted(self):
        # a stand-in that takes the first job and refuses the second
        self.write("bin/sbatch", f"""#!/bin/sh
            echo "$@" >> '{self.dir}/submitted'
            if [ "$(wc -l < '{self.dir}/submitted')" -gt 1 ]; then
              echo 'sbatch: error: Batch job submission failed: Invalid account' >&2; exit 1
            fi
            echo 41""")
        self.write("bin/scancel", f"#!/bin/sh\necho \"$@\" >> '{self.dir}/cancelled'\n")
        for name in ["sbatch", "scancel"]:
            (self.dir / "bin" / name).chmod(0o755)
        self.env["PATH"] = f"{self.dir}/bin:{self.env['PATH']}"
        self.refused("submit", "--slurm", "tiny.toml", "--out", "out", naming=["Slurm refuses", "Invalid account"])
        self.assertEqual((self.dir / "cancelled").read_text(), "41\n")
        reliability("a Slurm that takes a job and refuses the next", 1, "one sentence with its reason; the first is cancelled", "nothing")

    def stand_in(self, name, script):
        self.write(f"bin/{name}", f"#!/bin/sh\n{script}\n").chmod(0o755)
        self.env["PATH"] = f"{self.dir}/bin:{os.environ['PATH']}"

    def test_an_answer_without_a_number_cancels_what_was_submitted(self):
        self.stand_in("sbatch", f"""echo x >> '{self.dir}/submitted'
            if [ "$(wc -l < '{self.dir}/submitted')" -gt 1 ]; then cat '{self.dir}/said'; else echo 41; fi""")
        self.stand_in("scancel", f"echo \"$@\" >> '{self.dir}/cancelled'")
        answers = {"": "empty", "\n": "empty", "Welcome to the cluster\n": "'Welcome to the cluster'", "12 jobs\n": "'12 jobs'", "0": "'0'",
                   "-4\n": "'-4'", "12;\n": "'12;'", "12;a;b": "'12;a;b'", "99999999999999999999": "'99999999999999999999'", "4.2": "'4.2'"}
        for said, quoted in answers.items():
            for file in ("submitted", "cancelled"):
                (self.dir / file).unlink(missing_ok=True)
            self.write("said", said)
            with self.subTest(said):
                self.refused("submit", "--slurm", "tiny.toml", "--out", "out",
                             naming=["no job number", quoted, "squeue --me", "'assay-accuracy'", "nothing was submitted"])
                self.assertEqual((self.dir / "cancelled").read_text(), "41\n")
                self.assertEqual(json.loads((self.dir / "out/jobs/request.json").read_text())["jobs"], [])
        reliability("a Slurm whose answer has no job number", len(answers), "one sentence; what was submitted before is cancelled", "nothing")

    def test_a_wrapper_of_sbatch_may_greet(self):
        self.stand_in("sbatch", f"""echo "$@" >> '{self.dir}/submitted'
            echo 'Welcome to the cluster, quota 12 of 50'; echo 77; printf '%s;west\\r\\n' "$(wc -l < '{self.dir}/submitted')"
            echo 'Please cite us'""")
        text = self.assay("submit", "--slurm", "tiny.toml", "--out", "out", "--shards", "2")
        self.assertIn("job 1: 2 parts of runs", text.replace("\n", " "))
        self.assertEqual([job["id"] for job in json.loads((self.dir / "out/jobs/request.json").read_text())["jobs"]], list("12345"))
        self.assertIn("--dependency=afterany:1:2:3:4 ", (self.dir / "submitted").read_text())

    def test_a_record_that_cannot_be_written_leaves_no_job(self):
        self.stand_in("sbatch", f"rm -r '{self.dir}/out/jobs'\necho 41")
        self.stand_in("scancel", f"echo \"$@\" >> '{self.dir}/cancelled'")
        told = self.refused("submit", "--slurm", "tiny.toml", "--out", "out", status=1, naming=["request.json", "nothing was submitted"])
        self.assertEqual((self.dir / "cancelled").read_text(), "41\n", told)
        self.stand_in("scancel", "exit 1")
        self.refused("submit", "--slurm", "tiny.toml", "--out", "out", status=1, naming=["request.json", "'scancel 41'"])
        reliability("the record of submitted jobs cannot be written", 2, "one sentence; the jobs are cancelled, or named", "nothing")

    def test_links_of_the_directory_are_not_followed(self):
        self.env["PATH"] = str(self.dir)
        elsewhere = self.dir / "elsewhere"
        elsewhere.mkdir()
        for name in ("jobs", "jobs/finish.log", "shards", "shards/accuracy-1", "shards/timing-1", "runs", "runs/1", "references"):
            with self.subTest(name):
                shutil.rmtree(self.dir / "out", ignore_errors=True)
                link = self.dir / "out" / name
                link.parent.mkdir(parents=True)
                link.symlink_to(elsewhere)
                self.refused("submit", "--slurm", "tiny.toml", "--out", "out", naming=[f"out/{name}'", "a symbolic link"])
                self.assertEqual(list(elsewhere.iterdir()), [])

    def test_the_reason_is_the_last_error_and_no_warning(self):
        self.write("bin/sbatch", """#!/bin/sh
            echo 'sbatch: warning: nodes are few' >&2
            echo 'sbatch: error: Memory specification can not be satisfied' >&2
            echo 'sbatch: error: Batch job submission failed: Requested node configuration is not available.' >&2
            echo 'sbatch: see the manual' >&2
            exit 1""")
        (self.dir / "bin/sbatch").chmod(0o755)
        self.env["PATH"] = f"{self.dir}/bin:{self.env['PATH']}"
        told = self.refused("submit", "--slurm", "tiny.toml", "--out", "out",
                            naming=["the job: Batch job submission failed: Requested node configuration is not available;"])
        self.assertNotIn("warning", told)

    def test_more_options_of_sbatch(self):
        text = self.assay("submit", "--slurm", "tiny.toml", "--out", "out", "--sbatch=--constraint=[zen4|zen5]",
                          "--sbatch=--mem=8G", "--sbatch=--qos=long", "--dry-run")
        for line in ["#SBATCH --constraint=[zen4|zen5]", "#SBATCH --mem=8G", "#SBATCH --qos=long"]:
            self.assertEqual(text.splitlines().count(line), 4, text)
        for option, words in [("-C zen4", ["'-C zen4'", "long option"]), ("--mem=8G\n#SBATCH --array=1", ["--mem=8G"]),
                              ("--mem=8G --array=1", ["spaces"]), ("--array=1-9", ["--array", "itself"]),
                              ("--arr=1-9", ["--array", "itself"]), ("--time=1:00", ["use --time"]), ("--", ["long option"]),
                              ("--=x", ["--sbatch"])]:
            self.refused("submit", "--slurm", "tiny.toml", "--out", "out", f"--sbatch={option}", "--dry-run", naming=words)

    def test_a_newline_does_not_make_a_line_of_the_script(self):
        for option in ("--partition", "--account", "--time"):
            self.refused("submit", "--slurm", "tiny.toml", "--out", "out", option, "x\n#SBATCH --wrap=rm", "--dry-run",
                         naming=[option, "control character"])
        self.refused("submit", "--slurm", "tiny.toml", "--out", "o\nut", "--dry-run", naming=["--out", "control character"])

    def test_as_many_parts_on_each_node_and_none_of_little_work(self):
        told = re.sub(r"\s+", " ", self.assay("submit", "--help"))
        most = int(re.search(r"at least one and at most (\d+) a node", told)[1])

        def parts(*words):
            text = self.assay("submit", "--slurm", *words, "--out", "out", "--dry-run")
            return [max(int(n) for n in re.findall(rf"--array=[\d-]*?(\d+) (?:\S+ )?jobs/{kind}\.sh", text)) for kind in ("runs", "accuracy")]

        self.assertEqual(parts("paper", "--nodes", "2"), [2 * most, 2 * most])
        self.assertEqual(parts("quick", "--nodes", "64"), [64, 64])  # some seconds each
        few = parts("quick", "--nodes", "4")
        self.assertTrue(all(n % 4 == 0 and 4 < n < 4 * most for n in few), few)

    def test_wrong_use(self):
        self.refused("submit", "tiny.toml", "--out", "out", naming=["--slurm"])
        self.refused("submit", "--slurm", "--out", "out", naming=["CAMPAIGN"])
        self.refused("submit", "--resume", "--out", "out", naming=["request.json"])
        self.refused("submit", "--slurm", "tiny.toml", "--out", "out", "--nodes", "0", naming=["--nodes", "0"])


class Queue(CampaignTest):
    """Stand-ins of Slurm's commands: `queue` is what squeue says, `submitted` what sbatch was asked."""

    def setUp(self):
        super().setUp()
        self.write("bin/sbatch", f"""#!/bin/sh
            echo "$@" >> '{self.dir}/submitted'
            wc -l < '{self.dir}/submitted'""")
        self.write("bin/squeue", f"""#!/bin/sh
            if [ -e '{self.dir}/down' ]; then
              echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2; exit 1
            fi
            cat '{self.dir}/queue'""")
        for name in ["sbatch", "squeue"]:
            (self.dir / "bin" / name).chmod(0o755)
        self.env["PATH"] = f"{self.dir}/bin:{self.env['PATH']}"
        self.queue()
        self.assay("submit", "--slurm", "tiny.toml", "--out", "out", "--shards", "2")  # jobs 1 to 5
        self.assertEqual(self.new_jobs(), ["--array=1-2 runs.sh", "--array=1 accuracy.sh", "--array=2 --dependency=afterany:1 accuracy.sh",
                                           "--array=1%1 --dependency=afterany:1:2:3 timing.sh",
                                           "--export=ALL,ASSAY_ATTEMPT=1 --dependency=afterany:1:2:3:4 finish.sh"])

    def run_part_1(self):
        self.run_tiny("out/shards/accuracy-1", "--shard", "1/2", "--cells", "after-runs", "--references", "out/references")

    def queue(self, *lines):
        self.write("queue", "".join(f"{line}\n" for line in lines))

    def new_jobs(self):
        """Since the last call: the arguments of sbatch, without the folder of the script."""
        lines = (self.dir / "submitted").read_text().splitlines()
        new = lines[getattr(self, "seen", 0):]
        self.seen = len(lines)
        return [re.sub(r"\S*/jobs/", "", line).removeprefix("--parsable ") for line in new]

    def test_what_waits_or_runs_is_left_alone(self):
        self.queue("1_1 COMPLETED", "1_2 RUNNING", "2_1 PENDING", "3_2 PENDING", "4_1 PENDING", "5 PENDING")
        text = self.assay("submit", "--resume", "--out", "out")
        self.assertIn("accuracy parts 1-2, timing parts 1, parts of runs 2 wait or run (Slurm's jobs 1, 2, 3, 4, 5) and are left "
                      "alone", text)
        self.assertEqual(self.new_jobs(), [])
        self.queue("2_1 RUNNING", "3_2 PENDING", "4_1 PENDING", "5 PENDING")
        text = self.assay("submit", "--resume", "--out", "out")
        self.assertIn("accuracy parts 1-2, timing parts 1 wait or run (Slurm's jobs 2, 3, 4, 5) and are left alone", text)
        self.assertEqual(self.new_jobs(), [])
        # one that was killed is submitted again, before timings that still wait: their finishing job comes last
        self.queue("2_1 NODE_FAIL", "3_2 COMPLETING", "4_1 PENDING", "5 PENDING")
        self.assertIn("timing parts 1 wait or run", self.assay("submit", "--resume", "--out", "out"))
        self.assertEqual(self.new_jobs(), ["--array=1 accuracy.sh", "--array=2 accuracy.sh",
                                           "--export=ALL,ASSAY_ATTEMPT=1 --dependency=afterany:4:5:6:7 finish.sh"])
        self.queue("4_1 PENDING", "5 PENDING", "6_1 PENDING", "7_2 RUNNING", "8 PENDING")
        self.assay("submit", "--resume", "--out", "out")
        self.assertEqual(self.new_jobs(), [])

    def test_the_finishing_job_waits_for_what_was_submitted_meanwhile(self):
        self.env["SLURM_JOB_ID"] = "5"
        self.queue("2_1 COMPLETED", "3_2 RUNNING", "4_1 PENDING", "5 RUNNING")
        self.run_part_1()
        done = self.run_assay("submit", "--resume", "--out", "out", "--attempt", "3")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertNotIn("lost after", done.stdout)
        self.assertEqual(self.new_jobs(), ["--export=ALL,ASSAY_ATTEMPT=3 --dependency=afterany:3:4 finish.sh"])
        # and what has ended without all of its cells is lost
        self.queue()
        done = self.run_assay("submit", "--resume", "--out", "out", "--attempt", "3")
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertIn("lost after 3 tries: accuracy parts 2, timing parts 1", done.stderr)

    def test_without_an_answer_of_squeue_the_lock_decides(self):
        self.write("down", "")
        self.write("out/shards/accuracy-1/.lock", "")
        with open(self.dir / "out/shards/accuracy-1/.lock") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            done = self.run_assay("submit", "--resume", "--out", "out")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.check_sentence(done.stderr, ["jobs 1, 2, 3, 4, 5", "not known", "Unable to contact"])
            self.assertIn("accuracy parts 1, timing parts none wait or run", done.stdout)
            self.assertEqual(self.new_jobs()[:2], ["--array=2 accuracy.sh", "--array=1%1 --dependency=afterany:6 timing.sh"])
            self.refused("submit", "--slurm", "tiny.toml", "--out", "out", naming=["accuracy parts 1", "--resume"])

    def test_a_part_that_was_killed_at_its_start_is_lost(self):
        self.write("out/shards/accuracy-1/assay.sqlite", "")
        self.assertEqual([part["state"] for part in self.assay_json("status", "out", "--json")["parts"]], 3 * ["waiting"])
        self.assay("submit", "--resume", "--out", "out")
        self.assertEqual(self.new_jobs()[:2], ["--array=1 accuracy.sh", "--array=2 accuracy.sh"])

    def test_a_request_that_a_stranger_wrote(self):
        request = self.dir / "out/jobs/request.json"
        good = json.loads(request.read_text())

        def forge(**keys):
            request.write_text(json.dumps({**good, **keys}))

        evil = [{"runs_parts": 2000000000}, {"accuracy_parts": -1}, {"cpus": 0}, {"nodes": 10**9},
                {"options": ["--wrap=rm"]}, {"partition": "x\n#SBATCH --wrap=rm"},
                {"jobs": [{"id": "1; rm", "kind": "accuracy", "parts": [1]}]}, {"jobs": [{"id": "1", "kind": "accuracy", "parts": [0]}]}]
        for keys in evil:
            forge(**keys)
            self.refused("status", "out", naming=[])
            self.refused("submit", "--resume", "--out", "out", naming=[])
        self.assertEqual(self.new_jobs(), [])
        forge(program="/tmp/another program")
        self.assay("submit", "--resume", "--out", "out")
        self.assertEqual(self.new_jobs()[0], "--array=1 accuracy.sh")
        self.assertNotIn("another program", (self.dir / "out/jobs/accuracy.sh").read_text())
        request.unlink()
        os.mkfifo(request)
        self.refused("status", "out", naming=["request.json", "a named pipe"])
        self.refused("submit", "--resume", "--out", "out", naming=["request.json", "a named pipe"])
        reliability("a submitted directory whose record a stranger wrote: numbers, options, another program, a pipe", len(evil) + 2,
                    "one sentence, exit status 2; this program's own scripts", "nothing")

    def test_a_damaged_record_starts_no_part_twice(self):
        self.queue("3_2 RUNNING", "5 PENDING")
        request = self.dir / "out/jobs/request.json"
        good = request.read_bytes()
        damages = [b"", good[:len(good) // 2], good[:-3], b"[]", b"{}"]
        for damaged in damages:
            request.write_bytes(damaged)
            with self.subTest(damaged[-20:]):
                for command in (["submit", "--resume"], ["submit", "--slurm", "tiny.toml", "--shards", "2"]):
                    self.refused(*command, "--out", "out", naming=["request.json' is damaged", "squeue", "scancel", "move the file away"])
                self.refused("status", "out", naming=["request.json' is damaged"])
        # numbers that nobody asked for are refused by both, too
        request.write_text(json.dumps({**json.loads(good), "cpus": 0}))
        for command in (["submit", "--resume"], ["submit", "--slurm", "tiny.toml", "--shards", "2"]):
            self.refused(*command, "--out", "out", naming=["request.json'", "numbers", "move the file away"])
        self.assertEqual(self.new_jobs(), [])
        # what it advises works
        self.queue()
        request.rename(self.dir / "away.json")
        self.assay("submit", "--slurm", "tiny.toml", "--out", "out", "--shards", "2")
        self.assertEqual(len(self.new_jobs()), 5)
        reliability("a damaged record of submitted jobs while they run", len(damages), "refused, with what to do", "nothing")

    def test_a_directory_of_an_older_submission_is_resumed_or_refused(self):
        request = self.dir / "out/jobs/request.json"
        old = json.loads(request.read_text())
        for key in ["runs_parts", "runs_plan"]:
            del old[key]
        for part in old["accuracy_plan"]:
            del part["waits"]
        request.write_text(json.dumps({**old, "jobs": []}))
        self.assay("submit", "--resume", "--out", "out")
        self.assertEqual(self.new_jobs()[0], "--array=1-2 accuracy.sh")
        self.assertIn("--cells accuracy ", (self.dir / "out/jobs/accuracy.sh").read_text())
        self.refused("submit", "--slurm", "tiny.toml", "--out", "out", "--shards", "2", naming=["another way", "--resume"])

    def test_a_second_submission_over_jobs_is_refused(self):
        self.queue("3_2 RUNNING", "5 PENDING")
        for shards in ["2", "3"]:
            self.refused("submit", "--slurm", "tiny.toml", "--out", "out", "--shards", shards,
                         naming=["--resume", "scancel 3 5"])
        self.queue()
        self.assertEqual(self.new_jobs(), [])
        # nor may other parts follow those that have results
        self.run_part_1()
        self.refused("submit", "--slurm", "tiny.toml", "--out", "out", "--shards", "1",
                     naming=["2 accuracy parts", "not of 1", "--shards 2"])
        self.assay("submit", "--slurm", "tiny.toml", "--out", "out", "--shards", "2")
        self.assertEqual(len(self.new_jobs()), 5)

    def test_status_shows_what_was_submitted(self):
        self.run_tiny("whole")
        whole = self.assay_json("status", "whole", "--json")
        status = self.assay_json("status", "out", "--json")
        self.assertEqual([(part["dir"], part["state"]) for part in status["parts"]],
                         [(f"out/shards/{name}", "waiting") for name in ["accuracy-1", "accuracy-2", "timing-1"]])
        self.assertEqual((status["planned"], status["done"]), (whole["planned"], 0))
        self.assertGreater(status["left_s"], 0)
        self.assertEqual([(each["parts"], each["parts_ended"]) for each in status["runs"]], [(2, 0)])
        self.assertIn("in 2 parts, of which 0 ended and 0 are under way", self.assay("status", "out"))
        self.run_tiny("out/runs/1", "--shard", "1/2", "--cells", "runs", "--references", "out/references")
        ended, = self.assay_json("status", "out", "--json")["runs"]
        self.assertEqual((ended["parts_ended"], ended["parts_running"]), (1, 0))
        self.assertGreater(ended["runs_ended"], 0)
        self.assertLess(ended["runs_ended"], ended["runs"])
        self.run_part_1()
        self.assertNotIn("first the runs", self.assay("status", "out"))
        status = self.assay_json("status", "out", "--json")
        self.assertEqual([part["state"] for part in status["parts"]], ["complete", "waiting", "waiting"])
        self.assertEqual(status["planned"], whole["planned"])
        self.assay("merge", "out/shards", "--out", "out")
        self.assertEqual(self.assay_json("status", "out", "--json")["planned"], whole["planned"])


class RealSlurm(CampaignTest):
    def setUp(self):
        super().setUp()
        if missing():
            self.skipTest(f"no Slurm of one node here: {missing()} (setup/apt-packages.txt, group slurm)")
        self.slurm = Slurm(self.dir / "slurm")
        self.addCleanup(self.slurm.stop_all)
        self.slurm.start_all()
        self.env.update({"SLURM_CONF": self.slurm.env["SLURM_CONF"], "PATH": self.slurm.env["PATH"]})

    def jobs(self):
        return [line.split() for line in self.slurm.tell("squeue", "-h", "-r", "-o", "%i %T %j").splitlines()]

    def wait_for_the_end(self, seconds=300):
        idle = [0]

        def ended():
            idle[0] = 0 if self.jobs() else idle[0] + 1
            return idle[0] > 3

        Slurm.wait(ended, seconds)

    def logs(self):
        return "".join(f"{path.name}: {path.read_text()}" for path in sorted((self.dir / "out/jobs").glob("*.log")))

    def test_a_campaign_as_jobs_survives_what_a_cluster_does(self):
        self.run_tiny("whole")
        text = self.assay("submit", "--slurm", "tiny.toml", "--out", "out", "--shards", "2")
        self.assertRegex(text.replace("\n", " "), r"job \d+: 2 parts of runs that others read, jobs \d+ and \d+: 2 accuracy parts, "
                         r"job \d+: 1 timing part")
        # a part that is killed
        killed = False
        deadline = time.monotonic() + 120
        while not killed and time.monotonic() < deadline:
            for job, state, name in self.jobs():
                if state == "RUNNING" and name == "assay-accuracy":
                    killed = self.slurm.run("scancel", "--signal=KILL", "--full", job).returncode == 0
                    break
            time.sleep(0.05)
        self.assertTrue(killed, self.logs())
        # the node is drained and comes back; the controller is restarted meanwhile
        self.slurm.run("scontrol", "update", f"NodeName={self.slurm.host}", "State=DRAIN", "Reason=test")
        self.slurm.stop("slurmctld")
        self.slurm.start_controller()
        self.slurm.run("scontrol", "update", f"NodeName={self.slurm.host}", "State=RESUME")
        self.wait_for_the_end()
        self.assertEqual(self.table("out"), self.table("whole"), self.logs())
        self.assertTrue((self.dir / "out/report.html").exists(), self.logs())
        self.assertIn("finish.log", self.logs())
        with contextlib.closing(sqlite3.connect(self.dir / "out/assay.sqlite")) as db:
            names = {json.loads(text)["name"] for (text,) in db.execute("SELECT json FROM nodes")}
        self.assertEqual(names, {self.slurm.host})
        reliability("on a cluster: a part is killed, the node is drained, the controller is restarted", 3,
                    "the part is submitted again; the union has the same values", "that part's running cells")

    def test_resume_leaves_jobs_alone_that_wait(self):
        self.run_tiny("whole")
        self.slurm.run("scontrol", "update", f"NodeName={self.slurm.host}", "State=DRAIN", "Reason=test")
        self.assay("submit", "--slurm", "tiny.toml", "--out", "out", "--shards", "2", "--sbatch=--comment=tiny")
        first = {name: job.split("_")[0] for job, _, name in self.jobs()}
        before = self.jobs()
        self.assertEqual(len(before), 6)
        self.assertIn("are left alone", self.assay("submit", "--resume", "--out", "out"))
        self.refused("submit", "--slurm", "tiny.toml", "--out", "out", naming=["scancel", first["assay-timing"]])
        self.assertEqual(self.jobs(), before)
        self.assertIn("waiting", self.assay("status", "out"))
        self.slurm.run("scancel", *(job for job, _, name in before if name == "assay-accuracy" and job.endswith("_2")))
        self.assertIn("1 accuracy part,", self.assay("submit", "--resume", "--out", "out").replace("\n", " "))
        self.assertEqual(len(self.jobs()), 7)  # another finishing job, after the first one
        self.slurm.run("scontrol", "update", f"NodeName={self.slurm.host}", "State=RESUME")
        self.wait_for_the_end()
        self.assertEqual(self.table("out"), self.table("whole"), self.logs())
        self.assertNotIn("lost", self.logs())
        self.assertNotIn("another", self.logs())

    def test_slurm_refuses(self):
        self.refused("submit", "--slurm", "tiny.toml", "--out", "out", "--partition", "nowhere",
                     naming=["Slurm refuses", "nothing was submitted"])
        self.assertEqual(self.jobs(), [])


if __name__ == "__main__":
    main()
