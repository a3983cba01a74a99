#!/usr/bin/env python3
"""How much of a whole campaign `assay run ROBOT` needs, and how near its answer is.

    benchmarks/search_against_grid.py ROBOT... [--error 1mm] [--minutes 10] [--contenders NAME,...] [--rough] [--program ./assay]
        [--out DIR]

For each robot: the search, then every cell of the programme that the search wrote. Prints the answers of both, the ratio
of the realtime factors as the whole campaign timed them, and the ratio of the costs (processor time of all workers, with the
conformance suite, and wall time). Nothing is shared between the two: both measure everything themselves. With --rough the whole
campaign times each cell for a fifth of the time: its cost is too low, and the best of many noisy speeds is too high, so both ratios
are against the search.
"""

import argparse
import json
import pathlib
import re
import sqlite3
import subprocess
import sys


def costs(folder):
    with sqlite3.connect(folder / "assay.sqlite") as db:
        manifest = dict(db.execute("SELECT key, value FROM manifest"))
        cells = db.execute("SELECT count(*) FROM cells").fetchone()[0]
    return float(manifest["cpu_s"]), float(manifest["wall_s"]), cells


def recommended(program, folder, error):
    done = subprocess.run([program, "recommend", folder, "all", "--error", error, "--json"], capture_output=True, text=True)
    if not done.stdout.startswith("{"):
        sys.exit(f"{folder}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def speed_of(answer, contender, timestep_ms):
    """The realtime factor that the whole campaign timed for a point, and None where it says that it does not qualify."""
    for point in [answer["recommended"], *answer["contenders"]]:
        if point and point["contender"] == contender and point["timestep_ms"] == timestep_ms:
            return point["realtime_factor"]["value"]
    return None


def rough(campaign):
    """The campaign with less timing, beside it, so that paths in it hold."""
    text, found = re.subn(r"(?m)^\[timing\]\n(?:\w+ = .*\n)+", "[timing]\nrounds = 3\nprocesses = 2\nbatch_ms = 8\nwindows = 8\nwarmup = 3\n",
                          campaign.read_text(encoding="utf-8"))
    if found != 1:
        sys.exit(f"{campaign}: it has no [timing]")
    path = campaign.with_name("rough.toml")
    path.write_text(text, encoding="utf-8")
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="+")
    parser.add_argument("--error", default="1mm")
    parser.add_argument("--minutes", default="10")
    parser.add_argument("--contenders", help="of both; default: all that take the robot")
    parser.add_argument("--rough", action="store_true", help="time the whole campaign's cells for less")
    parser.add_argument("--program", default="./assay")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("search-against-grid"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    failed = False
    for robot in options.robots:
        name = pathlib.Path(robot).stem
        search, grid = options.out / f"{name}-search", options.out / f"{name}-grid"
        shared = [options.program, "run"]
        only = ["--contenders", options.contenders] if options.contenders else []
        subprocess.run([*shared, robot, "--minutes", options.minutes, "--error", options.error, "--out", search, "--references",
                        "off", *only], check=False, stdout=subprocess.DEVNULL)
        campaign = search / "campaign.toml"
        if options.rough:
            campaign = rough(campaign)
        subprocess.run([*shared, campaign, "--full", "--out", grid, "--references", "off"], check=True,
                       stdout=subprocess.DEVNULL)
        found, whole = (recommended(options.program, folder, options.error) for folder in (search, grid))
        own, best = found["recommended"], whole["recommended"]
        (cpu, wall, cells), (cpu_all, wall_all, cells_all) = costs(search), costs(grid)
        print(f"{name}: {cells} of {cells_all} cells, {cpu / cpu_all:.3f} of the processor time ({cpu:.0f} s of {cpu_all:.0f} s), "
              f"{wall / wall_all:.3f} of the wall time ({wall:.0f} s of {wall_all:.0f} s)")
        if own is None or best is None:
            print(f"  within {options.error}: search {own and own['contender']}, whole campaign {best and best['contender']}")
            failed |= (own is None) != (best is None)
            continue
        there = speed_of(whole, own["contender"], own["timestep_ms"])
        for what, point in (("search", own), ("whole campaign", best)):
            print(f"  {what}: {point['contender']} at {point['timestep_ms']:g} ms, {point['realtime_factor']['value']:.4g} x")
        ratio = (there or 0) / best["realtime_factor"]["value"]
        print(f"  the search's answer has {ratio:.3f} of the best speed" if there else
              "  the search's answer does not qualify in the whole campaign, or is not that contender's fastest there")
        failed |= ratio < 0.9 or cpu > cpu_all / 5
    print("within 10 % at a fifth of the cost" if not failed else "not within 10 % at a fifth of the cost")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
