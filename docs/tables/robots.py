"""The tables of robots.md.

Without --results: reads every model file of the four packages (`./assay robots` fetches them) with `assay check --json`, and
writes how many load. With --results: writes what campaigns/robots.toml gave in that directory; without its speeds where the
machine was shared.
"""

import concurrent.futures
import json
import math
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

from .common import DOCS, opened, table, write

PAGE = DOCS / "lab/robots.md"
ENGINES = 5  # that have to take a model's contacts

# Each package: its folder, and its robots' files below it. Scenes and parts that a robot's file includes are none.
PACKAGES = {
    "example-robot-data": ("example-robot-data-*", ["cmeel.prefix/share/example-robot-data/robots/**/*.urdf"], ()),
    "gymnasium": ("gymnasium-[0-9]*", ["gymnasium/envs/mujoco/assets/*.xml"], ()),
    "dm_control": ("dm_control-*", ["dm_control/suite/*.xml", "dm_control/locomotion/walkers/assets/humanoid_CMU_V*.xml",
                                    "dm_control/locomotion/walkers/assets/rodent.xml"], ()),
    "gymnasium-robotics": ("gymnasium-robotics-*", [f"gymnasium_robotics/envs/assets/{name}.xml" for name in (
        "hand/reach", "hand/manipulate_block", "fetch/reach", "fetch/pick_and_place", "adroit_hand/adroit_door",
        "adroit_hand/adroit_hammer")], ()),
}
SWITCHES = [["--drop-unsupported"], ["--floating-base"]]
# Refusals that say that the file is wrong, not that assay lacks something.
FAULTS = re.compile("is not positive|triangle inequality|unknown joint|has no link|has no bodies")


def cache():
    own = os.environ.get("ASSAY_CACHE")
    if own:
        return pathlib.Path(own)
    return pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "assay"


def files_of(package, folder):
    """The folder of the package's newest version below `folder`, and its robots' files, sorted."""
    pattern, files, _ = PACKAGES[package]
    roots = sorted(root for root in folder.glob(pattern) if root.is_dir())  # beside locks of set-up
    if not roots:
        sys.exit(f"{folder} has no {pattern}: fetch the robots with ./assay robots")
    return roots[-1], sorted({str(path) for each in files for path in roots[-1].glob(each)})


def share(part, whole):
    return f"{part} ({100 * part / whole:.0f} %)" if whole else "0"


class Loads:
    """What `assay check` says of files; each question is asked once."""

    def __init__(self, program):
        self.program = program

    def check(self, file, options):
        """The command's JSON, or one of its refusals as a sentence."""
        done = subprocess.run([self.program, "check", file, *options, "--json"], capture_output=True, text=True, timeout=600)
        try:
            answer = json.loads(done.stdout)
        except ValueError:
            answer = None
        if answer and answer.get("model"):
            return answer
        if answer and answer.get("problems"):
            refused = [problem for problem in answer["problems"] if problem["severity"] == "refused"]
            texts = [f"{problem['element']} {problem['message']}".strip() for problem in refused or answer["problems"]]
            # a fault of the file before what assay lacks
            at = next((i for i, text in enumerate(texts) if FAULTS.search(text)), 0)
            line = (refused or answer["problems"])[at].get("line")
            return f"line {line}: {texts[at]}" if line else texts[at]
        lines = done.stderr.strip().splitlines()
        return lines[-1] if lines else f"status {done.returncode}"

    def repaired(self, file):
        """Whether the file loads after `assay check --repair`."""
        with tempfile.TemporaryDirectory() as folder:
            mended = pathlib.Path(folder) / pathlib.Path(file).name
            subprocess.run([self.program, "check", file, "--repair", mended], capture_output=True, text=True, timeout=600)
            return mended.exists() and any(isinstance(self.check(mended, options), dict) for options in ([], *SWITCHES))

    def of(self, file):
        plain = self.check(file, [])
        options, answer = [], plain
        for switches in SWITCHES:
            if not isinstance(answer, dict):
                options, answer = switches, self.check(file, switches)
        row = {"file": file, "valid": isinstance(plain, dict) or not FAULTS.search(plain), "as it is": isinstance(plain, dict),
               "with a switch": isinstance(answer, dict), "switch": " ".join(options), "touches": False, "contacts": 0,
               "why": "" if isinstance(plain, dict) else plain, "repaired": False}
        if isinstance(answer, dict):
            grounded = self.check(file, [*options, "--ground"])
            answer = grounded if isinstance(grounded, dict) else answer
            row["touches"] = answer["model"]["contact_pairs"] > 0
            if row["touches"]:
                # builds of one engine count once: bullet-f32 and bullet-f64
                row["contacts"] = len({engine["engine"].split("-")[0] for engine in answer["engines"]
                                       if engine["verdict"] != "refused"} - {"null", "skeleton"})
        if not row["valid"]:
            row["repaired"] = self.repaired(file)
        return row


