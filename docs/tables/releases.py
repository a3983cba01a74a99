"""The tables of releases.md.

RESULTS is a folder of benchmarks/releases.py: a file CONTENDER-ROBOT.json.xz for each pair, what `assay bisect --json` prints.
The page has a block for each contender that has results, of its name. A block "CONTENDER times", where the page has one, gets
the time of a step in each release (`assay bisect --speed`).
"""

import json
import lzma
import pathlib

from .common import DOCS, table, write
from .engines import quantity

MOST_ROBOTS = 3  # that a row names


def course(path):
    text = path.read_bytes()
    return json.loads(lzma.decompress(text) if path.suffix == ".xz" else text)


def courses(folder):
    """{contender: [course, by robot]}; settings make another contender of it."""
    found = {}
    for path in sorted(folder.glob("*.json*")):
        each = course(path)
        found.setdefault(" ".join([each["contender"], *(f"{key}={value}" for key, value in each.get("settings", {}).items())]), []).append(each)
    return {contender: sorted(each, key=lambda run: run["system"]) for contender, each in found.items()}


def steps(runs):
    """{(before, after): {robot: change}}, old to new."""
    order, found = {}, {}
    for run in runs:
        for place, each in enumerate(run["releases"]):
            order.setdefault(each["release"], place)
        for change in run["changes"]:
            found.setdefault((change["before"], change["after"]), {})[run["system"]] = change
    return dict(sorted(found.items(), key=lambda step: [order[release] for release in reversed(step[0])]))


def named(texts):
    shown = ", ".join(texts[:MOST_ROBOTS])
    return shown + (f" and {len(texts) - MOST_ROBOTS} more" if len(texts) > MOST_ROBOTS else "")


def causes(changes):
    found = {}
    for change in changes:
        for probe in change["probes"]:
            condition = probe["condition"]
            found[condition if probe["probe"] == "conformance" else f"{probe['probe']} ({condition})" if condition else probe["probe"]] = 1
    return list(found)


def releases_table(runs):
    rows = []
    for (before, after), changes in steps(runs).items():
        moved = sorted(((robot, each) for robot, each in changes.items() if not each["rounding"]), key=lambda pair: -pair[1]["distance_m"])
        ran = sum(all(any(each["release"] == release and each["run"] for each in run["releases"]) for release in (before, after)) for run in runs)
        settings = {}
        for robot, each in moved:
            for restored in each["restoring"][:1]:
                settings.setdefault(f"`{restored['setting']}`", []).append(robot)
        rows.append([f"{before} to {after}", named([f"{robot} {quantity(each['distance_m'], 'm')}" for robot, each in moved]) or "–",
                     f"{len(changes) - len(moved)} of {ran}", named(causes(changes.values())) or "none",
                     ", ".join(f"{setting} ({named(robots)})" for setting, robots in settings.items()) or "–"])
    return table(["releases", "moved, and how far in the mean", "rounding alone", "probes that differ", "as before with"], rows)


def times_table(run):
    def text(of, count):
        return f"{of['value']:.{count}g} [{of['low']:.{count}g}, {of['high']:.{count}g}]"

    return table(["release", "time of a step, µs", "over the release before"],
                 [[each["release"], text(each["step_us"], 4), text(each["to_the_one_before"], 4) if each["to_the_one_before"] else "–"]
                  for each in run["step_times"]])


def blocks(page, folder):
    """Those of the page."""
    text, found = page.read_text(encoding="utf-8"), {}
    for contender, runs in courses(folder).items():
        found[contender] = releases_table(runs)
        found.update({f"{contender} times": times_table(run) for run in runs if run.get("step_times")})
    return {name: block for name, block in found.items() if f"<!-- {name}: begin -->" in text}


def add_arguments(parser):
    parser.add_argument("results", metavar="RESULTS", type=pathlib.Path)
    parser.add_argument("--page", type=pathlib.Path, default=DOCS / "releases.md")


def update(options):
    write(options.page, blocks(options.page, options.results))
