"""The figure and the tables of reality.md and lab/reality.md.

RESULTS is a folder of answers of `assay match`, NAME.json or NAME.json.xz, and of benchmarks/known_truth.py; README.md of results/
has the commands.
"""

import html
import json
import lzma
import pathlib
import random
import statistics

from .common import DOCS, milliseconds, table, write

# Of the figure: its title, and which error of a free body it shows.
PANELS = {"tosses": ("Tossed cube: held-out error over the whole motion (% of its side)", "position_percent"),
          "double-pendulum": ("Double pendulum: held-out error over 2 s (degrees)", None)}
OTHERS = ("pendulum-sysid", "pendulum-energy")  # tables alone
RESAMPLES = 2000


def answer(folder, name):
    path = folder / f"{name}.json"
    text = path.read_bytes() if path.exists() else lzma.decompress((folder / f"{name}.json.xz").read_bytes())
    return json.loads(text)


def score(figures):
    """By which contenders are ranked: the joints' error in degrees, or the mean of a free body's two."""
    if "joints_deg" in figures:
        return figures["joints_deg"]
    return (figures["position_percent"] + figures["rotation_deg"]) / 2


class Contender:
    """What one contender's held-out logs say; all means are taken here and not by the program."""

    def __init__(self, found):
        self.name, self.found = found["contender"], found
        self.logs = {log["log"]: log for log in found.get("logs", [])}

    def scores(self, which):
        return {name: score(log[which]) for name, log in self.logs.items() if log[which]}

    def mean(self, which, key=None):
        of = [log[which] for log in self.logs.values() if log.get(which)]
        return statistics.mean(score(each) if key is None else each[key] for each in of)

    def on(self, logs):
        """The same of these logs alone."""
        return Contender({**self.found, "logs": [log for log in self.found["logs"] if log["log"] in logs]})

    def parameter(self, name):
        return next(each for each in self.found["parameters"] if each["name"] == name)


def ranked(found):
    """Best first; those without a fit are not among them."""
    return sorted((Contender(each) for each in found["contenders"] if not each["failure"]), key=lambda each: each.mean("held_out"))


def apart(contender, other):
    """95 % of the mean difference of their errors on the same logs, by bootstrap over logs."""
    ours, theirs = contender.scores("held_out"), other.scores("held_out")
    differences = [ours[log] - theirs[log] for log in sorted(ours.keys() & theirs.keys())]
    draw = random.Random(1)
    means = sorted(statistics.fmean(draw.choices(differences, k=len(differences))) for _ in range(RESAMPLES))
    return means[int(0.025 * RESAMPLES)], means[int(0.975 * RESAMPLES) - 1]


def as_good_as_best(found):
    """The best contender's name first."""
    best, *others = ranked(found)
    return [best.name] + [each.name for each in others if apart(each, best)[0] <= 0]


def errors_text(contender, which):
    of = next(log[which] for log in contender.logs.values() if log.get(which))
    if "joints_deg" in of:
        return f"{contender.mean(which):.2f}°"
    return f"{contender.mean(which, 'position_percent'):.1f} %, {contender.mean(which, 'rotation_deg'):.1f}°"


def errors_table(found):
    order, rows = ranked(found), []
    best = order[0]
    short = "held_out_short" in found["contenders"][0]
    for each in order:
        low, high = apart(each, best) if each is not best else (0, 0)
        behind = "best" if each is best else f"{low:+.2g} to {high:+.2g}" + (": as good" if low <= 0 else "")
        if len(best.logs) < 2 and each is not best:
            behind = f"{low:+.2g}, of one log"
        rows.append([f"`{each.name}`", *([errors_text(each, "untuned_short"), errors_text(each, "held_out_short")] if short else []),
                     errors_text(each, "untuned"), errors_text(each, "held_out"), errors_text(each, "floor"), behind])
    for each in found["contenders"]:
        if each["failure"]:
            rows.append([f"`{each['contender']}`", *[""] * (5 if short else 3), each["failure"]])
    fit, report = (found["windows"].get(key) for key in ("fit_s", "report_s")) if short else (None, None)
    spans = [f"untuned, {fit:g} s", f"fitted, {fit:g} s", f"untuned, {report:g} s", f"fitted, {report:g} s"] if short else ["untuned", "fitted"]
    return table(["contender", *spans, "noise floor", "behind the best (95 %)"], rows)


