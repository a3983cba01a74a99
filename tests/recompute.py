"""Recomputes published figures from a results database, by docs/methodology.md and nothing else of the program.

    recompute.py RESULTS [--claims PAGE] [--values FILE]
    recompute.py --sentences

RESULTS is a results directory, its database, or a database packed as assay.sqlite.xz. Reads the database with sqlite3 and
the stored states, where RESULTS has them, by itself. Prints each figure that differs, then how many of which kind were
recomputed; status 1 when one differs. The standard library of Python is all that it needs.

    samples   the stored values that follow from stored samples: step times, self-consistency errors, scaling, means over states
    values    the stored values that follow from other stored values: timesteps that hold, observed orders, ...
    states    the stored values that follow from stored states: agreement, separation, slip, joint position errors
    page      the figures of a page (docs/lab/claims.md): every ratio, slope, exponent and timestep in its blocks
    export    each row of the exported values (values.csv)
    sentences what pages say in words: "the fastest", "none", "each engine" (tests/statements.py)

Pages have the figures that count (results/standing.py); samples, values, states and export are of all that was stored.
"""

import argparse
import collections
import contextlib
import csv
import fractions
import json
import math
import pathlib
import re
import sqlite3
import statistics
import struct
import sys
import tempfile
import tomllib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "results"))
import packed  # noqa: E402
import standing  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[1]
CLAIMS = ROOT / "docs/lab/claims.md"
# Errors below this count as this in ratios and slopes.
SMALLEST = 1e-16
HARNESS = "null"

Cell = collections.namedtuple("Cell", "id system contender timestep measure outcome values")
Value = collections.namedtuple("Value", "value low high unit")


def close(a, b, tolerance=1e-12):
    return a == b or abs(a - b) <= tolerance * max(abs(a), abs(b))


def same(a, b):
    """Of one timestep or factor, whatever its rounding."""
    return close(a, b, 1e-9)


def log(value):
    return math.log(max(value, SMALLEST))


def line(x, y):
    """Slope of the least-squares line."""
    mx, my = statistics.fmean(x), statistics.fmean(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)


# ---- the database ----------------------------------------------------------------------------------------------------


class Store:
    """A results database, of either version of the schema."""

    def __init__(self, path, counting=False):
        """With `counting` as far as it counts."""
        self.db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
        if counting:
            standing.standing(self.db)
        self.folder = path.parent
        self.manifest = dict(self.db.execute("SELECT key, value FROM manifest"))
        self.systems = {name: json.loads(text) for name, text in
                        self.db.execute("SELECT name, json FROM systems ORDER BY rowid")}
        self.contenders = [name for name, in self.db.execute("SELECT name FROM contenders ORDER BY rowid")]
        values = collections.defaultdict(dict)
        for cell, name, unit, value, low, high in self.db.execute(
                'SELECT cell_id, name, unit, value, low, high FROM "values"'):
            values[cell][name] = Value(value, low, high, unit)
        self.cells, self.by_measure, self.measures_of = {}, collections.defaultdict(list), collections.defaultdict(set)
        for row in self.db.execute("SELECT id, system, contender, timestep_ms, measure, outcome FROM cells"):
            cell = Cell(*row, values[row[0]])
            self.cells[cell.system, cell.contender, cell.timestep, cell.measure] = cell
            for place in ((), (cell.system,), (cell.system, cell.contender)):
                self.by_measure[cell.measure, *place].append(cell)
            for name in cell.values:
                self.measures_of[name].add(cell.measure)

        self.series = collections.defaultdict(set)
        for cell, name in self.db.execute("SELECT DISTINCT cell_id, name FROM samples"):
            self.series[cell].add(name)

    def close(self):
        self.db.close()

    def samples(self, cell):
        """{name: numbers} in the order in which they were taken."""
        series = collections.defaultdict(list)
        for name, value in self.db.execute(
                "SELECT name, value FROM samples WHERE cell_id = ? ORDER BY name, idx", [cell.id]):
            series[name].append(value)
        return series

    def of(self, measure, system=None, contender=None):
        """Cells of a measure, by timestep; never those of the harness."""
        place = (system, contender) if system and contender else (system,) if system else ()
        return sorted((cell for cell in self.by_measure[measure, *place]
                       if cell.contender != HARNESS and contender in (None, cell.contender)),
                      key=lambda cell: cell.timestep)

    def twin(self, cell):
        """The cell of the first contender that is the same engine with the same settings; None where it has none."""
        same_as = "SELECT engine, base, settings FROM contenders WHERE name = ?"
        own = self.db.execute(same_as, [cell.contender]).fetchone()
        first = next(name for name in self.contenders if self.db.execute(same_as, [name]).fetchone() == own)
        found = self.cells.get((cell.system, first, cell.timestep, cell.measure))
        return found if found and found.contender != cell.contender and "window_weight" in self.series[found.id] else None

    def is_reference(self, cell):
        """Whether the cell is at the timestep of the contender's fine-step run."""
        return "restart_floor" in cell.values


# ---- values from samples ---------------------------------------------------------------------------------------------

# 97.5 % quantiles of Student's t for 1 to 30 degrees of freedom, from the tables.
STUDENT_T = (12.7062, 4.3027, 3.1824, 2.7764, 2.5706, 2.4469, 2.3646, 2.3060, 2.2622, 2.2281, 2.2010, 2.1788, 2.1604,
             2.1448, 2.1314, 2.1199, 2.1098, 2.1009, 2.0930, 2.0860, 2.0796, 2.0739, 2.0687, 2.0639, 2.0595, 2.0555,
             2.0518, 2.0484, 2.0452, 2.0423)


