#!/usr/bin/env python3
"""How evenly a campaign is divided: measured parts, and what a scheduler with many nodes would make of them.

    benchmarks/balance.py shards build/release quick --parts 4 --out DIR
    benchmarks/balance.py nodes build/release quick --nodes 4,16,64 --out DIR

Both run every part, one after the other, with one worker, and take its processor time. `shards` runs `--shard I/N`, accuracy and timings,
and prints the longest over the mean. `nodes` runs the accuracy cells as one part, and then for each number of nodes the parts that
`assay submit` makes: those of the runs that others read, and those of the cells. A simulated scheduler gives each node the next part in turn, the
cells after all runs, as the jobs depend on each other. What is printed is the end over the mean of the nodes, and over the time of the one part
divided by nodes, which has no start of a process or reading of a model twice. A scheduler's own delays are not in it, nor are the conformance
suites, whose verdicts are in the cache before.
"""

import argparse
import heapq
import os
import pathlib
import re
import subprocess
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[1]


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


def makespan(parts, workers):
    """The end when workers take the parts in their order."""
    ends = [0.0] * workers
    for seconds in parts:
        heapq.heappush(ends, heapq.heappop(ends) + seconds)
    return max(ends)


def nodes(asked):
    know_suites(asked)
    one = part(asked, 1, 1, "accuracy", asked.out / "one", "--references", asked.out / "references-one")
    print(f"one part: {one:.0f} s\n\n| nodes | parts of runs, of cells | end, s | over the mean of the nodes | over one part / nodes |\n"
          "| ---: | ---: | ---: | ---: | ---: |", flush=True)
    for count in map(int, asked.nodes.split(",")):
        folder = asked.out / f"nodes-{count}"
        scripts = subprocess.run([asked.build / "bin/assay", "submit", "--slurm", asked.campaign, "--out", folder, "--nodes", str(count), "--dry-run"],
                                 capture_output=True, text=True, check=True).stdout
        # of a part alone the array is "1"
        sizes = {name: int(size) for size, name in re.findall(r"^sbatch --parsable --array=(?:1-)?(\d+)\S* (?:.* )?jobs/(\w+)\.sh$", scripts, re.M)}
        stages = []
        for name, cells in (("runs", "runs"), ("accuracy", "after-runs")):
            parts = sizes.get(name, 0)
            stages.append([part(asked, i, parts, cells, folder / f"{name}-{i}", "--references", folder / "references")
                           for i in range(1, parts + 1)])
        end = sum(makespan(stage, count) for stage in stages)
        print(f"| {count} | {len(stages[0])}, {len(stages[1])} | {end:.1f} | {end * count / sum(map(sum, stages)):.2f} | {end * count / one:.2f} |",
              flush=True)
        (folder / "times.txt").write_text("\n".join(" ".join(f"{seconds:.2f}" for seconds in stage) for stage in stages), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    for name, action in (("shards", shards), ("nodes", nodes)):
        command = commands.add_parser(name)
        command.set_defaults(action=action)
        command.add_argument("build", type=pathlib.Path)
        command.add_argument("campaign", help="the name of one in campaigns/")
        command.add_argument("--out", type=pathlib.Path, required=True)
        if name == "shards":
            command.add_argument("--parts", type=int, default=4)
            command.add_argument("--cells", default="all", help="as of assay run")
        else:
            command.add_argument("--nodes", default="4,16,64")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    asked.action(asked)


if __name__ == "__main__":
    main()
