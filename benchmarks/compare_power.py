#!/usr/bin/env python3
"""How small a change `assay compare` and `assay history` find, and how often they find one where nothing changed.

    benchmarks/compare_power.py build/release/bin/assay results/intel-xeon-2-cores/assay.sqlite.xz

The noise is that of the results: how much the processes of a timing differ from their cell's median, all cells together. From it
the script draws the processes' times of pairs of runs of a campaign (and of histories of 20 runs), in which one contender is slower
by 0, 1, 2, 3 or 5 %, and less accurate by as much, and counts what the commands answer. The campaign has 4 contenders with 6 timings
each and 10 processes a timing; campaigns/quick.toml is about --contenders 25 --timings 25 --processes 6.
"""

import argparse
import collections
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

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "results"))
import packed  # noqa: E402

SLOWER = [0, 0.01, 0.02, 0.03, 0.05]

# A results database of schema version 1, which is read without hashes.
SCHEMA = """
CREATE TABLE manifest(key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE systems(name TEXT PRIMARY KEY, json TEXT NOT NULL);
CREATE TABLE contenders(name TEXT PRIMARY KEY, engine TEXT NOT NULL, version TEXT NOT NULL, base TEXT NOT NULL,
  settings TEXT NOT NULL, capabilities_json TEXT NOT NULL, build_json TEXT NOT NULL);
CREATE TABLE conformance(contender TEXT NOT NULL, test TEXT NOT NULL, status TEXT NOT NULL, figure REAL, tolerance REAL,
  unit TEXT NOT NULL, note TEXT NOT NULL, PRIMARY KEY(contender, test));
CREATE TABLE cells(id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, system TEXT NOT NULL, contender TEXT NOT NULL,
  timestep_ms REAL NOT NULL, measure TEXT NOT NULL, outcome TEXT NOT NULL, reason TEXT NOT NULL, wall_s REAL, cpu_s REAL,
  engine_s REAL, steal REAL, started REAL, finished REAL);
CREATE TABLE "values"(cell_id INTEGER NOT NULL REFERENCES cells(id) ON DELETE CASCADE, name TEXT NOT NULL, unit TEXT NOT NULL,
  value REAL, low REAL, high REAL, PRIMARY KEY(cell_id, name)) WITHOUT ROWID;
CREATE TABLE samples(cell_id INTEGER NOT NULL REFERENCES cells(id) ON DELETE CASCADE, name TEXT NOT NULL, idx INTEGER NOT NULL,
  value REAL, PRIMARY KEY(cell_id, name, idx)) WITHOUT ROWID;
PRAGMA application_id = 1634956129;
PRAGMA user_version = 1;
"""


def noise_of(source):
    """Relative deviations of processes from their cell's median."""
    with tempfile.TemporaryDirectory() as folder:
        db = sqlite3.connect(f"file:{packed.database(source, folder)}?immutable=1", uri=True)
        cells = collections.defaultdict(lambda: collections.defaultdict(list))
        for cell, process, time in db.execute(
                """SELECT r.cell_id, p.value, r.value FROM samples r JOIN samples p ON p.cell_id = r.cell_id AND p.idx = r.idx
                   WHERE r.name = 'round_step_time_us' AND p.name = 'process' AND r.value > 0.05"""):
            cells[cell][process].append(time)
    noise = []
    for processes in cells.values():
        times = [statistics.median(rounds) for rounds in processes.values()]
        middle = statistics.median(times)
        noise += [time / middle - 1 for time in times]
    return noise


