"""The tables of lab/engines.md, and with --newer the first one of engines.md.

RESULTS is a results directory of campaigns/field.toml, or the database of one packed as assay.sqlite.xz; after --worlds one of
campaigns/batches.toml, after --full one of campaigns/paper.toml (default: the committed one). Without the field's speeds where the
machine was shared. Withdrawn figures are left out (results/standing.py).
"""

import json
import pathlib
import statistics
import subprocess
import tomllib

from .common import DOCS, milliseconds, opened, standing, table, write

PAGE = DOCS / "lab/engines.md"
FULL = DOCS.parent / "results/intel-xeon-2-cores/assay.sqlite.xz"
RELEASES = tomllib.loads((DOCS / "releases.toml").read_text("utf-8"))
NO = "–"
SI = [(1, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n")]
# Limited values in words.
SHORT = {"truth_error_max": "the error", "consistency": "the error", "consistency_cold": "the error", "penetration_max": "penetration",
         "penetration_added_max": "penetration beyond the start's", "grasp_slip": "slip"}
# system, options of `assay recommend`, in words
QUESTIONS = [
    ("spatial-chain", ["--error", "1mm"], "the chain, within 1 mm of the reference solution"),
    ("spatial-chain", ["--error", "1um"], "the chain, within 1 µm"),
    ("humanoid", ["--error", "5mm"], "the humanoid that falls, within 5 mm of its own motion at a fine timestep"),
    ("grasp", ["--slip", "5mm"], "the grasp, the object slips less than 5 mm"),
    ("capsules-27", ["--error", "5mm"], "27 capsules, within 5 mm"),
]
TOUCHING = ("humanoid", "grasp", "capsules-27")


def quantity(value, unit, count=2):
    """`count` significant digits with a prefix."""
    if value == 0:
        return f"0 {unit}"
    scale, prefix = next(((s, p) for s, p in SI if abs(value) >= 0.9995 * s), SI[-1])
    number = float(f"{value / scale:.{count}g}")
    return f"{number:g} {prefix}{unit}"


def family(engine):
    """Its name without the precision of the build."""
    return engine.removesuffix("-f64").removesuffix("-f32")


class Run:
    def __init__(self, db):
        self.db = standing.standing(db)
        self.contenders = [name for name, in db.execute("SELECT name FROM contenders ORDER BY rowid") if name != "null"]

    def duration(self, system):
        facts, = self.db.execute("SELECT json FROM main.systems WHERE name = ?", (system,)).fetchone()
        return f"{json.loads(facts)['duration_s']:g} s"

    def piece(self, system):
        facts, = self.db.execute("SELECT json FROM main.systems WHERE name = ?", (system,)).fetchone()
        return f"{json.loads(facts)['piece_ms']:g} ms"

    def late_step(self, system, contender, share=0.25):
        """The step time at 1 ms over the last part of the motion, in us; None where it was not timed."""
        cell = self.db.execute("SELECT id FROM cells WHERE system = ? AND contender = ? AND timestep_ms = 1 AND"
                               " measure = 'raw_speed' AND outcome = 'ok'", (system, contender)).fetchone()
        if not cell:
            return None
        weights, times = ([value for value, in self.db.execute(
            "SELECT value FROM samples WHERE cell_id = ? AND name = ? ORDER BY idx", (cell[0], name))]
            for name in ("window_weight", "window_step_time_us"))
        rounds = [times[at:at + len(weights)] for at in range(0, len(times), len(weights))]
        windows = [statistics.median(window) for window in zip(*rounds)]
        late = range(round((1 - share) * len(weights)), len(weights))
        return sum(weights[i] * windows[i] for i in late) / sum(weights[i] for i in late)

    def facts(self, contender):
        engine, version, capabilities = self.db.execute(
            "SELECT engine, version, capabilities_json FROM contenders WHERE name = ?", (contender,)).fetchone()
        return engine, version, json.loads(capabilities or "{}")

    def has_contacts(self, contender):
        """Whether it takes part where bodies touch."""
        marks = ", ".join("?" * len(TOUCHING))
        return self.db.execute(f"SELECT 1 FROM cells WHERE contender = ? AND system IN ({marks}) AND outcome <> 'unsupported' LIMIT 1",
                               (contender, *TOUCHING)).fetchone() is not None

    def outcome(self, system, contender, timestep, measure):
        row = self.db.execute("SELECT outcome FROM cells WHERE system = ? AND contender = ? AND timestep_ms = ? AND measure = ?",
                              (system, contender, timestep, measure)).fetchone()
        return row[0] if row else ""

    def why(self, system, contender, measure):
        """The outcome's cause where it is the machine's and not the contender's."""
        reason, = self.db.execute("SELECT reason FROM cells WHERE system = ? AND contender = ? AND measure = ?",
                                  (system, contender, measure)).fetchone()
        return "no memory" if "allocate" in reason else ""

    def stored(self, system, contender, timestep, measure, name):
        """The value with the ends of its interval, each None where there is none."""
        row = self.db.execute(
            'SELECT v.value, v.low, v.high FROM cells c JOIN "values" v ON v.cell_id = c.id WHERE c.system = ? AND '
            "c.contender = ? AND c.timestep_ms = ? AND c.measure = ? AND v.name = ?",
            (system, contender, timestep, measure, name)).fetchone()
        return row or (None, None, None)

    def text(self, system, contender, timestep, measure, name, unit, scale=1):
        """The value with its interval, times `scale`, or how the run ended."""
        outcome = self.outcome(system, contender, timestep, measure)
        if outcome in ("", "unsupported"):
            return NO
        value, low, high = self.stored(system, contender, timestep, measure, name)
        if outcome != "ok" or value is None:
            return outcome
        bound, _, _ = self.stored(system, contender, timestep, measure, f"{name}_bound")
        if bound is not None:
            return f"≤ {quantity(scale * bound, unit)}"
        around = "" if low is None or low == high else f" [{quantity(scale * low, unit)}, {quantity(scale * high, unit)}]"
        return quantity(scale * value, unit) + around

    def holds_up_to(self, contender):
        held = self.db.execute(
            'SELECT v.value FROM cells c JOIN "values" v ON v.cell_id = c.id WHERE c.system = \'grasp\' AND c.contender = ? AND '
            "v.name = 'stable_up_to_timestep' AND v.value IS NOT NULL", (contender,)).fetchone()
        if held:
            return f"{milliseconds(held[0])} ms"
        outcomes = {outcome for outcome, in self.db.execute(
            "SELECT outcome FROM cells WHERE system = 'grasp' AND contender = ? AND measure = 'grasp'", (contender,))}
        if "withdrawn" in outcomes:
            return "withdrawn"
        return NO if outcomes <= {"unsupported"} else "never"


def engines_table(run):
    rows = {}
    for contender in run.contenders:
        engine, version, capabilities = run.facts(contender)
        if not version:
            continue
        row = rows.setdefault(engine, [version, set(), set(), []])
        row[1].add(capabilities.get("precision", ""))
        row[2].add(capabilities.get("coordinates", ""))
        row[3].append(f"`{contender}`")
    def released(engine, version):
        known = RELEASES[family(engine)]
        return {known["version"]: known["released"], **known.get("earlier", {})}.get(version, "unknown")
    return table(["engine", "version", "released", "precision", "coordinates", "contenders here"],
                 [[engine, version, released(engine, version), ", ".join(sorted(precision)), ", ".join(sorted(coordinates)), ", ".join(contenders)]
                  for engine, (version, precision, coordinates, contenders) in rows.items()])


def figures_table(run, speeds):
    header = ["contender", "chain: error at 1 ms", "astronaut: energy drift at 4 ms", f"humanoid: error at 1 ms over pieces of {run.piece('humanoid')}",
              "humanoid: penetration at 4 ms", "grasp: holds up to", "27 capsules: penetration at 4 ms"]
    if speeds:
        header += ["chain: step at 1 ms", "humanoid: step at 1 ms", f"27 capsules, {run.duration('capsules-27')}: step at 1 ms",
                   "in its last quarter"]
    # runs of before that have the paper's variant alone
    error = "consistency_cold" if run.db.execute('SELECT 1 FROM "values" WHERE name = \'consistency_cold\' LIMIT 1').fetchone() else "consistency"
    rows = []
    for contender in run.contenders:
        row = [f"`{contender}`", run.text("spatial-chain", contender, 1, "truth", "truth_error_max", "m")]
        drift = run.text("astronaut-energy", contender, 4, "drift", "energy_drift_relative", "")
        share, _, _ = run.stored("astronaut-energy", contender, 4, "drift", "energy_drift_relative")
        row.append(f"{100 * share:.2g} %" if share is not None and drift not in (NO, "diverged", "unstable", "withdrawn") else drift)
        row.append(run.text("humanoid", contender, 1, "consistency", error, "m"))
        row.append(run.text("humanoid", contender, 4, "violation", "penetration_max", "m"))
        row.append(run.holds_up_to(contender))
        row.append(run.text("capsules-27", contender, 4, "violation", "penetration_max", "m"))
        if speeds:
            for system in ("spatial-chain", "humanoid", "capsules-27"):
                row.append(run.text(system, contender, 1, "raw_speed", "step_time", "s", 1e-6))
            late = run.late_step("capsules-27", contender)
            row.append(quantity(1e-6 * late, "s") if late else NO)
        if any(cell != NO for cell in row[1:]):
            rows.append(row)
    return table(header, rows)


def worlds_table(run, system):
    """World-steps a second by the number of worlds, and what a step of one and of the most costs."""
    counts = sorted({int(measure.removeprefix("batch-")) for measure, in run.db.execute(
        "SELECT DISTINCT measure FROM cells WHERE measure LIKE 'batch-%' AND system = ?", (system,))})
    timestep, = run.db.execute("SELECT DISTINCT timestep_ms FROM cells WHERE measure LIKE 'batch-%' AND system = ?", (system,)).fetchone()
    most = counts[-1]
    rows = []
    for contender in run.contenders:
        processes = max(int(run.stored(system, contender, timestep, f"batch-{worlds}", "batch_processes")[0] or 1) for worlds in counts)
        row = [f"`{contender}`", str(processes)]
        for worlds in counts:
            outcome = run.outcome(system, contender, timestep, f"batch-{worlds}")
            rate, _, _ = run.stored(system, contender, timestep, f"batch-{worlds}", "batch_rate")
            if outcome == "ok" and rate:
                row.append(f"{float(f'{rate / 1e3:.2g}'):g}")
            else:
                row.append(NO if outcome in ("", "unsupported") else run.why(system, contender, f"batch-{worlds}") or outcome)
        for worlds in (1, most):
            latency, _, _ = run.stored(system, contender, timestep, f"batch-{worlds}", "batch_latency")
            row.append(quantity(1e-6 * latency, "s") if latency else NO)
        memory, _, _ = run.stored(system, contender, timestep, f"batch-{most}", "batch_memory")
        row.append(f"{float(f'{memory / 1e6:.2g}'):g} MB" if memory else NO)
        if any(cell != NO for cell in row[2:]):
            rows.append(row)
    return table(["contender", "cores", *map(str, counts), "latency of 1", f"of {most}", f"memory of {most}"], rows)


def asked(program, folder, system, options):
    done = subprocess.run([program, "recommend", folder, system, *options, "--json"], capture_output=True, text=True)
    return json.loads(done.stdout)


def point_text(point):
    speed = point["realtime_factor"]["value"]
    about = "" if point["timed"] else "about "
    edge = f", {point['edge']}" if point["edge"] else ""
    return f"`{point['contender']}` at {milliseconds(point['timestep_ms'])} ms, {about}{float(f'{speed:.2g}'):g} times real time{edge}"


def fastest(answer):
    if answer["recommended"]:
        return point_text(answer["recommended"])
    ways = [f"with {SHORT.get(each['value'], each['value'])} within {each['text']} {point_text(each['recommended'])}" for each in answer["relaxations"]]
    return "none; " + "; ".join(ways) if ways else "none"


def usual(options, *answers):
    """The limits of contacts that the program adds to a question, as each of the answers has them."""
    defaults = [{limit["value"]: quantity(limit["largest"], limit["unit"]) for limit in answer["limits"]
                 if limit["default"] and not ("--slip" in options and limit["value"] == "grasp_slip")} for answer in answers]
    texts = []
    for name in dict.fromkeys(name for own in defaults for name in own):
        sizes = " or ".join(dict.fromkeys(own[name] for own in defaults if name in own))
        where = "" if all(name in own for own in defaults) else ", where it was measured"
        texts.append(f", {SHORT[name]} within {sizes} (default{where})")
    return "".join(texts)


def answers_table(program, folder, full):
    rows = []
    for system, options, words in QUESTIONS:
        here, there = (asked(program, run, system, options) for run in (folder, full))
        rows.append([words + usual(options, here, there), fastest(here), fastest(there), f"`assay recommend field {system} {' '.join(options)}`"])
    return table(["question", "fastest within it in this run", "in the full run", "asked by"], rows)


def best_table(program, folder, run):
    """Of each engine the fastest contender within each question's limits, with its interval."""
    header, columns = ["engine"], []
    for system, options, words in (question for question in QUESTIONS if question[0] in TOUCHING):
        answer, fastest_of = asked(program, folder, system, options), {}
        for point in sorted(answer["contenders"], key=lambda point: point["realtime_factor"]["value"]):
            fastest_of[family(run.facts(point["contender"])[0])] = point
        header.append(words + usual(options, answer))
        columns.append(fastest_of)
    engines = dict.fromkeys(family(run.facts(contender)[0]) for contender in run.contenders if run.has_contacts(contender))
    return table(header, [[engine, *(best_text(fastest_of.get(engine)) for fastest_of in columns)] for engine in engines])


def best_text(point):
    if point is None:
        return "none"
    value, low, high = (float(f"{point['realtime_factor'][name]:.2g}") for name in ("value", "low", "high"))
    return f"{'' if point['timed'] else 'about '}{value:g}× [{low:g}, {high:g}]: `{point['contender']}` at {milliseconds(point['timestep_ms'])} ms"


def add_arguments(parser):
    parser.add_argument("program", metavar="ASSAY")
    parser.add_argument("results", type=pathlib.Path)
    parser.add_argument("--worlds", type=pathlib.Path)
    parser.add_argument("--full", type=pathlib.Path, default=FULL)
    parser.add_argument("--without-speeds", action="store_true")
    parser.add_argument("--newer", action="store_true", help="write the tables of the run with the newer engines")
    parser.add_argument("--page", type=pathlib.Path, default=PAGE)


def update(options):
    with opened(options.results) as (database, db), opened(options.full) as (full, other):
        run = Run(db)
        blocks = {"engines": engines_table(run), "figures": figures_table(run, not options.without_speeds)}
        if options.newer:
            write(options.page, {"newer-figures": blocks["figures"]})
            write(DOCS / "engines.md", {"newer-best": best_table(options.program, database.parent, run)})
            return
        if not options.without_speeds:
            blocks["answers"] = answers_table(options.program, database.parent, full.parent)
    if options.worlds:
        with opened(options.worlds) as (_, db):
            run = Run(db)
            for system in ("planar-chain", "humanoid"):
                blocks[f"worlds-{system}"] = worlds_table(run, system)
    write(options.page, blocks)
