#!/usr/bin/env python3
"""How evenly a campaign is divided: measured parts, and what a scheduler with many nodes would make of them.

    benchmarks/balance.py shards build/release quick --parts 4 --out DIR
    benchmarks/balance.py slurm build/release quick --parts 4 --out DIR
    benchmarks/balance.py nodes build/release quick --nodes 4,16,64 --out DIR
    benchmarks/balance.py simulate build/release quick DIR/one --nodes 4,16,64

Each first runs the conformance suites, whose verdicts are then in the cache, so that they are in no part.

`shards` takes the processor time of the whole campaign in one part and of each part of `--shard I/N`, accuracy and timings, with one worker. No part
reads runs that another made, as on machines that share nothing. --at-once parts run side by side, each bound to a core of its own.

`slurm` starts a real Slurm of one node on this machine and submits the campaign to it with `assay submit --shards N`; it prints each part's time by the
clock, and for the runs and accuracy cells their end, from the start of the first, over the sum of their times divided by the cores.

`nodes` takes the processor time of the accuracy cells in one part, and then for each number of nodes of the parts that `assay submit` makes: those
of the runs that others read, and those of the cells. A simulated scheduler gives each node the next part in turn, first the runs, then the cells
that read none, and those that do after all runs have ended. Printed are the end x nodes / the sum of the parts, and / the one part, which has no
start of a process or reading of a model twice. The scheduler's own delays are not in it. `simulate` runs no cells: it has the parts take the processor
time that their runs and cells took in results of the accuracy cells, a run from each initial state as long as the first, and half a second for a
part's start. It prints the end x nodes / (work + starts), and / work: what expected times that are wrong cost, without the noise of the machine and
without what is read twice (starts of workers and reading of models, of which a part has its own). A run that was there already when the
results were made counts as long as expected; their number is printed.
"""

import argparse
import collections
import concurrent.futures
import contextlib
import csv
import datetime
import heapq
import io
import os
import pathlib
import queue
import re
import sqlite3
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
START = 0.5  # s of processor time of a part, beside its work
THERE = 0.25  # of the expected time: a run that took less was there already


def environment(out):
    return {**os.environ, "ASSAY_CACHE": str((out / "cache").resolve())}


def processor_seconds(words, out):
    env = environment(out)
    with (out / "log.txt").open("a", encoding="utf-8") as log:
        child = subprocess.Popen(list(map(str, words)), env=env, stdout=log, stderr=log)
        _, status, usage = os.wait4(child.pid, 0)  # with its processes
    if status != 0:
        raise SystemExit(f"{' '.join(map(str, words))} ended with status {os.waitstatus_to_exitcode(status)}: {out / 'log.txt'} says why")
    return usage.ru_utime + usage.ru_stime


def part(asked, number, count, cells, out, *more, before=()):
    return processor_seconds([*before, asked.build / "bin/assay", "run", asked.campaign, "--shard", f"{number}/{count}", "--jobs", 1, "--cells", cells,
                              "--out", out, *more], asked.out)


def division(asked, *more):
    """The campaign's cells, each with its part."""
    rows = subprocess.run([asked.build / "bin/assay_division", ROOT / f"campaigns/{asked.campaign}.toml", *more], capture_output=True, text=True,
                          check=True).stdout
    return list(csv.DictReader(io.StringIO(rows)))


def know_suites(asked):
    """So that the conformance suites are in no part."""
    contenders = sorted({row["contender"] for row in division(asked)})
    small = asked.out / "suites.toml"
    small.write_text(f'name = "suites"\ncontenders = {contenders}\ntimesteps_ms = [4]\nmeasures = ["drift"]\n'
                     '[[system]]\nname = "planar-chain"\nduration_s = 0.16\n', encoding="utf-8")
    taken = processor_seconds([asked.build / 'bin/assay', 'run', small, '--out', asked.out / 'suites'], asked.out)
    print(f"suites of {len(contenders)} contenders: {taken:.0f} s", flush=True)


def shards(asked):
    know_suites(asked)
    cores = queue.SimpleQueue()
    for core in sorted(os.sched_getaffinity(0))[:asked.at_once]:
        cores.put(core)

    def one(number, count, name):
        core = cores.get()
        try:
            taken = part(asked, number, count, asked.cells, asked.out / name, "--references", asked.out / f"references/{name}",
                         before=["taskset", "-c", core])
        finally:
            cores.put(core)
        print(f"{name}: {taken:.1f} s of processor time; load average {os.getloadavg()[0]:.1f}", flush=True)
        return taken

    with concurrent.futures.ThreadPoolExecutor(cores.qsize()) as pool:
        whole = pool.submit(one, 1, 1, "whole")
        times = list(pool.map(lambda i: one(i, asked.parts, f"parts/{i}"), range(1, asked.parts + 1)))
        whole = whole.result()
    subprocess.run([asked.build / "bin/assay", "merge", asked.out / "parts", "--out", asked.out / "union"], check=True)
    print(f"the longest of {asked.parts} parts over their mean: {max(times) * len(times) / sum(times):.3f}; "
          f"over the undivided campaign / {asked.parts}: {max(times) * len(times) / whole:.3f}")


