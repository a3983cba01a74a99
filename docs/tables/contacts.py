"""The figure and the tables of contact-truth.md.

RESULTS is a results directory of campaigns/contacts.toml, or its database packed as assay.sqlite.xz.
"""

import collections
import html
import json
import math
import pathlib
import re

from .common import DOCS, milliseconds, opened, standing, table, write

# The rows of the tables: one or two contenders of each engine and what the engine has by itself. Those that a run lacks have no row.
SHOWN = {
    "MuJoCo": ("mujoco-default", "mujoco-euler-elliptic", "mujoco-euler-noslip"), "MuJoCo Warp": ("mujoco-warp",), "MJX": ("mjx",),
    "Newton": ("newton-mujoco", "newton-steel"), "Bullet": ("bullet-si-f64", "bullet-mb", "bullet-default"),
    "ODE": ("ode-quick", "ode-default"), "PhysX 5.1": ("physx-d6-pgs4", "physx-art-tgs4"), "PhysX 5.6": ("physx56-d6-pgs", "physx56-art-tgs4"),
    "Havok": ("havok", "havok-default"), "Jolt": ("jolt-f64", "jolt-default"), "Box3D": ("box3d", "box3d-default"), "Rapier": ("rapier-impulse-f64", "rapier-default"),
    "SAPIEN": ("sapien-tgs",), "DART": ("dart", "dart-default"), "DART 6.20": ("dartpy",), "Drake": ("drake-sap", "drake-similar"), "Genesis": ("genesis",), "SuperDex": ("superdex",)}
CLOSE_M = 1e-3  # "within 1 mm"
HEADLINE_MS = 1  # the timestep of the comparison
TABLES = {
    "sliding and rolling": ("sliding-box", "incline-boxes", "sphere-to-rolling", "rolling", "tipping-box"),
    "impacts": ("rod-strike-sticks", "rod-strike-slips", "ball-row", "rimless-wheel"),
    "limits, rest and grip": ("joint-stops", "box-stack", "grip-holds", "grip-slips", "four-bar")}

# What moves, what is solved exactly, and after whom; the length is that of the run.
SYSTEMS = {
    "sliding-box": ("a box slides to rest, at 37° to the axes of world and box", "constant deceleration µ g", "Kleppner and Kolenkow"),
    "incline-boxes": ("four boxes on a slope of 26.6°: held, just held, sliding off, thrown across", "closed form of the bent path",
                      "Coulomb's law for a point, integrated in the tangent of half the angle"),
    "sphere-to-rolling": ("a ball thrown without spin, until it rolls", "5/7 of the speed, after 2 v / (7 µ g)", "Kleppner and Kolenkow"),
    "rolling": ("a ball, a cylinder and a capsule roll from rest down a slope", "constant accelerations, 5/7 and 2/3 of gravity along the slope",
                "Kleppner and Kolenkow"),
    "tipping-box": ("a tall box tips about its edge, which sticks", "a pendulum about the edge, integrated, energy checked",
                    "Euler's equation about a fixed axis"),
    "rod-strike-sticks": ("the end of a leaning rod strikes the ground and sticks", "impulse that stops the end", "Routh; Stewart"),
    "rod-strike-slips": ("the same with friction 0.1 and a speed along the ground: it slips", "impulse on the edge of the friction cone", "Routh; Stewart"),
    "ball-row": ("a ball meets four others, one after the other", "momentum: 1, 1/2, 1/3, 1/4, 1/5 m/s", "perfectly inelastic impacts"),
    "rimless-wheel": ("a wheel of eight feet rolls down a slope", "a pendulum between impacts, angular momentum about the new foot",
                      "McGeer; Coleman, Chatterjee and Ruina"),
    "joint-stops": ("four joints with limits, dry friction, springs, dampers", "closed form from stop to stop", "the linear oscillator in pieces"),
    "box-stack": ("five boxes in a stack", "rest: the loads' centres lie within the faces", "statics"),
    "grip-holds": ("two fingers on springs hold a box", "rest: 2 µ N is more than the weight", "statics"),
    "grip-slips": ("the same with less friction: the box slips", "constant acceleration g - 2 µ N / m", "Coulomb's law"),
    "four-bar": ("a loop of four bars, without contact", "the [reference solution](../methodology.md#error-against-the-reference-solution-smooth-systems)",
                 "Kane's equations with the loop held closed")}


