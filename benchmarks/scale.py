#!/usr/bin/env python3
"""What reads and unites results, on a store of 100,000 cells and 10,000 trajectories: time and memory of each command.

    cmake --build --preset release --target assay_synthetic_store
    benchmarks/scale.py build/release/bin [--cells 100000 --runs 10000 --shards 100 --folder /dev/shm]
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

LIMITS = {"merge": 5, "merge again": 5, "status": 5, "export csv": 5, "claims": 5, "compare": 20, "report": 20}  # seconds
MEMORY_MB = 1024
REPORT_MB = 10


def measure(words):
    """Seconds, megabytes and status of a command."""
    start = time.monotonic()
    pid = os.spawnvpe(os.P_NOWAIT, "sh", ["sh", "-c", 'exec "$@" > /dev/null', "sh", *map(str, words)], os.environ)
    _, status, usage = os.wait4(pid, 0)
    return time.monotonic() - start, usage.ru_maxrss / 1024, os.waitstatus_to_exitcode(status)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("--cells", type=int, default=100000)
    parser.add_argument("--runs", type=int, default=10000)
    parser.add_argument("--shards", type=int, default=100)
    parser.add_argument("--folder", default="/dev/shm")
    asked = parser.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp(prefix="assay-scale-", dir=asked.folder))
    assay, failed = asked.bin / "assay", False
    try:
        subprocess.run([asked.bin / "assay_synthetic_store", folder, "--cells", str(asked.cells), "--runs", str(asked.runs),
                        "--shards", str(asked.shards)], check=True)
        merged = folder / "merged"
        print(f"{asked.cells} cells, {asked.runs} trajectories, {asked.shards} shards\n\n| command | s | MB |\n| --- | --- | --- |")
        for name, words in [("merge", ["merge", folder / "shards", "--out", merged]),
                            ("merge again", ["merge", folder / "shards", "--out", merged]),
                            ("status", ["status", merged]),
                            ("export csv", ["export", merged, "--format", "csv"]),
                            ("claims", ["claims", merged]),
                            ("compare", ["compare", merged, merged]),
                            ("report", ["report", merged])]:
            seconds, megabytes, status = measure([assay, *words])
            wrong = status != 0 or seconds > LIMITS[name] or megabytes > MEMORY_MB
            failed |= wrong
            print(f"| {name} | {seconds:.2f} | {megabytes:.0f} |{' above its limit' if wrong else ''}", flush=True)
        size = (merged / "report.html").stat().st_size / 2**20
        failed |= size > REPORT_MB
        print(f"\nreport.html: {size:.1f} MB")
    finally:
        shutil.rmtree(folder)
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
