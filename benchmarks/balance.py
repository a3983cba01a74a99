#!/usr/bin/env python3
"""How evenly a campaign is divided: measured parts, and a simulation of a scheduler with more nodes.

    cmake --build --preset release --target assay assay_division
    benchmarks/balance.py measure build/release quick --parts 4 --out DIR     # runs the parts, one after the other
    benchmarks/balance.py simulate build/release quick DIR/union --nodes 4,16,64

`measure` prints the processor time of each part with one worker, and the longest over the mean. `simulate` takes the times of the cells
of a results directory (of cells that it lacks the expected time), divides the campaign as `assay submit` does, and lets nodes take the
parts in the scheduler's order: accuracy parts, twelve for each node and one worker each, then a timing part a node. The figure is the end over
total / nodes; the bound is what no division could beat: a fine-step run and the cells that read it stay together, and so do a
system's timings. Fine-step runs that timings read lie in a shared folder, as `submit` has it.
"""

import argparse
import contextlib
import csv
import heapq
import io
import os
import pathlib
import sqlite3
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[1]
PARTS_PER_NODE = 12  # as in src/cli/submit.cc
TIMED = ("raw_speed", "scaling")


def measure(asked):
    asked.out.mkdir(parents=True, exist_ok=True)
    env = {**os.environ, "ASSAY_CACHE": str((asked.out / "cache").resolve())}
    times = []
    for part in range(1, asked.parts + 1):
        words = [asked.build / "bin/assay", "run", asked.campaign, "--shard", f"{part}/{asked.parts}", "--jobs", "1", "--out",
                 asked.out / f"parts/{part}", "--cells", asked.cells]
        pid = os.spawnve(os.P_NOWAIT, words[0], list(map(str, words)), env)
        _, status, usage = os.wait4(pid, 0)
        if status != 0:
            raise SystemExit(f"part {part} ended with status {os.waitstatus_to_exitcode(status)}")
        times.append(usage.ru_utime + usage.ru_stime)
        print(f"part {part} of {asked.parts}: {times[-1]:.1f} s of processor time", flush=True)
    subprocess.run([asked.build / "bin/assay", "merge", asked.out / "parts", "--out", asked.out / "union"], check=True)
    print(f"the longest over the mean of {asked.parts} parts: {max(times) * len(times) / sum(times):.3f}")


def cell_times(results):
    """Seconds of each cell, by what names it: keys change with the program. Of accuracy cells processor time."""
    with contextlib.closing(sqlite3.connect(f"file:{results}/assay.sqlite?mode=ro", uri=True)) as db:
        return {(system, contender, float(timestep), kind): wall if kind in TIMED else cpu
                for system, contender, timestep, kind, wall, cpu in db.execute(
                    "SELECT system, contender, timestep_ms, measure, wall_s, cpu_s FROM cells WHERE contender <> 'null'")}


def division(build, campaign, parts, cells):
    done = subprocess.run([build / "bin/assay_division", ROOT / f"campaigns/{campaign}.toml", "--shards", str(parts), "--cells", cells],
                          capture_output=True, text=True, check=True)
    return list(csv.DictReader(io.StringIO(done.stdout)))


def loads(rows, times):
    """Seconds of each part, and of the longest group that stays together."""
    parts, groups, unknown = {}, {}, 0
    for row in rows:
        if row["shard"] == "0":
            continue
        name = (row["system"], row["contender"], float(row["timestep_ms"]), row["measure"])
        unknown += name not in times
        seconds = times.get(name, float(row["expected_s"]))
        parts[int(row["shard"])] = parts.get(int(row["shard"]), 0) + seconds
        of = "timing" if row["measure"] in TIMED else f"{row['contender']} {row['timestep_ms'] if row['alone'] == '1' else ''}"
        groups[row["system"], of] = groups.get((row["system"], of), 0) + seconds
    if unknown:
        print(f"cells without a measured time: {unknown} of {len(rows)}")
    return [parts[part] for part in sorted(parts)], max(groups.values(), default=0)


def makespan(parts, workers):
    """The end when workers take the parts in their order."""
    ends = [0.0] * workers
    for seconds in parts:
        heapq.heappush(ends, heapq.heappop(ends) + seconds)
    return max(ends)


def simulate(asked):
    times = cell_times(asked.results)
    print("| nodes | accuracy: parts | end / (total / nodes) | bound | timing: parts | end / (total / nodes) | bound |\n"
          "| ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for nodes in map(int, asked.nodes.split(",")):
        line = [str(nodes)]
        for kind, wanted in (("accuracy", PARTS_PER_NODE * nodes), ("timing", nodes)):
            parts, longest = loads(division(asked.build, asked.campaign, wanted, kind), times)
            if not any(parts):  # not measured
                line += ["", "", ""]
                continue
            mean = sum(parts) / nodes
            line += [str(len(parts)), f"{makespan(parts, nodes) / mean:.3f}", f"{max(longest, mean) / mean:.3f}"]
        print(f"| {' | '.join(line)} |", flush=True)
    if {"consistency", "raw_speed"} - {measure for *_, measure in times}:
        return
    for nodes in map(int, asked.nodes.split(",")):
        parts, longest = loads(division(asked.build, asked.campaign, nodes, "all"), times)
        mean = sum(parts) / nodes
        print(f"--shard I/{nodes}, one worker each: the longest part over the mean {max(parts) / mean:.3f}, bound "
              f"{max(longest, mean) / mean:.3f}")


def main():
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers(required=True)
    for name, action in (("measure", measure), ("simulate", simulate)):
        command = commands.add_parser(name)
        command.set_defaults(action=action)
        command.add_argument("build", type=pathlib.Path)
        command.add_argument("campaign")
        if name == "measure":
            command.add_argument("--parts", type=int, default=4)
            command.add_argument("--cells", default="all", help="all, accuracy or timing")
            command.add_argument("--out", type=pathlib.Path, required=True)
        else:
            command.add_argument("results", type=pathlib.Path)
            command.add_argument("--nodes", default="4,16,64")
    asked = parser.parse_args()
    asked.action(asked)


if __name__ == "__main__":
    main()
