#!/usr/bin/env python3
"""SIGKILL at random moments, of `assay run` and of its workers: whether every campaign ends in the values of an undisturbed one, and
what a fault costs.

    cmake --build --preset release --target assay assay-engine-slowed
    benchmarks/kills.py build/release [--kills 50] [--page docs/lab/reliability.md]

Each of the campaigns with killed parents is killed once or more often and then finished by the same command; each with killed
workers ends by itself. Accuracy values have to be equal bit by bit, timings have to be there. It prints a table, or replaces that of a page.
"""

import argparse
import contextlib
import datetime
import json
import os
import pathlib
import random
import signal
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "docs"))
from tables.common import updated  # noqa: E402

CAMPAIGN = """
name = "kills"
contenders = {contenders}
time_limit_s = {limit}
timesteps_ms = {timesteps}
reference_ms = "1/8"
measures = {measures}
[timing]
rounds = 4
processes = 2
batch_ms = 1
windows = 8
"""
SYSTEM = """[[system]]
name = "{name}"
duration_s = 0.48
pieces = 4
piece_ms = 48
sample_ms = 12
"""
CONTENDERS = ["mujoco-euler", "ode-step", "bullet-si-f64", "physx-d6-pgs"]
MEASURES = ["raw_speed", "consistency", "truth", "drift"]


