"""The table and the figures of many-worlds.md.

RESULTS is a folder with checks.csv, as results/gpu-2026-11-26.
"""

import csv
import pathlib

from .common import DOCS, write
from .common import table as markdown
from .plain_figure import Plot

COLORS = {"mujoco-warp": "#1b6ca8", "mujoco-warp-3-iterations": "#7fb3d5", "newton-mujoco": "#2e8b57", "newton-steel": "#b8860b",
          "mjx": "#b03a2e", "mjx-3-iterations": "#e59866"}
MODELS = {"humanoid": "25 degrees of freedom, 2 ms", "quadruped": "18 degrees of freedom, 5 ms", "capsules-27": "162 degrees of freedom, 2 ms"}


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
    (DOCS / f"many-worlds-{model}.svg").write_text(plot.svg(), "utf-8")


def table(rows):
    lines = []
    for model in MODELS:
        for name in COLORS:
            own = {int(row["worlds"]): row for row in rows if row["model"] == model and row["contender"] == name}
            if not own:
                continue
            cells = []
            for worlds in (1, 64, 1024, 4096, 16384):
                row = own.get(worlds)
                cells.append("-" if row is None else rate(row["world_steps_per_s"]) if row["outcome"] == "ok" else row["outcome"])
            memory = [float(row["memory_bytes_per_world"]) for _, row in sorted(own.items()) if row["memory_bytes_per_world"]]
            lines.append([model, f"`{name}`", *cells, f"{memory[-1] / 1e3:.0f} kB"])
    return markdown(["robot", "engine", "1 world", "64", "1024", "4096", "16,384", "memory a world"], lines)


def add_arguments(parser):
    parser.add_argument("results", metavar="RESULTS", type=pathlib.Path)


def update(options):
    with open(options.results / "checks.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for model in MODELS:
        figure(rows, model)
    write(DOCS / "many-worlds.md", {"worlds": table(rows)})
