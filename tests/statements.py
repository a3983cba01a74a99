"""Sentences of the pages that say more than one figure ("the fastest", "each engine", "none"), and the query that proves each.

    statements.py [--show] [PAGE...]

Each entry of SENTENCES names a page and a function that makes the sentence, as the page has to have it, from committed
databases; `recompute.py --sentences` and the tests compare. A sentence that is reworded on the page is reworded here. --show
prints the sentences as the databases have them. The rule of points is that of docs/methodology.md; the program is not used.
"""

import collections
import contextlib
import fractions
import functools
import json
import math
import pathlib
import random
import re
import sqlite3
import statistics
import sys
import tempfile
import tomllib

ROOT = PAGES = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "results"))
import packed  # noqa: E402
import standing  # noqa: E402

sys.path.insert(0, str(ROOT / "docs"))
from tables import contacts as contact_tables, engines as engine_tables, reality, releases as release_tables, self_consistency  # noqa: E402

RESULTS = "docs/results.md"
CONTACTS = "docs/lab/contact-truth.md"
COUNTS = ("none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve", "thirteen")

Point = collections.namedtuple("Point", "contender timestep speed timed worst edge")


def ms(timestep):
    return f"{fractions.Fraction(timestep)} ms"


def digits(value, count=2):
    return f"{float(f'{value:.{count}g}'):g}"