def phases_table(found):
    """Where in the motion the fitted contenders are off."""
    order = ranked(found)
    phases = [each["phase"] for each in order[0].found["phases"]]
    return table(["contender", *phases], [[f"`{each.name}`", *(f"{of['position_percent']:.1f} %, {of['rotation_deg']:.1f}°" for of in each.found["phases"])]
                                          for each in order])


def parameters_table(found, contenders=3):
    """What the best contenders were given."""
    chosen = ranked(found)[:contenders]
    rows = []
    for parameter in chosen[0].found["parameters"]:
        row = [f"`{parameter['name']}`", parameter["unit"], f"{parameter['model']:.3g}"]
        for each in chosen:
            of = next((other for other in each.found["parameters"] if other["name"] == parameter["name"]), None)
            if of is None:
                row.append("–")
            elif of["status"] == "not identified":
                row.append("not identified")
            else:
                bound = ", at its bound" if of["status"] == "at its bound" else ""
                row.append(f"{of['value']:.3g}" + (f" ({of['low']:.3g} to {of['high']:.3g}){bound}" if of["low"] is not None else bound))
        rows.append(row)
    return table(["parameter", "unit", "model", *(f"`{each.name}`" for each in chosen)], rows)


def timesteps_table(found):
    """The same fits at other timesteps than the one that they were made at."""
    order = ranked(found)
    steps = sorted({at["timestep_ms"] for each in order for at in each.found["timesteps"]})
    rows = []
    for each in order:
        of = {at["timestep_ms"]: at for at in each.found["timesteps"]}
        rows.append([f"`{each.name}`", *(figures_text(of[step]["held_out"]) + (f", {of[step]['failed']} fail" if of[step]["failed"] else "")
                                         if step in of else "–" for step in steps)])
    return table(["contender", *(f"{milliseconds(step)} ms" for step in steps)], rows)


def figures_text(of):
    return f"{of['joints_deg']:.2f}°" if "joints_deg" in of else f"{of['position_percent']:.1f} %, {of['rotation_deg']:.1f}°"


def ablations(folder, found):
    """{what was not fitted: (the contender with the whole fit, the same without)}, both on the logs that both predict, the worst loss
    first: alone a contender has fewer predictable logs than beside others."""
    whole = {each.name: each for each in ranked(found)}
    pairs = {}
    for path in sorted(folder.glob("tosses-without-*.json*")):
        name = path.name.removeprefix("tosses-without-").split(".")[0]
        without = ranked(answer(folder, f"tosses-without-{name}"))[0]
        both = whole[without.name].logs.keys() & without.logs.keys()
        pairs[name] = whole[without.name].on(both), without.on(both)
    return dict(sorted(pairs.items(), key=lambda pair: -sum(apart(pair[1][1], pair[1][0]))))


def ablations_table(pairs):
    rows = []
    for name, (whole, without) in pairs.items():
        low, high = apart(without, whole)
        rows.append([name, len(whole.logs), errors_text(whole, "held_out"), errors_text(without, "held_out"), f"{low:+.2g} to {high:+.2g}"])
    return table(["not fitted", "tosses", f"`{next(iter(pairs.values()))[0].name}`, all fitted", "without it", "worse by (95 %)"], rows)


def known_truth_table(found):
    rows = []
    for model in dict.fromkeys(each["model"] for each in found["found"]):
        own = [each for each in found["found"] if each["model"] == model]
        off = [abs(each["value"] - each["truth"]) / abs(each["size"]) for each in own]
        covered = sum(each["low"] is not None and each["low"] <= each["truth"] <= each["high"] for each in own)
        hinges = sum(each["parameter"].startswith("damping") for each in own)
        rows.append([f"chain of {hinges}" if hinges else "tossed box", len(own), f"{100 * max(off):.2g} %", f"{100 * statistics.median(off):.2g} %", f"{covered} of {len(own)}"])
    return table(["model", "parameters", "largest error", "median", "95 % intervals that have the truth"], rows)


# ---- the figure -------------------------------------------------------------------------------------------------------

