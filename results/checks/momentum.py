"""Largest drift of linear and angular momentum of the astronaut in files of `assay simulate`: momentum.py RUN.csv...

Masses and inertias are those of the capsules and spheres of models/parts/humanoid-figure.xml; angular momentum is about
the origin.
"""

import csv
import math
import pathlib
import sys
import xml.etree.ElementTree as xml

FIGURE = pathlib.Path(__file__).resolve().parents[2] / "models/parts/humanoid-figure.xml"


def matrix(entry):
    return [[entry(i, j) for j in range(3)] for i in range(3)]


def numbers(text):
    return [float(word) for word in text.split()]


def shape(geom):
    """Mass, centre and inertia about it."""
    mass, radius = float(geom.get("mass")), numbers(geom.get("size"))[0]
    if geom.get("type") == "sphere":
        return mass, numbers(geom.get("pos", "0 0 0")), matrix(lambda i, j: 0.4 * mass * radius**2 * (i == j))
    ends = numbers(geom.get("fromto"))
    centre = [(a + b) / 2 for a, b in zip(ends[:3], ends[3:])]
    length = math.dist(ends[:3], ends[3:])
    axis = [(b - a) / length for a, b in zip(ends[:3], ends[3:])]
    cylinder = mass * length / (length + 4 / 3 * radius)
    balls = mass - cylinder
    along = cylinder * radius**2 / 2 + balls * 0.4 * radius**2
    across = (cylinder * (radius**2 / 4 + length**2 / 12) +
              balls * (0.4 * radius**2 + length**2 / 4 + 3 / 8 * length * radius))
    return mass, centre, matrix(lambda i, j: across * (i == j) + (along - across) * axis[i] * axis[j])


def bodies(node):
    found = {}
    for body in node.iter("body"):
        shapes = [shape(geom) for geom in body.findall("geom") if float(geom.get("mass")) > 0]
        mass = sum(part[0] for part in shapes)
        centre = [sum(part[0] * part[1][k] for part in shapes) / mass for k in range(3)]
        inertia = matrix(lambda i, j: 0.0)
        for part_mass, part_centre, own in shapes:
            d = [a - b for a, b in zip(part_centre, centre)]
            square = sum(x * x for x in d)
            inertia = matrix(lambda i, j: inertia[i][j] + own[i][j] + part_mass * (square * (i == j) - d[i] * d[j]))
        found[body.get("name")] = mass, inertia
    return found


def rotation(a, b, c, d):
    return [[1 - 2 * (c * c + d * d), 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), 1 - 2 * (b * b + d * d), 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), 1 - 2 * (b * b + c * c)]]


def times(m, v):
    return [sum(m[i][k] * v[k] for k in range(3)) for i in range(3)]


def momenta(path, parts):
    """{time: (p, L)}"""
    sums = {}
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            mass, inertia = parts[row["body"]]
            x, v, w = ([float(row[letter + axis]) for axis in "xyz"] for letter in ("", "v", "w"))
            r = rotation(*(float(row[name]) for name in ("qw", "qx", "qy", "qz")))
            spin = times(r, times(inertia, times(list(zip(*r)), w)))
            p, l = sums.setdefault(float(row["time"]), ([0.0] * 3, [0.0] * 3))
            for k in range(3):
                p[k] += mass * v[k]
                l[k] += spin[k] + mass * (x[k - 2] * v[k - 1] - x[k - 1] * v[k - 2])
    return sums


def main():
    parts = bodies(xml.parse(FIGURE).getroot().find("worldbody"))
    for path in sys.argv[1:]:
        run = momenta(path, parts)
        start = run[min(run)]
        linear, angular = (max(math.dist(values[k], start[k]) for values in run.values()) for k in (0, 1))
        print(f"{path}: linear momentum {linear:.3g} kg m/s, angular momentum {angular:.3g} kg m^2/s")


if __name__ == "__main__":
    main()
