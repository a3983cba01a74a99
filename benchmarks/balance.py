#!/usr/bin/env python3
"""How evenly a campaign is divided: measured parts, and what a scheduler with many nodes would make of them.

    benchmarks/balance.py shards build/release quick --parts 4 --out DIR
    benchmarks/balance.py nodes build/release quick --nodes 4,16,64 --out DIR
    benchmarks/balance.py simulate build/release quick DIR/one --nodes 4,16,64

The first two run every part, one after the other, with one worker, and take its processor time. `shards` runs `--shard I/N`, accuracy and timings,
and prints the longest over the mean. `nodes` runs the accuracy cells as one part, and then for each number of nodes the parts that
`assay submit` makes: those of the runs that others read, and those of the cells. A simulated scheduler gives each node the next part in turn, first the
runs, then the cells that read none, and those that do after all runs have ended. What is printed is the end over the mean of the nodes, and over the time of the one part
divided by nodes, which has no start of a process or reading of a model twice. A scheduler's own delays are not in it, nor are the conformance
suites, whose verdicts are in the cache before. `simulate` runs nothing: it has the parts take the processor time that their runs and cells took in
results of the accuracy cells, a run from each initial state as long as the first, and half a second for a part's start; so it shows what expected times that are
wrong cost, without the noise of the machine and without what is read twice.
"""

import argparse
import collections
import contextlib
import csv
import heapq
import io
import os
import pathlib
import re
import sqlite3
import subprocess
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[1]
START = 0.5  # s of processor time of a part, beside its work


def processor_seconds(words, out):
    env = {**os.environ, "ASSAY_CACHE": str((out / "cache").resolve())}
    with (out / "log.txt").open("a", encoding="utf-8") as log:
        child = subprocess.Popen(list(map(str, words)), env=env, stdout=log, stderr=log)
        _, status, usage = os.wait4(child.pid, 0)  # with its processes
    if status != 0:
        raise SystemExit(f"{' '.join(map(str, words))} ended with status {os.waitstatus_to_exitcode(status)}: {out / 'log.txt'} says why")
    return usage.ru_utime + usage.ru_stime


def part(asked, number, count, cells, out, *more):
    return processor_seconds([asked.build / "bin/assay", "run", asked.campaign, "--shard", f"{number}/{count}", "--jobs", 1, "--cells", cells,
                              "--out", out, *more], asked.out)


def shards(asked):
    times = []
    for number in range(1, asked.parts + 1):
        times.append(part(asked, number, asked.parts, asked.cells, asked.out / f"parts/{number}"))
        print(f"part {number} of {asked.parts}: {times[-1]:.1f} s of processor time", flush=True)
    subprocess.run([asked.build / "bin/assay", "merge", asked.out / "parts", "--out", asked.out / "union"], check=True)
    print(f"the longest over the mean of {asked.parts} parts: {max(times) * len(times) / sum(times):.3f}")


def know_suites(asked):
    """So that the conformance suites are in no part."""
    contenders = tomllib.loads((ROOT / f"campaigns/{asked.campaign}.toml").read_text(encoding="utf-8"))["contenders"]
    small = asked.out / "suites.toml"
    small.write_text(f'name = "suites"\ncontenders = {contenders}\ntimesteps_ms = [4]\nmeasures = ["drift"]\n'
                     '[[system]]\nname = "planar-chain"\nduration_s = 0.16\n', encoding="utf-8")
    print(f"suites: {processor_seconds([asked.build / 'bin/assay', 'run', small, '--out', asked.out / 'suites'], asked.out):.0f} s", flush=True)


def makespan(runs, free, waiting, workers):
    """The end when workers take the parts in this order, those that wait for runs not before all of these have ended."""
    ends, of_runs = [0.0] * workers, 0.0
    for seconds in runs:
        heapq.heappush(ends, heapq.heappop(ends) + seconds)
    of_runs = max(ends)
    for seconds in free:
        heapq.heappush(ends, heapq.heappop(ends) + seconds)
    for seconds in waiting:
        heapq.heappush(ends, max(of_runs, heapq.heappop(ends)) + seconds)
    return max(ends)