def loads_table(program, jobs, folder):
    loads = Loads(program)
    header = ["package", "files", "valid", "valid ones load as they are", "with a switch", "have contacts", f"... in {ENGINES} engines"]
    rows = []
    switched, invalid, few, sums = [], [], [], [0] * 6
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for package in PACKAGES:
            root, found = files_of(package, folder)
            done = list(pool.map(loads.of, found))
            valid = [row for row in done if row["valid"]]
            touching = [row for row in valid if row["touches"]]
            counts = [len(done), len(valid), sum(row["as it is"] for row in valid), sum(row["with a switch"] for row in valid),
                      len(touching), sum(row["contacts"] >= ENGINES for row in touching)]
            sums = [a + b for a, b in zip(sums, counts)]
            rows.append(counts_row(package, counts))
            for row in done:
                name = str(pathlib.Path(row["file"]).relative_to(root))
                print(package, name, {key: row[key] for key in row if key != "file"}, file=sys.stderr)
                why = row["why"].removeprefix("assay: ").replace(str(root) + "/", "").replace("|", "\\|")
                name = f"`{pathlib.Path(name).name}`"
                loads_with = f"`{row['switch']}`" if row["with a switch"] else "no"
                if not row["valid"]:
                    invalid.append([package, name, why, loads_with, "yes" if row["repaired"] else "no"])
                elif not row["as it is"]:
                    switched.append([package, name, why, loads_with])
                if row["valid"] and row["touches"] and row["contacts"] < ENGINES:
                    few.append(f"{name} ({row['contacts']})")
    rows.append(counts_row("all", sums))
    text = table(header, rows)
    if switched:
        text += "\nValid files that do not load as they are:\n\n" + table(["package", "file", "first reason", "loads with"], switched)
    if invalid:
        text += ("\nInvalid files; a file without links or bodies cannot be repaired:\n\n"
                 + table(["package", "file", "first reason", "loads with", "loads after `--repair`"], invalid))
    if few:
        text += f"\nContacts in fewer than {ENGINES} engines: " + ", ".join(few) + ".\n"
    return text


def counts_row(name, counts):
    files, valid, plain, switched, touching, common = counts
    return [name, files, valid, share(plain, valid), share(switched, valid), touching, share(common, touching)]


AGREEMENT = 1e-4  # m
BASELINE = "mujoco-euler"  # whose speeds the others' are divided by


def contenders_table(db, speeds_too):
    """A row for each contender, over all robots."""
    names = [name for name, in db.execute("SELECT name FROM contenders WHERE name != 'null' ORDER BY rowid")]
    outcomes = {(contender, system, measure): outcome for contender, system, measure, outcome in db.execute(
        "SELECT contender, system, measure, outcome FROM cells WHERE measure IN ('reference', 'truth')")}
    errors, speeds = (
        {(contender, system): value for contender, system, value in db.execute(
            'SELECT c.contender, c.system, v.value FROM cells c JOIN "values" v ON v.cell_id = c.id '
            "WHERE v.name = ? AND c.outcome = 'ok'", [value])} for value in ("truth_error_max", "realtime_factor"))
    robots = sorted({system for _, system, measure in outcomes if measure == "reference"})
    header = ["contender", "robots it takes", "sound for 2 s", "diverged", "unstable", "crashed", "takes without contacts",
              "within 0.1 mm of the reference solution", *([f"speed / `{BASELINE}`, median (range)"] if speeds_too else [])]
    rows = []
    for name in names:
        ended = [outcomes[name, robot, "reference"] for robot in robots if (name, robot, "reference") in outcomes]
        took = len(ended) - ended.count("unsupported")
        swings = [f"{robot}-swing" for robot in robots
                  if outcomes.get((name, f"{robot}-swing", "truth"), "unsupported") not in ("unsupported", "timeout")]
        rows.append([f"`{name}`", took if len(ended) == len(robots) else f"{took} of {len(ended)}",
                     *(ended.count(outcome) for outcome in ("ok", "diverged", "unstable", "crashed")), len(swings),
                     sum(errors.get((name, swing), math.inf) < AGREEMENT for swing in swings)])
        if speeds_too and name == BASELINE:
            rows[-1].append("1")
        elif speeds_too:
            both = sorted(speeds[name, robot] / speeds[BASELINE, robot] for robot in robots if all(
                (each, robot) in speeds and outcomes.get((each, robot, "reference")) == "ok" for each in (name, BASELINE)))
            rows[-1].append(f"{statistics.median(both):.2g} ({both[0]:.2g}–{both[-1]:.2g}), {len(both)} {'robots' if len(both) > 1 else 'robot'}" if both else "–")
    return table(header, rows)