WIDTH, LEFT, RIGHT, LINE, TOP = 640, 190, 30, 17, 40


def panel(found, title, key):
    order = ranked(found)
    most = max(each.mean(which, key) for each in order for which in ("untuned", "held_out")) * 1.05
    height = TOP + LINE * len(order) + 30

    def x_of(value):
        return LEFT + value / most * (WIDTH - LEFT - RIGHT)
    parts = [f'<text x="{LEFT}" y="16" font-weight="bold">{html.escape(title)}</text>']
    step = next(step for step in (0.5, 1, 2, 5, 10, 20, 50) if most / step <= 8)
    for tick in range(int(most / step) + 1):
        at = x_of(tick * step)
        parts.append(f'<line x1="{at:.1f}" y1="{TOP - 12}" x2="{at:.1f}" y2="{height - 26}" stroke="#dddddd"/>')
        parts.append(f'<text x="{at:.1f}" y="{height - 12}" text-anchor="middle">{tick * step:g}</text>')
    for i, each in enumerate(order):
        y = TOP + LINE * i
        untuned, fitted, floor = (x_of(each.mean(which, key)) for which in ("untuned", "held_out", "floor"))
        parts.append(f'<text x="{LEFT - 8}" y="{y + 4}" text-anchor="end">{html.escape(each.name)}</text>')
        parts.append(f'<line x1="{untuned:.1f}" y1="{y}" x2="{fitted:.1f}" y2="{y}" stroke="#999999"/>')
        parts.append(f'<circle cx="{untuned:.1f}" cy="{y}" r="4" fill="white" stroke="#1463c4" stroke-width="1.5"/>')
        parts.append(f'<circle cx="{fitted:.1f}" cy="{y}" r="4" fill="#1463c4" stroke="#1463c4" stroke-width="1.5"/>')
        parts.append(f'<line x1="{floor:.1f}" y1="{y - 5}" x2="{floor:.1f}" y2="{y + 5}" stroke="#d4590c" stroke-width="2"/>')
    return parts, height


def figure(found, path):
    panels = [panel(found[name], *PANELS[name]) for name in found]
    key = ('<circle cx="200" cy="10" r="4" fill="white" stroke="#1463c4" stroke-width="1.5"/><text x="210" y="14">as the file says</text>'
           '<circle cx="320" cy="10" r="4" fill="#1463c4"/><text x="330" y="14">fitted to other logs</text>'
           '<line x1="455" y1="5" x2="455" y2="15" stroke="#d4590c" stroke-width="2"/><text x="463" y="14">noise floor</text>')
    total = 24 + sum(height for _, height in panels)
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {total}" font-family="sans-serif" font-size="11">',
             f'<rect width="{WIDTH}" height="{total}" fill="white"/>', key]
    at = 24
    for parts, height in panels:
        lines += [f'<g transform="translate(0 {at})">', *parts, "</g>"]
        at += height
    path.write_text("\n".join(lines) + "\n</svg>\n", "utf-8")


def add_arguments(parser):
    parser.add_argument("results", metavar="RESULTS", type=pathlib.Path)
    parser.add_argument("--page", type=pathlib.Path, default=DOCS / "reality.md")
    parser.add_argument("--lab", type=pathlib.Path, default=DOCS / "lab/reality.md")


def update(options):
    found = {name: answer(options.results, name) for name in (*PANELS, *OTHERS) if list(options.results.glob(f"{name}.json*"))}
    figure({name: of for name, of in found.items() if name in PANELS}, options.page.with_suffix(".svg"))
    write(options.page, {name: errors_table(of) for name, of in found.items()})
    tables = {}
    if pairs := ablations(options.results, found["tosses"]):
        tables["tosses-without"] = ablations_table(pairs)
    for name, of in found.items():
        tables[f"{name}-parameters"] = parameters_table(of)
        if all("timesteps" in each.found for each in ranked(of)):  # younger than version 0.1's
            tables[f"{name}-timesteps"] = timesteps_table(of)
        if of["windows"] == "whole motions":
            tables[f"{name}-phases"] = phases_table(of)
    tables["known-truth"] = known_truth_table(answer(options.results, "known-truth"))
    write(options.lab, tables)
