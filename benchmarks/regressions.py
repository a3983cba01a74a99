#!/usr/bin/env python3
"""How small a regression of a real engine `assay compare` finds in real runs: an engine that repeats a share of its steps, or is less
accurate on purpose (slowed_engine.cc), measured by the program before and after.

    cmake --build --preset release --target assay assay-engine-slowed
    benchmarks/regressions.py build/release [--trials 20] [--shares 0,1,2,5] [--append FILE]

A trial is one run without a regression and one for each share, in random order, so that a slow hour of the machine does not
fall on one of them. "Found" means that `assay compare --threshold T` calls a time of the slowed contender worse; a false alarm is
any other time that it calls better or worse. It does both with and without a control: a contender that did not change. Other work on
the machine makes the noise larger than on a quiet one; the table says how large it was.
"""

import argparse
import contextlib
import datetime
import json
import os
import pathlib
import random
import shutil
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time

CAMPAIGN = """
name = "regressions"
contenders = ["slowed", "mujoco-euler", "ode-quick", "bullet-si-f64"]
timesteps_ms = [{timesteps}]
reference_ms = 1
measures = ["{measure}"]
[timing]
rounds = {rounds}
processes = {processes}
batch_ms = 4
windows = 8
[[system]]
name = "planar-chain"
duration_s = 1.024
[[system]]
name = "falling-chain"
duration_s = 1.024
"""
CONTROL = "mujoco-euler"


class Bench:
    def __init__(self, build, folder, wrapped, contender):
        self.assay = build / "bin/assay"
        self.folder = pathlib.Path(folder)
        self.env = {k: v for k, v in os.environ.items() if not k.startswith(("ASSAY_", "SLOWED_"))}
        self.env.update(ASSAY_ENGINE_PATH=str(build / "benchmarks/slowed"), SLOWED_CONTENDER=contender,
                        SLOWED_PLUGIN=str(build / f"engines/assay-engine-{wrapped}.so"), ASSAY_CACHE=str(self.folder / "cache"))

    def run(self, campaign, out, **slowed):
        shutil.rmtree(self.folder / out, ignore_errors=True)
        done = subprocess.run([self.assay, "run", self.folder / campaign, "--out", self.folder / out, "--jobs", "1"],
                              env={**self.env, **{key: str(value) for key, value in slowed.items()}}, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-2000:]
        with contextlib.closing(sqlite3.connect(self.folder / out / "assay.sqlite")) as db:
            failed = db.execute("SELECT contender, system, outcome, reason FROM cells WHERE outcome <> 'ok'").fetchone()
        if failed is not None:
            sys.exit("{} on {} is {}: {}".format(*failed))

    def compare(self, a, b, *words):
        done = subprocess.run([self.assay, "compare", self.folder / a, self.folder / b, "--format", "json", *words], env=self.env,
                              capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-2000:]
        return json.loads(done.stdout)