def t_interval(samples):
    """The mean with its interval, widened where successive samples are alike."""
    count, value = len(samples), statistics.fmean(samples)
    if not 2 <= count <= len(STUDENT_T) + 1:
        return value, None, None
    apart = [sample - value for sample in samples]
    squares = sum(a * a for a in apart)
    alike = sum(a * b for a, b in zip(apart, apart[1:])) / squares if squares > 0 else 0
    wider = 1 + 2 * (count - 1) / count * min(max(0, alike + 1 / count), 0.9)
    half = STUDENT_T[count - 2] * math.sqrt(squares / (count - 1) / count * wider)
    return value, value - half, value + half


def process_times(samples):
    """The time of each process in us: the mean over windows, by their weights, of the median over rounds."""
    weights = samples["window_weight"]
    rounds = collections.defaultdict(list)
    times = samples["window_step_time_us"]
    for number, process in enumerate(samples["process"]):
        rounds[process].append(times[number * len(weights):(number + 1) * len(weights)])
    return {process: sum(weight * statistics.median(window) for weight, window in zip(weights, zip(*of)))
            for process, of in sorted(rounds.items())}


def clopper_pearson(hits, trials):
    """95 % interval of a probability."""
    def at_most(k, p):
        return sum(math.comb(trials, i) * p ** i * (1 - p) ** (trials - i) for i in range(k + 1))

    def where(goes_down, target):
        low, high = 0.0, 1.0
        for _ in range(80):
            middle = (low + high) / 2
            low, high = (middle, high) if goes_down(middle) > target else (low, middle)
        return low
    return (0 if hits == 0 else where(lambda p: at_most(hits - 1, p), 0.975),
            1 if hits == trials else where(lambda p: at_most(hits, p), 0.025))


def step_time(samples):
    """Value and, where it does not depend on random numbers, interval."""
    if "window_weight" not in samples:  # version 0.1: the median over all slices
        return statistics.median(samples["step_time_us"]), None, None
    times = list(process_times(samples).values())
    if len(times) < 2:
        return statistics.fmean(times), None, None
    _, low, high = t_interval([math.log(time) for time in times])
    value = statistics.fmean(times)
    middle = statistics.fmean([math.log(time) for time in times])
    return value, value * math.exp(low - middle), value * math.exp(high - middle)


def from_samples(store):
    """(cell, value's name, number) of what stored samples determine."""
    for cell in store.of("raw_speed"):
        if "step_time" not in cell.values:
            continue
        samples = store.samples(cell)
        time, low, high = step_time(samples)
        yield cell, "step_time", time
        if "aa_ratio" in cell.values and (twin := store.twin(cell)):
            other = process_times(store.samples(twin))
            mine = process_times(samples)
            both = [math.log(mine[process] / other[process]) for process in mine if process in other]
            if len(mine) > 1 and len(both) > 1:
                for end, number in zip(("", " low", " high"), t_interval(both)):
                    yield cell, f"aa_ratio{end}", math.exp(number)
        yield cell, "raw_speed", 1e3 / time
        yield cell, "realtime_factor", 1e3 * cell.timestep / time
        if low is not None:
            yield cell, "step_time low", low
            yield cell, "step_time high", high
    for cell in store.of("consistency"):
        if "consistency" not in cell.values:
            continue
        for series, errors in store.samples(cell).items():
            if series.startswith("piece_error_m"):
                length = re.match(r"piece_error_m(?: (\S+) ms)?$", series).group(1)
                yield cell, f"consistency_{length}ms" if length else "consistency", statistics.fmean(errors)
    for cell in store.of("agreement"):
        parted = [numbers[0] for series, numbers in store.samples(cell).items() if series.startswith("parting_time_s ")]
        if parted and "parting_time" in cell.values:
            yield cell, "parting_time", statistics.median(parted)
    for cell in store.cells.values():
        of_states = {name for name in cell.values if f"{name} of states" in store.series[cell.id]}
        for name in sorted(of_states):
            numbers = store.samples(cell)[f"{name} of states"]
            if None in numbers:  # not a number in a run that diverged: no mean, and no value
                assert cell.outcome != "ok" and cell.values[name].value is None, (cell, name)
                continue
            if name == "grasp_held":
                states = store.systems[cell.system]["initial_states"]["count"]
                low, high = clopper_pearson(round(sum(numbers)), states)
                yield cell, name, sum(numbers) / states
                yield cell, f"{name} low", low
                yield cell, f"{name} high", high
            else:
                yield cell, name, min(numbers) if name == "drop_time" else statistics.fmean(numbers)
    sizes = collections.defaultdict(list)
    for cell in store.of("scaling"):
        if "run_time" not in cell.values:
            continue
        system = store.systems[cell.system]
        runs = store.samples(cell)["run_time_s"]
        time = statistics.median(runs)
        yield cell, "run_time", time
        yield cell, "steps_per_second", 1e3 * system["duration_s"] / cell.timestep / time
        sizes[system.get("family"), cell.contender, cell.timestep].append((system["bodies"], runs, cell))
    for found in sizes.values():
        with_exponent = [cell for _, _, cell in found if "scaling_exponent" in cell.values]
        times = collections.defaultdict(list)  # systems of one size differ by their seed
        for bodies, runs, _ in found:
            times[bodies] += runs
        if len(times) < 3:
            continue
        exponent = line([math.log(bodies) for bodies in times],
                        [math.log(statistics.median(runs)) for runs in times.values()])
        for cell in with_exponent:
            yield cell, "scaling_exponent", exponent