def campaign_table(db, speeds_too):
    systems = [name for name, in db.execute("SELECT name FROM systems ORDER BY rowid")]
    facts = {name: json.loads(text) for name, text in db.execute("SELECT name, json FROM systems")}
    engine_of, double = {}, set()
    for name, engine, capabilities in db.execute("SELECT name, engine, capabilities_json FROM contenders"):
        engine_of[name] = engine
        if "double" in json.loads(capabilities).get("precision", ""):
            double.add(name)
    cells = list(db.execute("SELECT id, system, contender, timestep_ms, measure, outcome FROM cells WHERE contender != 'null'"))
    values = {(cell, name): value for cell, name, value in db.execute('SELECT cell_id, name, value FROM "values"')}
    header = ["robot", "DOF", "engines that take it", "sound for 2 s", "within 0.1 mm of the reference solution", "largest error",
              *(["fastest sound at 1 ms"] if speeds_too else [])]
    rows = []
    for system in systems:
        if system.endswith("-swing"):
            continue
        own = [cell for cell in cells if cell[1] == system]
        took = {engine_of[cell[2]] for cell in own if cell[4] == "reference" and cell[5] != "unsupported"}
        sound_contenders = {cell[2] for cell in own if cell[4] == "reference" and cell[5] == "ok"}
        sound = {engine_of[name] for name in sound_contenders}
        swings = [cell for cell in cells
                  if cell[1] == f"{system}-swing" and cell[4] == "truth" and cell[5] not in ("unsupported", "timeout")
                  and cell[2] in double and math.isclose(cell[3], 1 / 64)]
        errors = [(values.get((cell[0], "truth_error_max"), values.get((cell[0], "truth_error"))), cell[2]) for cell in swings if cell[5] == "ok"]
        errors = [error for error in errors if error[0] is not None]
        speeds = [(values.get((cell[0], "realtime_factor")) or 0, cell[2]) for cell in own
                  if cell[4] == "raw_speed" and cell[5] == "ok" and cell[2] in sound_contenders]
        rows.append([system, facts[system]["dof"], len(took), len(sound),
                     f"{sum(error < AGREEMENT for error, _ in errors)} of {len(swings)}" if swings else "–",
                     "{:.1e} m ({})".format(*max(errors)) if errors else "–"])
        if speeds_too:
            rows[-1].append("{1}, {0:.0f}×".format(*max(speeds)) if speeds else "–")
    return table(header, rows)


def add_arguments(parser):
    parser.add_argument("program", metavar="ASSAY")
    parser.add_argument("--results")
    parser.add_argument("--without-speeds", action="store_true")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--page", type=pathlib.Path, default=PAGE)
    parser.add_argument("--robots", type=pathlib.Path, default=cache() / "robots", help="folder of the packages")


def update(options):
    if options.results:
        with opened(options.results) as (_, db):
            blocks = {"contenders": contenders_table(db, not options.without_speeds),
                      "campaign": campaign_table(db, not options.without_speeds)}
    else:
        blocks = {"loads": loads_table(options.program, options.jobs, options.robots)}
    write(options.page, {name: f"\n{block}\n" for name, block in blocks.items()})