def write_run(folder, noise, size, slower, less_accurate, number, seed):
    draw = random.Random(seed)
    contenders, timings, processes = size
    names = ["changed", *(f"same-{other}" for other in range(1, contenders))]
    folder.mkdir(parents=True)
    db = sqlite3.connect(folder / "assay.sqlite")
    db.executescript("PRAGMA synchronous = OFF;" + SCHEMA)
    db.executemany("INSERT INTO manifest VALUES(?, ?)", [("campaign", "power"), ("campaign_hash", "1"), ("cpu", "x"),
                                                         ("started", f"2026-01-01 {number:06}")])
    db.execute("INSERT INTO systems VALUES('chain', '{\"model_hash\": \"1\"}')")
    for name in names:
        db.execute("INSERT INTO contenders VALUES(?, ?, '1', ?, '', '{}', '{}')", (name, name, name))
    cell = 0
    for index, name in enumerate(names):
        for timestep in range(1, timings + 1):
            changed = name == "changed"
            level = (2 + index) * (1 + slower if changed else 1)
            times = [level * (1 + draw.choice(noise)) for _ in range(processes)]
            mean, error = statistics.mean(times), 2 * statistics.stdev(times) / processes**0.5
            for measure, values in [("raw_speed", [("step_time", "us", mean, mean - error, mean + error)]),
                                    ("truth", [("truth_error", "m", 1e-3 * (1 + less_accurate if changed else 1), None, None)])]:
                cell += 1
                db.execute("INSERT INTO cells VALUES(?, ?, 'chain', ?, ?, ?, 'ok', '', 1, 1, 1, 0, 1, 2)",
                           (cell, str(cell), name, timestep, measure))
                db.executemany("INSERT INTO \"values\" VALUES(?, ?, ?, ?, ?, ?)", [(cell, *value) for value in values])
                if measure == "raw_speed":
                    db.executemany("INSERT INTO samples VALUES(?, 'round_step_time_us', ?, ?)",
                                   [(cell, i, time) for i, time in enumerate(times)])
                    db.executemany("INSERT INTO samples VALUES(?, 'process', ?, ?)",
                                   [(cell, i, i) for i in range(processes)])
    db.commit()
    db.close()


def asked(assay, *words):
    done = subprocess.run([assay, *map(str, words)], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def judge(rows, contender):
    """Whether a time of the contender got worse, and whether another one, or any better, was claimed to change."""
    moved = [row for row in rows if row["change"] in ("worse", "better") and row["measure"] == "raw_speed"]
    right = [row for row in moved if row["contender"] == contender and row["change"] == "worse"]
    return bool(right), len(moved) > len(right)


def simulate(assay, source, trials, size, slowdowns, with_history):
    noise = noise_of(source)
    spread = 100 * statistics.stdev(noise)
    print(f"noise of {len(noise)} processes: standard deviation {spread:.2f} %; {size[0]} contenders, {size[1]} timings of each, {size[2]} "
          f"processes a timing, {trials} trials\n\n| slower and less accurate by | compare: found | accuracy found | compare: false alarms | history: found | "
          "history: false alarms |\n| --- | --- | --- | --- | --- | --- |")
    failed = False
    for slower in slowdowns:
        found = accuracy = false = later = later_false = 0
        for trial in range(trials):
            folder = pathlib.Path(tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
            try:
                seed = 1000 * trial
                write_run(folder / "a", noise, size, 0, 0, 0, seed)
                write_run(folder / "b", noise, size, slower, slower, 1, seed + 1)
                rows = asked(assay, "compare", folder / "a", folder / "b", "--format", "json")["rows"]
                right, wrong = judge(rows, "changed")
                found, false = found + right, false + wrong
                accuracy += any(row["value"] == "truth_error" and row["change"] == "worse" for row in rows)
                for run in range(20) if with_history else ():
                    write_run(folder / "h" / str(run), noise, size, slower if run >= 12 else 0, 0, run, seed + 10 + run)
                courses = [] if not with_history else asked(assay, "history", *(folder / "h").iterdir(), "--format", "json")["courses"]
                moved = [(course["contender"], change["run"]) for course in courses for change in course["changes"]]
                later += any(name == "changed" and abs(run - 12) <= 1 for name, run in moved)
                later_false += any(name != "changed" or abs(run - 12) > 1 or slower == 0 for name, run in moved)
            finally:
                shutil.rmtree(folder)
        print(f"| {100 * slower:.0f} % | {found} | {accuracy} | {false} | {later} | {later_false} |", flush=True)
        missed = slower == 0.05 and (found < 0.95 * trials or (with_history and later < 0.95 * trials))
        failed |= max(false, later_false) > 0.05 * trials or missed
    return 1 if failed else 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("assay")
    parser.add_argument("results", type=pathlib.Path)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--contenders", type=int, default=4)
    parser.add_argument("--timings", type=int, default=6, help="of each contender")
    parser.add_argument("--processes", type=int, default=10, help="of each timing")
    parser.add_argument("--slower", default=",".join(map(str, SLOWER)), help="shares")
    parser.add_argument("--no-history", dest="history", action="store_false")
    given = parser.parse_args()
    return simulate(given.assay, given.results, given.trials, (given.contenders, given.timings, given.processes),
                    [float(share) for share in given.slower.split(",")], given.history)


if __name__ == "__main__":
    sys.exit(main())