def judge(found, slowed):
    """Whether a time of the slowed contender is worse, whether anything else is claimed, and its ratios."""
    moved = [row for row in found["rows"] if row["value"] == "step_time" and row["change"] in ("worse", "better")]
    right = [row for row in moved if slowed and row["contender"] == "slowed" and row["change"] == "worse"]
    ratios = [row["ratio"] for row in found["rows"] if row["contender"] == "slowed" and row["value"] == "step_time" and row["ratio"]]
    return bool(right), len(moved) > len(right), ratios


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--shares", default="0,1,2,5", help="percent")
    parser.add_argument("--processes", type=int, default=8)
    parser.add_argument("--timesteps", default="1", help="ms")
    parser.add_argument("--thresholds", default="1%,2%", help="each judges the same runs")
    parser.add_argument("--wrap", default="ode", help="plugin that is wrapped")
    parser.add_argument("--contender", default="ode-quick")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="no new trial after so many")
    parser.add_argument("--append", type=pathlib.Path, help="file to which the table is appended")
    asked = parser.parse_args()
    shares = [float(text) for text in asked.shares.split(",")]
    thresholds = asked.thresholds.split(",")
    names = [(threshold, control, ("--threshold", threshold, *(("--control", CONTROL) if control else ())))
             for threshold in thresholds for control in (False, True)]
    counts = {(share, threshold, control): [0, 0] for share in shares for threshold, control, _ in names}
    seen = {share: [] for share in shares}
    accuracy = dict.fromkeys(shares, "")
    chance = random.Random(asked.seed)
    begin, trials = time.monotonic(), 0
    with tempfile.TemporaryDirectory(prefix="assay-regressions-", dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None) as folder:
        bench = Bench(asked.build.resolve(), folder, asked.wrap, asked.contender)
        timed = CAMPAIGN.format(timesteps=asked.timesteps, measure="raw_speed", rounds=3 * asked.processes, processes=asked.processes)
        (bench.folder / "times.toml").write_text(timed)
        (bench.folder / "errors.toml").write_text(CAMPAIGN.format(timesteps=asked.timesteps, measure="truth", rounds=1, processes=1))
        bench.run("errors.toml", "exact")
        for share in shares:  # deterministic: once
            bench.run("errors.toml", "less", SLOWED_ERROR=share / 100)
            rows = [row for row in bench.compare("exact", "less", "--threshold", thresholds[0])["rows"]
                    if row["contender"] == "slowed" and row["value"] == "truth_error_max"]
            assert rows, "no error was compared"
            worse = sum(row["change"] == "worse" for row in rows)
            accuracy[share] = f"{worse} of {len(rows)} ({', '.join(sorted({row['text'] for row in rows}))})"
        for trial in range(asked.trials):
            if time.monotonic() - begin > 60 * asked.minutes:
                break
            trials = trial + 1
            runs = ["before", *shares]
            chance.shuffle(runs)
            for each in runs:
                slower = {} if each == "before" else {"SLOWED_REPEATS": each / 100}
                bench.run("times.toml", str(each), **slower)
            for share in shares:
                for threshold, control, words in names:
                    right, wrong, ratios = judge(bench.compare("before", str(share), *words), share > 0)
                    counts[share, threshold, control][0] += right
                    counts[share, threshold, control][1] += wrong
                    if control and threshold == thresholds[0]:
                        seen[share] += ratios
            told = "; ".join(f"{share:g} % at {threshold}{' with a control' if control else ''}: {right} found, {wrong} false"
                             for (share, threshold, control), (right, wrong) in counts.items())
            print(f"trial {trial + 1}: {told}", file=sys.stderr, flush=True)
    lines = [f"{datetime.date.today().isoformat()}, `benchmarks/regressions.py build/release --trials {trials} --processes {asked.processes} "
             f"--shares {asked.shares}`: {trials} trials, {asked.contender} wrapped, two systems, timesteps {asked.timesteps} ms; load average at the "
             f"end {os.getloadavg()[1]:.1f} on {os.cpu_count()} cores.", "",
             "| steps repeated | threshold | compare: found | trials with a false alarm | with a control: found | trials with a false alarm | "
             "ratio measured, with a control | less accurate by as much: found |", "| --- | --- | ---: | ---: | ---: | ---: | --- | --- |"]
    for share in shares:
        level, spread = statistics.mean(seen[share]), statistics.stdev(seen[share]) if len(seen[share]) > 1 else 0
        for threshold in thresholds:
            cells = " | ".join(f"{counts[share, threshold, control][0]} | {counts[share, threshold, control][1]}" for control in (False, True))
            lines.append(f"| {share:g} % | {threshold} | {cells} | {level:.4f} ± {spread:.4f} | {accuracy[share]} |")
    text = "\n".join(lines) + "\n"
    print(text)
    if asked.append:
        with asked.append.open("a", encoding="utf-8") as file:
            file.write("\n" + text)


if __name__ == "__main__":
    main()
