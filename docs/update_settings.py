#!/usr/bin/env python3
"""Writes the tables of docs/settings.md from a run of campaigns/settings.toml, and that of docs/performance.md from one of
campaigns/builds.toml.

    update_settings.py ASSAY [--settings RESULTS] [--builds RESULTS]

RESULTS is a results directory, or the database of one packed as assay.sqlite.xz.
"""

import argparse
import contextlib
import json
import pathlib
import sqlite3
import subprocess
import sys
import tempfile

from update_claims import packed, table, updated

HERE = pathlib.Path(__file__).resolve().parent
SYSTEMS = ("capsules-27", "humanoid", "grasp")
ERROR, DEPTH = "1mm", "5mm"
NONE = "at none"


def within(program, results, system, *limits):
    """By contender of the campaign the fastest of its points within the limits: as it is, and with any setting."""
    done = subprocess.run([program, "recommend", results, system, "--error", ERROR, *limits, "--json"], capture_output=True, text=True)
    if not done.stdout.startswith("{"):
        sys.exit(f"{system}: {done.stderr.strip()}")
    own, best = {}, {}
    for point in json.loads(done.stdout)["contenders"]:
        if not point["timed"]:
            continue
        base = point["varies"]
        if point["contender"] == base:
            own[base] = point
        if base not in best or point["realtime_factor"]["value"] > best[base]["realtime_factor"]["value"]:
            best[base] = point
    return own, best


def text_of(point, base):
    if point is None:
        return NONE
    setting = point["contender"].removeprefix(base).strip()
    return f"{point['realtime_factor']['value']:.2g}× at {point['timestep_ms']:g} ms" + (f", `{setting}`" if setting else "")


def settings_tables(program, results, contenders):
    text = ""
    for system in SYSTEMS:
        own, best = within(program, results, system)
        _, shallow = within(program, results, system, "--penetration", DEPTH)
        rows = [[f"`{base}`", text_of(own.get(base), base), text_of(best.get(base), base), text_of(shallow.get(base), base)]
                for base in contenders if base in best]
        missing = [f"`{base}`" for base in contenders if base not in best]
        text += f"\n{system}:\n\n" + table(["contender", "as it is", "with the best of the settings", f"and at most {DEPTH} deep"], rows)
        if missing:
            text += f"\nWithin {ERROR} with no setting: {', '.join(missing)}.\n"
    return text


def ratio_table(db):
    """What the second build takes of the first one's time, from the campaign's ratios."""
    found, systems = {}, []
    for system, contender, value, low, high in db.execute(
            'SELECT system, contender, value, low, high FROM cells JOIN "values" ON cell_id = cells.id'
            " WHERE \"values\".name = 'ratio' AND outcome = 'ok'"):
        found[contender, system] = (value, low, high)
        if system not in systems:
            systems.append(system)
    rows = []
    for contender in dict.fromkeys(contender for contender, _ in found):
        cells = [found.get((contender, system)) for system in systems]
        rows.append([f"`{contender}`", *(f"{c[0]:.2f} [{c[1]:.2f}, {c[2]:.2f}]" if c else "–" for c in cells)])
    return table(["build", *systems], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--settings", type=pathlib.Path)
    parser.add_argument("--builds", type=pathlib.Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        if options.settings:
            database = packed.database(options.settings, pathlib.Path(scratch) / "settings")
            with contextlib.closing(sqlite3.connect(database)) as db:
                contenders = [name for name, in db.execute("SELECT name FROM contenders WHERE name NOT LIKE '% %' ORDER BY rowid")]
            page = HERE / "settings.md"
            page.write_text(updated(page.read_text("utf-8"), {"settings": settings_tables(options.program, database.parent, contenders)}), "utf-8")
        if options.builds:
            database = packed.database(options.builds, pathlib.Path(scratch) / "builds")
            with contextlib.closing(sqlite3.connect(database)) as db:
                rows = ratio_table(db)
            page = HERE / "performance.md"
            page.write_text(updated(page.read_text("utf-8"), {"builds": rows}), "utf-8")


if __name__ == "__main__":
    main()