class Errors:
    """What a run has of each contender."""

    def __init__(self, db):
        standing.standing(db)
        self.facts = {name: json.loads(text) for name, text in db.execute("SELECT name, json FROM systems")}
        self.contenders = [name for name, in db.execute("SELECT name FROM contenders ORDER BY rowid")]
        self.outcome, self.value = {}, collections.defaultdict(dict)
        for cell, *place, outcome in db.execute("SELECT id, system, contender, timestep_ms, outcome FROM cells WHERE measure = 'truth'"):
            self.outcome[tuple(place)] = outcome
            for name, value in db.execute('SELECT name, value FROM "values" WHERE cell_id = ?', (cell,)):
                self.value[tuple(place)][name] = value
        self.measured = {contender for _, contender, _ in self.outcome}
        self.timesteps = sorted({timestep for _, _, timestep in self.outcome})

    def error(self, system, contender, timestep=HEADLINE_MS):
        """In m; None where the run did not end well."""
        place = system, contender, timestep
        return self.value[place].get("truth_error_max") if self.outcome.get(place) == "ok" else None

    def order(self, system, contender):
        """Between the timesteps around that of the comparison."""
        return self.value[system, contender, HEADLINE_MS].get("truth_order")

    def has_floor(self, system, contender):
        return "truth_floor" in self.value[system, contender, self.timesteps[0]]

    def shown(self):
        return {engine: here for engine, names in SHOWN.items() if (here := [name for name in names if name in self.measured])}


def millimetres(error):
    value = 1e3 * error
    return "<0.001" if value < 1e-3 else f"{value:.0f}" if value >= 99.5 else f"{float(f'{value:.2g}'):g}"


def cell(errors, system, contender):
    least = errors.timesteps[0]
    outcome = errors.outcome.get((system, contender, HEADLINE_MS))
    if outcome in (None, "unsupported"):
        return "–"
    if outcome != "ok":
        return outcome
    here, fine, order = errors.error(system, contender), errors.error(system, contender, least), errors.order(system, contender)
    text = f"{millimetres(here)} → {millimetres(fine) if fine is not None else errors.outcome[system, contender, least]}"
    if errors.has_floor(system, contender):
        text = f"**{text}**"
    return text + (f" ({order:.1f})".replace("-0.0", "0.0").replace("-", "−") if order is not None and here >= 1e-6 else "")


def error_tables(errors):
    parts = []
    for title, systems in TABLES.items():
        parts.append(f"{title[0].upper()}{title[1:]}:\n\n" + table_of(errors, systems, cell))
    return "\n".join(parts)


def signed(value, digits=2):
    """In so many digits, with its sign."""
    text = f"{float(f'{abs(value):.{digits}g}'):g}"
    return "0" if abs(value) < 1e-3 else ("−" if value < 0 else "+") + text


def event_cell(errors, system, contender):
    """The largest error in ms with the sign of the mean, at 1 ms and at the smallest timestep; what is missed."""
    if errors.outcome.get((system, contender, HEADLINE_MS)) in (None, "unsupported"):
        return "–"

    def at(timestep):
        outcome, values = errors.outcome.get((system, contender, timestep)), errors.value[system, contender, timestep]
        if outcome != "ok":
            return outcome
        missed = f"{values['missed_events']:.0f} missed" if values["missed_events"] else ""
        if "event_time_error" not in values:
            return missed
        return ", ".join(part for part in (signed(math.copysign(values["event_time_error"], values["event_lag"])), missed) if part)
    text = f"{at(HEADLINE_MS)} → {at(errors.timesteps[0])}"
    return f"**{text}**" if "event_time_floor" in errors.value[system, contender, errors.timesteps[0]] else text


