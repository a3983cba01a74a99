#!/usr/bin/env python3
"""How many engines stay sound when a robot falls.

    benchmarks/dropped.py [ROBOT...] [--program ./assay] [--out DIR] [--contenders NAME,...] [--jobs N] [--page FILE]

Each robot falls 5 cm onto a plane, held at its start pose, and is simulated for 2 s at 1 ms. What `assay run` would measure
first is taken as it is; a robot that it leaves on a fixed base gets a free one. Without ROBOT: every model file of the four
packages (`./assay robots` fetches them). Writes the campaign into DIR, runs it, resumes it when called again, and prints a
table; with --page it writes that table between the marks `dropped` of a page.
"""

import argparse
import collections
import concurrent.futures
import json
import pathlib
import sqlite3
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "docs"))
from tables.common import table, updated  # noqa: E402
from tables.robots import ENGINES, PACKAGES, SWITCHES, cache, files_of, share  # noqa: E402

DURATION_S = 2
CONTENDERS = ("mujoco-euler,bullet-mb,bullet-si-f64,dart,simbody-euler,ode-quick,ode-step,physx-art-pgs,physx-d6-tgs,jolt-f64,havok,"
              "rapier-multibody-f64,rapier-impulse-f64")


def toml(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(part)}" for key, part in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(toml(part) for part in value) + "]"
    return json.dumps(value)


def planned(program, robot, options, folder):
    """What `assay run` would measure first of a robot, as a table of a campaign; else its refusal as a sentence."""
    done = subprocess.run([program, "run", robot, *options, "--plan", "--out", folder], capture_output=True, text=True, timeout=600)
    if done.returncode != 0:
        return (done.stderr.strip().splitlines() or [f"status {done.returncode}"])[-1]
    with open(folder / "campaign.toml", "rb") as file:
        system = tomllib.load(file)["system"][0]
    if "qpos" in system:
        system["qpos"] = str((folder / system["qpos"]).resolve())
    return system


def dropped(program, robot, name, folder):
    """The robot's [[system]], or why there is none."""
    why = ""
    for options in ([], *SWITCHES):
        free = [*options, *({"--floating-base", "--ground"} - set(options))]
        for more in (options, free):
            # a folder keeps one plan
            system = planned(program, robot, more, folder / name / ("as-it-is" + "".join(more)))
            if isinstance(system, str):
                why = why or system.removeprefix("assay: ")
            elif system["name"] == "drop":
                return {**system, "name": name, "model": str(pathlib.Path(robot).resolve()), "measures": ["violation"],
                        "duration_s": DURATION_S, "sample_ms": 16}
            else:
                why = "no shape of it can meet the ground"
    return why


def robots_of(given):
    files = given or [file for package in PACKAGES for file in files_of(package, cache() / "robots")[1]]
    return [pathlib.Path(file) for file in files]


def write_campaign(options):
    robots = robots_of(options.robots)
    counts = collections.Counter(robot.stem for robot in robots)
    names = [robot.stem if counts[robot.stem] == 1 else f"{robot.parent.name}-{robot.stem}" for robot in robots]
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        systems = list(pool.map(lambda pair: dropped(options.program, *pair, options.out / "plans"), zip(robots, names)))
    left_out = {name: why for name, why in zip(names, systems) if isinstance(why, str)}
    unused = ("pieces", "piece_ms")  # of a measure that is left out
    lines = ['name = "dropped"', 'title = "Robots that fall 5 cm onto a plane"', f"contenders = {toml(options.contenders.split(','))}",
             "timesteps_ms = [1]", "reference_ms = 1", "time_limit_s = 120", ""]
    for system in systems:
        if isinstance(system, dict):
            lines += ["[[system]]", *(f"{key} = {toml(value)}" for key, value in system.items() if key not in unused), ""]
    campaign = options.out / "dropped.toml"
    campaign.write_text("\n".join(lines), encoding="utf-8")
    (options.out / "left-out.json").write_text(json.dumps(left_out, indent=1), encoding="utf-8")
    return campaign


def summary(folder):
    with sqlite3.connect(folder / "assay.sqlite") as db:
        systems = [name for name, in db.execute("SELECT name FROM systems ORDER BY rowid")]
        engine_of = dict(db.execute("SELECT name, engine FROM contenders"))
        cells = list(db.execute("SELECT system, contender, outcome FROM cells WHERE measure IN ('reference', 'violation')"))
    left_out = json.loads((folder / "left-out.json").read_text(encoding="utf-8"))
    took, sound, reasons = (collections.defaultdict(set) for _ in range(3))
    ran = {(system, contender) for system, contender, outcome in cells if outcome != "unsupported" and engine_of[contender] != "null"}
    failed = {(system, contender): outcome for system, contender, outcome in cells if (system, contender) in ran and outcome != "ok"}
    for system, contender in sorted(ran):
        engine = engine_of[contender].split("-")[0]  # builds of one engine count once
        took[system].add(engine)
        if (system, contender) in failed:
            reasons[system].add(f"`{contender}` {failed[system, contender]}")
        else:
            sound[system].add(engine)
    engines = sorted({engine for each in took.values() for engine in each})
    enough = [system for system in systems if len(sound[system]) >= ENGINES]
    text = (f"\n{len(enough)} of {len(systems)} robots that can meet a ground ({100 * len(enough) / len(systems):.0f} %) stay sound in "
            f"{ENGINES} engines or more. {len(left_out)} files do not load or have no shape that can.\n\n")
    text += table(["engine", "takes", "stays sound"],
                  [[engine, sum(engine in took[system] for system in systems),
                    share(sum(engine in sound[system] for system in systems), sum(engine in took[system] for system in systems))]
                   for engine in engines])
    few = [system for system in systems if len(sound[system]) < ENGINES]
    if few:
        text += f"\nSound in fewer than {ENGINES} engines:\n\n" + table(
            ["robot", "sound in", "why not in the others"],
            [[system, ", ".join(sorted(sound[system])) or "none",
              ", ".join(sorted(reasons[system])) or f"taken by {len(took[system])}"]
             for system in few])
    return text + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*")
    parser.add_argument("--program", default=str(ROOT / "assay"))
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("dropped"))
    parser.add_argument("--contenders", default=CONTENDERS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--page", type=pathlib.Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    campaign = options.out / "dropped.toml"
    if not campaign.exists():
        campaign = write_campaign(options)
    done = subprocess.run([options.program, "run", campaign, "--out", options.out / "results", "--references", "off"], check=False)
    if not (options.out / "results" / "assay.sqlite").exists():
        sys.exit(done.returncode or 1)
    (options.out / "results" / "left-out.json").write_bytes((options.out / "left-out.json").read_bytes())
    text = summary(options.out / "results")
    print(text)
    if options.page:
        page = options.page.read_text(encoding="utf-8")
        options.page.write_text(updated(page, {"dropped": text}), encoding="utf-8")


if __name__ == "__main__":
    main()
