"""The figure and the text blocks of self-consistency.md.

RESULTS is a results directory with self-consistency errors and errors against the reference solution of the planar chain,
or the database of one packed as assay.sqlite.xz.
"""

import collections
import itertools
import json
import math
import pathlib
import sys

from .common import DOCS, milliseconds, opened, standing, table, write
from .plain_figure import Plot

SYSTEM = "planar-chain"
FACTORS = (10, 30, 100, 300)
SHOWN = 30  # the figure's realtime factor
CLEAR = 2  # two errors are clearly different when one is this many times the other
LENGTHS_MS = (8, 32, 128, 512, 2048)  # of a piece
MAIN_MS = 128  # the paper's; its value has no length in its name
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


def near_floor(db):
    """Contenders and timesteps whose self-consistency error is not told apart from the floor of their curve."""
    return set(db.execute("SELECT contender, timestep_ms FROM cells JOIN \"values\" ON cell_id = cells.id"
                          " WHERE system = ? AND measure = 'consistency' AND name = 'consistency_floor'", (SYSTEM,)))


def rankings(db, length_ms=MAIN_MS):
    """By realtime factor a list of (contender, self-consistency error, error against the reference solution)."""
    own = values(db, "consistency", ("consistency" if length_ms == MAIN_MS else f"consistency_{length_ms}ms",))
    # at the fine-step run's own timestep a contender is compared with itself
    own_steps = {(contender, step) for contender, steps in values(db, "consistency", ("restart_floor",)).items() for step in steps}
    for contender, step in own_steps | near_floor(db):
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
    """Pairs that differ clearly in both errors, and of these the ones that they order differently, the clearest first."""
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


def misranking(by_length, whole):
    """The tables of pairs; `by_length` has rankings by the length of a piece in ms."""
    rows = []
    for length, found in by_length.items():
        cells = [f"{length} ms" + (" (the paper's)" if length == MAIN_MS else "")]
        for factor in FACTORS:
            clear, wrong = inversions(found[factor])
            cells.append(f"{len(wrong)} of {clear}" if clear else "–")
        rows.append(cells)
    text = (f"Pairs of contenders on the planar chain at equal speed whose two errors order them differently, of the pairs whose errors both "
            f"differ by a factor of {CLEAR} or more; error against the reference solution "
            f"{'over the whole run (largest)' if whole else 'at the end of the run'}:\n\n")
    text += table(["length of a piece", *(f"realtime factor {factor}" for factor in FACTORS)], rows)
    wrong = inversions(by_length[MAIN_MS][SHOWN])[1]
    text += f"\nThe clearest of them at {MAIN_MS} ms and realtime factor {SHOWN}, one of each pair of engines:\n\n"
    rows, seen = [], set()
    for _, a, b, by_own, by_truth in wrong:
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
                " WHERE system = 'grasp' AND measure = 'grasp' AND outcome NOT IN ('unsupported', 'withdrawn') AND contender = ?"
                " ORDER BY timestep_ms", (contender,)):
            if outcome != "ok" or held != 1:
                fails = timestep
                break
            largest = timestep
        if largest is not None or fails is not None:
            facts = json.loads(text)
            rows.append([f"`{contender}`", facts.get("springs", "?"), facts.get("spring_note", ""), "–" if largest is None else milliseconds(largest),
                         "–" if fails is None else milliseconds(fails)])
    rows.sort(key=lambda row: row[1])
    return table(["contender", "dampers", "how", "holds up to (ms)", "fails at (ms)"], rows)


def figure(found, path):
    plot = Plot("self-consistency error (m)", "error against the reference solution (m)",
                [own for _, own, _ in found[SHOWN]], [truth for _, _, truth in found[SHOWN]])
    for contender, own, truth in found[SHOWN]:
        plot.mark(own, truth, FAMILIES.get(contender.split("-")[0], "#000000"), contender)
    path.write_text(plot.svg(), encoding="utf-8")


def add_arguments(parser):
    parser.add_argument("results", metavar="RESULTS", type=pathlib.Path)
    parser.add_argument("--page", type=pathlib.Path, default=DOCS / "lab/self-consistency.md")


def update(options):
    with opened(options.results) as (_, db):
        standing.standing(db)
        found, whole = rankings(db)
        by_length = {length: rankings(db, length)[0] for length in LENGTHS_MS}
        held = held_steps(db)
    if not found[SHOWN]:
        sys.exit(f"'{options.results}' has no errors of '{SYSTEM}' at realtime factor {SHOWN}: measure campaigns/paper.toml")
    figure(found, options.page.with_suffix(".svg"))
    write(options.page, {"misranking": misranking(by_length, whole), "held": held})