def impulse_cell(errors, system, contender):
    """The normal and the tangential error at 1 ms, %."""
    outcome = errors.outcome.get((system, contender, HEADLINE_MS))
    if outcome != "ok":
        return "–" if outcome in (None, "unsupported") else outcome
    values, least = errors.value[system, contender, HEADLINE_MS], errors.value[system, contender, errors.timesteps[0]]
    parts = []
    for part in ("normal", "tangential"):
        error = values.get(f"{part}_impulse_error")
        if error is None:
            continue
        text = "<0.1" if error < 1e-3 else ">999" if error >= 9.995 else f"{float(f'{100 * error:.2g}'):g}"
        parts.append(f"**{text}**" if f"{part}_impulse_floor" in least else text)
    return " / ".join(parts)


def table_of(errors, systems, of_cell):
    rows = [[f"`{name}`", *(of_cell(errors, system, name) for system in systems)] for names in errors.shown().values() for name in names]
    return table(["contender", *(f"`{system}`" for system in systems)], rows)


def event_tables(errors):
    has = [system for systems in TABLES.values() for system in systems
           if any("missed_events" in values for (of, *_), values in errors.value.items() if of == system)]
    return table_of(errors, has, event_cell) if has else ""  # a run of before event times


def impulse_tables(errors):
    parts = []
    for title, systems in TABLES.items():
        has = [system for system in systems if any("normal_impulse_error" in values for (of, *_), values in errors.value.items() if of == system)]
        if has:
            parts.append(f"{title[0].upper()}{title[1:]}:\n\n" + table_of(errors, has, impulse_cell))
    return "\n".join(parts)


def within(errors):
    rows = []
    for system in SYSTEMS:
        every, some = [], []
        for engine, names in errors.shown().items():
            given = [name for name in names if errors.outcome.get((system, name, HEADLINE_MS)) not in (None, "unsupported")]
            close = [name for name in given if (error := errors.error(system, name)) is not None and error <= CLOSE_M]
            if given and close == given:
                every.append(engine)
            elif close:
                some.append(f"{engine} ({', '.join(f'`{name}`' for name in close)})")
        rows.append([f"`{system}`", ", ".join(every) or "none", ", ".join(some) or "none"])
    return table(["system", "every contender shown", "some"], rows)


def systems(errors):
    rows = []
    for system, (what, how, source) in SYSTEMS.items():
        facts = errors.facts[system]
        solution = f"`{facts['solution']}`" if "solution" in facts else "smooth"
        rows.append([f"[`{system}`](../../models/{facts['model']})", f"{facts['duration_s']:g} s", what, solution, how, source])
    return table(["system", "length", "what moves", "solution", "what is exact", "after"], rows)


# ---- laws of friction on the sliding box ------------------------------------------------------------------------------


