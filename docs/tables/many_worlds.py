"""The tables and the figures of many-worlds.md.

RESULTS are folders with checks.csv, as results/gpu-2026-11-26. In the first table and the figures the contenders of a model are those of the
first folder that has them with it. The G1 is of the first folder that has it, a contender's same bits are of the last.
"""

import csv
import pathlib

from .common import DOCS, write
from .common import table as markdown
from .plain_figure import Plot

COLORS = {"mujoco-warp": "#1b6ca8", "mujoco-warp-3-iterations": "#7fb3d5", "newton-mujoco": "#2e8b57", "newton-steel": "#b8860b",
          "genesis": "#7d3c98", "mjx": "#b03a2e", "mjx-3-iterations": "#e59866"}
MODELS = {"humanoid": "25 degrees of freedom, 2 ms", "quadruped": "18 degrees of freedom, 5 ms", "capsules-27": "162 degrees of freedom, 2 ms"}

SAME_BITS = (1, 1024, 4096, 16384)  # worlds


def rate(text):
    value = float(text)
    return f"{value / 1e6:.2f} M" if value >= 1e6 else f"{value / 1e3:.0f} k" if value >= 1e4 else f"{value:.0f}"


def figure(rows, model):
    chosen = [row for row in rows if row["model"] == model and row["outcome"] == "ok" and not row["contender"].endswith("anchor")]
    cores = {int(row["threads"]): float(row["world_steps_per_s"]) for row in chosen if row["threads"]}
    lines = {}
    for row in chosen:
        if not row["threads"] and row["contender"] in COLORS:
            lines.setdefault(row["contender"], []).append((int(row["worlds"]), float(row["world_steps_per_s"])))
    points = [point for line in lines.values() for point in line]
    plot = Plot(f"worlds ({model}: {MODELS[model]})", "world-steps per second", [x for x, _ in points], [y for _, y in points] + list(cores.values()))
    for name, line in lines.items():
        line.sort()
        plot.line(line, COLORS[name])
        for x, y in line:
            plot.mark(x, y, COLORS[name], name if (x, y) == line[-1] else "")
    if cores:
        most = max(cores)
        plot.line([(1, cores[most]), (16384, cores[most])], "#555555", "4 3")
        plot.labels.append([plot.x.at(1) + 4, plot.y.at(cores[most]) - 4, "#555555", f"MuJoCo, {most} CPU threads"])
    (DOCS / f"lab/many-worlds-{model}.svg").write_text(plot.svg(), "utf-8")


def cell(row):
    """A rate; of worlds that are not those of a run alone, with this."""
    if row is None:
        return "-"
    return rate(row["world_steps_per_s"]) if row["outcome"] == "ok" else row["outcome"]


def measured(row):
    """A rate with its interval, also of worlds that are not those of a run alone."""
    if row is None or not row["world_steps_per_s"]:
        return "-" if row is None else row["outcome"]
    return f"{rate(row['world_steps_per_s'])} ({rate(row['low'])} to {rate(row['high'])})" + (
        ", *diverged*" if row["outcome"] == "diverged" else "")


def having(results, wanted):
    """Rows of the first results that have a row that is wanted."""
    return next((rows for rows in results if any(map(wanted, rows))), [])


def table_of_g1(rows):
    lines = []
    for name in COLORS:
        own = {int(row["worlds"]): row for row in rows if row["model"] == "g1" and row["contender"] == name}
        if own:
            memory = float(own[max(own)]["memory_bytes_per_world"])
            lines.append([f"`{name}`", *(measured(own.get(worlds)) for worlds in (1, 64, 1024, 4096, 16384)), f"{memory / 1e3:.0f} kB"])
    return markdown(["engine", "1 world", "64", "1024", "4096", "16,384", "memory a world"], lines)


def first_measured(results):
    """Of each contender with each model the rows of the first results that have them."""
    found, of = [], {}
    for number, rows in enumerate(results):
        found += [row for row in rows if of.setdefault((row["model"], row["contender"]), number) == number]
    return found


def last_measured(results):
    """The last row of each cell."""
    return list({(row["model"], row["contender"], row["worlds"], row["threads"]): row for rows in results for row in rows}.values())


def table_of_bits(rows):
    lines = []
    for name in ("genesis", "mjx", "mjx-deterministic", "mujoco-warp", "mujoco-warp-deterministic"):
        for row in sorted((row for row in rows if row["model"] == "humanoid" and row["contender"] == name), key=lambda row: int(row["worlds"])):
            other = f"{row['worlds_with_other_bits']}" if row["worlds_with_other_bits"] else "-"
            lines.append([f"`{name}`", f"{int(row['worlds']):,}" if int(row["worlds"]) >= 10000 else row["worlds"], measured(row), other])
    return markdown(["contender", "humanoids", "world-steps per second", "worlds with other bits"], lines)


def table(rows):
    lines = []
    for model in MODELS:
        for name in COLORS:
            own = {int(row["worlds"]): row for row in rows if row["model"] == model and row["contender"] == name}
            if not own:
                continue
            cells = []
            for worlds in (1, 64, 1024, 4096, 16384):
                cells.append(cell(own.get(worlds)))
            memory = [float(row["memory_bytes_per_world"]) for _, row in sorted(own.items()) if row["memory_bytes_per_world"]]
            lines.append([model, f"`{name}`", *cells, f"{memory[-1] / 1e3:.0f} kB" if memory else "-"])
    return markdown(["robot", "engine", "1 world", "64", "1024", "4096", "16,384", "memory a world"], lines)


def add_arguments(parser):
    parser.add_argument("results", metavar="RESULTS", type=pathlib.Path, nargs="+")


def update(options):
    results = []
    for folder in options.results:
        with open(folder / "checks.csv", encoding="utf-8") as file:
            results.append(list(csv.DictReader(file)))
    together = first_measured(results)
    for model in MODELS:
        figure(together, model)
    g1 = having(results, lambda row: row["model"] == "g1")
    same = [row for row in last_measured(results) if int(row["worlds"]) in SAME_BITS and
            (row["worlds_with_other_bits"] or row["contender"].endswith("-deterministic"))]
    write(DOCS / "lab/many-worlds.md", {"worlds": table(together), "worlds-g1": table_of_g1(g1), "worlds-bits": table_of_bits(same)})
