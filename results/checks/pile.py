"""Contacts in files of `assay simulate capsules-N`: pile.py RUN.csv...

Prints for each sample the number of touching pairs, of ends on the ground, and the size of the largest connected group
(the ground does not connect).
"""

import collections
import csv
import math
import sys

RADIUS, HALF = 0.05, 0.1  # of the capsules of models/capsules-27.xml, in m


def distance(p, d, q, e):
    """Distance of the segments p + s d and q + t e, s and t from 0 to 1."""

    def dot(a, b):
        return sum(x * y for x, y in zip(a, b))

    r = [a - b for a, b in zip(p, q)]
    a, b, c, f, g = dot(d, d), dot(d, e), dot(d, r), dot(e, r), dot(e, e)
    slope = a * g - b * b
    s = min(1, max(0, (b * f - c * g) / slope)) if slope > 1e-12 else 0
    t = (b * s + f) / g
    if not 0 <= t <= 1:
        t = min(1, max(0, t))
        s = min(1, max(0, (b * t - c) / a))
    return math.dist([x + s * y for x, y in zip(p, d)], [x + t * y for x, y in zip(q, e)])


def samples(path):
    """{time: [(end, vector to the other end) of each capsule]}"""
    found = {}
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            a, b, c, d = (float(row[name]) for name in ("qw", "qx", "qy", "qz"))
            axis = [2 * (b * d + a * c), 2 * (c * d - a * b), 1 - 2 * (b * b + c * c)]
            end = [float(row[name]) - HALF * x for name, x in zip("xyz", axis)]
            found.setdefault(float(row["time"]), []).append((end, [2 * HALF * x for x in axis]))
    return found


def main():
    for path in sys.argv[1:]:
        print(path)
        for time, capsules in samples(path).items():
            group = list(range(len(capsules)))
            pairs = 0
            for i, (p, d) in enumerate(capsules):
                for j, (q, e) in enumerate(capsules[:i]):
                    if distance(p, d, q, e) < 2 * RADIUS:
                        pairs += 1
                        group = [group[j] if label == group[i] else label for label in group]
            ends = sum(height < RADIUS for p, d in capsules for height in (p[2], p[2] + d[2]))
            largest = max(collections.Counter(group).values())
            print(f"  {time:g} s: {pairs} pairs, {ends} ends on the ground, largest group {largest} of {len(capsules)}")


if __name__ == "__main__":
    main()