class SlidingBox:
    """The box of models/sliding-box.xml: where each law of friction would let it stop."""

    def __init__(self):
        text = (DOCS.parent / "models/sliding-box.xml").read_text("utf-8")

        def numbers(pattern):
            return [float(word) for word in re.search(pattern, text).group(1).split()]
        self.vx, self.vy = numbers(r'qvel="([^"]*)"')[:2]
        self.mu = numbers(r'name="box" type="box"[^>]*friction="([^"]*)"')[0]
        self.half = numbers(r'name="box" type="box" size="([^"]*)"')
        self.g = -numbers(r'gravity="([^"]*)"')[2]
        self.a = self.mu * self.g

    def way(self):
        return (self.vx ** 2 + self.vy ** 2) / (2 * self.a)

    def cone(self):
        v = math.hypot(self.vx, self.vy)
        return self.way() * self.vx / v, self.way() * self.vy / v

    def pyramid_inside(self):
        """|Fx| + |Fy| <= mu N, the most that brakes: first along the larger part of the slip, then along the diagonal."""
        vx, vy = max(self.vx, self.vy), min(self.vx, self.vy)
        first = (vx - vy) / self.a
        x, y = (vx ** 2 - vy ** 2) / (2 * self.a) + vy ** 2 / self.a, vy * first + vy ** 2 / self.a
        return (x, y) if self.vx >= self.vy else (y, x)

    def pyramid_around(self):
        """|Fx| <= mu N and |Fy| <= mu N."""
        return self.vx ** 2 / (2 * self.a), self.vy ** 2 / (2 * self.a)

    def scaled(self, corners=False, steps=20000):
        """Each of the box's two directions asks for the impulse that stops it by itself, the two are scaled to mu N: F is along
        (vx / kx, vy / ky) with k the inverse mass that the point shows in the direction: 1 / m + z^2 / I at the middle of the face, more by
        s^2 / In at its corners, s across the direction from the middle, In the inertia about the normal."""
        x, y, z = self.half

        def weight(along, across):
            return 1 / (1 + z ** 2 / ((along ** 2 + z ** 2) / 3) + (across ** 2 / ((x ** 2 + y ** 2) / 3) if corners else 0))
        wx, wy = weight(x, y), weight(y, x)
        way_x = way_y = 0.0
        # over vx, with vy = vy0 (vx / vx0)^(wy / wx)
        for i in range(steps):
            u = self.vx * (i + 0.5) / steps
            v = self.vy * (u / self.vx) ** (wy / wx)
            share = math.hypot(wx * u, wy * v) / (self.a * wx) * self.vx / steps
            way_x += share
            way_y += share * v / u
        return way_x, way_y

    def off(self, law):
        return math.dist(law(), self.cone())

    def laws(self):
        return {"Coulomb's cone": self.off(self.cone),
                "a pyramid inside the cone": self.off(self.pyramid_inside),
                "a pyramid around the cone": self.off(self.pyramid_around),
                "two directions solved separately, then scaled to the cone": self.off(self.scaled),
                "the same at each corner": self.off(lambda: self.scaled(corners=True))}


ALIKE_M = 2e-3  # the engine's error and the law's


def by_law(errors, system="sliding-box"):
    """{law: (its error, the contenders that have it at the smallest timestep)}; the others under ''."""
    laws = SlidingBox().laws()
    found = {law: (off, []) for law, off in laws.items()} | {"": (None, [])}
    for contender in errors.contenders:
        error = errors.error(system, contender, errors.timesteps[0])
        if error is not None:
            law = next((law for law, off in laws.items() if abs(error - off) <= ALIKE_M), "")
            found[law][1].append(contender)
    return found


def laws(errors):
    rows = []
    for law, (off, contenders) in by_law(errors).items():
        rows.append([law or "none of these", "–" if off is None else f"{1e3 * off:.1f} mm", ", ".join(f"`{name}`" for name in contenders) or "none"])
    return table(["law of friction", "where it lets the box stop is off by", "contenders within 2 mm of that at 1/16 ms"], rows)


# ---- the figure -------------------------------------------------------------------------------------------------------

PANELS = {"sliding-box": "A box slides to rest", "rolling": "Bodies roll down a slope", "rod-strike-sticks": "A rod's end strikes and sticks",
          "grip-holds": "Two fingers hold a box"}
LINES = {"mujoco-default": ("MuJoCo's defaults", "#1463c4", ""), "mujoco-euler-elliptic": ("MuJoCo, elliptic", "#1463c4", "5 3"),
         "bullet-si-f64": ("Bullet", "#d4590c", ""), "ode-quick": ("ODE", "#2b8a3e", ""), "physx-d6-pgs4": ("PhysX", "#8a2be2", ""),
         "havok": ("Havok", "#c2185b", ""), "jolt-f64": ("Jolt", "#0b7285", ""), "jolt-default": ("Jolt's defaults", "#0b7285", "5 3"),
         "rapier-impulse-f64": ("Rapier", "#7f6000", ""), "rapier-default": ("Rapier's defaults", "#7f6000", "5 3"), "dart": ("DART", "#495057", "")}
WIDTH, HEIGHT = 400, 300  # of a panel
LEFT, RIGHT, TOP, BOTTOM = 62, 106, 26, 40
LOW, HIGH = 1e-3, 200  # mm; less is drawn at the lower edge
LABEL = 10  # px between labels


