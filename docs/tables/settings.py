"""The tables of settings.md from a run of campaigns/settings.toml, and that of performance.md from one of campaigns/builds.toml.

RESULTS is a results directory, or the database of one packed as assay.sqlite.xz.
"""

import contextlib
import json
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import tempfile

from .common import DOCS, milliseconds, opened, standing, table, write

SYSTEMS = ("capsules-27", "humanoid", "grasp")
ERROR, DEPTH = "1 mm", "5 mm"
NONE = "at none"


def within(program, results, system, *limits):
    """By contender of the campaign the fastest of its points within the limits alone, with any of its settings."""
    free = [] if "--penetration" in limits else ["--penetration", "any"]
    done = subprocess.run([program, "recommend", results, system, "--error", ERROR.replace(" ", ""), *limits, *free, "--slip", "any", "--json"],
                          capture_output=True, text=True)
    if not done.stdout.startswith("{"):
        sys.exit(f"{system}: {done.stderr.strip()}")
    return {point["varies"]: point for point in json.loads(done.stdout)["contenders"]}


def without_sweeps(database, folder):
    """A copy of the results as if the campaign had swept nothing; what a sweep makes has a blank in its name."""
    folder.mkdir()
    shutil.copy(database, folder / "assay.sqlite")
    with contextlib.closing(sqlite3.connect(folder / "assay.sqlite")) as db:
        db.execute("PRAGMA foreign_keys = ON")
        db.execute("DELETE FROM cells WHERE contender LIKE '% %'")
        db.commit()
    return folder


def is_no_better(point, own):
    """Than the contender's own settings: the same timestep, and speeds whose intervals overlap."""
    return point["timestep_ms"] == own["timestep_ms"] and point["realtime_factor"]["low"] <= own["realtime_factor"]["high"]


def text_of(point, base):
    if point is None:
        return NONE
    setting = point["contender"].removeprefix(base).strip()
    speed, low, high = (float(f"{point['realtime_factor'][name]:.2g}") for name in ("value", "low", "high"))
    about = "" if point["timed"] else "~"  # interpolated between timesteps that were timed
    return f"{about}{speed:g}× [{low:g}, {high:g}] at {milliseconds(point['timestep_ms'])} ms" + (f", `{setting}`" if setting else "")


def withdrawn_contenders(database):
    """{system: contenders whose errors do not count}"""
    found = {system: set() for system in SYSTEMS}
    with contextlib.closing(sqlite3.connect(database)) as db:
        for system, contender in standing.standing(db).execute(
                "SELECT DISTINCT system, contender FROM cells WHERE measure = 'consistency' AND outcome = 'withdrawn'"):
            found[system].add(contender)
    return found


def settings_tables(program, results, plain, contenders, withdrawn):
    text = ""
    for system in SYSTEMS:
        own, best = within(program, plain, system), within(program, results, system)
        depth = ("--penetration", DEPTH.replace(" ", ""))
        own_shallow, shallow = within(program, plain, system, *depth), within(program, results, system, *depth)
        for of_own, of_all in ((own, best), (own_shallow, shallow)):
            of_all.update({base: point for base, point in of_own.items() if is_no_better(of_all[base], point)})
        rows = [[f"`{base}`", text_of(own.get(base), base), text_of(best.get(base), base), text_of(shallow.get(base), base)]
                for base in contenders if base in best]
        missing = [f"`{base}`" for base in contenders if base not in best and base not in withdrawn[system]]
        text += f"\n{system}:\n\n" + table(["contender", "as it is", "with the best of the settings", f"and at most {DEPTH} deep"], rows)
        if missing:
            text += f"\nSound and within {ERROR} at none of these timesteps with any setting: {', '.join(missing)}.\n"
        if withdrawn[system]:
            text += f"\nWithdrawn: {', '.join(f'`{base}`' for base in contenders if base in withdrawn[system])}.\n"
    return text


def ratio_table(db):
    """What the second build takes of the first one's time, from the campaign's ratios."""
    found, systems = {}, []
    for system, contender, value, low, high in db.execute(
            'SELECT system, contender, value, low, high FROM cells JOIN "values" ON cell_id = cells.id'
            " WHERE \"values\".name = 'time_ratio' AND outcome = 'ok'"):
        found[contender, system] = (value, low, high)
        if system not in systems:
            systems.append(system)
    rows = []
    for contender in dict.fromkeys(contender for contender, _ in found):
        cells = [found.get((contender, system)) for system in systems]
        rows.append([f"`{contender}`", *(f"{c[0]:.2f} [{c[1]:.2f}, {c[2]:.2f}]" if c else "–" for c in cells)])
    return table(["build", *systems], rows)


def add_arguments(parser):
    parser.add_argument("program", metavar="ASSAY")
    parser.add_argument("--settings", type=pathlib.Path)
    parser.add_argument("--builds", type=pathlib.Path)
    parser.add_argument("--pages", type=pathlib.Path, default=DOCS / "lab", help="folder of the pages")


def update(options):
    if options.settings:
        with opened(options.settings) as (database, db), tempfile.TemporaryDirectory() as scratch:
            contenders = [name for name, in db.execute("SELECT name FROM contenders WHERE name NOT LIKE '% %' AND name <> 'null'")]
            plain = without_sweeps(database, pathlib.Path(scratch) / "plain")
            tables = settings_tables(options.program, database.parent, plain, contenders, withdrawn_contenders(database))
        write(options.pages / "settings.md", {"settings": tables})
    if options.builds:
        with opened(options.builds) as (_, db):
            write(options.pages / "performance.md", {"builds": ratio_table(db)})
