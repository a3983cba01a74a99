#!/usr/bin/env python3
"""assay's own costs as ratios to a baseline that is measured in the same run, appended to a history.

    cmake --build --preset release --target assay assay_synthetic_store assay_division assay_benchmark_adapter_overhead
    benchmarks/record.py build/release                                      # prints them
    benchmarks/record.py build/release --append benchmarks/history.jsonl    # a line for this program, once a release

| name | what is measured | baseline |
| --- | --- | --- |
| harness_step | a step of mujoco-euler through its adapter | the same in a loop written by hand |
| store_writes | cells with values and samples, a transaction each | the same rows by Python's SQLite, a transaction each |
| plan | cells of campaigns/engines.toml with their keys and parts | the same rows as JSON, hashed by Python |
| merge, export, report | 10 parts of 1000 cells; their union | SQLite's copy of the union (VACUUM INTO) |

Each is the median of pairs that are measured one after the other, with the smallest and the largest; the machine's speed divides out as
far as both depend on it alike.
"""

import argparse
import contextlib
import datetime
import hashlib
import json
import os
import pathlib
import platform
import shutil
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]


def seconds(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def run(*words):
    return subprocess.run(list(map(str, words)), check=True, capture_output=True, text=True)


def ratio(pairs, work, baseline):
    """Median, smallest and largest ratio of the two."""
    ratios = sorted(seconds(work) / seconds(baseline) for _ in range(pairs))
    return [round(number, 4) for number in (statistics.median(ratios), ratios[0], ratios[-1])]


def rows_of(database, table):
    with contextlib.closing(sqlite3.connect(database)) as db:
        return list(db.execute(f'SELECT * FROM "{table}"'))


def write_rows(folder, tables):
    """As the store does: a transaction a cell, on disk when it ends."""
    target = folder / "baseline.sqlite"
    target.unlink(missing_ok=True)
    with contextlib.closing(sqlite3.connect(target, isolation_level=None)) as db:
        db.execute("PRAGMA journal_mode = WAL")
        db.execute("PRAGMA synchronous = FULL")
        db.execute("CREATE TABLE cells(id INTEGER PRIMARY KEY, row TEXT)")
        for name in ("values", "samples"):
            db.execute(f'CREATE TABLE "{name}"(cell INTEGER, name TEXT, idx, value, PRIMARY KEY(cell, name, idx)) WITHOUT ROWID')
        of_cell = {name: {} for name in ("values", "samples")}
        for name, found in of_cell.items():
            for row in tables[name]:
                found.setdefault(row[0], []).append((*row[:3], row[3]))
        for cell in tables["cells"]:
            db.execute("BEGIN")
            db.execute("INSERT INTO cells VALUES(?, ?)", (cell[0], json.dumps(cell)))
            for name, found in of_cell.items():
                db.executemany(f'INSERT INTO "{name}" VALUES(?, ?, ?, ?)', found.get(cell[0], []))
            db.execute("COMMIT")


def copy(union, target):
    target.unlink(missing_ok=True)
    with contextlib.closing(sqlite3.connect(union)) as db:
        db.execute("VACUUM INTO ?", (str(target),))


def measure(build, folder, pairs):
    assay, synthetic = build / "bin/assay", build / "bin/assay_synthetic_store"
    found = {}
    overhead = build / "bin/assay_benchmark_adapter_overhead"
    if overhead.exists():
        rows = json.loads(run(overhead, "--contender", "mujoco-euler", "--json").stdout)
        of_step = [row for row in rows["rows"] if row["system"] == "planar-chain" and row["loop"].startswith("advance(n)")]
        found["harness_step"] = [round(of_step[0][key], 4) for key in ("ratio", "low", "high")]
    else:
        print("harness_step is left out: build assay_benchmark_adapter_overhead", file=sys.stderr)

    def write():
        shutil.rmtree(folder / "written", ignore_errors=True)
        run(synthetic, folder / "written", "--cells", 1000, "--runs", 1, "--shards", 1)

    write()
    tables = {name: rows_of(folder / "written/shards/1/assay.sqlite", name) for name in ("cells", "values", "samples")}
    found["store_writes"] = ratio(pairs, write, lambda: write_rows(folder, tables))

    engines = ROOT / "campaigns/engines.toml"

    def plan():
        return run(build / "bin/assay_division", engines, "--shards", 64).stdout.splitlines()

    cells = [line.split(",") for line in plan()]
    found["plan"] = ratio(pairs, plan, lambda: [hashlib.sha256(json.dumps(cell).encode()).hexdigest() for _ in range(20) for cell in cells])

    run(synthetic, folder / "large", "--cells", 10000, "--runs", 100, "--shards", 10)
    union, copied = folder / "union", folder / "copied.sqlite"

    def merge():
        shutil.rmtree(union, ignore_errors=True)
        run(assay, "merge", folder / "large/shards", "--out", union)

    merge()
    for name, work in (("merge", merge), ("export", lambda: run(assay, "export", union, "--format", "csv")),
                       ("report", lambda: run(assay, "report", union))):
        found[name] = ratio(pairs, work, lambda: copy(union / "assay.sqlite", copied))
    return found


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--folder", default="/dev/shm" if os.access("/dev/shm", os.W_OK) else None)
    parser.add_argument("--append", type=pathlib.Path)
    asked = parser.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp(prefix="assay-record-", dir=asked.folder))
    try:
        ratios = measure(asked.build.resolve(), folder, asked.pairs)
    finally:
        shutil.rmtree(folder)
    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo", encoding="utf-8") if line.startswith("model name")), "unknown")
    line = {"date": datetime.date.today().isoformat(), "version": run(asked.build / "bin/assay", "--version").stdout.strip(),
            "commit": run("git", "-C", ROOT, "rev-parse", "--short=12", "HEAD").stdout.strip(), "cpu": cpu, "cores": os.cpu_count(),
            "kernel": platform.release(), "load": round(os.getloadavg()[1], 1), "ratios": ratios}
    print("| name | ratio to its baseline | smallest to largest |\n| --- | ---: | --- |")
    for name, (middle, low, high) in ratios.items():
        print(f"| {name} | {middle:.3f} | {low:.3f} to {high:.3f} |")
    if asked.append:
        with asked.append.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main()