def panel(errors, system, title):
    steps = errors.timesteps

    def x_of(step):  # the larger timestep is on the left
        return LEFT + math.log(steps[-1] / step) / math.log(steps[-1] / steps[0]) * (WIDTH - RIGHT - LEFT)

    def y_of(error):
        return HEIGHT - BOTTOM - math.log(max(1e3 * error, LOW) / LOW) / math.log(HIGH / LOW) * (HEIGHT - BOTTOM - TOP)
    parts = [f'<text x="{LEFT}" y="15" font-weight="bold">{html.escape(title)}</text>']
    for step in steps:
        parts.append(f'<line x1="{x_of(step):.1f}" y1="{TOP}" x2="{x_of(step):.1f}" y2="{HEIGHT - BOTTOM}" stroke="#dddddd"/>')
        parts.append(f'<text x="{x_of(step):.1f}" y="{HEIGHT - BOTTOM + 14}" text-anchor="middle">{milliseconds(step)}</text>')
    for mm in (0.001, 0.01, 0.1, 1, 10, 100):
        at = y_of(mm / 1e3)
        parts.append(f'<line x1="{LEFT}" y1="{at:.1f}" x2="{WIDTH - RIGHT}" y2="{at:.1f}" stroke="{"#999999" if mm == 1 else "#dddddd"}"/>')
        parts.append(f'<text x="{LEFT - 5}" y="{at + 4:.1f}" text-anchor="end">{"≤ " if mm == LOW else ""}{mm:g}</text>')
    labels = []
    for contender, (name, color, dash) in LINES.items():
        points = [(x_of(step), y_of(error)) for step in reversed(steps) if (error := errors.error(system, contender, step)) is not None]
        if not points:
            continue
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="1.5" stroke-dasharray="{dash}"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{color}"/>' for x, y in points]
        labels.append([points[-1][1], color, name])
    # labels that would overlap move apart, around where they belong
    labels.sort()
    places = [label[0] for label in labels]
    for _ in range(200):
        for i in range(len(places) - 1):
            if (close := LABEL - (places[i + 1] - places[i])) > 0:
                places[i] -= close / 2
                places[i + 1] += close / 2
        over = max(0, places[-1] - (HEIGHT - BOTTOM + 4))
        places[-1] -= over
    for place, (at, color, name) in zip(places, labels):
        parts.append(f'<line x1="{WIDTH - RIGHT + 3}" y1="{at:.1f}" x2="{WIDTH - RIGHT + 11}" y2="{place:.1f}" stroke="{color}" stroke-width="0.7"/>')
        parts.append(f'<text x="{WIDTH - RIGHT + 13}" y="{place + 3:.1f}" fill="{color}" font-size="9">{html.escape(name)}</text>')
    middle = (LEFT + WIDTH - RIGHT) / 2
    parts.append(f'<text x="{middle:.1f}" y="{HEIGHT - 9}" text-anchor="middle">timestep (ms), smaller to the right</text>')
    up = (TOP + HEIGHT - BOTTOM) / 2
    parts.append(f'<text x="13" y="{up}" text-anchor="middle" transform="rotate(-90 13 {up})">largest error (mm)</text>')
    return parts


def figure(errors, path):
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * WIDTH} {2 * HEIGHT}" font-family="sans-serif" font-size="11">',
             f'<rect width="{2 * WIDTH}" height="{2 * HEIGHT}" fill="white"/>']
    for number, (system, title) in enumerate(PANELS.items()):
        lines.append(f'<g transform="translate({number % 2 * WIDTH} {number // 2 * HEIGHT})">')
        lines += panel(errors, system, title)
        lines.append("</g>")
    path.write_text("\n".join(lines) + "\n</svg>\n", "utf-8")


def add_arguments(parser):
    parser.add_argument("results", metavar="RESULTS", type=pathlib.Path)
    parser.add_argument("--page", type=pathlib.Path, default=DOCS / "lab/contact-truth.md")


def update(options):
    with opened(options.results) as (_, db):
        errors = Errors(db)
    figure(errors, options.page.with_suffix(".svg"))
    write(options.page, {"within": within(errors), "errors": error_tables(errors), "events": event_tables(errors),
                         "impulses": impulse_tables(errors), "laws": laws(errors), "systems": systems(errors)})