# ---- values from values ----------------------------------------------------------------------------------------------


def from_values(store):
    """(cell, value's name, number) of what other values determine."""
    for system in store.systems:
        for contender in store.contenders:
            held = {cell.timestep: cell.outcome == "ok" and cell.values["grasp_held"].value == 1
                    for cell in store.of("grasp", system, contender)}
            for cell in store.of("grasp", system, contender):
                if "largest_stable_timestep" in cell.values:
                    yield cell, "largest_stable_timestep", max((h for h in held if held[h]), default=0)
                if "stable_up_to_timestep" in cell.values:
                    fails = min((h for h in held if not held[h]), default=math.inf)
                    yield cell, "stable_up_to_timestep", max((h for h in held if h < fails), default=0)
            runs = store.of("truth", system, contender)
            distance = "truth_error_max" if any("truth_error_max" in cell.values for cell in runs) else "truth_error"
            for name, order in ((distance, "truth_order"), ("event_time_error", "event_time_order"),
                                ("normal_impulse_error", "normal_impulse_order"), ("tangential_impulse_error", "tangential_impulse_order")):
                curve = [cell for cell in runs if name in cell.values]
                for before, cell in zip(curve, curve[1:]):
                    small, large = before.values[name].value, cell.values[name].value
                    if order in cell.values and small > 0 and large > 0:
                        yield cell, order, math.log(large / small) / math.log(cell.timestep / before.timestep)


# ---- values from states ----------------------------------------------------------------------------------------------


class States:
    """A stored run: per sample its time, and per body position (of the centre of mass) and quaternion w, x, y, z."""

    MAGICS = (b"assay-trajectory-1\n", b"assay-trajectory-2\n")

    def __init__(self, path):
        data = path.read_bytes()
        at = len(self.MAGICS[0])
        if data[:at] not in self.MAGICS:
            raise ValueError(f"{path} is no trajectory")
        if data[:at] == self.MAGICS[1]:  # then the run's address
            at += 8 + struct.unpack_from("<Q", data, at)[0]
        count, bodies, hinges = struct.unpack_from("<3Q", data, at)
        at += 24
        state = struct.Struct(f"<{1 + 13 * bodies + 2 * hinges}d")
        self.time, self.position, self.quaternion = [], [], []
        for number in range(count):
            numbers = state.unpack_from(data, at + number * state.size)
            self.time.append(numbers[0])
            self.position.append([numbers[1 + 13 * b:4 + 13 * b] for b in range(bodies)])
            self.quaternion.append([numbers[4 + 13 * b:8 + 13 * b] for b in range(bodies)])


def rotate(q, v):
    w, x, y, z = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx)


def mean_distance(a, b):
    return statistics.fmean(math.dist(p, q) for p, q in zip(a, b))


def separation_time(time, apart):
    """When runs first are 1 mm apart, interpolated in the logarithm; the run's length if never."""
    for i, distance in enumerate(apart):
        if distance > 1e-3:
            if i == 0 or apart[i - 1] <= 0:
                return time[i] - time[0]
            share = math.log(1e-3 / apart[i - 1]) / math.log(distance / apart[i - 1])
            return time[i - 1] + share * (time[i] - time[i - 1]) - time[0]
    return time[-1] - time[0]


