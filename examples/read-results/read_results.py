"""Reads exported results and plots speed against error: read_results.py RESULTS PLOT.svg."""

import collections
import csv
import math
import pathlib
import sqlite3
import sys

import numpy as np

COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"]


def read_values(path):
    """{(system, contender, timestep_ms): {measure: value}}; failed cells have no value."""
    points = collections.defaultdict(dict)
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["outcome"] == "ok" and row["value"]:
                key = (row["system"], row["contender"], float(row["timestep_ms"]))
                points[key][row["measure"]] = float(row["value"])
    return points


def failures(results):
    """Failed cells with their reasons, from the database."""
    db = sqlite3.connect(f"file:{results / 'assay.sqlite'}?mode=ro", uri=True)
    rows = db.execute("SELECT system, contender, timestep_ms, measure, outcome, reason FROM cells WHERE outcome != 'ok'")
    return rows.fetchall()


def path_lengths(results):
    """How far each body's centre moved in each stored run: {(system, contender): {body: m}}."""
    lengths = {}
    with open(results / "states/index.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            run = np.load(results / "states" / row["file"])
            steps = np.linalg.norm(np.diff(run["position"], axis=0), axis=2)
            lengths[row["system"], row["contender"]] = dict(zip(run["bodies"].tolist(), steps.sum(axis=0).tolist()))
    return lengths


def plot(points, path):
    """Self-consistency error over realtime factor, a line per contender, both axes logarithmic."""
    curves = collections.defaultdict(list)
    for (_, contender, _), values in sorted(points.items()):
        if values.get("consistency", 0) > 0 and "realtime_factor" in values:
            curves[contender].append((math.log10(values["realtime_factor"]), math.log10(values["consistency"])))
    corners = np.array([point for curve in curves.values() for point in curve])
    low, span = corners.min(axis=0), np.maximum(np.ptp(corners, axis=0), 1e-9)
    least, most = 10**low, 10**(low + span)
    svg = ['<svg xmlns="http://www.w3.org/2000/svg" width="640" height="420" font-family="sans-serif" font-size="13">',
           '<rect width="640" height="420" fill="white"/>',
           f'<text x="320" y="410" text-anchor="middle">realtime factor, {least[0]:.3g} to {most[0]:.3g}</text>',
           f'<text x="20" y="200" text-anchor="middle" transform="rotate(-90 20 200)">'
           f'self-consistency error, {least[1]:.2g} to {most[1]:.2g} m</text>']
    for i, (contender, curve) in enumerate(curves.items()):
        colour = COLOURS[i % len(COLOURS)]
        xy = [(40 + 420 * (x - low[0]) / span[0], 380 - 350 * (y - low[1]) / span[1]) for x, y in curve]
        svg.append(f'<polyline fill="none" stroke="{colour}" points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in xy)}"/>')
        svg += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>' for x, y in xy]
        svg.append(f'<text x="475" y="{40 + 20 * i}" fill="{colour}">{contender}</text>')
    path.write_text("\n".join(svg + ["</svg>", ""]), encoding="utf-8")


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: read_results.py RESULTS PLOT.svg")
    results = pathlib.Path(sys.argv[1])
    points = read_values(results / "values.csv")
    print(f"{'system':<14} {'contender':<22} {'timestep':>9} {'real time':>10} {'error':>12} {'penetration':>12}")
    for (system, contender, timestep_ms), values in sorted(points.items()):
        cells = [f"{values[name]:.3g}{unit}" if name in values else "-"
                 for name, unit in (("realtime_factor", " x"), ("consistency", " m"), ("penetration_max", " m"))]
        print(f"{system:<14} {contender:<22} {timestep_ms:>6g} ms {cells[0]:>10} {cells[1]:>12} {cells[2]:>12}")
    for failure in failures(results):
        print("failed: ", *failure)
    for (system, contender), lengths in path_lengths(results).items():
        print(f"{system}, {contender}: " + ", ".join(f"{body} moved {length:.3f} m" for body, length in lengths.items()))
    plot(points, pathlib.Path(sys.argv[2]))


if __name__ == "__main__":
    main()