class Bench:
    def __init__(self, build, folder):
        self.assay = build / "bin/assay"
        self.folder = pathlib.Path(folder)
        self.env = {k: v for k, v in os.environ.items() if not k.startswith("ASSAY_")}
        self.env.update(ASSAY_ENGINE_PATH=str(build / "benchmarks/slowed"), SLOWED_CONTENDER="ode-quick",
                        SLOWED_PLUGIN=str(build / "engines/assay-engine-ode.so"))

    def campaign(self, name, contenders, limit=60, measures=None, systems=2, timesteps=("1/8", "1/4", 1, 4)):
        path = self.folder / f"{name}.toml"
        text = CAMPAIGN.format(contenders=json.dumps(contenders), limit=limit, measures=json.dumps(measures or MEASURES),
                               timesteps=json.dumps(timesteps))
        path.write_text(text + "".join(SYSTEM.format(name=each) for each in ("planar-chain", "falling-chain")[:systems]))
        return path

    def start(self, campaign, out, *words):
        # A folder of its own for fine-step runs, so that every campaign makes its own; verdicts of the suite lie beside it.
        return subprocess.Popen([self.assay, "run", campaign, "--out", self.folder / out, "--references", self.folder / f"{out}-runs", *words],
                                env=self.env, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def finish(self, campaign, out, *words):
        process = self.start(campaign, out, *words)
        _, errors = process.communicate()
        return process.returncode, errors

    def values(self, out):
        """What has to be equal: outcomes, and all values and samples but those of timings, of which that they are there."""
        with contextlib.closing(sqlite3.connect(self.folder / out / "assay.sqlite")) as db:
            cells = sorted(db.execute("SELECT key, outcome, reason FROM cells WHERE contender <> 'null'"))
            of = "JOIN cells c ON c.id = v.cell_id WHERE c.measure <> 'raw_speed' ORDER BY 1, 2, 3"
            values = list(db.execute(f'SELECT c.key, v.name, v.value, v.low, v.high FROM "values" v {of}'))
            samples = list(db.execute(f"SELECT c.key, v.name, v.idx, v.value FROM samples v {of}"))
            timed = sorted(db.execute("SELECT c.key FROM \"values\" v JOIN cells c ON c.id = v.cell_id "
                                      "WHERE v.name = 'step_time' AND c.contender <> 'null'"))
        return cells, values, samples, timed


def children(parent):
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue  # it has ended
        if int(fields[1]) == parent:
            found.append(int(entry.name))
    return found


def workers(parent):
    """The processes that measure: the children of the parent's guards."""
    return [worker for guard in children(parent) for worker in children(guard)]


def kill(pid):
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
        return True
    return False


def kill_parents(bench, campaign, expected, seconds, kills, chance):
    done = same = campaigns = 0
    while done < kills:
        out = f"parent-{campaigns}"
        campaigns += 1
        here = 0
        while True:
            process = bench.start(campaign, out)
            try:
                process.communicate(timeout=chance.uniform(0.02, 0.9) * seconds)
            except subprocess.TimeoutExpired:
                if done + here < kills and here < 4:
                    process.kill()
                    process.communicate()
                    here += 1
                    continue
                process.communicate()
            break
        equal = process.returncode == 0 and bench.values(out) == expected
        done += here
        same += here if equal else 0
        print(f"  {out}: {here} kills, {'the same values' if equal else 'OTHER VALUES'}", file=sys.stderr, flush=True)
    return done, same, campaigns


def kill_workers(bench, campaign, expected, seconds, kills, chance):
    done = same = campaigns = 0
    while done < kills:
        out = f"worker-{campaigns}"
        campaigns += 1
        process = bench.start(campaign, out)
        begin, here = time.monotonic(), 0
        moments = sorted(chance.uniform(0.02, 0.95) * seconds for _ in range(5))
        for moment in moments:
            time.sleep(max(0, begin + moment - time.monotonic()))
            alive = workers(process.pid)
            if process.poll() is None and alive and done + here < kills:
                here += kill(chance.choice(alive))
        process.communicate()
        equal = process.returncode == 0 and bench.values(out) == expected
        done += here
        same += here if equal else 0
        print(f"  {out}: {here} kills, {'the same values' if equal else 'OTHER VALUES'}", file=sys.stderr, flush=True)
    return done, same, campaigns


FAULTS = ["hang", "loop", "abort", "crash", "exit"]
TRIES = 5  # of each fault
JOBS = [2, 1]  # workers at a time


def cost_of_faults(bench, limit):
    """What a fault in one cell adds to a campaign, in seconds, each time it was tried with each number of workers: against the same cell without."""
    campaign = bench.campaign("fault", ["mujoco-euler", "slowed"], limit, ["drift"], systems=1, timesteps=[1, 3])

    def seconds(out, jobs, **fault):
        bench.env.update(fault)
        begin = time.monotonic()
        status, errors = bench.finish(campaign, out, "--jobs", str(jobs))
        elapsed = time.monotonic() - begin
        for name in fault:
            del bench.env[name]
        assert status == 0, errors
        with contextlib.closing(sqlite3.connect(bench.folder / out / "assay.sqlite")) as db:
            failed = list(db.execute("SELECT contender, timestep_ms, outcome FROM cells WHERE outcome <> 'ok'"))
        expected = [("slowed", 3.0, "timeout" if fault.get("SLOWED_FAULT") in ("hang", "loop") else "crashed")] if fault else []
        assert failed == expected, failed
        return elapsed

    costs = {}
    for jobs in JOBS:
        without = statistics.median(seconds(f"fault-none-{jobs}-{i}", jobs) for i in range(TRIES))
        for fault in FAULTS:
            costs[fault, jobs] = sorted(seconds(f"fault-{fault}-{jobs}-{i}", jobs, SLOWED_FAULT=fault, SLOWED_FAULT_MS="3") - without
                                        for i in range(TRIES))
    return costs


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=random.randrange(1 << 32))
    parser.add_argument("--limit", type=float, default=5, help="time limit of the cells with faults, s")
    parser.add_argument("--page", type=pathlib.Path)
    asked = parser.parse_args()
    chance = random.Random(asked.seed)
    with tempfile.TemporaryDirectory(prefix="assay-kills-") as folder:
        bench = Bench(asked.build.resolve(), folder)
        campaign = bench.campaign("kills", CONTENDERS)
        for out in ("first", "clean"):  # the first one also fills the cache of the suite's verdicts
            begin = time.monotonic()
            status, errors = bench.finish(campaign, out)
            assert status == 0, errors
            seconds = time.monotonic() - begin
        expected = bench.values("clean")
        assert bench.values("first") == expected, "two undisturbed runs differ"
        parents = kill_parents(bench, campaign, expected, seconds, asked.kills, chance)
        killed = kill_workers(bench, campaign, expected, seconds, asked.kills, chance)
        costs = cost_of_faults(bench, asked.limit)
    date = datetime.date.today().isoformat()
    text = (f"Measured on {date} by `benchmarks/kills.py build/release --kills {asked.kills} --seed {asked.seed}`: {len(expected[0])} cells of "
            f"{len(CONTENDERS)} contenders, {len(expected[1])} accuracy values and {len(expected[2])} samples compared bit by bit.\n\n"
            "| SIGKILL at random moments of | kills | campaigns | kills after which all values are the same |\n"
            "| --- | ---: | ---: | ---: |\n"
            f"| the parent | {parents[0]} | {parents[2]} | {parents[1]} |\n| workers | {killed[0]} | {killed[2]} | {killed[1]} |\n\n"
            f"What a fault in one cell adds to the time of a campaign of 4 cells, with a time limit of {asked.limit:g} s a cell, over the median of {TRIES} "
            f"campaigns without, in seconds: median and range of {TRIES} tries. Load average at the end {os.getloadavg()[0]:.1f} on {os.cpu_count()} "
            "cores; a time limit stands still while a worker waits for a processor, so a busy machine takes longer.\n\n"
            f"| fault | {' | '.join(f'`--jobs {jobs}`' for jobs in JOBS)} |\n| --- |{' ---: |' * len(JOBS)}\n" +
            "".join(f"| {fault} | " + " | ".join(f"{statistics.median(cost):.1f} ({cost[0]:.1f} to {cost[-1]:.1f})"
                                                 for cost in (costs[fault, jobs] for jobs in JOBS)) + " |\n" for fault in FAULTS))
    if asked.page:
        asked.page.write_text(updated(asked.page.read_text("utf-8"), {"kills": text}), encoding="utf-8")
    print(text)
    good = parents[0] == parents[1] and killed[0] == killed[1] and max(costs[fault, 2][-1] for fault in FAULTS) < asked.limit
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
