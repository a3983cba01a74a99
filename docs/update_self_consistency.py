"""Writes figures and text blocks of docs/self-consistency.md: update_self_consistency.py RESULTS [PAGE].

RESULTS is a results directory with self-consistency errors and errors against the reference solution of the planar chain,
or the database of one packed as assay.sqlite.xz.
"""

import collections
import contextlib
import itertools
import json
import math
import pathlib
import sqlite3
import sys

from plain_figure import Plot
from update_claims import milliseconds, table, unpacked, updated

SYSTEM = "planar-chain"
FACTORS = (10, 30, 100, 300)
SHOWN = 30  # the figure's realtime factor
CLEAR = 2  # two errors are told apart when one is this many times the other
FAMILIES = {"mujoco": "#1463c4", "bullet": "#d4590c", "ode": "#2b8a3e", "physx": "#8a2be2", "havok": "#c2185b", "jolt": "#0b7285",
            "rapier": "#7f6000", "dart": "#495057", "simbody": "#e8590c"}


def values(db, measure, names):
    """By contender and timestep the first of the values that a cell has; cells that failed have none."""
    found = collections.defaultdict(dict)
    for name in reversed(names):
        for contender, timestep, value in db.execute(
                "SELECT contender, timestep_ms, value FROM cells"
                ' JOIN "values" ON cell_id = cells.id AND "values".name = ?'
                " WHERE system = ? AND measure = ? AND outcome = 'ok' AND value IS NOT NULL", (name, SYSTEM, measure)):
            found[contender][timestep] = value
    return found


def at_factor(speeds, errors, factor):
    """An error at a realtime factor, interpolated in logarithms between neighbouring timesteps; None outside of them."""
    points = sorted((speeds[step], errors[step]) for step in speeds if errors.get(step, 0) > 0)
    for (slow, low), (fast, high) in itertools.pairwise(points):
        if slow <= factor <= fast:
            weight = math.log(factor / slow) / math.log(fast / slow)
            return low ** (1 - weight) * high ** weight
    return None


def interpolated_speeds(timed, steps):
    """Realtime factors of untimed timesteps between timed ones: the step time is interpolated in logarithms."""
    known = sorted(timed.items())
    found = dict(timed)
    for (a, at_a), (b, at_b) in itertools.pairwise(known):
        for step in steps:
            if a < step < b:
                weight = math.log(step / a) / math.log(b / a)
                found[step] = at_a ** (1 - weight) * at_b ** weight
    return found


def number(value):
    return f"{value:.2g}" if 1e-2 <= value < 1e4 else f"{value:.1e}"


def rankings(db):
    """By realtime factor a list of (contender, self-consistency error, error against the reference solution)."""
    own = values(db, "consistency", ("consistency",))
    # at the fine-step run's own timestep a contender is compared with itself
    for contender, steps in values(db, "consistency", ("restart_floor",)).items():
        for step in steps:
            own[contender].pop(step, None)
    truth = values(db, "truth", ("truth_error_max", "truth_error"))
    speed = values(db, "raw_speed", ("realtime_factor",))
    found = collections.defaultdict(list)
    for contender in sorted(own):
        speeds = interpolated_speeds(speed[contender], own[contender])
        for factor in FACTORS:
            pair = [at_factor(speeds, errors[contender], factor) for errors in (own, truth)]
            if None not in pair:
                found[factor].append((contender, *pair))
    whole = db.execute("SELECT count(*) FROM cells JOIN \"values\" ON cell_id = cells.id"
                       " WHERE system = ? AND name = 'truth_error_max'", (SYSTEM,)).fetchone()[0] > 0
    return found, whole


def inversions(points):
    """Pairs that both errors tell apart, and of these the ones that they order differently, the clearest first."""
    clear, wrong = 0, []
    for (a, own_a, truth_a), (b, own_b, truth_b) in itertools.combinations(points, 2):
        by_own, by_truth = own_b / own_a, truth_b / truth_a
        if by_own < 1:
            a, b, by_own, by_truth = b, a, 1 / by_own, 1 / by_truth
        if by_own < CLEAR or max(by_truth, 1 / by_truth) < CLEAR:
            continue
        clear += 1
        if by_truth < 1:
            wrong.append((by_own / by_truth, a, b, by_own, 1 / by_truth))
    return clear, sorted(wrong, reverse=True)