def sizes_of(asked, folder, count):
    """The number of parts of each kind that `assay submit` makes."""
    scripts = subprocess.run([asked.build / "bin/assay", "submit", "--slurm", asked.campaign, "--out", folder, "--nodes", str(count), "--dry-run"],
                             capture_output=True, text=True, check=True).stdout
    arrays = re.findall(r"^sbatch --parsable --array=([\d-]+)\S* (.*)jobs/(\w+)\.sh$", scripts, re.M)
    sizes = {"runs": 0, "free": 0, "accuracy": 0}
    for parts, waits, name in arrays:
        last = int(parts.split("-")[-1])
        sizes["free" if name == "accuracy" and not waits else name] = last
    sizes["accuracy"] = max(sizes["free"], sizes["accuracy"])
    return sizes


def simulate(asked):
    with contextlib.closing(sqlite3.connect(f"file:{asked.results}/assay.sqlite?immutable=1", uri=True)) as db:
        took = {(system, contender, float(timestep), kind): seconds for system, contender, timestep, kind, seconds in db.execute(
            "SELECT system, contender, timestep_ms, measure, cpu_s FROM cells")}

    def seconds(row):
        kind, expected = row["measure"], float(row["expected_s"])
        of_run = kind.startswith("state ")
        if kind == "reference":
            return 0  # its run is there
        return took.get((row["system"], row["contender"], float(row["timestep_ms"]), "reference" if of_run else kind), expected)

    print("| nodes | parts of runs, of cells | end, s | over the mean of the nodes | over the work / nodes |\n| ---: | ---: | ---: | ---: | ---: |")
    for count in map(int, asked.nodes.split(",")):
        sizes, stages = sizes_of(asked, "out", count), []
        for name, cells in (("runs", "runs"), ("accuracy", "after-runs")):
            parts = collections.Counter()
            rows = subprocess.run([asked.build / "bin/assay_division", ROOT / f"campaigns/{asked.campaign}.toml", "--shards", str(sizes[name]),
                                   "--cells", cells], capture_output=True, text=True, check=True).stdout
            for row in csv.DictReader(io.StringIO(rows)):
                if row["shard"] != "0":
                    parts[int(row["shard"])] += seconds(row)
            stages.append([parts[part] for part in range(1, sizes[name] + 1)])
        runs, cells = ([START + each for each in stage] for stage in stages)
        end = makespan(runs, cells[:sizes["free"]], cells[sizes["free"]:], count)
        work = sum(map(sum, stages))
        print(f"| {count} | {len(stages[0])}, {len(stages[1])} | {end:.1f} | {end * count / (work + START * sum(map(len, stages))):.2f} | "
              f"{end * count / work:.2f} |", flush=True)


def nodes(asked):
    know_suites(asked)
    one = part(asked, 1, 1, "accuracy", asked.out / "one", "--references", asked.out / "references-one")
    print(f"one part: {one:.0f} s\n\n| nodes | parts of runs, of cells | end, s | over the mean of the nodes | over one part / nodes |\n"
          "| ---: | ---: | ---: | ---: | ---: |", flush=True)
    for count in map(int, asked.nodes.split(",")):
        folder = asked.out / f"nodes-{count}"
        sizes, stages = sizes_of(asked, folder, count), []
        for name, cells in (("runs", "runs"), ("accuracy", "after-runs")):
            parts = sizes[name]
            stages.append([part(asked, i, parts, cells, folder / f"{name}-{i}", "--references", folder / "references")
                           for i in range(1, parts + 1)])
        runs, of_cells = stages
        end = makespan(runs, of_cells[:sizes["free"]], of_cells[sizes["free"]:], count)
        print(f"| {count} | {len(stages[0])}, {len(stages[1])} | {end:.1f} | {end * count / sum(map(sum, stages)):.2f} | {end * count / one:.2f} |",
              flush=True)
        (folder / "times.txt").write_text("\n".join(" ".join(f"{seconds:.2f}" for seconds in stage) for stage in stages), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    for name, action in (("shards", shards), ("nodes", nodes), ("simulate", simulate)):
        command = commands.add_parser(name)
        command.set_defaults(action=action)
        command.add_argument("build", type=pathlib.Path)
        command.add_argument("campaign", help="the name of one in campaigns/")
        if name == "simulate":
            command.add_argument("results", type=pathlib.Path)
        else:
            command.add_argument("--out", type=pathlib.Path, required=True)
        if name == "shards":
            command.add_argument("--parts", type=int, default=4)
            command.add_argument("--cells", default="all", help="as of assay run")
        else:
            command.add_argument("--nodes", default="4,16,64")
    asked = parser.parse_args()
    if asked.action is not simulate:
        asked.out.mkdir(parents=True, exist_ok=True)
    asked.action(asked)


if __name__ == "__main__":
    main()