def from_states(store):
    """(cell, value's name, number) of what stored states determine."""
    kept = {}
    tables = {name for name, in store.db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    for system, contender, timestep, address in store.db.execute(
            "SELECT system, contender, timestep_ms, address FROM runs" if "runs" in tables else "SELECT 1 WHERE 0"):
        path = store.folder / "trajectories" / f"{address}.bin"
        if path.exists() and system in store.systems:
            kept[system, contender, timestep] = States(path)
    scenes = {system: json.loads(text) for system, text in store.db.execute("SELECT system, json FROM scenes")} \
        if "scenes" in tables else {}
    for cell in store.of("agreement"):
        own = kept.get((cell.system, cell.contender, cell.timestep))
        others = [name.removeprefix("parting_time_s ") for name in store.samples(cell)
                  if name.startswith("parting_time_s ")]
        theirs = [kept.get((cell.system, other, cell.timestep)) for other in others]
        if own is None or not theirs or None in theirs:
            continue
        apart = [[mean_distance(a, b) for a, b in zip(own.position, other.position)] for other in theirs]
        yield cell, "agreement", statistics.median(series[-1] for series in apart)
        yield cell, "parting_time", statistics.median(separation_time(own.time, series) for series in apart)
    for cell in store.of("grasp"):
        own, facts = kept.get((cell.system, cell.contender, cell.timestep)), store.systems[cell.system].get("grasp")
        if own is None or not facts or store.systems[cell.system].get("initial_states"):
            continue
        names = [body["name"] for body in scenes[cell.system]["bodies"]]
        hand, thing = names.index(facts["hand"]), names.index(facts["object"])

        def in_hand(i):
            w, x, y, z = own.quaternion[i][hand]
            return rotate((w, -x, -y, -z), [a - b for a, b in zip(own.position[i][thing], own.position[i][hand])])
        yield cell, "grasp_slip", max(math.dist(in_hand(i), in_hand(0)) for i in range(len(own.time)))
    for cell in store.of("violation"):
        own = kept.get((cell.system, cell.contender, cell.timestep))
        if own is None or "joint_dislocation_max" not in cell.values or store.systems[cell.system].get("initial_states"):
            continue
        bodies = scenes[cell.system]["bodies"]
        if store.systems[cell.system]["hinges"] + sum(is_free(body) for body in bodies) != len(bodies):
            continue
        yield cell, "joint_dislocation_max", max(
            hinge_gap(bodies, b, own.position[i], own.quaternion[i]) for i in range(len(own.time))
            for b in range(len(bodies)))


def is_free(body):
    """A free body has no anchor but its centre of mass."""
    return body["parent"] < 0 and body["anchor"] == body["cm"]


def hinge_gap(bodies, number, position, quaternion):
    """Distance between the anchor of a body's hinge as the body has it and as its parent has it, in m."""
    body = bodies[number]
    if is_free(body):
        return 0
    arm = rotate(quaternion[number], [a - c for a, c in zip(body["anchor"], body["cm"])])
    child = [p + a for p, a in zip(position[number], arm)]
    # where the hinge is in the parent, from the poses at zero angles
    start = body["start"]
    place = [p + a for p, a in zip(start["p"], rotate(start["q"], body["anchor"]))]
    if body["parent"] < 0:
        return math.dist(child, place)
    parent = bodies[body["parent"]]
    w, x, y, z = parent["start"]["q"]
    local = rotate((w, -x, -y, -z), [a - b for a, b in zip(place, parent["start"]["p"])])
    arm = rotate(quaternion[body["parent"]], [a - c for a, c in zip(local, parent["cm"])])
    return math.dist(child, [p + a for p, a in zip(position[body["parent"]], arm)])


# ---- the page of claims ----------------------------------------------------------------------------------------------


def line_up(page):
    """{engine of the paper: contenders} from the table of docs/lab/claims.md."""
    rows = re.search(r"^\| engine of the paper \|.*\n\|.*\n((?:\|.*\n)+)", page, re.M)
    return {cells[0].strip(): re.findall(r"`([^`]+)`", cells[1])
            for cells in (row.strip("| \n").split("|") for row in rows.group(1).splitlines())}


Figure = collections.namedtuple("Figure", "value low high")


class Claims:
    """The figures of claims, by the kinds of docs/lab/claims.md."""

    def __init__(self, store, engines):
        self.store, self.engines = store, engines
        self.values = {}
        for cell, name, number in from_samples(store):
            self.values[cell.id, name] = number

    # One contender.

    def figure(self, system, contender, name, timestep):
        """With recomputed value and stored interval; None where the cell did not end well."""
        for cell in self.cells(system, contender, name):
            if same(cell.timestep, timestep):
                return self.of(cell, name)
        return None

    def of(self, cell, name):
        stored = cell.values.get(name)
        if cell.outcome != "ok" or stored is None or stored.value is None:
            return None
        value = self.values.get((cell.id, name), stored.value)
        if name == "consistency" and "consistency_bound" in cell.values:
            bound = cell.values["consistency_bound"].value
            return Figure(bound, 0, bound)
        return Figure(value, value if stored.low is None else stored.low, value if stored.high is None else stored.high)

    def cells(self, system, contender, name):
        return [cell for measure in self.store.measures_of[name] for cell in self.store.of(measure, system, contender)]

    def timed(self, system):
        return any("realtime_factor" in cell.values and cell.outcome == "ok"
                   for cell in self.store.of("raw_speed", system))

    def speed(self, system, contender, timestep):
        timed = {cell.timestep: self.of(cell, "realtime_factor") for cell in self.store.of("raw_speed", system, contender)}
        timed = {h: factor for h, factor in timed.items() if factor}
        if timestep in timed:
            return timed[timestep].value
        below = max((h for h in timed if h < timestep), default=None)
        above = min((h for h in timed if h > timestep), default=None)
        if below is None or above is None:
            return None
        weight = math.log(timestep / below) / math.log(above / below)
        seconds = math.exp((1 - weight) * math.log(below / timed[below].value) + weight * math.log(above / timed[above].value))
        return timestep / seconds

    # Two contenders: the second's value over the first's, with the least and the most along the curve.

    def at_timestep(self, system, first, second, name, timestep):
        under, over = (self.figure(system, contender, name, timestep) for contender in (first, second))
        if not under or not over:
            return None
        return Ratio(max(over.value, SMALLEST) / max(under.value, SMALLEST),
                     max(over.low, SMALLEST) / max(under.high, SMALLEST),
                     max(over.high, SMALLEST) / max(under.low, SMALLEST), None, None, 0)

    def curve(self, system, contender, name):
        """[(speed, value, is near a floor)], the slowest first; the speed is the timestep where nothing was timed."""
        points = []
        for cell in self.cells(system, contender, name):
            figure = self.of(cell, name)
            if not figure or self.store.is_reference(cell):
                continue
            speed = self.speed(system, contender, cell.timestep) if self.timed(system) else cell.timestep
            if speed is not None:
                points.append((speed, figure.value, name == "consistency" and "consistency_bound" in cell.values))
        return sorted(points)

    def at_equal_speed(self, system, first, second, name):
        under, over = self.curve(system, first, name), self.curve(system, second, name)
        ratios = []
        for speed, value, near_floor in over:
            if not under or speed > under[-1][0] * (1 + 1e-9):
                continue
            if speed <= under[0][0]:
                there, beside = log(under[0][1]), under[0][2]
            else:
                after = next(i for i, (other, _, _) in enumerate(under) if speed <= other * (1 + 1e-9))
                (slow, at_slow, slow_near), (fast, at_fast, fast_near) = under[after - 1], under[after]
                beside = slow_near or fast_near
                weight = math.log(speed / slow) / math.log(fast / slow)
                there = (1 - weight) * log(at_slow) + weight * log(at_fast)
            if not near_floor and not beside:
                ratios.append(log(value) - there)
        if not ratios:
            return None
        least, most = math.exp(min(ratios)), math.exp(max(ratios))
        range_of = (least, most) if most > 10 * least else (None, None)  # no mean stands for more than a decade
        return Ratio(math.exp(statistics.fmean(ratios)), *range_of, least, most, len(ratios))


Ratio = collections.namedtuple("Ratio", "value low high least most points")


class Answers:
    """What each test of a claim says: its figures by name, as (figure, kind) of docs/lab/claims.md."""

    def __init__(self, claims):
        self.claims = claims
        self.store = claims.store

    def stand_ins(self, engine):
        return [name for name in self.claims.engines[engine] if name in self.store.contenders]

    def ratio(self, test, system, first, second):
        """Of two engines; of several contenders of one engine the best counts."""
        def of(a, b):
            if test["kind"] == "at-timestep":
                return self.claims.at_timestep(system, a, b, test["value"], test["timestep_ms"])
            return self.claims.at_equal_speed(system, a, b, test["value"])
        best = None
        for a in self.stand_ins(first):
            ratios = [ratio for b in self.stand_ins(second) if (ratio := of(a, b))]
            if ratios:
                nearest = min(ratios, key=lambda ratio: ratio.value)
                best = nearest if best is None or nearest.value > best.value else best
        return best

    @staticmethod
    def holds(test, ratio):
        """Whether a ratio is as the test demands: 0 no, 1 not settled, 2 yes."""
        low, high = (ratio.value, ratio.value) if ratio.low is None else (ratio.low, ratio.high)
        if "above" in test:
            return 2 if low > test["above"] else 0 if high <= test["above"] else 1
        if "below" in test:
            return 2 if high < test["below"] else 0 if low >= test["below"] else 1
        if "not_above" in test:
            return 2 if high <= test["not_above"] else 0 if low > test["not_above"] else 1
        least, most = test["between"]
        return 2 if least <= low and high <= most else 0 if high < least or low > most else 1

    def nearest(self, test, system):
        """(who comes second, who comes first, ratio) of the pair that decides: by its verdict first, then its ratio."""
        chosen = []
        for who in test["who"]:
            ratios = []
            for rival in test["against"]:
                first, second = (who, rival) if test.get("is", "less") == "less" else (rival, who)
                if first != second and (ratio := self.ratio(test, system, first, second)):
                    ratios.append((ratio.value, second, first, ratio))
            ratios.sort(key=lambda entry: (self.holds(test, entry[3]), entry[0]))
            if len(ratios) > test.get("but", 0):
                decides = ratios[test.get("but", 0)]
                chosen.append((*decides, self.holds(test, decides[3])))
        if not chosen:
            return None
        pick = min if test.get("each") else max
        return pick(chosen, key=lambda entry: (entry[-1], entry[0]))[1:-1]

    def slope(self, system, contender, name):
        points = [(cell.timestep, figure.value) for cell in self.claims.cells(system, contender, name)
                  if (figure := self.claims.of(cell, name))]
        if len(points) < 2:
            return None
        return line([math.log(h) for h, _ in points], [log(value) for _, value in points])

    def steps(self, measure, system, contender, well):
        """The largest timestep up to which all cells end well, and the first that does not; 0 and infinity for none."""
        cells = self.store.of(measure, system, contender)
        fails = min((cell.timestep for cell in cells if not well(cell)), default=math.inf)
        return max((cell.timestep for cell in cells if cell.timestep < fails), default=0), fails


# ---- comparisons with what is printed --------------------------------------------------------------------------------

NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
# As the page writes values that claims are about.
LABELS = {"step time": "step_time", "run time": "run_time", "self-consistency error": "consistency",
          "energy drift": "energy_drift", "angular momentum drift": "angular_momentum_drift",
          "linear momentum drift": "linear_momentum_drift", "scaling exponent": "scaling_exponent",
          "error against the reference solution": "truth_error_max", "penetration": "penetration_max"}


def agrees(printed, number):
    """Whether a number rounds to what is printed, at the digits that are printed."""
    if number is None:
        return False
    mantissa, _, exponent = printed.partition("e")
    unit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    return abs(number - float(printed)) <= 0.5 * unit * (1 + 1e-6)


def milliseconds(timestep):
    return str(fractions.Fraction(timestep))


class Report:
    """Counts figures by kind, and keeps those that differ."""

    def __init__(self):
        self.counts, self.wrong = collections.Counter(), []

    def check(self, kind, what, shown, good, number):
        self.counts[kind] += 1
        if not good:
            self.wrong.append(f"{kind}: {what}: {shown} is given, {number} was recomputed")

    def printed(self, kind, what, text, number):
        self.check(kind, what, text, agrees(text, number), number)

    def stored(self, kind, cell, name, number, is_least=False):
        base, _, end = name.partition(" ")
        if base not in cell.values:
            return
        given = getattr(cell.values[base], end or "value")
        # intervals by a quantile that a table gives to five digits; positions to their rounding
        good = given is not None and (close(given, number, 1e-4 if end else 1e-9) or
                                      kind == "states" and abs(given - number) < 1e-13 or is_least and given >= number)
        self.check(kind, f"{name} of {cell.contender} on {cell.system} at {milliseconds(cell.timestep)} ms", given, good,
                   number)


def blocks_of(page):
    """{number of a claim: the text below its heading}."""
    block = page[page.index("<!-- claims: begin -->"):page.index("<!-- claims: end -->")]
    parts = re.split(r"^### (\d+)\. .*$", block, flags=re.M)
    return {int(number): text for number, text in zip(parts[1::2], parts[2::2])}


def check_claims(report, store, page, claims_file, rules):
    claims = Claims(store, line_up(rules))
    answers = Answers(claims)
    for claim in tomllib.loads(claims_file)["claim"]:
        text = blocks_of(page).get(claim["number"])
        if text is None:
            continue
        measured = re.search(r"^- Measured: (.*)$", text, re.M)
        for test in claim["test"]:
            if measured:
                check_test(report, answers, f"claim {claim['number']}", test, measured.group(1))
        for today in re.findall(r"All contenders, ([^:]*): (.*?)(?= All contenders, |$)", text, re.M):
            check_today(report, claims, f"claim {claim['number']}, all contenders", *today)


def check_test(report, answers, what, test, text):
    kind, name = test["kind"], test.get("value")
    if kind in ("at-timestep", "at-equal-speed"):
        for system in test["systems"]:
            decides = answers.nearest(test, system)
            number = rf"({NUMBER})(?: to ({NUMBER})| \[({NUMBER}), ({NUMBER})\])?"
            found = re.findall(rf"{re.escape(system)} {number} \(([^()]*?) over ([^(),]*)([^()]*)\)", text)
            if decides is None:
                continue
            second, first, ratio = decides
            shown = [entry for entry in found if entry[4:6] == (second, first)]
            label = f"{what}: {name} on {system}, {second} over {first}"
            report.check("page", label, [entry[4:6] for entry in found], bool(shown), (second, first))
            for value, most, low, high, _, _, along in shown[:1]:
                report.printed("page", label, value, ratio.least if most else ratio.value)
                if most or ratio.points and ratio.low is not None:
                    report.check("page", f"{label}, most", most, bool(most) and agrees(most, ratio.most), ratio.most)
                if low and ratio.low is not None:
                    report.printed("page", f"{label}, lower end", low, ratio.low)
                    report.printed("page", f"{label}, upper end", high, ratio.high)
                ends = re.search(rf"({NUMBER}) to ({NUMBER}) along the curve", along)
                if ends and ratio.least is not None:
                    report.printed("page", f"{label}, least", ends.group(1), ratio.least)
                    report.printed("page", f"{label}, most", ends.group(2), ratio.most)
                if count := re.search(r"(\d+) points?\b", along):
                    report.check("page", f"{label}, points", count.group(1), int(count.group(1)) == ratio.points, ratio.points)
    elif kind == "slope":
        for system in test["systems"]:
            for engine in test["who"]:
                shown = re.search(rf"slope in logarithms, {re.escape(system)}: .*?\b{engine} ({NUMBER})", text)
                slopes = [slope for contender in answers.stand_ins(engine)
                          if (slope := answers.slope(system, contender, name)) is not None]
                if shown and slopes:
                    report.printed("page", f"{what}: slope of {name} of {engine}", shown.group(1), min(slopes))
    elif kind == "value" and name == "scaling_exponent":
        for engine in test["who"]:
            shown = re.search(rf"Scaling exponent, {test['family']}: {engine} ({NUMBER})", text)
            found = [answers.claims.of(cell, name).value for contender in answers.stand_ins(engine)
                     for cell in answers.store.of("scaling", contender=contender) if name in cell.values
                     and answers.store.systems[cell.system].get("family") == test["family"]]
            if shown and found:
                report.printed("page", f"{what}: exponent of {engine}", shown.group(1), min(found))
    elif kind == "value":
        for system in test["systems"]:
            for engine in test["who"]:
                shown = re.search(rf"timestep, {re.escape(system)}: .*?\b{re.escape(engine)} ({NUMBER})", text)
                found = []
                for contender in answers.stand_ins(engine):
                    cells = answers.claims.cells(system, contender, name)
                    if cells and (figure := answers.claims.of(cells[0], name)):
                        found.append(figure.value)
                if shown and found:
                    report.printed("page", f"{what}: {name} of {engine} on {system}", shown.group(1), max(found))
    elif kind == "order":
        for engine in (engine for group in test["order"] for engine in group):
            shown = re.search(rf"\b{re.escape(engine)} ({NUMBER}(?:/\d+)?)", text)
            steps = [answers.steps("grasp", test["systems"][0], contender, lambda cell: cell.outcome == "ok" and
                                   cell.values["grasp_held"].value == 1)[0] for contender in answers.stand_ins(engine)]
            if shown and steps:
                report.check("page", f"{what}: largest timestep of {engine}", shown.group(1),
                             same(float(fractions.Fraction(shown.group(1))), max(steps)), milliseconds(max(steps)))
    elif kind == "unstable":
        for engine in test["who"] + test.get("against", []):
            for system in test["systems"]:
                found = [answers.steps(test["measure"], system, contender, lambda cell: cell.outcome not in (
                    "unstable", "diverged")) for contender in answers.stand_ins(engine)]
                if not found:
                    continue
                good, bad = max(found)
                says = f"stable up to {milliseconds(good)} ms and not at {milliseconds(bad)} ms" if bad < math.inf else ""
                scope = text[re.search(rf"\b{re.escape(system)}: ", text).end():] if f"{system}: " in text else text
                shown = re.search(rf"\b{re.escape(engine)} (stable up to \S+ ms and not at \S+ ms)", scope)
                if shown and says:
                    report.check("page", f"{what}: {engine} on {system}", shown.group(1), shown.group(1) == says, says)


def check_today(report, claims, what, title, text):
    """All contenders against one of the line-up."""
    name = next((value for label, value in LABELS.items() if title.lower().startswith(label)), None)
    step = re.search(r" at (\S+) ms$", title)
    for system, count, more, own, other, shown in re.findall(
            rf"([\w-]+) (none|\d+) of \d+ have (less|more) than ([\w-]+), the (?:nearest|least|most) ([\w-]+)"
            rf" \(({NUMBER})(?: to {NUMBER}| \[{NUMBER}, {NUMBER}\])? times\)", text):
        if name is None or system not in claims.store.systems:
            continue

        def of(contender):
            if step:
                return claims.at_timestep(system, own, contender, name, float(fractions.Fraction(step.group(1))))
            if more == "less":
                return claims.at_equal_speed(system, own, contender, name)
            turned = claims.at_equal_speed(system, contender, own, name)  # each point of what should have most
            return turned and Ratio(1 / turned.value, turned.low and 1 / turned.high, turned.high and 1 / turned.low,
                                    1 / turned.most, 1 / turned.least, turned.points)
        ratio = of(other)
        label = f"{what}: {name} of {other} over {own} on {system}"
        report.printed("page", label, shown, ratio and (ratio.least if ratio.points and ratio.low is not None else ratio.value))
        if step:
            ratios = [ratio for contender in claims.store.contenders
                      if contender not in (own, HARNESS) and (ratio := of(contender))]
            beyond = sum(ratio.high < 1 if more == "less" else ratio.low > 1 for ratio in ratios)
            report.check("page", f"{label}: how many have {more}", count, count == (str(beyond) if beyond else "none"),
                         beyond)


# As the page's text calls contenders.
PROSE = {"MuJoCo Euler": "mujoco-euler", "MuJoCo": "mujoco-euler", "MuJoCo with CG": "mujoco-euler-cg",
         "MuJoCo Runge-Kutta 4": "mujoco-rk4", "MuJoCo with Runge-Kutta 4": "mujoco-rk4", "PhysX": "physx-d6-pgs",
         "Bullet": "bullet-si-f64", "Bullet, double precision": "bullet-si-f64", "BulletMB": "bullet-mb", "ODE": "ode-quick",
         "Havok": "havok", "Jolt": "jolt-f32", "Rapier": "rapier-impulse-f64", "DART": "dart",
         "Newton, dense": "mujoco-euler-dense", "Newton, sparse": "mujoco-euler", "CG, sparse": "mujoco-euler-cg"}


def tables_of(page):
    """(text before, header, rows) of each table."""
    for found in re.finditer(r"([^\n]*\n(?:[^\n|]+\n)*)\n?((?:\|.*\n)+)", page):
        rows = [[cell.strip() for cell in row.strip().strip("|").split("|")] for row in found.group(2).splitlines()]
        if len(rows) > 2:
            yield found.group(1), rows[0], rows[2:]


def check_text(report, store, page):
    """Lists and tables that the page's author wrote."""
    claims = Claims(store, {})
    flat = " ".join(page.split())
    for list_ in re.findall(r"A step at 1 ms takes, in µs: ([^;]*?)\. ", flat):
        for name, value in re.findall(rf"([A-Z][\w -]*?) ({NUMBER})(?=,| \(|$)", list_):
            figure = name in PROSE and claims.figure("capsules-27", PROSE[name], "step_time", 1)
            if figure:
                report.printed("page", f"step time of {name} on capsules-27 in the text", value, figure.value)
    for before, header, rows in tables_of(page):
        before = " ".join(before.split())
        for row in rows:
            contender = PROSE.get(re.sub(r" \(.*\)$", "", row[0]))
            for column, text in zip(header[1:], row[1:]):
                label = f"{row[0]} in the column {column} of the table below '{before[:40]}...'"
                if contender and "Self-consistency error in mm at 1 ms" in before and column in store.systems:
                    if column == "grasp" and "(grasp: with drives)" in row[0]:
                        contender += "-native-pd"
                    figure = claims.figure(column, contender, "consistency", 0.25 if column == "grasp" else 1)
                    if re.fullmatch(NUMBER, text):
                        report.printed("page", label, text, figure and 1e3 * figure.value)
                if contender and header[0] == "capsules" and (column == "exponent" or column.isdigit()):
                    value = exponent_of(claims, contender, "capsules") if column == "exponent" else \
                        median_of_seeds(claims, contender, f"capsules-{column}", "run_time", 10)
                    if value:
                        report.printed("page", label, text, value)
            if header[:2] == ["contender", "holds up to (ms)"] and row[1] == "withdrawn":
                cells = store.of("grasp", "grasp", row[0])
                report.check("page", f"that {row[0]} is withdrawn", row[1], any(cell.outcome == "withdrawn" for cell in cells),
                             collections.Counter(cell.outcome for cell in cells))
                continue
            if header[:2] == ["contender", "holds up to (ms)"]:
                held, _ = Answers(claims).steps("grasp", "grasp", row[0], lambda cell: cell.outcome == "ok" and
                                                cell.values["grasp_held"].value == 1)
                report.check("page", f"what {row[0]} holds up to", row[1],
                             row[1] == (milliseconds(held) if held else "none"), milliseconds(held))
                fails = fractions.Fraction(row[2].partition(":")[0])
                cell = next(each for each in store.of("grasp", "grasp", row[0]) if each.timestep == float(fails))
                share = cell.values.get("grasp_held")
                if share:
                    report.printed("page", f"share that {row[0]} holds at {row[2].partition(':')[0]} ms", row[3].removesuffix(" %"),
                                   100 * share.value)
            if "hidden damping (1/s)" in header:
                cell = store.of("drift", row[0], row[1])[0]
                shown, unit, way = row[2].split()
                drift, rate = cell.values["energy_drift_relative"].value, cell.values["damping_rate"].value
                report.printed("page", f"energy that leaks, {row[1]} on {row[0]}", shown, 100 * drift)
                report.check("page", f"the way it leaks, {row[1]} on {row[0]}", way,
                             (unit, way) == ("%", "lost" if rate > 0 else "gained"), rate)
                report.printed("page", f"hidden damping, {row[1]} on {row[0]}", row[3], rate)


def median_of_seeds(claims, contender, system, name, timestep):
    """Over the system and those that differ from it in their seed, where the run ended well."""
    seeds = [each for each in claims.store.systems if re.fullmatch(rf"{system}(-seed-\d+)?", each)]
    found = [figure.value for each in seeds if (figure := claims.figure(each, contender, name, timestep))]
    return statistics.median(found) if found else None


def exponent_of(claims, contender, family):
    found = [cell for cell in claims.store.of("scaling", contender=contender) if "scaling_exponent" in cell.values
             and claims.store.systems[cell.system].get("family") == family]
    return claims.of(found[0], "scaling_exponent").value if found else None


def check_counts(report, store, readme):
    """The numbers of cells that a run's README gives."""
    text = " ".join(readme.split())
    found = re.search(r"(\d+) cells of which (\d+) are ok, ((?:\d+ \w+(?:, | and )?)+)", text)
    if not found:
        return
    cells = collections.Counter(cell.outcome for cell in store.cells.values() if cell.contender != HARNESS)
    shown = {"ok": int(found.group(2))} | {outcome: int(count) for count, outcome in re.findall(r"(\d+) (\w+)", found.group(3))}
    report.check("page", "number of cells", found.group(1), int(found.group(1)) == sum(cells.values()), sum(cells.values()))
    for outcome, count in shown.items():
        report.check("page", f"number of cells that ended {outcome}", count, count == cells[outcome], cells[outcome])
    share = re.search(rf"({NUMBER}) % of the processor's time was inside engine steps", text)
    if share:
        report.printed("page", "share of time in engine steps", share.group(1),
                       100 * float(store.manifest["engine_s"]) / float(store.manifest["cpu_s"]))


def check_export(report, store, rows):
    """Each exported row against the database, and each value of the database against the rows."""
    left = collections.defaultdict(list)  # several where many worlds were stepped: by their number
    for cell in sorted(store.cells.values(), key=lambda cell: (cell.measure, cell.id)):
        for name, value in cell.values.items():
            if cell.contender != HARNESS:
                left[cell.system, cell.contender, cell.timestep, name].append(value)
    for row in rows:
        place = row["system"], row["contender"], float(row["timestep_ms"]), row["measure"]
        if not left.get(place):
            continue
        value = left[place].pop(0)
        near_floor = row["measure"] in ("consistency", "consistency_cold") and row["value"] == "" and row["high"]
        for end in ("value", "low", "high"):
            given, stored = row[end], getattr(value, end)
            good = near_floor or (given == "" and stored is None) or (
                given != "" and stored is not None and close(float(given), stored, 1e-15))
            report.check("export", f"{end} of {' '.join(map(str, place))}", given, good, stored)
    for place, values in left.items():
        for value in values:
            report.check("export", " ".join(map(str, place)), "nothing", False, value)


def check_all(database, page=None, readme=None, values=None):
    """A Report of all that can be recomputed; the paths of text are optional."""
    report, store = Report(), Store(database)
    try:
        for kind, numbers in (("samples", from_samples), ("values", from_values), ("states", from_states)):
            for cell, name, number in numbers(store):
                # read between the kept states too, since rules 3: they are a lower bound
                between = kind == "states" and cell.measure in ("grasp", "violation") and int(store.manifest.get("soundness_rules", 1)) >= 3
                report.stored(kind, cell, name, number, between)
        if page:
            text = page.read_text("utf-8")
            with contextlib.closing(Store(database, counting=True)) as counting:
                check_claims(report, counting, text, (ROOT / "campaigns/paper_claims.toml").read_text("utf-8"),
                             CLAIMS.read_text("utf-8"))
                check_text(report, counting, text)
        if readme:
            check_counts(report, store, readme.read_text("utf-8"))
        if values:
            with values.open(newline="", encoding="utf-8") as rows:
                check_export(report, store, csv.DictReader(rows))
    finally:
        store.close()
    return report


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=pathlib.Path, nargs="?")
    parser.add_argument("--sentences", action="store_true", help="compare sentences of the pages with all committed results")
    parser.add_argument("--claims", type=pathlib.Path, metavar="PAGE", help="the page of claims that was written from RESULTS")
    parser.add_argument("--values", type=pathlib.Path, metavar="FILE", help="the values that were exported from RESULTS")
    parser.add_argument("--readme", type=pathlib.Path, metavar="FILE", help="the README of RESULTS")
    given = parser.parse_args()
    if given.sentences == (given.results is not None):
        parser.error("give RESULTS, or --sentences")
    with tempfile.TemporaryDirectory() as scratch:
        if given.sentences:
            import statements
            report = Report()
            statements.check(report)
        else:
            report = check_all(packed.database(given.results, scratch), given.claims, given.readme, given.values)
    for wrong in report.wrong:
        print(wrong)
    print(", ".join(f"{count} {kind}" for kind, count in report.counts.items()) + f": {len(report.wrong)} differ")
    return 1 if report.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
