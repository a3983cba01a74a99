#!/usr/bin/env python3
"""Writes the table from which shards are balanced, src/campaign/step_costs.csv, from the timings of results directories: the time of
a step of each contender, per body and on each of the systems.

    benchmarks/step_costs.py results/intel-xeon-2-cores/assay.sqlite.xz results/field-2026-11-25/assay.sqlite.xz src/campaign/step_costs.csv [--runs DIR]

A contender's times are those of the first directory that has it. --runs names results (`assay run quick --cells accuracy --jobs 1 --references off`) whose fine-step runs tell what a step costs there, also
where the run ends early or the engine is timed elsewhere in the motion: they replace the timings of their systems, scaled to the timings' machine
by the median ratio.
"""

import argparse
import collections
import json
import math
import pathlib
import sqlite3
import statistics
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "results"))
import packed  # noqa: E402


def mean(logs):
    return math.exp(sum(logs) / len(logs))


def read(source, times, of_system):
    """Adds the logarithms of a directory's step times: per body, and of a system, of contenders that are not there yet."""
    known = {contender for contender, _ in times}
    with tempfile.TemporaryDirectory() as folder:
        db = sqlite3.connect(f"file:{packed.database(source, folder)}?immutable=1", uri=True)
        facts = {name: json.loads(text) for name, text in db.execute("SELECT name, json FROM systems")}
        for system, contender, value in db.execute(
                """SELECT c.system, c.contender, v.value FROM cells c JOIN "values" v ON v.cell_id = c.id
                   WHERE v.name = 'step_time' AND c.outcome = 'ok' AND v.value > 0"""):
            if contender in known:
                continue
            contacts = facts[system].get("contact_pairs", 0) > 0
            times[contender, contacts].append(math.log(value / facts[system]["bodies"]))
            of_system[system, contender].append(math.log(value))
        for system, contender, timestep, value in db.execute(
                """SELECT c.system, c.contender, c.timestep_ms, v.value FROM cells c JOIN "values" v ON v.cell_id = c.id
                   WHERE v.name = 'run_time' AND c.outcome = 'ok' AND v.value > 0"""):
            if contender in known:
                continue
            steps = 1e3 * facts[system]["duration_s"] / timestep
            of_system[system, contender].append(math.log(1e6 * value / steps))


def runs(folder):
    """Microseconds of processor time of each planned step of the fine-step runs, by system and contender."""
    db = sqlite3.connect(f"file:{folder}/assay.sqlite?mode=ro", uri=True)
    duration = {name: json.loads(text)["duration_s"] for name, text in db.execute("SELECT name, json FROM systems")}
    return {(system, contender): 1e6 * seconds / (1e3 * duration[system] / timestep) for system, contender, timestep, seconds in db.execute(
        "SELECT system, contender, timestep_ms, cpu_s FROM cells WHERE measure = 'reference' AND cpu_s > 0")}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("sources", nargs="+", type=pathlib.Path)
    parser.add_argument("target", type=pathlib.Path)
    parser.add_argument("--runs", type=pathlib.Path)
    asked = parser.parse_args()
    times, of_system = collections.defaultdict(list), collections.defaultdict(list)
    for source in asked.sources:
        read(source, times, of_system)
    if asked.runs is not None:
        of_runs = runs(asked.runs)
        scale = statistics.median(mean(of_system[at]) / us for at, us in of_runs.items() if at in of_system)
        print(f"fine-step runs of {len(of_runs)} pairs, times {scale:.3f}")
        for at, us in of_runs.items():
            of_system[at] = [math.log(max(scale * us, 0.1))]
    systems = sorted({system for system, _ in of_system})
    rows = [["contender", "body", "body with contacts", *systems]]
    for contender in sorted(({name for name, _ in times} | {name for _, name in of_system}) - {"null"}):
        body = [f"{mean(found):.2f}" if found else "" for found in (times[contender, False], times[contender, True])]
        rows.append([contender, *body,
                     *(f"{mean(of_system[system, contender]):.1f}" if (system, contender) in of_system else "" for system in systems)])
    lines = ["# Microseconds of a step, by which parts are balanced: per body without and with contact pairs, then on each system; empty",
             "# where it was not measured. Written by benchmarks/step_costs.py from measured step times.",
             *(",".join(row) for row in rows)]
    asked.target.write_text("\n".join(lines) + "\n", encoding="utf-8")


main()
