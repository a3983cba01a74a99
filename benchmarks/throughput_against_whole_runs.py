#!/usr/bin/env python3
"""The timing's estimate of a contender's step time against whole runs, timed end to end.

    benchmarks/throughput_against_whole_runs.py [--system capsules-27] [--duration 3.2] [--timestep 1] [--runs 7]
        [--turn 200] [--contenders NAME,...] [--program ./assay] [--out DIR]

First a campaign times the contenders as `assay paper` does: windows of the run, rounds, processes. Then `assay simulate
--time` runs each of them from the start to the end, in turn, `--runs` times, on the core that the timing uses; only the
engine's own step calls count. Prints both times, their ratio and both orders. Status 1 when a ratio is more than 5 % from
1, or when two contenders whose whole runs differ by more than 2 % come in another order.
"""

import argparse
import os
import pathlib
import re
import sqlite3
import statistics
import subprocess
import sys

CONTENDERS = ("mujoco-euler,mujoco-euler-cg,mujoco-euler-pgs,bullet-si-f64,bullet-mb,ode-quick,physx-d6-pgs,havok,jolt-f32,"
              "rapier-impulse-f64,dart")
NEAR, SAME_ORDER = 0.05, 0.02

CAMPAIGN = """name = "throughput"
contenders = [{contenders}]
timesteps_ms = [{timestep}]
reference_ms = {reference}
measures = ["raw_speed"]
[timing]
rounds = 24
processes = 8
batch_ms = {turn}
[[system]]
name = "{system}"
duration_s = {duration}
sample_ms = {sample}
"""


def estimates(options):
    options.out.mkdir(parents=True, exist_ok=True)
    names = ", ".join(f'"{name}"' for name in options.contenders)
    timestep = f'"{options.timestep}"'
    campaign = options.out / "throughput.toml"
    campaign.write_text(CAMPAIGN.format(contenders=names, timestep=timestep, reference=f'"{options.reference}"',
                                        turn=options.turn, system=options.system, duration=options.duration,
                                        sample=options.sample))
    results = options.out / "results"
    subprocess.run([options.program, "run", campaign, "--out", results], check=True)
    with sqlite3.connect(results / "assay.sqlite") as db:
        rows = db.execute("""SELECT c.contender, c.outcome, v.name, v.value, v.low, v.high FROM cells c
                             JOIN "values" v ON v.cell_id = c.id WHERE c.measure = 'raw_speed'""").fetchall()
    found = {}
    for contender, outcome, name, value, low, high in rows:
        if outcome in ("ok", "unstable"):
            found.setdefault(contender, {})[name] = (value, low, high)
    return found


def whole_run_us(options, contender):
    core = max(os.sched_getaffinity(0))  # as the timing does
    done = subprocess.run([options.program, "simulate", options.system, "--engine", contender, "--timestep", options.timestep,
                           "--duration", options.duration, "--sample", options.sample, "--time", "--out", "/dev/null"],
                          capture_output=True, text=True, preexec_fn=lambda: os.sched_setaffinity(0, {core}))
    told = re.search(r"([\d.]+) us a step", done.stderr)
    if done.returncode != 0 or not told:
        sys.exit(f"{contender}: {done.stderr.strip()}")
    return float(told.group(1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--system", default="capsules-27")
    parser.add_argument("--duration", default="3.2")
    parser.add_argument("--timestep", default="1", help="in ms, as text: 1, 1/4")
    parser.add_argument("--reference", default="1/4", help="timestep of the runs whose states the windows start from")
    parser.add_argument("--sample", default="32")
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--turn", default="200", help="batch_ms of the campaign")
    parser.add_argument("--contenders", default=CONTENDERS)
    parser.add_argument("--program", default="./assay")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("throughput"))
    options = parser.parse_args()
    options.contenders = options.contenders.split(",")
    found = estimates(options)
    runs = {name: [] for name in options.contenders if "step_time" in found.get(name, {})}
    for _ in range(options.runs):
        for name in runs:
            runs[name].append(whole_run_us(options, name))
    whole = {name: statistics.median(times) for name, times in runs.items()}
    print(f"{options.system}, {options.duration} s at {options.timestep} ms; us a step")
    print("| contender | whole runs | estimate | ratio | covered |\n| --- | --- | --- | --- | --- |")
    failed = False
    for name in sorted(whole, key=whole.get):
        value, low, high = found[name]["step_time"]
        ratio = value / whole[name]
        failed |= abs(ratio - 1) > NEAR
        print(f"| {name} | {whole[name]:.2f} ({min(runs[name]):.2f} to {max(runs[name]):.2f}) | {value:.2f} ({low:.2f} to "
              f"{high:.2f}) | {ratio:.3f} | {100 * found[name]['coverage'][0]:.0f} % |")
    by_estimate = {name: found[name]["step_time"][0] for name in whole}
    flips = [(a, b) for a in whole for b in whole
             if whole[a] * (1 + SAME_ORDER) < whole[b] and by_estimate[a] > by_estimate[b]]
    for a, b in flips:
        print(f"order: {a} is faster than {b} in whole runs, slower by the estimate")
    print(f"{len(whole)} contenders, {len(flips)} pairs in another order, "
          f"largest difference {100 * max(abs(by_estimate[name] / whole[name] - 1) for name in whole):.1f} %")
    sys.exit(1 if failed or flips else 0)


if __name__ == "__main__":
    main()