def quantity(value, unit="m", count=2):
    """As docs/update.py engines writes them."""
    scale, prefix = next(((s, p) for s, p in ((1, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n")) if value >= 0.9995 * s), (1e-9, "n"))
    return f"{digits(value / scale, count)} {prefix}{unit}"


def listed(texts):
    """a, b and c."""
    *before, last = texts
    return f"{', '.join(before)} and {last}" if before else last


def names(contenders):
    """`a`, `b` and `c`."""
    return listed(f"`{name}`" for name in contenders)


class Run:
    """A committed database, as far as it counts (results/standing.py)."""

    def __init__(self, folder, scratch):
        path = packed.database(ROOT / "results" / folder / "assay.sqlite.xz", pathlib.Path(scratch) / folder)
        self.db = standing.standing(sqlite3.connect(f"file:{path}?mode=ro", uri=True))
        self.contenders = [name for name, in self.db.execute("SELECT name FROM contenders ORDER BY rowid") if name != "null"]
        self.facts = {name: json.loads(text) for name, text in self.db.execute("SELECT name, json FROM main.systems")}

    def engine(self, contender):
        return self.db.execute("SELECT engine FROM contenders WHERE name = ?", (contender,)).fetchone()[0]

    def withdrawn(self):
        """{(contender, system)} that have withdrawn cells."""
        return set(self.db.execute("SELECT DISTINCT contender, system FROM cells WHERE outcome = 'withdrawn'"))

    @functools.cache
    def cells(self, system):
        """{contender: {timestep: {measure: (outcome, {value's name: (value, low, high)})}}}"""
        values = collections.defaultdict(dict)
        for cell, name, *numbers in self.db.execute(
                'SELECT cell_id, name, value, low, high FROM "values" WHERE cell_id IN (SELECT id FROM main.cells WHERE system = ?)', (system,)):
            values[cell][name] = numbers
        found = collections.defaultdict(lambda: collections.defaultdict(dict))
        for cell, contender, timestep, measure, outcome in self.db.execute(
                "SELECT id, contender, timestep_ms, measure, outcome FROM cells WHERE system = ?", (system,)):
            if contender in self.contenders:
                found[contender][timestep][measure] = (outcome, values[cell])
        return found

    def value(self, system, contender, timestep, name):
        """Of a cell that ended well, else None."""
        for outcome, values in self.cells(system)[contender][timestep].values():
            if name in values and outcome == "ok":
                return values[name][0]
        return None

    def values(self, system, timestep, name):
        return {contender: value for contender in self.contenders
                if (value := self.value(system, contender, timestep, name)) is not None}

    @functools.cache
    def points(self, system):
        """Sound points: every cell of the contender there, and at all smaller timesteps, ended well and held what it was to hold."""
        found = []
        for contender, steps in self.cells(system).items():
            timed = {h: cells["raw_speed"][1]["realtime_factor"][0] for h, cells in steps.items()
                     if cells.get("raw_speed", ("",))[0] == "ok" and "realtime_factor" in cells["raw_speed"][1]}
            # of a name for the same contender that only the clock's test needs
            if any("aa_ratio" in values for cells in steps.values() for _, values in cells.values()) and \
                    not any(name.startswith(("consistency", "truth")) for cells in steps.values() for _, values in cells.values() for name in values):
                continue
            worst = {}
            for h in sorted(steps):
                good = all(outcome == "ok" and values.get("grasp_held", [1])[0] == 1 for outcome, values in steps[h].values())
                if not good:
                    break
                here = set()
                for _, values in steps[h].values():
                    for name, (value, _, _) in values.items():
                        if name == "consistency" and "restart_floor" in values:
                            continue  # compared with itself
                        if name == "consistency" and "consistency_bound" in values:
                            value = values["consistency_bound"][0]
                        if value is not None:
                            worst[name] = max(worst.get(name, -math.inf), value)
                            here.add(name)
                found.append(Point(contender, h, speed_at(timed, h), h in timed, {name: worst[name] for name in here}, ""))
        return found

    def fastest(self, system, **limits):
        """Each contender's fastest point within the limits, the fastest first."""
        best = {}
        for point in sorted(self.points(system), key=lambda point: -(point.speed or 0)):
            if point.speed and all(name in point.worst and point.worst[name] <= limit for name, limit in limits.items()):
                best.setdefault(point.contender, point)
        return [point._replace(edge=self.edge(system, point, limits)) for point in best.values()]

    def edge(self, system, point, limits):
        """What of the timesteps beyond the point says nothing of the limits."""
        steps = [h for h, cells in self.cells(system)[point.contender].items() if set(cells) != {"scaling"}]
        sound = {each.timestep: each for each in self.points(system) if each.contender == point.contender}

        def lacks(h):
            other = sound.get(h)
            if other is None or any(other.worst.get(name, 0) > limit for name, limit in limits.items()):
                return ""
            if other.speed is None:
                return "timed"
            return "" if any(name in other.worst for name in limits) and all(name in other.worst for name in limits) else "measured in full"

        def first(beyond):
            gaps = []
            for h in beyond:
                if not lacks(h):
                    return gaps, True
                gaps.append(h)
            return gaps, False
        larger, smaller = sorted(h for h in steps if h > point.timestep), sorted((h for h in steps if h < point.timestep), reverse=True)
        if not larger and not smaller:
            return "the only timestep tried"
        texts = []
        gaps, told = first(larger)
        if gaps and told:
            texts.append(f"not measured in full at {', '.join(str(fractions.Fraction(h)) for h in gaps)} ms")
        elif not told:
            texts.append(f"the largest timestep {lacks(gaps[0]) if gaps else 'tried'}")
        gaps, told = first(smaller)
        if not told:
            texts.append(f"the smallest timestep {lacks(gaps[0]) if gaps else 'tried'}")
        return " and ".join(texts)

    def holds_up_to(self, contender):
        """The timestep (0: none), and whether it is the largest tried; None where nothing of it counts."""
        steps = self.cells("grasp")[contender]
        tried = {h: cells["grasp"] for h, cells in steps.items() if "grasp" in cells}
        if not tried or any(outcome == "withdrawn" for outcome, _ in tried.values()):
            return None
        held = 0
        for h in sorted(tried):
            outcome, values = tried[h]
            if outcome != "ok" or values["grasp_held"][0] != 1:
                return held, False
            held = h
        return held, True

    def late_step_us(self, system, contender, timestep=1, share=0.25):
        """The mean step time over the last part of the motion."""
        cell, = self.db.execute("SELECT id FROM cells WHERE system = ? AND contender = ? AND timestep_ms = ? AND measure = 'raw_speed'",
                                (system, contender, timestep)).fetchone()
        series = collections.defaultdict(list)
        for name, value in self.db.execute(
                "SELECT name, value FROM samples WHERE cell_id = ? AND name LIKE 'window%' ORDER BY name, idx", (cell,)):
            series[name].append(value)
        weights, times = series["window_weight"], series["window_step_time_us"]
        rounds = [times[at:at + len(weights)] for at in range(0, len(times), len(weights))]
        windows = [statistics.median(window) for window in zip(*rounds)]
        late = range(round((1 - share) * len(weights)), len(weights))
        return sum(weights[i] * windows[i] for i in late) / sum(weights[i] for i in late)

    def samples(self, system, contender, timestep, measure, name):
        return [value for value, in self.db.execute(
            "SELECT s.value FROM cells c JOIN samples s ON s.cell_id = c.id WHERE c.system = ? AND c.contender = ? AND c.timestep_ms = ? AND"
            " c.measure = ? AND s.name = ? ORDER BY s.idx", (system, contender, timestep, measure, name))]

    def states(self, system, contender, timestep, name):
        """What a cell that ended well has from each initial state."""
        good = any(outcome == "ok" and name in values for outcome, values in self.cells(system)[contender][timestep].values())
        return self.samples(system, contender, timestep, "violation", f"{name} of states") if good else []


def speed_at(timed, h):
    """Realtime factor at a timestep; between timed ones the step time is interpolated in logarithms."""
    if h in timed:
        return timed[h]
    below, above = max((x for x in timed if x < h), default=None), min((x for x in timed if x > h), default=None)
    if below is None or above is None:
        return None
    weight = math.log(h / below) / math.log(above / below)
    return h / math.exp((1 - weight) * math.log(below / timed[below]) + weight * math.log(above / timed[above]))


class Runs:
    """Committed folders by the first word of their names, unpacked when they are asked for; of several the last."""

    FULL = "intel-xeon-2-cores"

    def __init__(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.opened = {}

    def folder(self, name):
        """The newest of a name: 'quadruped_20ms' is results/quadruped-20ms-YEAR-MONTH-DAY."""
        return self.FULL if name == "full" else max(
            path.parent.name for path in ROOT.glob(f"results/{name.replace('_', '-')}-20[0-9][0-9]-*/assay.sqlite.xz"))

    def __getattr__(self, name):
        if name not in self.opened:
            self.opened[name] = Run(self.folder(name), self.scratch.name)
        return self.opened[name]

    def close(self):
        for run in self.opened.values():
            run.db.close()
        self.scratch.cleanup()


SENTENCES = []


def sentence(page):
    def add(of):
        SENTENCES.append((page, of.__name__.replace("_", " "), of))
        return of
    return add


MM = 1e-3


def at_end(point):
    return f", {point.edge}" if point.edge else ""


def answer(point):
    """As in the tables of answers."""
    about = "" if point.timed else "about "
    return f"`{point.contender}` at {ms(point.timestep)}, {about}{digits(point.speed)} times real time{at_end(point)}"


# ---- docs/lab/engines.md: the field -------------------------------------------------------------------------------------

ENGINES, FIELD = "docs/engines.md", "docs/lab/engines.md"
DISPLAY = {"mujoco-euler": "MuJoCo", "mujoco-warp": "MuJoCo Warp", "mjx": "MJX", "newton-mujoco": "Newton's MuJoCo solver",
           "havok": "Havok", "jolt-f32": "Jolt", "physx56-art-tgs4": "PhysX 5.6's articulations"}


def shown(contenders):
    """The engines' names of contenders, of which a text may give one for several alike."""
    return listed(dict.fromkeys(DISPLAY.get(name, f"`{name}`") for name in contenders))


@sentence(FIELD)
def systems_of_the_field(runs):
    rows = []
    for system, facts in runs.field.facts.items():
        pieces = "consistency" in facts["measures"]
        reference = f"{ms(facts['reference_ms'])}, in single precision {fractions.Fraction(facts.get('reference_single_ms', 0))}" if pieces else "–"
        steps = facts["timesteps_ms"]
        between = "and" if len(steps) == 2 else "to"
        rows.append(f"| `{system}` | {facts['duration_s']:g} s | {ms(facts['piece_ms']) if pieces else '–'} | {reference} |"
                    f" {fractions.Fraction(min(steps))} {between} {ms(max(steps))} |")
    return rows


@sentence(FIELD)
def lengths_of_other_runs(runs):
    full = {runs.full.facts[system]["duration_s"] for system in ("capsules-27", "humanoid", "grasp")}
    pieces = {runs.full.facts[system]["piece_ms"] for system in ("capsules-27", "humanoid", "grasp")}
    assert len(full) == len(pieces) == 1
    return (f"has {full.pop():g} s of `capsules-27`, the humanoid and the grasp and pieces of {ms(pieces.pop())}, [settings](settings.md)"
            f" {runs.settings.facts['capsules-27']['duration_s']:g} s of `capsules-27`.")


@sentence(ENGINES)
def errors_on_the_chain(runs):
    error = runs.field.values("spatial-chain", 1, "truth_error_max")
    first_order = {name: value for name, value in error.items() if value > 1e-4}
    least, most = min(first_order, key=first_order.get), max(first_order, key=first_order.get)
    assert quantity(error["mujoco-rk4"]) == quantity(error["bullet-mb-rk4"])
    return (f"At 1 ms it is off by {quantity(error['mujoco-rk4'])} with `mujoco-rk4` and `bullet-mb-rk4`, by {quantity(error['simbody-rkm'])} with"
            f" `simbody-rkm`, by {quantity(error['drake-rk3'])} with `drake-rk3`; in first order by {quantity(first_order[least])} with"
            f" `{least}` (four substeps a step), by {quantity(error['mujoco-euler'])} with most in joint coordinates, by"
            f" {quantity(first_order[most])} with `{most}`.")


def by_held(run):
    """{timestep: contenders that hold the object up to it}, and those at the end of the grid."""
    found, at_the_end = collections.defaultdict(list), []
    for contender in run.contenders:
        held = run.holds_up_to(contender) if contender in run.cells("grasp") else None
        if held:
            found[held[0]].append(contender)
            if held[1]:
                at_the_end.append(contender)
    return found, at_the_end


@sentence(ENGINES)
def who_holds_the_object(runs):
    found, at_the_end = by_held(runs.field)
    assert found[16] == at_the_end
    assert set(found) == {0, 0.25, 0.5, 8, 16}, found
    return (f"{names(found[16])} hold the object from all six states up to 16 ms, the largest timestep tried, and"
            f" {names(found[8])} up to 8 ms.")


@sentence(ENGINES)
def who_does_not_hold_it(runs):
    found, _ = by_held(runs.field)
    return f"The others take it as an explicit torque here and end at 1/4 to 1/2 ms; {names(found[0])} holds it at none of the timesteps tried (1/4 ms and more)."


@sentence(ENGINES)
def native_drives(runs):
    found, at_the_end = by_held(runs.full)
    longest = max(found)
    assert at_the_end == found[longest] == ["ode-step-native-pd"] and found[16] == ["dart"], found
    native = [name for name in found[8] if name.endswith("-native-pd")]
    return (f"in the [full run](lab/claims.md), whose timesteps go to 32 ms, `ode-step-native-pd` holds it up to {ms(longest)}, the largest timestep tried and"
            f" longer than any contender of this run, {names(native)} up to 8 ms.")


@sentence(ENGINES)
def the_deepest(runs):
    depth = runs.field.values("humanoid", 1, "penetration_max")
    order = sorted(depth, key=depth.get, reverse=True)
    soft = [name for name in order if name in ("mujoco-euler", "mujoco-implicitfast", "mujoco-warp", "mjx", "newton-mujoco")]
    assert order[:len(soft)] == soft
    return (f"on the humanoid at 1 ms MuJoCo, MuJoCo Warp, MJX and Newton's MuJoCo solver are deepest, {1e3 * depth[soft[-1]]:.0f} to"
            f" {1e3 * depth[soft[0]]:.0f} mm")


@sentence(ENGINES)
def the_least_deep(runs):
    depth = runs.field.values("humanoid", 4, "penetration_max")
    pile = runs.field.values("capsules-27", 4, "penetration_max")
    order, least = sorted(depth, key=depth.get)[:2], min(pile, key=pile.get)
    assert least == "havok"
    return (f"At 4 ms {shown(order)} ({digits(1e3 * depth[order[0]])} and {digits(1e3 * depth[order[1]])} mm) are least deep;"
            f" in the pile Havok is ({quantity(pile[least])}).")


@sentence(ENGINES)
def steps_of_the_humanoid(runs):
    time = runs.field.values("humanoid", 1, "step_time")
    order = sorted(time, key=time.get)
    assert order[:2] == ["mujoco-euler", "mujoco-implicitfast"] and order[2:4] == ["havok", "physx56-art-tgs4"], order[:5]
    return (f"on the humanoid at 1 ms MuJoCo takes {digits(time['mujoco-euler'])} µs a step, the least; Havok and PhysX 5.6's articulations with 4 iterations,"
            f" {digits(time['havok'])} and {digits(time['physx56-art-tgs4'])}, do not differ significantly; DART takes {digits(time['dart'])}.")


@sentence(ENGINES)
def the_pile(runs):
    field, full = runs.field, runs.full
    time = {**field.values("capsules-27", 1, "step_time")}
    order = [name for name in sorted(time, key=time.get)]
    assert order[0] == "physx-art-tgs4" and order[1] == "ode-step", order[:4]
    late = {name: field.late_step_us("capsules-27", name) for name in time}
    behind = sum(late[name] < late["ode-step"] for name in late)
    words = {4: "fifth", 5: "sixth"}
    return (f"The run of the pile, {field.facts['capsules-27']['duration_s']:g} s, begins with free fall. A step takes `physx-art-tgs4` {time['physx-art-tgs4']:.0f} µs"
            f" in the mean and {late['physx-art-tgs4']:.0f} in the last quarter, `ode-step` {time['ode-step']:.0f} and {late['ode-step']:.0f}, `mujoco-euler`"
            f" {time['mujoco-euler']:.0f} and {late['mujoco-euler']:.0f}. ODE's exact solver is second in the mean, but {words[behind]} where the capsules lie on each other."
            f" Over the {full.facts['capsules-27']['duration_s']:g} s of the full run it takes {full.value('capsules-27', 'ode-step', 1, 'step_time'):.0f} µs and"
            f" {full.late_step_us('capsules-27', 'ode-step'):.0f}, MuJoCo {full.value('capsules-27', 'mujoco-euler', 1, 'step_time'):.0f} and"
            f" {full.late_step_us('capsules-27', 'mujoco-euler'):.0f}.")


@sentence(ENGINES)
def slips_at_16_ms(runs):
    slip = runs.field.values("grasp", 16, "grasp_slip")
    held, _ = by_held(runs.field)
    least = min(held[16], key=slip.get)
    assert least == "genesis"
    return (f"at 16 ms the object slips by {digits(1e3 * slip['genesis'])} mm with Genesis, {digits(1e3 * slip['dart'])} with DART 6.13,"
            f" {digits(1e3 * slip['mjx'])} with MJX, {digits(1e3 * slip['drake-sap'])} with `drake-sap`, {digits(1e3 * slip['drake-similar'])} with"
            f" `drake-similar`, {digits(1e3 * slip['dartpy'])} with DART 6.20.")


@sentence(FIELD)
def other_limits(runs):
    slip, = runs.field.fastest("grasp", grasp_slip=7 * MM)[:1]
    soft, = runs.field.fastest("humanoid", consistency=5 * MM, penetration_max=50 * MM)[:1]
    pile, = runs.field.fastest("capsules-27", consistency=5 * MM, penetration_max=15 * MM)[:1]
    assert slip.contender == soft.contender == "mujoco-euler" and not slip.timed and pile.edge and not slip.edge and not soft.edge
    return (f"where the object may slip by 7 mm, `mujoco-euler` is the fastest ({ms(slip.timestep)}, {digits(slip.speed)} times real time, interpolated between"
            f" timed steps); where bodies of the humanoid may sink in by 50 mm, too ({ms(soft.timestep)}, {digits(soft.speed)} times); where capsules may sink in"
            f" by 15 mm, `{pile.contender}` ({ms(pile.timestep)}{at_end(pile)}, {digits(pile.speed)} times).")


QUESTIONS = (("spatial-chain", {"truth_error_max": MM}), ("spatial-chain", {"truth_error_max": 1e-6}),
             ("humanoid", {"consistency": 5 * MM, "penetration_max": 5 * MM}), ("grasp", {"grasp_slip": 5 * MM, "penetration_max": 5 * MM}),
             ("capsules-27", {"consistency": 5 * MM, "penetration_max": 5 * MM}))


@sentence(FIELD)
def answers_of_both_runs(runs):
    def fastest(run, system, limits):
        asked = {name: limit for name, limit in limits.items() if any(name in point.worst for point in run.points(system))}
        return answer(run.fastest(system, **asked)[0])
    return [" | ".join(fastest(run, system, limits) for run in (runs.field, runs.full)) for system, limits in QUESTIONS]


# ---- docs/lab/methods.md ---------------------------------------------------------------------------------------------

@sentence("docs/lab/methods.md")
def missed_depths(runs):
    field, full = runs.field, runs.full
    count = field.facts["capsules-27"]["initial_states"]["count"]
    assert field.facts["capsules-27"]["initial_states"] | {"count": 20} == full.facts["capsules-27"]["initial_states"]
    assert field.facts["capsules-27"]["model_hash"] == full.facts["capsules-27"]["model_hash"]
    rows = []
    for contender in field.contenders:
        dense, sparse = (run.states("capsules-27", contender, 4, "penetration_max")[:count] for run in (field, full))
        if len(dense) == len(sparse) == count:
            a, b = 1e3 * statistics.fmean(dense), 1e3 * statistics.fmean(sparse)
            rows.append((1 - b / a, contender))
    rows.sort(reverse=True)
    (most, first), (next_most, _), (least, _) = rows[0], rows[1], rows[-1]
    assert first == "physx-d6-pgs" and len(rows) == 9
    return [f"looks every 32 ms would miss {100 * most:.0f} % of the largest depth of PhysX on 27 capsules, and {100 * least:.0f} to {100 * next_most:.0f} % of others'"]


# ---- docs/lab/claims.md --------------------------------------------------------------------------------------------------

CLAIMS = "docs/lab/claims.md"
# Engines of the table of claim 4, each with all of its contenders.
PRACTICE = {"MuJoCo": ("mujoco",), "ODE": ("ode",), "PhysX": ("physx",), "Bullet": ("bullet-f64", "bullet-f32"), "Havok": ("havok", "havok-node"),
            "DART": ("dart",), "Jolt": ("jolt-f32", "jolt-f64"), "Rapier": ("rapier",)}


@sentence(CLAIMS)
def each_engine_within_1_mm(runs):
    run, rows = runs.full, []
    for name, engines in PRACTICE.items():
        row = [name]
        for system in ("grasp", "humanoid", "capsules-27"):
            own = [contender for contender in run.contenders if run.engine(contender) in engines and not contender.endswith("-matched")]
            best = next((point for point in run.fastest(system, consistency=MM) if point.contender in own), None)
            if best is None:
                gone = [(contender, system) in run.withdrawn() for contender in own
                        if any("consistency" in cells for cells in run.cells(system)[contender].values())]
                row.append("withdrawn" if all(gone) else "at none that counts" if any(gone) else "at none")
                continue
            depth = best.worst.get("penetration_max")
            row.append(f"{digits(best.speed)} at {ms(best.timestep)}, `{best.contender}`" +
                       (f", {1e3 * depth:.2g} mm deep" if depth is not None else "") + at_end(best))
        rows.append("| " + " | ".join(row) + " |")
    return rows


@sentence(CLAIMS)
def soft_contacts_win_the_humanoid(runs):
    within = runs.full.fastest("humanoid", consistency=MM)
    assert not runs.full.fastest("humanoid", consistency=MM, penetration_max=10 * MM)
    first = within[0]
    return (f"On the humanoid no contender is within 1 mm and at most 10 mm deep at a timestep at which both were measured: the answer `{first.contender}`"
            f" sinks in by {1e3 * first.worst['penetration_max']:.0f} mm.")


@sentence(CLAIMS)
def restarts_alone_exceed_1_mm(runs):
    """Errors at the fine-step run's own timestep in the full run, and those against a reference that starts cold, too, in the newer one."""
    floor = {name: error for name, error in runs.full.values("humanoid", 1 / 16, "consistency").items() if error > MM}
    order = sorted(floor, key=floor.get, reverse=True)
    cold = runs.newer_field.values("humanoid", 1 / 4, "consistency_cold")
    first, *others = (f"`{name}` ({digits(1e3 * floor[name])}{'' if i else ' mm'})" for i, name in enumerate(order))
    return (f"At the fine-step run's own timestep {listed([first, *others])} are therefore already more than 1 mm off on the humanoid, and within 1 mm at none."
            f" Where the reference starts so, too ([second run](engines.md#each-engine-at-its-best-sapien-box3d-and-superdex-among-them)), `physx-d6-pgs` is"
            f" {digits(1e3 * cold['physx-d6-pgs'])} and `havok` {digits(1e3 * cold['havok'])} mm off at 1/4 ms: restarts are not all of it.")


@sentence(CLAIMS)
def at_equal_compliance(runs):
    run = runs.full
    error = {name: run.value("capsules-27", name, 1, "consistency") for name in ("mujoco-euler-matched", "ode-quick-matched")}
    bound = run.value("capsules-27", "physx-d6-pgs-matched", 1, "consistency_bound")
    assert error["mujoco-euler-matched"] > max(error["ode-quick-matched"], bound)
    humanoid = [run.value("humanoid", name, 1, "consistency") for name in (*error, "physx-d6-pgs-matched")]
    assert min(humanoid) == humanoid[0]
    return (f"With contacts of equal compliance (`*-matched`) the claim turns round on the capsules: at 1 ms the error is {1e3 * error['mujoco-euler-matched']:.2f} mm"
            f" with `mujoco-euler-matched`, {1e3 * error['ode-quick-matched']:.2f} with `ode-quick-matched` and at most {1e3 * bound:.2f} with `physx-d6-pgs-matched`."
            f" On the humanoid MuJoCo stays first: {1e3 * humanoid[0]:.2f}, {1e3 * humanoid[1]:.2f} and {1e3 * humanoid[2]:.2f} mm.")


@sentence(CLAIMS)
def own_iterations(runs):
    run = runs.full
    time = {name: run.value("humanoid", name, 1, "step_time") for name in ("mujoco-euler", "physx-d6-pgs4", "physx-d6-pgs")}
    return (f"The paper's 50 iterations decide by how much. On the humanoid PhysX with its own 4 (`physx-d6-pgs4`) takes {time['physx-d6-pgs4']:.1f} µs a step,"
            f" {time['physx-d6-pgs4'] / time['mujoco-euler']:.2f} times MuJoCo Euler's {time['mujoco-euler']:.1f}; with 50 it takes {time['physx-d6-pgs']:.1f}.")


@sentence(RESULTS)
def verdicts_in_brief(_):
    """The verdicts of lab/claims.md, and in the last column no number that is not there."""
    claims, brief = ((ROOT / page).read_text("utf-8") for page in (CLAIMS, RESULTS))
    rows = {}
    for number, title, verdict, figures in re.findall(r"^\| (\d+) \| ([^|]+) \| ([^|]+) \| ([^|]+) \|$", claims[:claims.index("### 1. ")], re.M):
        known = {float(value) for value in re.findall(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?", figures)}
        today = re.search(rf"^\| {number} \| [^|]+ \| [^|]+ \| ([^|]+) \|$", brief, re.M).group(1)
        for text in re.findall(r"\d+(?:\.\d+)?", today):
            half = 0.5 * 10.0 ** -len(text.partition(".")[2]) + 1e-9
            assert any(abs(float(text) - other) <= half or float(text) == float(f"{other:.2g}") for other in known), (number, text)
        rows[number] = f"| {number} | {title} | {verdict} |"
    assert len(rows) == 17
    counts = collections.Counter(row.split("|")[3].strip(" *") for row in rows.values())
    return [*rows.values(), f"{COUNTS[counts['holds']]} hold today, {COUNTS[counts['changed']]} have changed, and {COUNTS[counts['not settled']]} are [not settled]"]


@sentence(RESULTS)
def iterations_in_brief(runs):
    time = {name: runs.full.value("humanoid", name, 1, "step_time") for name in ("mujoco-euler", "physx-d6-pgs4", "physx-d6-pgs")}
    four, fifty = (time[name] / time["mujoco-euler"] for name in ("physx-d6-pgs4", "physx-d6-pgs"))
    return f"PhysX takes {four:.2f} times MuJoCo's step on the humanoid with its own 4, and {fifty:.1f} times with 50."


def times_of_own_defaults(runs):
    """{contender with 50 sweeps: its step time over that of the engine's own defaults}, on the humanoid at 1 ms."""
    pairs = {"bullet-si-f64": "bullet-default", "ode-quick": "ode-default", "physx-d6-pgs": "physx-d6-pgs4", "jolt-f32": "jolt-default"}
    time = runs.full.values("humanoid", 1, "step_time")
    return {tuned: time[tuned] / time[own] for tuned, own in pairs.items()}


@sentence(RESULTS)
def sweeps_of_the_robots_in_brief(runs):
    times = times_of_own_defaults(runs).values()
    return f"on the paper's humanoid {digits(min(times))} to {digits(max(times))} times the time of their own defaults."


@sentence("docs/lab/robots.md")
def sweeps_of_the_robots(runs):
    bullet, ode, physx, jolt = map(digits, times_of_own_defaults(runs).values())
    time = runs.full.values("humanoid", 1, "step_time")
    return (f"On the paper's humanoid at 1 ms that takes {bullet} (rigid bodies), {ode}, {physx} (D6 joints) and {jolt} times as long as their own defaults;"
            f" MuJoCo's own take {digits(time['mujoco-default'] / time['mujoco-euler'])} times the time of `mujoco-euler`.")


@sentence("docs/lab/robots.md")
def windows_of_one_step(runs):
    systems = {system for system, in runs.robots.db.execute(
        "SELECT c.system FROM cells c JOIN samples s ON s.cell_id = c.id WHERE s.name = 'window_steps' GROUP BY c.id HAVING max(s.value) = 1")}
    assert systems == {"g1", "talos", "romeo", "tiago", "humanoid-cmu"}, systems
    return "G1, Talos, Romeo, Tiago and humanoid-cmu have 16 windows of one step each, after two untimed ones"


@sentence(RESULTS)
def softness_in_brief(runs):
    first = runs.full.fastest("humanoid", consistency=MM)[0]
    return f"the fastest contender within 1 mm on the humanoid sinks in by {1e3 * first.worst['penetration_max']:.0f} mm."


@sentence(RESULTS)
def misrankings_in_brief(runs):
    short, long = (self_consistency.inversions(self_consistency.rankings(runs.full.db, length)[0][30]) for length in (128, 2048))
    assert not long[1]
    return f"misrank {len(short[1])} of {short[0]} clearly different pairs at 30 times real time; pieces of 2 s none of {long[0]}"


@sentence(CLAIMS)
def havok_is_the_largest(runs):
    for system in ("planar-chain", "humanoid", "capsules-27"):
        error = {}
        for name in ("mujoco-euler", "mujoco-rk4", "bullet-si-f64", "ode-quick", "physx-d6-pgs", "havok"):
            bound = runs.full.value(system, name, 1, "consistency_bound")
            error[name] = runs.full.value(system, name, 1, "consistency") if bound is None else bound
        assert max(error, key=error.get) == "havok", (system, error)
    return "Havok has the largest figure of these in every column"


@sentence(RESULTS)
def explicit_dampers(runs):
    run, held = runs.full, collections.Counter()
    for contender in run.cells("grasp"):
        facts, = run.db.execute("SELECT capabilities_json FROM contenders WHERE name = ?", (contender,)).fetchone()
        if json.loads(facts).get("springs") == "explicit" and (of := run.holds_up_to(contender)):
            held[of[0]] += 1
    words = {3: "three", 4: "four", 6: "six", 7: "seven"}
    assert set(held) == {0, 0.125, 0.25, 0.5} and held[0] == 1 and run.holds_up_to("havok-default")[0] == 0, held
    return (f"Of {sum(held.values())} explicit contenders {words[held[0.5]]} hold it up to 1/2 ms, {words[held[0.25]]} up to 1/4 ms, {words[held[0.125]]} up to 1/8 ms and"
            f" `havok-default` at no timestep; none holds it at 1 ms")


@sentence(RESULTS)
def implicit_dampers(runs):
    def held(name):
        return runs.full.holds_up_to(name)
    assert held("ode-step-native-pd")[1]
    return (f"`ode-quick` {held('ode-quick-native-pd')[0]:g} instead of {fractions.Fraction(held('ode-quick')[0])} ms, `ode-step` {held('ode-step-native-pd')[0]:g} (the"
            f" largest timestep tried) instead of {fractions.Fraction(held('ode-step')[0])}, `physx-d6-pgs` {held('physx-d6-pgs-native-pd')[0]:g} instead of"
            f" {fractions.Fraction(held('physx-d6-pgs')[0])}, `havok` {held('havok-native-pd')[0]:g} instead of {fractions.Fraction(held('havok')[0])}.")


# ---- docs/lab/settings.md ------------------------------------------------------------------------------------------------

SETTINGS = "docs/lab/settings.md"


def with_settings(run, system, **limits):
    """{contender: (its own fastest point, the fastest of all its settings)} of contenders that have either."""
    found = {}
    for point in run.fastest(system, **limits):
        base = point.contender.partition(" ")[0]
        own, best = found.get(base, (None, None))
        found[base] = (point if point.contender == base else own, best or point)
    return found


@sentence(RESULTS)
def gains_on_the_pile(runs):
    run = runs.settings
    found = with_settings(run, "capsules-27", consistency=MM)
    counted = [name for name in run.contenders if " " not in name and any(
        outcome != "withdrawn" for cells in run.cells("capsules-27")[name].values() for measure, (outcome, _) in cells.items() if measure == "consistency")]
    gains, anew = [], []
    for name in counted:
        own, best = found.get(name, (None, None))
        if own is None and best is not None:
            anew.append(name)
        elif best is not None and best.contender != name and not overlap(run, "capsules-27", best, own):
            gains.append(best.speed / own.speed)
    assert anew == ["physx-d6-tgs"] and min(gains) > 1
    return (f"On the pile {COUNTS[len(gains) + len(anew)]} of {COUNTS[len(counted)]} contenders are faster with settings of the campaign than with their own,"
            f" {COUNTS[len(gains)]} of them {min(gains):.1f} to {max(gains):.1f} times (the other, `physx-d6-tgs`, meets the limit only with the campaign's)")


def overlap(run, system, best, own):
    """Whether a point of the same timestep is no faster by what both intervals tell."""
    if best.timestep != own.timestep:
        return False

    def end(point, which):
        return speed_at({h: cells["raw_speed"][1]["realtime_factor"][which] for h, cells in run.cells(system)[point.contender].items()
                         if "realtime_factor" in cells.get("raw_speed", ("", {}))[1]}, point.timestep)
    return end(best, 1) <= end(own, 2)


@sentence(RESULTS)
def hard_contacts_of_mujoco(runs):
    speed = {}
    for system in ("capsules-27", "humanoid"):
        own = with_settings(runs.settings, system, consistency=MM)["mujoco-euler"][0]
        hard = with_settings(runs.settings, system, consistency=MM, penetration_max=5 * MM)["mujoco-euler"][1]
        assert "contact_timeconst=0.002" in hard.contender
        speed[system] = f"{digits(hard.speed)} in place of {digits(own.speed)}"
    return f"{speed['capsules-27']} times real time on the pile, {speed['humanoid']} on the humanoid ([tables](lab/settings.md))"


@sentence(SETTINGS)
def no_interval_lies_below(runs):
    run = runs.settings
    for own, best in with_settings(run, "capsules-27", consistency=MM).values():
        for point in (own, best):
            if point:
                high = run.cells("capsules-27")[point.contender][point.timestep]["consistency"][1]["consistency"][2]
                assert high > MM, (point, high)
    return "On the pile no point of the first two columns has an error whose 95 % interval lies below 1 mm"


@sentence(SETTINGS)
def half_widths(runs):
    halves = [max(high / value, value / low) - 1 for value, low, high in runs.settings.db.execute(
        "SELECT value, low, high FROM \"values\" WHERE name = 'step_time' AND low > 0")]
    return f"speeds are good to {100 * statistics.median(halves):.0f} % in the median and to {100 * max(halves):.0f} % at worst (95 % intervals of two processes)"


# ---- docs/lab/engines.md: the run with the newer engines ----------------------------------------------------------------

NEWER = ("drake-sap", "dartpy", "sapien-tgs", "superdex", "box3d")  # contenders of the engines that came or changed


def by_value(found, contenders, text):
    """1 mm with `a`, 2 mm with `b` and 3 mm with `c`."""
    return listed(f"{text(found[name])} with `{name}`" for name in sorted(contenders, key=found.get))


def with_values(found, contenders):
    """`a` (1 mm), `b` (2 mm) and `c` (3 mm)."""
    return listed(f"`{name}` ({quantity(found[name])})" for name in contenders)


@sentence(FIELD)
def what_the_newer_run_is(runs):
    run = runs.newer_field
    touching = [facts for name, facts in run.facts.items() if name in ("humanoid", "grasp", "capsules-27")]
    states, = {facts["initial_states"]["count"] for facts in touching}
    length, = {facts["duration_s"] for facts in touching}
    pieces, = {facts["piece_ms"] for facts in touching if "consistency" in facts["measures"]}
    fine, = {facts["reference_ms"] for facts in touching if "consistency" in facts["measures"]}
    engines = {engine_tables.family(run.engine(name)) for name in run.contenders}
    number = {3: "three"}[states]
    return (f"{len(run.contenders)} contenders of {len(engines)} engines; where bodies touch {number} initial states, motions of {length:g} s, pieces of"
            f" {ms(pieces)} and fine-step runs at {ms(fine)} for all.")


@sentence(FIELD)
def the_newer_on_the_chain(runs):
    error = runs.newer_field.values("spatial-chain", 1, "truth_error_max")
    return f"On the chain at 1 ms the error is {by_value(error, NEWER, quantity)}."


@sentence(FIELD)
def the_newer_keep_energy(runs):
    drift = runs.newer_field.values("astronaut-energy", 4, "energy_drift_relative")
    return f"The astronaut's energy drifts at 4 ms by {by_value(drift, NEWER, lambda value: f'{100 * value:.2g} %')}."


@sentence(FIELD)
def who_holds_longest(runs):
    found, at_the_end = by_held(runs.newer_field)
    longest = [h for h in sorted(found, reverse=True) if h >= 4]
    parts = [f"up to {ms(h)}{', the largest timestep tried,' if set(found[h]) <= set(at_the_end) else ''} by {names(found[h])}" for h in longest]
    return "The object is held " + "; ".join(parts) + "."


@sentence(FIELD)
def own_drives_against_explicit_dampers(runs):
    run, alike = runs.newer_field, collections.defaultdict(list)
    held = {name: run.holds_up_to(name)[0] for name in run.contenders if name in run.cells("grasp") and run.holds_up_to(name)}
    for name in held:
        base = name.removesuffix("-native-pd")
        if base != name and base in held:
            alike[held[name], held[base]].append(base)
    texts = [f"from {f'up to {ms(explicit)}' if explicit else 'no timestep tried'} to up to {ms(own)} with {names(bases)}" for (own, explicit), bases in
             sorted(alike.items(), reverse=True)]
    return "The engine's own drives in place of explicit dampers raise this " + "; ".join(texts) + "."


@sentence(FIELD)
def means_and_medians(runs):
    """Of the self-consistency error, of contenders whose mean is no bound."""
    run, ratios = runs.newer_field, {}
    for system in ("humanoid", "capsules-27"):
        mean, median, floor = (run.values(system, 1, "consistency_cold" + name) for name in ("", "_median", "_floor"))
        ratios[system] = {name: mean[name] / median[name] for name in mean if name not in floor}
    mean, median = (run.values("humanoid", 1, "consistency_cold" + name) for name in ("", "_median"))
    low, high = min(ratios["humanoid"].values()), max(ratios["humanoid"].values())
    gaps = [of["physx-art-tgs4"] / of["mujoco-euler"] for of in (mean, median)]
    return (f"on the humanoid at 1 ms the mean is {digits(low)} to {digits(high)} times the median, in the pile {digits(min(ratios['capsules-27'].values()))} to"
            f" {digits(max(ratios['capsules-27'].values()))} times. So `physx-art-tgs4` is {digits(gaps[0])} times as far off as `mujoco-euler` on the humanoid by the"
            f" mean ({digits(1e3 * mean['physx-art-tgs4'])} and {digits(1e3 * mean['mujoco-euler'])} mm) and {digits(gaps[1])} times by the median"
            f" ({digits(1e3 * median['physx-art-tgs4'])} and {digits(1e3 * median['mujoco-euler'])}).")


@sentence(FIELD)
def depths_of_the_newer_run(runs):
    run, texts = runs.newer_field, []
    for system, words in (("humanoid", "On the humanoid at 1 ms"), ("capsules-27", "in the pile")):
        depth = run.values(system, 1, "penetration_max")
        order = sorted(depth, key=depth.get)
        texts.append(f"{words} bodies sink in least with {with_values(depth, order[:3])}, most with {with_values(depth, order[-2:])}")
    return "; ".join(texts) + "."


@sentence(FIELD)
def steps_of_the_newer_run(runs):
    run = runs.newer_field
    widths = sorted(values["step_time"][2] / values["step_time"][0] for system in run.facts for steps in run.cells(system).values()
                    for cells in steps.values() for outcome, values in cells.values() if outcome == "ok" and "step_time" in values)
    shown = []
    for name in ("mujoco-euler", "box3d", "dartpy", "sapien-tgs", "drake-sap"):
        value, low, high = run.cells("humanoid")[name][1]["raw_speed"][1]["step_time"]
        shown.append(f"`{name}` {digits(value)} µs [{digits(low)}, {digits(high)}]")
    return (f"The clock was disturbed: half of the intervals of step times reach {100 * (statistics.median(widths) - 1):.0f} % or"
            f" more above the value, so most orders of speed in this run are not settled. A step of the humanoid at 1 ms takes {', '.join(shown)}.")


# ---- docs/lab/engines.md: many worlds ------------------------------------------------------------------------------------

@sentence(FIELD)
def most_world_steps(runs):
    run = runs.worlds
    rate = {(system, contender, measure): value for system, contender, measure, value in run.db.execute(
        "SELECT c.system, c.contender, c.measure, v.value FROM cells c JOIN \"values\" v ON v.cell_id = c.id"
        " WHERE c.outcome = 'ok' AND v.name = 'batch_rate'")}

    def most(system, among=None):
        return max(((value, contender, measure) for (of, contender, measure), value in rate.items()
                    if of == system and (among is None or contender in among)))
    at_once = ("mujoco-warp", "newton-steel", "newton-mujoco", "mjx", "genesis")
    chain, humanoid = most("planar-chain"), most("humanoid")
    assert chain[1:] == humanoid[1:] == ("mujoco-euler", "batch-16")
    together, others = most("planar-chain", at_once), most("humanoid", at_once)
    assert together[1] == "newton-steel" and others[1] == "genesis"
    return (f"MuJoCo makes the most: up to {digits(chain[0] / 1e6)} million chain steps and {digits(humanoid[0] / 1e3)} thousand humanoid steps a second (16 worlds, two"
            f" cores). Of those that step all worlds in one call, `newton-steel` makes the most on the chain ({digits(together[0] / 1e3)} thousand), Genesis on the"
            f" humanoid ({digits(others[0] / 1e3)} thousand), on one.")


# ---- docs/results.md and docs/lab/contact-truth.md: contacts ---------------------------------------------------------------------------------------


def off(runs, system, contender, timestep=1):
    """The largest distance to the certified solution, m."""
    error = runs.contacts.value(system, contender, timestep, "truth_error_max")
    assert error is not None, (system, contender, timestep)
    return error


def mm(error):
    return f"{1e3 * error:.0f}" if error >= 0.0995 else digits(1e3 * error)


def alike(runs, system, contenders, timestep=1):
    """In mm, of contenders that have the same in the digits of the page."""
    shown = {mm(off(runs, system, contender, timestep)) for contender in contenders}
    assert len(shown) == 1, (system, shown)
    return shown.pop()


def floors(runs, system, *contenders):
    """That the errors do not shrink with the timestep."""
    for contender in contenders:
        assert runs.contacts.value(system, contender, 1 / 16, "truth_floor") is not None, (system, contender)


@sentence(RESULTS)
def how_many_are_close(runs):
    run, best = runs.contacts, {}
    for engine, names_ in contact_tables.SHOWN.items():
        errors = {name: [error for system in run.facts if (error := run.value(system, name, 1, "truth_error_max")) is not None] for name in names_}
        counted = {name: sum(error <= MM for error in of) for name, of in errors.items() if of}
        if counted:
            name = max(counted, key=counted.get)
            best[name] = counted[name]
    order = sorted(best, key=lambda name: -best[name])
    first, *rest = order
    return (f"At 1 ms `{first}` is within 1 mm on {best[first]} of the {len(run.facts)} systems, " +
            ", ".join(f"`{name}` on {best[name]}" for name in rest[:-1]) + f" and `{rest[-1]}` on {best[rest[-1]]}; for each engine the best of the contenders in the [tables](lab/contact-truth.md#errors).")


@sentence(CONTACTS)
def no_contender_on_the_wheel(runs):
    error = runs.contacts.values("rimless-wheel", 1, "truth_error_max")
    fine = runs.contacts.values("rimless-wheel", 1 / 16, "truth_error_max")
    assert min(error.values()) > MM
    least = min(error, key=error.get)
    close = [name for name in runs.contacts.contenders if fine.get(name, 1) <= MM]
    return (f"On the rimless wheel no contender is within 1 mm at 1 ms: `{least}` is at {1e3 * error[least]:.2f} mm, `dart` at {mm(error['dart'])}, `ode-quick` at"
            f" {mm(error['ode-quick'])}, `mujoco-default` at {mm(error['mujoco-default'])}. At 1/16 ms {names(close)} are.")


@sentence(RESULTS)
def the_pyramid_inside(runs):
    box = contact_tables.SlidingBox()
    error, way = off(runs, "sliding-box", "mujoco-default", 1 / 16), box.way()
    floors(runs, "sliding-box", "mujoco-default", "mujoco-euler-elliptic")
    assert math.hypot(*box.pyramid_inside()) > 1.3 * way
    return (f"At 1/16 ms `mujoco-default` ends {mm(error)} mm off, {100 * error / way:.0f} % of the box's way of {1e3 * way:.0f} mm, beyond the point where it stops, because its"
            f" pyramid lies inside the cone. With the elliptic cone (`mujoco-euler-elliptic`) {mm(off(runs, 'sliding-box', 'mujoco-euler-elliptic', 1 / 16))} mm are left.")


@sentence(RESULTS)
def the_pyramid_around(runs):
    box, same = contact_tables.SlidingBox(), ("ode-quick", "ode-default", "ode-step", "dart-default", "dartpy")
    floors(runs, "sliding-box", *same)
    assert math.hypot(*box.pyramid_around()) < 0.8 * box.way()
    return (f"ODE, `dart-default` and `dartpy` end {alike(runs, 'sliding-box', same, 1 / 16)} mm off, short of that point, because their pyramid lies around the cone. `dart` turns the pyramid"
            f" along the slip, and is within {mm(off(runs, 'sliding-box', 'dart', 1 / 16))} mm.")


@sentence(RESULTS)
def two_directions_scaled(runs):
    box = contact_tables.SlidingBox()
    same = ("havok", "havok-default", "jolt-f32", "jolt-f64", "jolt-default", "box3d", "box3d-default", "rapier-default")
    floors(runs, "sliding-box", *same)
    x, y = box.scaled()
    straight = math.degrees(math.atan2(box.vy, box.vx))
    return (f"Havok, Jolt, Box3D and `rapier-default` end {alike(runs, 'sliding-box', same, 1 / 16)} mm off, to the side: friction has the right size and a wrong direction, and"
            f" the box comes to rest at {math.degrees(math.atan2(y, x)):.0f}° in place of {straight:.0f}°.")


@sentence(CONTACTS)
def others_on_the_box(runs):
    floors(runs, "sliding-box", "rapier-impulse-f64", "bullet-mb", "bullet-si-f64")
    floors(runs, "incline-boxes", "rapier-impulse-f64")
    return (f"`rapier-impulse-f64` is {mm(off(runs, 'sliding-box', 'rapier-impulse-f64', 1 / 16))} mm off on this box and"
            f" {mm(off(runs, 'incline-boxes', 'rapier-impulse-f64', 1 / 16))} mm on the slope, where `rapier-default` is within"
            f" {mm(off(runs, 'incline-boxes', 'rapier-default', 1 / 16))} mm; `bullet-mb` {mm(off(runs, 'sliding-box', 'bullet-mb', 1 / 16))} mm on this box and"
            f" {mm(off(runs, 'incline-boxes', 'bullet-mb', 1 / 16))} mm on the slope.")


@sentence(RESULTS)
def who_follows_the_cone(runs):
    error = runs.contacts.values("sliding-box", 1, "truth_error_max")
    close = [name for name in runs.contacts.contenders if error.get(name, 1) <= MM]
    engines = sorted({runs.contacts.engine(name) for name in close})
    assert engines == ["dart", "physx", "physx56", "sapien"], engines
    assert all(name in close for name in runs.contacts.contenders if runs.contacts.engine(name) in engines[1:] and name in error)
    assert [name for name in close if runs.contacts.engine(name) == "dart"] == ["dart", "dart-pgs"]
    fine = [1e3 * off(runs, "sliding-box", name, 1) for name in close]
    return f"Within 1 mm at 1 ms are all contenders of PhysX 5.1, PhysX 5.6 and SAPIEN, `dart` and `dart-pgs` ({min(fine):.2f} to {max(fine):.2f} mm)."


@sentence(RESULTS)
def rolling(runs):
    error = runs.contacts.values("rolling", 1, "truth_error_max")
    far = [name for name in runs.contacts.contenders if error.get(name, 0) > MM]
    braked = ["havok", "havok-default", "jolt-default"]
    prisms = [name for name in far if name not in braked]
    assert all(name.startswith(("physx56", "sapien", "box3d")) for name in prisms) and set(braked) < set(far), far
    floors(runs, "rolling", *braked)
    rest = max(value for name, value in error.items() if name not in far)
    return (f"Bodies that roll down a slope are {mm(error['havok'])} mm off with `havok` and `havok-default` and {mm(error['jolt-default'])} mm with `jolt-default` at 1 ms, and a"
            f" smaller step does not help. PhysX 5.6, SAPIEN and Box3D, where a cylinder is a prism, are {mm(min(error[name] for name in prisms))} to"
            f" {mm(max(error[name] for name in prisms))} mm off; all others {mm(rest)} mm at most.") if mm(error["havok"]) == mm(error["havok-default"]) else "two figures for Havok"


@sentence(CONTACTS)
def the_rod_sticks(runs):
    error = runs.contacts.values("rod-strike-sticks", 1, "truth_error_max")
    close = [name for name in runs.contacts.contenders if error.get(name, 1) <= 0.2 * MM]
    floors(runs, "rod-strike-sticks", "havok", "rapier-impulse-f64", "mujoco-default")
    ode = [off(runs, "rod-strike-sticks", "ode-quick", h) for h in (1, 1 / 4, 1 / 16)]
    assert [mm(off(runs, "rod-strike-sticks", "dart", h)) for h in (1, 1 / 4, 1 / 16)] == [mm(value) for value in ode]
    return (f"{names(close)} are within 0.2 mm at 1 ms; `mujoco-default` is {mm(error['mujoco-default'])} mm off, `rapier-impulse-f64` {mm(error['rapier-impulse-f64'])},"
            f" `havok` {mm(error['havok'])}, and these do not shrink. `ode-quick` and `dart` are {mm(ode[0])} mm off at 1 ms, {mm(ode[1])} at 1/4 and {mm(ode[2])} at 1/16:")


@sentence(RESULTS)
def softness(runs):
    shown = {}
    for system in ("joint-stops", "ball-row", "rod-strike-sticks", "box-stack"):
        floors(runs, system, "mujoco-default")
        shown[system] = off(runs, system, "mujoco-default")
    return (f"At 1 ms `mujoco-default` is off by {mm(shown['joint-stops'])} mm on the joints' stops, {mm(shown['ball-row'])} mm on the row of balls, {mm(shown['rod-strike-sticks'])} mm on the"
            f" rod that sticks and {mm(shown['box-stack'])} mm on the stack, and a smaller step does not help:")


@sentence(CONTACTS)
def the_grip(runs):
    error = runs.contacts.values("grip-holds", 1, "truth_error_max")
    still = [name for engine in contact_tables.SHOWN.values() for name in engine if error.get(name, 1) <= 0.1 * MM]
    return (f"At 1 ms {names(still)} are within 0.1 mm of rest. `mujoco-default` is {mm(error['mujoco-default'])} mm off, `mujoco-euler-elliptic` by"
            f" {mm(error['mujoco-euler-elliptic'])} and `mujoco-euler-noslip` by {mm(error['mujoco-euler-noslip'])}, `bullet-default` by {mm(error['bullet-default'])}, `rapier-default` by"
            f" {mm(error['rapier-default'])}, `havok-default` by {mm(error['havok-default'])}, `box3d-default` by {mm(error['box3d-default'])}."
            f" {drake_grips(runs)}")


def drake_grips(runs):
    dropped = {name: {h for h in (4, 1, 1 / 4, 1 / 16) if off(runs, "grip-holds", name, h) > 1} for name in ("drake-sap", "drake-similar", "drake-lagged")}
    assert dropped == {"drake-sap": {4, 1, 1 / 4, 1 / 16}, "drake-similar": {4, 1, 1 / 4, 1 / 16}, "drake-lagged": {4, 1 / 16}}, dropped
    held = [mm(off(runs, "grip-holds", "drake-lagged", h)) for h in (1, 1 / 4)]
    return ("Drake has one contact point for each pair of shapes (its hydroelastic contact was not used): `drake-sap` and `drake-similar` drop the box at every"
            f" timestep, `drake-lagged` at 4 and 1/16 ms, and is {held[0]} and {held[1]} mm off at 1 and 1/4.")


@sentence(CONTACTS)
def an_exact_solver_gives_up(runs):
    cells = runs.contacts.cells("grip-holds")["ode-step"]
    assert {h: at["truth"][0] for h, at in cells.items()} == {1 / 16: "ok", 1 / 4: "diverged", 1: "diverged", 4: "diverged"}
    other = [(system, name, h) for system in runs.contacts.facts for name, steps in runs.contacts.cells(system).items() for h, at in steps.items()
             for outcome, _ in at.values() if outcome not in ("ok", "unsupported") and (system, name) != ("grip-holds", "ode-step")]
    assert set(other) == {("incline-boxes", "drake-lagged", 4)}, other
    return ("`ode-step` gives up on the grip at 1/4, 1 and 4 ms (its exact solver finds no solution). On the slope a box sinks wholly into the ground in `drake-lagged`"
            " at 4 ms. No other run of the campaign failed.")


@sentence(CONTACTS)
def the_slipping_grip(runs):
    assert 0.9 < runs.contacts.value("grip-slips", "dart", 1, "truth_order") < 1.1
    floors(runs, "grip-slips", "rapier-impulse-f64")
    return (f"Where the grip slips, `dart` is {mm(off(runs, 'grip-slips', 'dart'))} mm off at 1 ms and {mm(off(runs, 'grip-slips', 'dart', 1 / 16))} at 1/16, in first order;"
            f" `rapier-impulse-f64` keeps {mm(off(runs, 'grip-slips', 'rapier-impulse-f64'))} mm.")


@sentence(CONTACTS)
def the_closed_loop(runs):
    error = runs.contacts.values("four-bar", 1, "truth_error_max")
    far = {name for name in error if error[name] > 2 * MM}
    assert far == {"havok", "havok-default", "jolt-f32", "jolt-f64", "jolt-default", "box3d-default"}, far
    floors(runs, "four-bar", "havok")
    assert len({mm(error[name]) for name in far if name.startswith("jolt")}) == 1
    assert 0.9 < runs.contacts.value("four-bar", "jolt-f64", 1, "truth_order") < 1.1
    rest = max(value for name, value in error.items() if name not in far)
    cells = runs.contacts.cells("four-bar")
    assert {runs.contacts.engine(name) for name in cells if cells[name][1].get("truth", ("",))[0] == "unsupported"} == {"bullet-f64", "dart", "dartpy"}
    havok = [off(runs, "four-bar", "havok", h) for h in cells["havok"]]
    return (f"`havok` is {mm(min(havok))} to {mm(max(havok))} mm off at every timestep, `havok-default` {mm(error['havok-default'])} mm and `box3d-default` {mm(error['box3d-default'])} at 1 ms; Jolt's three contenders are {mm(error['jolt-f64'])} mm off at 1 ms, in first order; the others are within {mm(rest)} mm at 1 ms."
            " The adapters of Bullet's rigid bodies and of DART refuse it.")


@sentence(RESULTS)
def smaller_is_not_always_better(runs):
    return (f"`physx-d6-tgs` goes from {mm(off(runs, 'ball-row', 'physx-d6-tgs'))} mm at 1 ms to {mm(off(runs, 'ball-row', 'physx-d6-tgs', 1 / 16))} at 1/16 on"
            f" the row of balls, `bullet-default` from {mm(off(runs, 'rimless-wheel', 'bullet-default'))} to {mm(off(runs, 'rimless-wheel', 'bullet-default', 1 / 16))} on the"
            " wheel.")


# ---- policies --------------------------------------------------------------------------------------------------------

def transfer_values(runs, contender):
    return {name: value for name, (value, _, _) in runs.quadruped.cells("policy")[contender][5]["transfer"][1].items()}


@sentence("docs/lab/policies.md")
def policies_of_the_quadruped(runs):
    rows = []
    for contender in runs.quadruped.contenders:
        if contender not in runs.quadruped.cells("policy"):
            continue
        of = transfer_values(runs, contender)
        training = contender == "mujoco-euler"
        parts = "" if training else "never, in 10 s" if of["policy_parting_time"] == 10 else f"{1e3 * of['policy_parting_time']:.0f} ms"
        if contender == "drake-sap":
            continue  # the page shows drake-similar and drake-lagged
        rows.append(f"| `{contender}`{' (training)' if training else ''} | {of['velocity_error']:.3f} m/s | {of['turning_error']:.3f} rad/s |"
                    f" {of['foot_slip']:.3f} m/s | {of['joint_power']:.1f} W | {parts} |".replace("|  |", "| |"))
    return rows


def slow_quadruped(runs):
    return {h: {name: value for name, (value, _, _) in at["transfer"][1].items()} for h, at in runs.quadruped_20ms.cells("policy")["mujoco-euler"].items()}


def share(of):
    return f"{100 * of['value']:.0f} % [{100 * of['low']:.0f}, {100 * of['high']:.0f}]"


def explanation(runs):
    return json.loads((ROOT / "results" / runs.folder("quadruped_20ms") / "explain.json").read_text("utf-8"))


@sentence("README.md")
def falls_at_20_ms(runs):
    assert slow_quadruped(runs)[20]["fall_rate"] == 1
    return "At 20 ms the robot falls even in MuJoCo, in all 20 runs"


@sentence("README.md")
def why_it_falls(runs):
    first = explanation(runs)["advice"][0]
    assert first["changes_b"] == ["law=engine"]
    return f'an implicit one (`law = "engine"`) closes {share(first["share_with_those_before"])} of the gap'


@sentence("docs/guide.md")
def a_fall_and_its_hint(runs):
    slow, trained = slow_quadruped(runs)[20], slow_quadruped(runs)[5]
    assert slow["fall_rate"] == 1 and trained["fall_rate"] == 0
    return (f"At 5 ms `mujoco-euler` stays up in all 20 runs; at 20 ms it falls in all 20 runs, after {slow['time_up']:.2f} s in the mean"
            f" ([run](../results/{runs.folder('quadruped_20ms')}/README.md)). The matrix has a first hint: the joints take {slow['joint_power'] / 1e3:.1f} kW instead of"
            f" {trained['joint_power']:.0f} W.")


@sentence("docs/guide.md")
def advice(runs):
    of = explanation(runs)
    law, step = of["causes"][:2]
    assert [law["changes_b"], step["changes_b"]] == [["law=engine"], ["timestep=0.5"]] == [each["changes_b"] for each in of["advice"]]
    assert law["fall_rate_b"] == step["fall_rate_b"] == 0 and of["starts"] == 10
    return (f'B with law = "engine" closes {share(law["share"])} of the gap. 2. Timestep: use a timestep of 10 ms in B. B at half the timestep closes'
            f" {share(step['share'])} of the gap; with those before {share(of['advice'][1]['share_with_those_before'])}.")


@sentence("docs/lab/policies.md")
def first_bodies(runs):
    when = statistics.median(runs.quadruped.samples("policy", "bullet-mb", 5, "transfer", "parting_s of states"))
    return f"which is earlier: {1e3 * when:.0f} ms with `bullet-mb`."


EXCESSES = {"velocity_error": "is {} times as far from the velocity", "turning_error": "is {} times as far from the turning rate",
            "foot_slip": "slips {} times as much", "joint_power": "takes {} times as much power"}


def excesses(of, trained):
    """By the rule of docs/methodology.md, "Policies": {value: times} of those that are twice that of training by the near ends, too."""
    both = [name for name in EXCESSES if name in of and name in trained and trained[name][2]]
    return {name: of[name][0] / trained[name][0] for name in both if of[name][1] >= 2 * trained[name][2]}


@sentence("docs/lab/policies.md")
def the_worst_follower(runs):
    cells = {contender: steps[5]["transfer"][1] for contender, steps in runs.quadruped.cells("policy").items()}
    found = {contender: excesses(of, cells["mujoco-euler"]) for contender, of in cells.items()}
    assert [contender for contender, of in found.items() if of] == ["drake-lagged"]
    *parts, last = (EXCESSES[name].format(f"{times:.2g}") for name, times in sorted(found["drake-lagged"].items(), key=lambda each: -each[1]))
    return (f"`drake-lagged` stays up, but worse (`!`): it {', '.join(parts)} and {last.removeprefix('is ')} as `mujoco-euler`, because its friction is bounded")


def falls_of(run, system, h=5):
    """{contender: falls} of 200 runs."""
    return {contender: round(sum(run.samples(system, contender, h, "transfer", "fall_rate of states"))) for contender in run.cells(system)}


def same_share(a, b, runs=200):
    """The rank test's p-value of a and b falls in as many runs each (docs/methodology.md, "Policies")."""
    both = a + b
    z = max(0, runs * abs(a - b) - 1) * math.sqrt((2 * runs - 1) / (runs * runs * both * (2 * runs - both)))
    return math.erfc(z / math.sqrt(2))


def told_apart(falls):
    """{contender: p} against training, after Benjamini and Hochberg."""
    p = {contender: same_share(count, falls["mujoco-euler"]) for contender, count in falls.items() if contender != "mujoco-euler"}
    order = sorted(p, key=p.get)
    return {name: min(p[other] * len(p) / (i + 1) for i, other in enumerate(order) if i >= order.index(name)) for name in p}


def percents(of):
    return f"{100 * of[1]:.0f} to {100 * of[2]:.0f} %"


@sentence("docs/lab/policies.md")
def pushed_on_rough_ground(runs):
    run = runs.quadruped_rough
    cells = {contender: steps[5]["transfer"][1] for contender, steps in run.cells("rough").items()}
    falls = falls_of(run, "rough")
    p, rows = told_apart(falls), []
    assert all(value <= 0.05 for value in p.values()) and all(told_apart({name: falls[name] for name in ("mujoco-euler", f"mujoco-euler-{kind}")})[f"mujoco-euler-{kind}"] <= 0.05 for kind in ("elliptic", "noslip"))
    assert min(falls, key=falls.get) == "drake-lagged" and 2 < max(falls.values()) / falls["mujoco-euler"] < 2.5
    for contender in sorted(falls, key=lambda each: (falls[each], each)):
        of = cells[contender]
        worse = excesses(of, cells["mujoco-euler"])
        assert round(200 * of["fall_rate"][0]) == falls[contender] and list(worse) == (["foot_slip"] if contender == "drake-lagged" else [])
        mark = "(training)"
        if contender in p:
            mark = f"falls {'more' if falls[contender] > falls['mujoco-euler'] else 'less'} often, p {'< 0.001' if p[contender] < 0.001 else f'= {p[contender]:.1g}'}"
        if worse:
            mark += f"; slips {worse['foot_slip']:.2g} times as much"
        rows.append(f"| `{contender}` | {100 * of['fall_rate'][0]:.1f} % | {percents(of['fall_rate'])} | {mark} | {of['time_up'][0]:.1f} s |"
                    f" {of['velocity_error'][0]:.2f} m/s | {of['foot_slip'][0]:.2f} m/s |")
    return rows


@sentence("docs/guide.md")
def shares_of_falls_on_rough_ground(runs):
    falls = falls_of(runs.quadruped_rough, "rough").values()
    return f"and falls in {min(falls) / 2:.0f} to {max(falls) / 2:.0f} % of the runs on [rough ground with pushes]"


@sentence("docs/lab/policies.md")
def what_falls_on_rough_ground_depend_on(runs):
    run = runs.quadruped_rough
    rough, finer, level = falls_of(run, "rough"), falls_of(run, "rough-finer", 2.5), falls_of(run, "level")
    moved = max(abs(rough[contender] - count) for contender, count in finer.items())
    p = told_apart(level)
    assert p["ode-step"] <= 0.05 < p["bullet-mb"]
    return [*(f"| `{contender}` | {rough[contender] / 2:.1f} % | {finer[contender] / 2:.1f} % | {level[contender] / 2:.1f} % |" for contender in ("mujoco-euler", "bullet-mb", "ode-step")),
            f"at half the timestep the shares move by at most {moved / 2:.1g} of 100",
            f"{rough['mujoco-euler'] / 2:.0f} % of its runs with its own friction, {rough['mujoco-euler-elliptic'] / 2:.0f} % with the elliptic cone and {rough['mujoco-euler-noslip'] / 2:.0f} % without creep"]


@sentence("docs/lab/policies.md")
def cart_poles(runs):
    cells = [(contender, values) for contender, steps in runs.cart_pole.cells("policy").items() for at in steps.values() for _, values in at.values()]
    assert all(values["fall_rate"][0] == 0 for _, values in cells) and 20 * len(cells) == 660
    apart = {contender: values["policy_parting_time"][0] for contender, values in cells if values["policy_parting_time"][0] < 10}
    assert set(apart) == {"havok"}
    times = [values["policy_parting_time"][0] for contender, values in cells if contender == "havok"]
    return f"Ten of them stay within 1 mm of the run in MuJoCo; Havok separates after {min(times):.2f} to {max(times):.2f} s"


@sentence("docs/lab/policies.md")
def all_stay_up(runs):
    cells = runs.quadruped.cells("policy")
    assert all(steps[5]["transfer"][1]["fall_rate"][0] == 0 for steps in cells.values())
    words = {11: "eleven", 10: "ten", 12: "twelve"}
    return f"Of nine engines all {words[len(cells)]} contenders of the committed run stay up in all 20 runs of 10 s"


# ---- versions --------------------------------------------------------------------------------------------------------

NAMES = {"mujoco": "MuJoCo", "bullet": "Bullet", "ode": "ODE", "physx": "PhysX", "havok": "Havok", "jolt": "Jolt", "rapier": "Rapier", "dart": "DART",
         "simbody": "Simbody", "physx56": "PhysX", "dartpy": "DART", "mujoco-warp": "MuJoCo Warp", "mjx": "MJX", "genesis": "Genesis",
         "newton": "Newton", "drake": "Drake", "sapien": "SAPIEN", "box3d": "Box3D", "superdex": "SuperDex"}


@sentence(ENGINES)
def releases(_):
    known = tomllib.loads((ROOT / "docs/releases.toml").read_text("utf-8"))
    lines = (ROOT / ENGINES).read_text("utf-8").splitlines()
    rows = []
    for engine, of in known.items():
        start = f"| {NAMES[engine]} {of['version']}"
        # as the row is, with the date that it has to have
        cells = next((line for line in lines if line.startswith(start)), f"{start} | | |").split("|")
        cells[3] = f" {of['released']} "
        rows.append("|".join(cells))
    return rows


@sentence(CLAIMS)
def releases_of_the_line_up(_):
    known = tomllib.loads((ROOT / "docs/releases.toml").read_text("utf-8"))
    return ", ".join(f"{NAMES[engine]} {known[engine]['version']} ({known[engine]['released']})" for engine in ("mujoco", "bullet", "ode", "physx", "havok"))


# ---- withdrawn -------------------------------------------------------------------------------------------------------

@sentence("results/README.md")
def withdrawn_folders(runs):
    rows = []
    for path in sorted(ROOT.glob("results/*/assay.sqlite.xz")):
        if path.parent.name.startswith("gpu-"):
            continue
        run = Run(path.parent.name, runs.scratch.name)
        count, = run.db.execute("SELECT count(*) FROM cells WHERE outcome = 'withdrawn'").fetchone()
        run.db.close()
        if count:
            rows.append(f"| `{path.parent.name}/` | {count} |")
    return rows


@sentence("results/README.md")
def scales_that_vanish(runs):
    for path in sorted(ROOT.glob("results/*/assay.sqlite.xz")):
        run = Run(path.parent.name, runs.scratch.name)
        for reason, in run.db.execute("SELECT reason FROM main.cells WHERE outcome = 'unstable'"):
            apart, energy = re.search(r"is ([\d.e+-]+) m apart", reason), re.search(r"where at most ([\d.e+-]+) J", reason)
            assert not apart or float(apart.group(1)) > 0.01, (path.parent.name, reason)
            assert not energy or float(energy.group(1)) > 0.1, (path.parent.name, reason)
        # the systems of models/, whose actuators are motors, and robots that assay's own PD holds
        for name, facts in run.facts.items():
            assert not (facts.get("control") == "actuators" and facts["model"].startswith("robots:")), (path.parent.name, name)
        run.db.close()
    models = [path for path in ROOT.glob("models/**/*.xml") if re.search(r"\bkv=|<velocity|<damper|biasprm", path.read_text("utf-8"))]
    assert not models, models
    return "No published verdict *unstable* rests on a scale that vanishes, and no published system has actuators with a velocity gain."


@sentence("results/README.md")
def passed_limits(runs):
    counted = [len(standing.passed_a_limit(run.db)) for run in (runs.full, runs.field)]
    return f"That concerns {counted[0]} cells of the full run and {counted[1]} of the field"


@sentence("results/README.md")
def below_the_ground(runs):
    """2 % of the length of the humanoid, whose forearm is at most 1.056 m from the root."""
    allowed, found = 0.0211, {}
    for path in sorted(ROOT.glob("results/*/assay.sqlite.xz")):
        run = Run(path.parent.name, runs.scratch.name)
        manifest = json.loads((path.parent / "manifest.json").read_text("utf-8"))
        depths = [(system, float(depth.group(1))) for system, reason in run.db.execute("SELECT system, reason FROM main.cells WHERE outcome = 'unstable'")
                  if (depth := re.search(r"lies wholly below the ground, by ([\d.e+-]+) m", reason))]
        run.db.close()
        if depths and int(manifest.get("soundness_rules", 1)) < 3:
            found[path.parent.name] = depths
    field, full, robots, settings = (found.pop(runs.folder(name)) for name in ("field", "full", "robots", "settings"))
    assert list(found) == [runs.folder("quadruped_20ms")], found  # whose falls count all the same
    less = [sum(system == "humanoid" and depth < allowed for system, depth in depths) for depths in (full, field, settings)]
    return (f"By the older rule {len(full)} cells of the full run, {len(field)} of the field, {len(settings)} of the settings and {len(robots)} of the robots are"
            f" unstable; {less[0]}, {less[1]} and {less[2]} of the first three are of the humanoid at less than 21 mm.")


@sentence(CLAIMS)
def ends_by_an_older_rule(runs):
    """Contenders whose first unstable timestep on the humanoid is one where shapes lie below the ground and nothing else is said."""
    first = {}
    for contender, timestep, reason in runs.full.db.execute(
            "SELECT contender, timestep_ms, reason FROM cells WHERE system = 'humanoid' AND outcome IN ('unstable', 'diverged') ORDER BY timestep_ms"):
        if timestep <= first.setdefault(contender, (timestep, []))[0]:
            first[contender][1].append(re.search(r"lies wholly below the ground, by ([\d.e+-]+) m", reason))
    ground = {contender: [float(depth.group(1)) for depth in depths] for contender, (_, depths) in first.items() if all(depths)}
    return f"so on the humanoid {len(ground)} of {len(first)} contenders end, {sum(min(each) < 0.0211 for each in ground.values())} of them at a depth of less than 21 mm"


# ---- comparison with the pages ---------------------------------------------------------------------------------------

def flat(text):
    """Without line ends and the marks of quotations."""
    return " ".join(re.sub(r"^> ", "", text, flags=re.M).split())


# ---- docs/reality.md -----------------------------------------------------------------------------------------------------

REALITY = "docs/reality.md"


@functools.cache
def measured_motion(name):
    folder = max(ROOT.glob("results/reality-20[0-9][0-9]-*"))
    return reality.answer(folder, name)


@sentence(REALITY)
def errors_of_the_double_pendulum(runs):
    """All means again from the errors of single logs, and the program's own beside them."""
    found = measured_motion("double-pendulum")
    for each in reality.ranked(found):
        for which, of in (("held_out", "held_out"), ("untuned", "untuned"), ("floor", "floor"), ("held_out_short", "held_out_short")):
            assert math.isclose(each.mean(which), each.found[of]["joints_deg"], rel_tol=1e-9), (each.name, which)
        assert math.isclose(each.mean("held_out"), each.found["score"]["value"], rel_tol=1e-9), each.name
    return reality.errors_table(found).strip().split("\n")[2:]


@sentence(REALITY)
def errors_of_the_tossed_cube(runs):
    found = measured_motion("tosses")
    for each in reality.ranked(found):
        for of in ("held_out", "untuned", "floor"):
            for key in ("position_percent", "rotation_deg"):
                assert math.isclose(each.mean(of, key), each.found[of][key], rel_tol=1e-9), (each.name, of, key)
        assert math.isclose(each.mean("held_out"), each.found["score"]["value"], rel_tol=1e-9), each.name
    return reality.errors_table(found).strip().split("\n")[2:]


@sentence(REALITY)
def soft_or_hard(runs):
    """Contacts of MuJoCo are springs; the others' are rigid but for how they correct depths."""
    order = reality.ranked(measured_motion("tosses"))
    soft = next(each for each in order if each.name.startswith("mujoco"))
    hard = next(each for each in order if not each.name.startswith(("mujoco", "drake", "genesis", "mjx", "newton")))
    low, high = reality.apart(hard, soft)
    time = soft.parameter("softness")
    assert time["status"] == "fitted" and time["model"] == 0.02
    more = f"{low:.1f} to {high:.1f} more" if high > 0 else f"{-high:.1f} to {-low:.1f} less"
    return (f"`{soft.name}`, whose contacts are springs, is off by {soft.mean('held_out', 'position_percent'):.1f} % and {soft.mean('held_out', 'rotation_deg'):.1f}°. The best"
            f" engine with rigid contacts, `{hard.name}`, is off by {hard.mean('held_out', 'position_percent'):.1f} % and {hard.mean('held_out', 'rotation_deg'):.1f}°: {more}"
            f" in the mean of both numbers (95 %, on the same tosses){', so neither is clearly nearer' if low <= 0 <= high else ''}.")


@sentence(REALITY)
def how_soft_the_cube_is(runs):
    soft = next(each for each in reality.ranked(measured_motion("tosses")) if each.name.startswith("mujoco"))
    time = soft.parameter("softness")
    return f"The fit makes MuJoCo's contacts stiffer than its default: a time constant of {1e3 * time['value']:.1f} ms in place of {1e3 * time['model']:.0f}."


@sentence(REALITY)
def what_matters_for_the_cube(runs):
    folder = max(ROOT.glob("results/reality-20[0-9][0-9]-*"))
    pairs = reality.ablations(folder, measured_motion("tosses"))
    worse, same, better = [], [], []
    for name, (whole, without) in pairs.items():
        assert whole.name == "mujoco-euler-elliptic"
        low, high = reality.apart(without, whole)
        if low > 0:
            worse.append(f"{low:.1f} to {high:.1f} without {name}")
        else:
            (better if high < 0 else same).append(name)
    listed = lambda names: ", ".join(names[:-1]) + (" or " if len(names) > 1 else "") + names[-1]
    return ("Which parameters matter? `mujoco-euler-elliptic` is worse in the mean of both numbers (95 %, on the same tosses) by " + ", by ".join(worse)
            + (f"; it is not clearly worse without {listed(same)}" if same else "") + (f", and better without {listed(better)}" if better else "") + ".")


@sentence(REALITY)
def cube_by_timestep(runs):
    best = reality.ranked(measured_motion("tosses"))[0]
    by = {each["timestep_ms"]: each["held_out"]["position_percent"] for each in best.found["timesteps"]}
    return f"The best contender's fit is off by {by[8]:.1f} % at 8 ms in place of {by[1]:.1f}."


def signed(value):
    return re.sub(r"^[+-](?=0\.0$)", "", f"{value:+.1f}")


def rank_correlation(values, others):
    """Spearman's, and the size that chance alone exceeds in 5 % of shuffles."""
    def ranks(of):
        order = sorted(of)
        return [(order.index(each) + len(order) - 1 - order[::-1].index(each)) / 2 for each in of]
    ours, theirs = ranks(values), ranks(others)
    draw = random.Random(1)
    chance = sorted(abs(statistics.correlation(ours, draw.sample(theirs, len(theirs)))) for _ in range(4000))
    return statistics.correlation(ours, theirs), chance[int(0.95 * len(chance))]


@sentence(REALITY)
def what_other_measures_predict(runs):
    """A better engine by the other measure has the smaller error on the real cube: positive."""
    order = reality.ranked(measured_motion("tosses"))
    systems = [system for of in contact_tables.TABLES.values() for system in of]
    truths = {each: -sum(error is not None and error <= MM for error in (runs.contacts.value(system, each.name, 1, "truth_error_max") for system in systems))
              for each in order if each.name in runs.contacts.contenders}
    own = {each: value for each in order if (value := runs.full.value("humanoid", each.name, 1, "consistency")) is not None}
    texts = []
    for others in (truths, own):
        found, chance = rank_correlation([each.mean("held_out") for each in others], list(others.values()))
        assert abs(found) < chance, (found, chance)
        texts.append(f"{signed(found)} over {COUNTS[len(others)]} contenders; chance alone gives up to {chance:.1f}")
    return (f"Neither the number of [contact systems](lab/contact-truth.md) within 1 mm at 1 ms tells which engine is near the real cube (rank correlation {texts[0]}), nor"
            f" [self-consistency](lab/self-consistency.md) on the falling humanoid ({texts[1]}).")


def known_found(boxes):
    """Parameters of the chains, or of the tossed boxes; errors as shares of what 5 % are of; how many intervals have the truth."""
    every = measured_motion("known-truth")["found"]
    chains = {each["model"] for each in every if each["parameter"].startswith("damping")}
    found = [each for each in every if (each["model"] not in chains) == boxes]
    off = [abs(each["value"] - each["truth"]) / abs(each["size"]) for each in found]
    return found, off, sum(each["low"] is not None and each["low"] <= each["truth"] <= each["high"] for each in found)


@sentence(REALITY)
def known_truth(runs):
    found, off, covered = known_found(boxes=False)
    hinges = max(sum(each["model"] == one["model"] and each["parameter"].startswith("damping") for each in found) for one in found)
    return (f"Of seeded chains of one to {COUNTS[hinges]} hinges with the noise of good encoders all {len(found)} masses, dampings and dry frictions are found within"
            f" {100 * max(off):.1f} %, half of them within {100 * statistics.median(off):.2g} %; {covered} of {len(off)} intervals (95 %) contain the true value.")


@sentence(REALITY)
def known_truth_of_boxes(runs):
    found, off, covered = known_found(boxes=True)
    frictions = [share for share, each in zip(off, found) if each["parameter"] == "friction"]
    heights = [share for share, each in zip(off, found) if each["parameter"] == "ground"]
    assert len(frictions) + len(heights) == len(off)
    return (f"Of {COUNTS[len(frictions)]} tossed boxes the frictions are found within {100 * max(frictions):.1f} % and the ground's heights within"
            f" {100 * max(heights):.1f} % of the side; {covered} of {len(off)} intervals contain the true value.")


@sentence(REALITY)
def pendulum_tables(runs):
    return [line for name in reality.OTHERS for line in reality.errors_table(measured_motion(name)).strip().split("\n")[2:]]


@sentence(REALITY)
def what_the_energy_log_determines(runs):
    order = reality.ranked(measured_motion("pendulum-energy"))
    combinations = {each.name: [set(of["members"]) for of in each.found["not_identified"]] for each in order}
    mass = [name for name, of in combinations.items() if any("mass:link" in members for members in of)]
    friction = [name for name, of in combinations.items() if any({"mass:link", "dry_friction:hinge"} <= members for members in of)]
    assert len(mass) == len(order), combinations
    return f"The mass is not identified in any of the {COUNTS[len(order)]}: it is named with damping, in {COUNTS[len(friction)]} of them with dry friction, too."


@sentence(REALITY)
def what_the_energy_log_is_worth(runs):
    order = reality.ranked(measured_motion("pendulum-energy"))
    fitted, untuned = [each.mean("held_out") for each in order], [each.mean("untuned") for each in order]
    return (f"Fits do not help on its last third: {min(fitted):.1f}° to {max(fitted):.1f}° over 2 s, {min(untuned):.1f}° to {max(untuned):.1f}° untuned, and"
            f" {order[0].mean('at_rest'):.1f}° for a link that stays where each window starts.")


@sentence(REALITY)
def planted_cases(runs):
    found = measured_motion("known-truth")
    assert found["planted"] == len(found["combinations"]) and found["named"] == sum(map(bool, found["combinations"]))
    return f"In {found['named']} of {found['planted']} planted cases the direction that the logs do not determine is named."


@sentence(REALITY)
def as_good_as_the_best(runs):
    found = measured_motion("double-pendulum")
    best, *equal = reality.as_good_as_best(found)
    own = {each["contender"]: each["as_good_as_best"] for each in found["contenders"] if not each["failure"]}
    assert own == {name: name in (best, *equal) for name in own}, own
    order = reality.ranked(found)
    low, high = min(each.mean("held_out") for each in order), max(each.mean("held_out") for each in order)
    raw = [each.mean("untuned") for each in order]
    return (f"The error over 2 s is {min(raw):.1f}° to {max(raw):.1f}° untuned and {low:.1f}° to {high:.1f}° fitted: the parameters matter more than the"
            f" engine. {len(equal) + 1} of {len(order)} contenders are as good as the best, `{best}`.")


# ---- docs/releases.md ----------------------------------------------------------------------------------------------------

@sentence("docs/releases.md")
def robots_through_the_releases(_):
    folder = max(ROOT.glob("results/releases-20[0-9][0-9]-*"))
    for runs in release_tables.courses(folder).values():
        for found in runs:
            bits = {each["release"]: each["bits"] for each in found["releases"] if each["run"]}
            ran = list(bits)
            for change in found["changes"]:  # neighbours, and only those whose bits differ
                assert ran.index(change["after"]) == ran.index(change["before"]) + 1 and bits[change["before"]] != bits[change["after"]], change
    tables = release_tables.blocks(ROOT / "docs/releases.md", folder)
    return [line for table in tables.values() for line in table.strip().split("\n")[2:]]


def check(report, only=None):
    """Each sentence against its page; `report` counts (recompute.Report)."""
    runs, texts = Runs(), {}
    try:
        for page, title, of in SENTENCES:
            if only and page not in only:
                continue
            text = texts.setdefault(page, flat((PAGES / page).read_text("utf-8")))
            try:
                wanted = of(runs)
            except AssertionError as error:
                report.check("sentences", f"{page}, {title}", "the sentence", False, f"something else: {error}")
                continue
            for each in [wanted] if isinstance(wanted, str) else wanted:
                report.check("sentences", f"{page}, {title}", nearest(text, flat(each)), flat(each) in text, flat(each))
    finally:
        runs.close()


def nearest(text, wanted):
    """What the page has in place of it: from where the two begin alike."""
    for length in range(len(wanted), 7, -1):
        if (at := text.find(wanted[:length])) >= 0:
            return text[at:at + len(wanted) + 40]
    return "nothing like it"


def main():
    runs = Runs()
    pages = [word for word in sys.argv[1:] if word != "--show"]
    with contextlib.closing(runs):
        for page, title, of in SENTENCES:
            if not pages or page in pages:
                try:
                    wanted = of(runs)
                except AssertionError as error:
                    wanted = f"NOT TRUE ANY MORE: {error}"
                print(f"{page}, {title}:", *([wanted] if isinstance(wanted, str) else wanted), sep="\n    ")


if __name__ == "__main__":
    main()