def slurm(asked):
    sys.path.insert(0, str(ROOT / "tests/cli"))
    from one_node_slurm import Slurm, missing
    if missing():
        raise SystemExit(f"no Slurm of one node here: {missing()} (setup/apt-packages.txt, group slurm)")
    know_suites(asked)
    out = asked.out / "results"
    scheduler = Slurm(asked.out / "slurm", "task/affinity")
    try:
        scheduler.start_all()
        subprocess.run([asked.build / "bin/assay", "submit", "--slurm", asked.campaign, "--out", out, "--shards", str(asked.parts)],
                       env={**scheduler.env, **environment(asked.out)}, check=True)
        ended, jobs, bound = 0, {}, set()
        while ended < 3:
            time.sleep(2)
            told = scheduler.tell("scontrol", "show", "job", "-o")
            ended = 0 if re.search(r"JobState=(PENDING|RUNNING|CONFIGURING|COMPLETING)", told) else ended + 1
            for line in told.splitlines():
                job = dict(word.split("=", 1) for word in line.split() if "=" in word)
                if job.get("JobState") == "COMPLETED":
                    jobs[job["JobId"]] = job
            for pid in filter(str.isdigit, os.listdir("/proc")):
                with contextlib.suppress(OSError):
                    if b"\0--shard\0" in pathlib.Path(f"/proc/{pid}/cmdline").read_bytes():
                        bound.add(tuple(sorted(os.sched_getaffinity(int(pid)))))
    finally:
        scheduler.stop_all()
    stages = collections.defaultdict(list)
    for job in jobs.values():
        begin, end = (datetime.datetime.fromisoformat(job[key]).timestamp() for key in ("StartTime", "EndTime"))
        stages[job["JobName"].removeprefix("assay-")].append((begin, end))
    print(f"parts were bound to the cores {sorted(bound)}; load average at the end {os.getloadavg()[0]:.1f}")
    for name, spans in stages.items():
        print(f"{name}: {', '.join(f'{end - begin:.0f}' for begin, end in sorted(spans))} s", flush=True)
    shared = stages["runs"] + stages["accuracy"]
    span, work = max(end for _, end in shared) - min(begin for begin, _ in shared), sum(end - begin for begin, end in shared)
    cores = os.cpu_count()
    print(f"runs and accuracy cells: {span:.0f} s on {cores} cores, of {work:.0f} s in parts: {span * cores / work:.3f}")


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

    there = set()

    def seconds(row):
        kind, expected = row["measure"], float(row["expected_s"])
        of_run = kind.startswith("state ")
        if kind == "reference":
            return 0  # its run is there
        key = (row["system"], row["contender"], float(row["timestep_ms"]), "reference" if of_run else kind)
        known = took.get(key)
        if known is None or (of_run and known < THERE * expected):
            there.add(key)
            return expected
        return known

    print("| nodes | parts of runs, of cells | end, s | end x nodes / (work + starts) | end x nodes / work |\n| ---: | ---: | ---: | ---: | ---: |")
    for count in map(int, asked.nodes.split(",")):
        sizes, stages = sizes_of(asked, "out", count), []
        for name, cells in (("runs", "runs"), ("accuracy", "after-runs")):
            parts = collections.Counter()
            for row in division(asked, "--shards", str(sizes[name]), "--cells", cells):
                if row["shard"] != "0":
                    parts[int(row["shard"])] += seconds(row)
            stages.append([parts[part] for part in range(1, sizes[name] + 1)])
        runs, cells = ([START + each for each in stage] for stage in stages)
        end = makespan(runs, cells[:sizes["free"]], cells[sizes["free"]:], count)
        work = sum(map(sum, stages))
        print(f"| {count} | {len(stages[0])}, {len(stages[1])} | {end:.1f} | {end * count / (work + START * sum(map(len, stages))):.2f} | "
              f"{end * count / work:.2f} |", flush=True)
    print(f"\n{len(there)} runs or cells were there already or are not in the results: they count as long as expected")


def nodes(asked):
    know_suites(asked)
    one = part(asked, 1, 1, "accuracy", asked.out / "one", "--references", asked.out / "references-one")
    print(f"one part: {one:.0f} s\n\n| nodes | parts of runs, of cells | end, s | end x nodes / all parts | end x nodes / one part |\n"
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
    for name, action in (("shards", shards), ("slurm", slurm), ("nodes", nodes), ("simulate", simulate)):
        command = commands.add_parser(name)
        command.set_defaults(action=action)
        command.add_argument("build", type=pathlib.Path)
        command.add_argument("campaign", help="the name of one in campaigns/")
        if name == "simulate":
            command.add_argument("results", type=pathlib.Path)
        else:
            command.add_argument("--out", type=pathlib.Path, required=True)
        if name in ("shards", "slurm"):
            command.add_argument("--parts", type=int, default=4)
        if name == "shards":
            command.add_argument("--cells", default="all", help="as of assay run")
            command.add_argument("--at-once", type=int, default=1, help="parts side by side, each on a core (default: 1)")
        if name in ("nodes", "simulate"):
            command.add_argument("--nodes", default="4,16,64")
    asked = parser.parse_args()
    if asked.action is not simulate:
        asked.out.mkdir(parents=True, exist_ok=True)
    asked.action(asked)


if __name__ == "__main__":
    main()
