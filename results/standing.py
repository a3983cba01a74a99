"""Which cells of a results database count: without those of withdrawn.toml, and judged by today's rules of soundness.

`standing(db)` makes `cells` and "values" of a connection mean what counts, so that whoever reads them needs to know nothing of
it. A withdrawn cell has the outcome 'withdrawn', its reason, and no values. `main.cells` is still what was stored.
"""

import fnmatch
import json
import math
import pathlib
import tomllib

WITHDRAWN = pathlib.Path(__file__).with_name("withdrawn.toml")
# A hinge more than a full turn beyond its limit is no state of the model (docs/methodology.md, "Outcomes"). The measure 'violation' has
# how far it went, from any initial state; these read the same runs.
TURN = 2 * math.pi
OF_RUNS = ("violation", "drift", "truth", "grasp", "reference")


def entries(path=WITHDRAWN):
    return tomllib.loads(path.read_text("utf-8"))["withdrawn"]


def is_where(where, facts):
    """Whether a system, by its stored facts, is of those that the entry's word names."""
    if not facts.get("contacts", True) or not facts.get("contact_pairs", 0):
        return False
    if where == "contacts of joined bodies":
        return facts.get("hinges", 0) > 0
    if where == "rest":
        return facts.get("dof", 0) - facts.get("hinges", 0) >= 6 and any(facts.get("gravity", [0, 0, -9.81]))
    if where != "contacts":
        raise ValueError(f"'{where}' is no place of {WITHDRAWN.name}")
    return True


def is_any(name, patterns):
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def why_withdrawn(cell, facts, listed):
    """Of a cell (system, contender, measure, started) the reason; None for one that counts."""
    _, contender, measure, started = cell
    for entry in listed:
        if (is_any(contender, entry["contenders"]) and not is_any(contender, entry.get("except", []))
                and is_any(measure, entry.get("measures", ["*"])) and started is not None
                and facts.get("model") not in entry.get("except_models", [])
                and started < entry["before"].timestamp() and is_where(entry["where"], facts)):
            return entry["why"]
    return None


def passed_a_limit(db):
    """{cell: radians} of cells that were called sound though a hinge of their run is more than a full turn beyond its limit."""
    runs = {}
    for table, name in (('main."values"', "limit_violation_max"), ("main.samples", "limit_violation_max of states")):
        for *run, most in db.execute(
                f"SELECT c.system, c.contender, c.timestep_ms, max(v.value) FROM main.cells c JOIN {table} v ON v.cell_id = c.id"
                " WHERE v.name = ? GROUP BY c.id", (name,)):
            if most is not None and most > TURN:
                runs[tuple(run)] = max(most, runs.get(tuple(run), 0))
    return {cell: runs[tuple(run)] for cell, measure, *run in db.execute(
        "SELECT id, measure, system, contender, timestep_ms FROM main.cells WHERE outcome = 'ok'")
        if measure in OF_RUNS and tuple(run) in runs}


def standing(db, listed=None):
    """The connection, whose `cells` and "values" are those that count."""
    listed = entries() if listed is None else listed
    facts = {name: json.loads(text) for name, text in db.execute("SELECT name, json FROM main.systems")}
    db.execute("CREATE TEMP TABLE judged (id INTEGER PRIMARY KEY, outcome TEXT, reason TEXT)")
    turned = passed_a_limit(db)
    db.executemany("INSERT INTO judged VALUES (?, 'unstable', ?)",
                   [(cell, f"judged again: a hinge is {most:.3g} rad beyond its limit") for cell, most in turned.items()])
    columns = [row[1] for row in db.execute("PRAGMA main.table_info(cells)")]
    if "started" in columns:
        for cell, *place in db.execute("SELECT id, system, contender, measure, started FROM main.cells").fetchall():
            if why := why_withdrawn(place, facts.get(place[0], {}), listed):
                db.execute("INSERT OR REPLACE INTO judged VALUES (?, 'withdrawn', ?)", (cell, why))
    shown = ["coalesce(judged.{0}, c.{0}) AS {0}".format(name) if name in ("outcome", "reason") else f"c.{name}" for name in columns]
    db.execute(f"CREATE TEMP VIEW cells AS SELECT {', '.join(shown)} FROM main.cells c LEFT JOIN judged USING (id)")
    db.execute('CREATE TEMP VIEW "values" AS SELECT * FROM main."values" WHERE cell_id NOT IN'
               " (SELECT id FROM temp.judged WHERE outcome = 'withdrawn')")
    return db
