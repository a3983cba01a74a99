"""The verdicts and failures of claims.md.

RESULTS is a results directory, or the database of one packed as assay.sqlite.xz. The blocks are `assay report --claims --markdown`
and the tables of failed runs, each with the command that shows it.
"""

import contextlib
import json
import pathlib
import re
import sqlite3
import subprocess

from .common import DOCS, milliseconds, opened, standing, table, write

# Measures whose run starts at the system's initial state, as `assay simulate` does.
WHOLE_RUNS = ("grasp", "drift", "violation", "truth")
# Largest relative energy drift at the smallest timestep that is not listed as a leak.
LEAK = 1e-3


def command(facts, contender, timestep):
    model = facts["model"].removesuffix(".xml")
    control = f" --control {facts['control_option']}" if "control_option" in facts else ""
    return (f"`assay simulate {model} --engine {contender} --timestep {milliseconds(timestep)}{control}"
            f" --duration {facts['duration_s']:g} --sample {facts['sample_ms']:g} --out run.csv`")


# m: a shape whose top is less than this below the ground is unstable by the thickness of a sheet.
NEAR = 2e-3


def near_threshold(reason):
    """What to add where the verdict rests on very little."""
    below = re.search(r"lies wholly below the ground, by ([\d.e+-]+) m", reason)
    return " (near the threshold: the shape's own thickness, exceeded by little)" if below and float(below.group(1)) < NEAR else ""


def grasp_failures(db, facts):
    """For each contender the smallest timestep at which it does not hold the object."""
    rows = []
    for contender, in db.execute("SELECT name FROM contenders ORDER BY rowid"):
        runs = db.execute(
            "SELECT timestep_ms, outcome, reason,"
            ' (SELECT value FROM "values" WHERE cell_id = id AND name = \'grasp_held\'),'
            ' (SELECT value FROM "values" WHERE cell_id = id AND name = \'drop_time\')'
            " FROM cells WHERE system = 'grasp' AND measure = 'grasp' AND contender = ?"
            " ORDER BY timestep_ms", (contender,))
        held = "none"
        for timestep, outcome, reason, holds, dropped in runs:
            if outcome == "withdrawn":
                rows.append([contender, "withdrawn", reason, "–", "–"])
                break
            if outcome == "ok" and holds == 1:
                held = milliseconds(timestep)
                continue
            what = f"dropped by {dropped:g} s" if outcome == "ok" else f"{outcome} {reason}"
            share = "–" if holds is None else f"{100 * holds:.0f} %"
            rows.append([contender, held, f"{milliseconds(timestep)}: {what}", share, command(facts, contender, timestep)])
            break
    return ("The reason is that of the worst outcome. The column *held* says from how many of the initial states the object was held there.\n\n" +
            table(["contender", "holds up to (ms)", "then, at (ms)", "held", "shown by"], rows))


def other_failures(db, facts):
    """For each contender and system the smallest timestep whose run from the initial state did not end well."""
    rows, seen = [], set()
    for system, contender, timestep, outcome, reason in db.execute(
            "SELECT cells.system, contender, timestep_ms, outcome, reason FROM cells"
            " JOIN systems ON systems.name = cells.system JOIN contenders ON contenders.name = contender"
            f" WHERE measure IN ({','.join('?' * len(WHOLE_RUNS))}) AND cells.system != 'grasp'"
            " AND outcome IN ('unstable', 'diverged', 'crashed')"
            " ORDER BY systems.rowid, contenders.rowid, timestep_ms, measure", WHOLE_RUNS):
        if (system, contender) not in seen:
            seen.add((system, contender))
            rows.append([system, contender, milliseconds(timestep), f"{outcome} {reason}{near_threshold(reason)}",
                         command(facts[system], contender, timestep)])
    return table(["system", "contender", "from (ms)", "outcome", "shown by"], rows)