def misranking(found, whole):
    rows = []
    for factor in FACTORS:
        clear, wrong = inversions(found[factor])
        if clear:
            rows.append([f"{factor}", f"{len(found[factor])}", f"{clear}", f"{len(wrong)} ({100 * len(wrong) / clear:.0f} %)"])
    text = (f"Pairs of contenders on the planar chain at equal speed, where both errors differ by a factor of {CLEAR} or more; error "
            f"against the reference solution {'over the whole run (largest)' if whole else 'at the end of the run'}:\n\n")
    text += table(["realtime factor", "contenders", "pairs told apart", "ordered differently"], rows)
    text += f"\nThe clearest of them at realtime factor {SHOWN}, one of each pair of engines:\n\n"
    rows, seen = [], set()
    for _, a, b, by_own, by_truth in inversions(found[SHOWN])[1]:
        engines = frozenset((a.split("-")[0], b.split("-")[0]))
        if len(engines) == 2 and engines not in seen and len(rows) < 8:
            seen.add(engines)
            rows.append([f"`{a}`", f"{number(by_own)} times", f"`{b}`", f"{number(by_truth)} times"])
    return text + table(["by self-consistency the better is", "over the other", "by the reference solution it is", "over the other"],
                        rows)


def held_steps(db):
    """Of each contender on the grasp how it treats the dampers, up to where it holds the object and where it first does not."""
    rows = []
    for contender, text in db.execute("SELECT name, capabilities_json FROM contenders ORDER BY rowid"):
        largest = fails = None
        for timestep, outcome, held in db.execute(
                'SELECT timestep_ms, outcome, (SELECT value FROM "values" WHERE cell_id = id AND name = \'grasp_held\') FROM cells'
                " WHERE system = 'grasp' AND measure = 'grasp' AND outcome != 'unsupported' AND contender = ?"
                " ORDER BY timestep_ms", (contender,)):
            if outcome != "ok" or held != 1:
                fails = timestep
                break
            largest = timestep
        if largest is not None:
            facts = json.loads(text)
            rows.append([f"`{contender}`", facts.get("springs", "?"), facts.get("spring_note", ""), milliseconds(largest),
                         "–" if fails is None else milliseconds(fails)])
    rows.sort(key=lambda row: row[1])
    return table(["contender", "dampers", "how", "holds up to (ms)", "fails at (ms)"], rows)


def figure(found, path):
    plot = Plot("self-consistency error (m)", "error against the reference solution (m)",
                [own for _, own, _ in found[SHOWN]], [truth for _, _, truth in found[SHOWN]])
    for contender, own, truth in found[SHOWN]:
        plot.mark(own, truth, FAMILIES.get(contender.split("-")[0], "#000000"), contender)
    path.write_text(plot.svg(), encoding="utf-8")


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: update_self_consistency.py RESULTS [PAGE]")
    page = pathlib.Path(sys.argv[2] if len(sys.argv) == 3 else pathlib.Path(__file__).parent / "self-consistency.md")
    with unpacked(pathlib.Path(sys.argv[1])) as folder, contextlib.closing(sqlite3.connect(folder / "assay.sqlite")) as db:
        found, whole = rankings(db)
        held = held_steps(db)
    if not found[SHOWN]:
        sys.exit(f"'{sys.argv[1]}' has no errors of '{SYSTEM}' at realtime factor {SHOWN}: measure campaigns/paper.toml")
    figure(found, page.with_suffix(".svg"))
    page.write_text(updated(page.read_text(encoding="utf-8"), {"misranking": misranking(found, whole), "held": held}), encoding="utf-8")


if __name__ == "__main__":
    main()
