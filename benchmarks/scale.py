#!/usr/bin/env python3
"""What reads and unites results, on a store of 100,000 cells and 10,000 trajectories: time and memory of each command.

    cmake --build --preset release --target assay assay_synthetic_store assay_division
    benchmarks/scale.py build/release/bin [--cells 100000 --runs 10000 --shards 100 --folder /dev/shm]
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import tempfile

LIMITS = {"plan": 5, "resume": 5, "merge": 5, "merge again": 5, "status": 5, "export csv": 5, "claims": 5, "compare": 20, "report": 20}  # seconds
MEMORY_MB = 1024
REPORT_MB = 10


def measure(words):
    """Seconds of processor time, megabytes and status of a command."""
    pid = os.spawnvpe(os.P_NOWAIT, "sh", ["sh", "-c", 'exec "$@" > /dev/null', "sh", *map(str, words)], os.environ)
    _, status, usage = os.wait4(pid, 0)
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, os.waitstatus_to_exitcode(status)


CAMPAIGN = """name = "scale"
contenders = {contenders}
timesteps_ms = {timesteps}
measures = ["raw_speed", "consistency", "truth", "drift"]
"""
SYSTEM = """[[system]]
name = "system-{number:02}"
model = "planar-chain"
duration_s = 1.024
piece_ms = 128
pieces = 4
"""


def write_campaign(assay, folder, cells):
    """A real campaign of at least as many cells: 40 contenders, 11 timesteps, and as many systems as it takes."""
    listed = json.loads(subprocess.run([assay, "engines", "--json"], check=True, capture_output=True, text=True).stdout)
    contenders = [row["contender"] for row in listed["contenders"]
                  if row["engine"].startswith(("mujoco", "ode", "bullet", "jolt", "rapier", "physx"))][:40]
    timesteps = [2.0**power for power in range(-6, 5)]
    of_system = len(contenders) * (1 + 4 * len(timesteps))  # a fine-step run, and four measures at each timestep
    path = folder / "scale.toml"
    path.write_text(CAMPAIGN.format(contenders=json.dumps(contenders), timesteps=timesteps) +
                    "".join(SYSTEM.format(number=number) for number in range(-(-cells // of_system))))
    return path


def measured_plan(asked, folder, rows):
    """Times of planning and of finding that all is done."""
    campaign = write_campaign(asked.bin / "assay", folder, asked.cells)
    seconds, megabytes, status = measure([asked.bin / "assay_division", campaign, "--shards", "100"])
    done = subprocess.run([asked.bin / "assay_division", campaign], check=True, capture_output=True, text=True)
    planned, name, identity = done.stderr.strip().splitlines()[-3:]
    rows.append((f"plan ({planned})", "plan", seconds, megabytes, status))
    (folder / "plan.csv").write_text(done.stdout)
    subprocess.run([asked.bin / "assay_synthetic_store", folder / "planned", "--plan", folder / "plan.csv", "--campaign", name, "--hash",
                    identity], check=True)
    rows.append(("resume, nothing to do", "resume",
                 *measure([asked.bin / "assay", "run", campaign, "--out", folder / "planned", "--references", "off"])))


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
        rows = []
        measured_plan(asked, folder, rows)
        print(f"{asked.cells} cells, {asked.runs} trajectories, {asked.shards} shards\n\n| command | processor time, s | MB |\n| --- | --- | --- |")
        for title, name, seconds, megabytes, status in rows:
            wrong = status != 0 or seconds > LIMITS[name] or megabytes > MEMORY_MB
            failed |= wrong
            print(f"| {title} | {seconds:.2f} | {megabytes:.0f} |{' above its limit' if wrong else ''}", flush=True)
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