def leaks(db, facts):
    """Contenders whose energy drifts at the smallest timestep, where the integration error is negligible."""
    rows = []
    for system, contender, timestep, drift, rate, capabilities in db.execute(
            "SELECT cells.system, contender, timestep_ms, d.value, r.value, contenders.capabilities_json FROM cells"
            " JOIN systems ON systems.name = cells.system JOIN contenders ON contenders.name = contender"
            ' JOIN "values" d ON d.cell_id = cells.id AND d.name = \'energy_drift_relative\''
            ' JOIN "values" r ON r.cell_id = cells.id AND r.name = \'damping_rate\''
            " WHERE timestep_ms = (SELECT min(timestep_ms) FROM cells) AND d.value > ?"
            " ORDER BY systems.rowid, contenders.rowid", (LEAK,)):
        single = json.loads(capabilities).get("precision") == "single"
        rounding = (2.0 ** -23 if single else 2.0 ** -52) / (1e-3 * timestep)
        rows.append([system, contender, f"{100 * drift:.2g} % {'lost' if rate > 0 else 'gained'}",
                     f"{rate:.2g}", "yes" if abs(rate) <= rounding else "no", command(facts[system], contender, timestep)])
    return ("Rounding that always errs the same way causes a damping of up to 2⁻²³/h in single precision (0.0076 1/s at 1/64 ms). A rate that is "
            "within it is not told apart from rounding.\n\n") + table(["system", "contender", "largest drift of the energy", "hidden damping (1/s)", "within rounding", "shown by"], rows)


# Engines of the table of claim 4, each with all of its contenders.
PRACTICE = {"MuJoCo": ("mujoco",), "ODE": ("ode",), "PhysX": ("physx",), "Bullet": ("bullet-f64", "bullet-f32"),
            "Havok": ("havok", "havok-node"), "DART": ("dart",), "Jolt": ("jolt-f32", "jolt-f64"), "Rapier": ("rapier",)}


def practice(program, results):
    """Each engine's fastest point within 1 mm, of all its contenders but those with contacts of matched compliance."""
    systems = ("grasp", "humanoid", "capsules-27")
    with contextlib.closing(sqlite3.connect(results / "assay.sqlite")) as db:
        engines = dict(db.execute("SELECT name, engine FROM contenders"))
        measured = standing.standing(db).execute(
            "SELECT DISTINCT system, contender, outcome = 'withdrawn' FROM cells WHERE measure = 'consistency'").fetchall()
    found = {}
    for system in systems:
        done = subprocess.run([program, "recommend", results, system, "--error", "1mm", "--measure", "consistency",
                               "--penetration", "any", "--slip", "any", "--json"],
                              capture_output=True, text=True, check=True)
        found[system] = [point for point in json.loads(done.stdout)["contenders"] if not point["contender"].endswith("-matched")]

    def text(point):
        depth = point["worst"].get("penetration_max")
        deep = f", {1e3 * depth['value']:.2g} mm deep" if depth else ""
        end = f", {point['edge']}" if point["edge"] else ""
        return f"{float(format(point['realtime_factor']['value'], '.2g')):g} at {milliseconds(point['timestep_ms'])} ms, `{point['contender']}`{deep}{end}"
    rows = []
    for name, own in PRACTICE.items():
        best = [next((text(point) for point in found[system] if engines[point["contender"]] in own), None) for system in systems]
        for i, system in enumerate(systems):
            gone = {bool(withdrawn) for of, contender, withdrawn in measured if of == system and engines[contender] in own}
            best[i] = best[i] or ("withdrawn" if gone == {True} else "at none that counts" if True in gone else "at none")
        rows.append([name, *best])
    return table(["", *systems], rows)


def failures(results):
    with contextlib.closing(sqlite3.connect(results / "assay.sqlite")) as db:
        standing.standing(db)
        facts = {name: json.loads(text) for name, text in db.execute("SELECT name, json FROM systems")}
        return ("\n### The object is dropped\n\n" + grasp_failures(db, facts["grasp"]) +
                "\n### Other runs that fail\n\n" + other_failures(db, facts) +
                "\n### Energy that leaks at the smallest timestep\n\n" + leaks(db, facts) + "\n")


def claims(program, results):
    return subprocess.run([program, "claims", results, "--markdown"], check=True, capture_output=True, text=True).stdout


def blocks(program, results):
    """The text of each generated block."""
    with opened(results) as (database, _):
        folder = database.parent
        return {"claims": claims(program, folder), "practice": practice(program, folder), "failures": failures(folder)}


def add_arguments(parser):
    parser.add_argument("program", metavar="ASSAY")
    parser.add_argument("results", type=pathlib.Path)
    parser.add_argument("--page", type=pathlib.Path, default=DOCS / "lab/claims.md")


def update(options):
    write(options.page, blocks(options.program, options.results))
