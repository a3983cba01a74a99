#!/usr/bin/env python3
"""Whether `assay match` finds parameters that are known, and names what logs do not determine.

    benchmarks/known_truth.py [--program ./assay] [--models 10] [--first 0] [--planted 10] [--contender mujoco-rk4] [--seed 1] [--out DIR]

Seeded models of 1 to 7 hinges and of tossed boxes move in `mujoco-rk4` at 1/8 ms (boxes: `mujoco-euler`); their logs get noise,
and `match` gets the model with other parameters. Counted are parameters within 5 % (of a ground's height: of the box), 95 % intervals
that have the truth, and planted cases in which a direction is not determined: without gravity masses, dampings and gears scale
alike, and of a passive swing masses and dampings. OUT/known-truth.json has all of them; what was fitted before is not fitted again.
"""

import argparse
import json
import math
import pathlib
import random
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
RATE = 200  # Hz
ANGLE_NOISE, POSITION_NOISE, ROTATION_NOISE = 3e-4, 2e-4, 5e-4  # rad, m, rad
SIDE = 0.1  # m, of the boxes


def hinges(links, gravity=True, friction=True):
    """A serial chain as MJCF; links are tables of damping, dry friction, mass and length."""
    text = f'<mujoco model="chain"><compiler angle="radian" autolimits="true"/><option gravity="0 0 {-9.81 if gravity else 0}"/><worldbody>'
    above = -2.0  # where the link before ends, below it
    for i, link in enumerate(links, 1):
        length, mass = link["length"], link["mass"]
        inertia = mass * length**2 / 12
        dry = f'frictionloss="{link["dry"]:.9g}"' if friction else ""
        axis = "0 1 0" if i % 2 else "1 0 0"
        text += (f'<body name="link{i}" pos="0 0 {-above:.9g}"><joint name="hinge{i}" axis="{axis}" damping="{link["damping"]:.9g}" {dry}/>'
                 f'<inertial pos="0 0 {-length / 2:.9g}" mass="{mass:.9g}" diaginertia="{inertia:.9g} {inertia:.9g} {inertia / 10:.9g}"/>'
                 f'<geom type="capsule" fromto="0 0 0 0 0 {-length:.9g}" size="0.01" contype="0" conaffinity="0"/>')
        above = length
    return text + "</body>" * len(links) + "</worldbody></mujoco>"


def box(friction, height, turn=(1, 0, 0, 0), velocity=(0,) * 6, ground=0.0):
    qpos = " ".join(f"{x:.9g}" for x in (0, 0, height, *turn))
    return (f'<mujoco model="box"><worldbody><geom name="ground" type="plane" size="2 2 0.1" pos="0 0 {ground:.9g}" friction="{friction:.9g} 0 0"/>'
            f'<body name="box" pos="0 0 {height:.9g}"><freejoint/>'
            f'<geom type="box" size="{SIDE / 2} {SIDE / 2} {SIDE / 2}" mass="0.4" friction="{friction:.9g} 0 0"/></body></worldbody>'
            f'<keyframe><key qpos="{qpos}" qvel="{" ".join(f"{x:.9g}" for x in velocity)}"/></keyframe></mujoco>')


def product(a, b):
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


class Work:
    def __init__(self, given, folder):
        self.given, self.folder = given, folder
        folder.mkdir(parents=True, exist_ok=True)

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return str(self.folder / name)

    def run(self, *arguments):
        done = subprocess.run([self.given.program, *arguments], capture_output=True, text=True, cwd=self.folder)
        if done.returncode != 0:
            sys.exit(f"{' '.join(arguments)}: {done.stderr}")
        return done.stdout

    def poses(self, model, contender, seconds, *more):
        """{body: [(time, x, y, z, qw, qx, qy, qz)]}"""
        found = {}
        for line in self.run("simulate", model, "--engine", contender, "--timestep", "1/8", "--duration", f"{seconds}", "--sample", "5", *more,
                             "--out", "-").splitlines()[1:]:
            row = line.split(",")
            found.setdefault(row[1], []).append(tuple(float(x) for x in (row[0], *row[2:9])))
        return found

    def swing(self, name, model, count, seconds, rng, driven=True, start=0.0):
        """A log of joints under sums of sines."""
        waves = [[(rng.uniform(0.3, 1), rng.uniform(0.4, 2.5), rng.uniform(0, 6)) for _ in range(3)] for _ in range(count)]
        scale = [0.6 * (count - i) ** 1.5 / count**0.5 for i in range(count)]
        torque = lambda i, t: scale[i] * sum(a * math.sin(2 * math.pi * f * t + p) for a, f, p in waves[i]) if driven else 0.0
        names = [f"hinge{i + 1}" for i in range(count)]
        times = [i / RATE for i in range(round(seconds * RATE) + 1)]
        control = ["passive"]
        if driven:
            rows = [",".join(f"{x:.9g}" for x in (t, *(torque(i, t) for i in range(count)))) for t in times]
            control = [self.write(f"{name}-torque.csv", "\n".join([",".join(["time", *names]), *rows]) + "\n")]
        if start:
            text = pathlib.Path(model).read_text()
            angles = " ".join(f"{rng.uniform(0.5, 1) * start:.6g}" for _ in range(count))
            model = self.write(f"{name}-start.xml", text.replace("</mujoco>", f'<keyframe><key qpos="{angles}"/></keyframe></mujoco>'))
        poses = self.poses(model, "mujoco-rk4", seconds, "--control", *control)
        angles = []
        for i in range(count):
            column, before, turns = [], 0.0, 0
            for sample in range(len(times)):
                own = poses[f"link{i + 1}"][sample][4:]
                above = poses[f"link{i}"][sample][4:] if i else (1, 0, 0, 0)
                w, x, y, z = product((above[0], -above[1], -above[2], -above[3]), own)
                angle = 2 * math.atan2(y if i % 2 == 0 else x, w)
                turns -= round((angle + 2 * math.pi * turns - before) / (2 * math.pi))
                before = angle + 2 * math.pi * turns
                column.append(before + rng.gauss(0, ANGLE_NOISE))
            angles.append(column)
        header = ["time", *names, *(f"{each}.torque" for each in names if driven)]
        rows = [[t, *(c[k] for c in angles), *(torque(i, t) for i in range(count) if driven)] for k, t in enumerate(times)]
        return self.write(f"{name}.csv", "\n".join([",".join(header), *(",".join(f"{x:.8f}" for x in row) for row in rows)]) + "\n")

    def match(self, model, logs, contender, fits, *more):
        found = json.loads(self.run("match", model, "--log", *logs, "--contenders", contender, *(x for each in fits for x in ("--fit", each)),
                                    "--out", str(self.folder / "matched"), "--json", *more))
        return found["contenders"][0]


def links_of(count, rng):
    return [{"length": rng.uniform(0.25, 0.4), "mass": rng.uniform(0.3, 1), "damping": rng.uniform(0.03, 0.08), "dry": rng.uniform(0.03, 0.08)}
            for _ in range(count)]


def changed(links, rng):
    return [{"length": each["length"], "mass": each["mass"] * rng.uniform(0.8, 1.25), "damping": each["damping"] * rng.uniform(0.5, 2),
             "dry": each["dry"] * rng.uniform(0.5, 2)} for each in links]


def judge(what, contender, truths, tally):
    """Counts the parameters of a fit against {name: (truth, size that 5 % are of)}."""
    if contender["failure"]:
        sys.exit(f"{what}: {contender['failure']}")
    for name, (truth, size) in truths.items():
        found = next(each for each in contender["parameters"] if each["name"] == name)
        if found["status"] == "not identified":
            tally["not identified"] += 1
            continue
        tally["found"].append({"model": what, "parameter": name, "truth": truth, "size": size,
                               **{key: found[key] for key in ("value", "low", "high", "unit")}})
        close = abs(found["value"] - truth) <= 0.05 * size
        covers = found["low"] is not None and found["low"] <= truth <= found["high"]
        tally["parameters"] += 1
        tally["within 5 %"] += close
        tally["covered"] += covers
        if not close or not covers:
            print(f"    {what}: {name} is {truth:.4g}, found {found['value']:.4g} [{found['low']:.4g}, {found['high']:.4g}]", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=str(ROOT / "assay"))
    parser.add_argument("--models", type=int, default=10, help="seven in ten are chains, of 1 to 7 hinges")
    parser.add_argument("--first", type=int, default=0, help="the first of them: several runs can share the work")
    parser.add_argument("--planted", type=int, default=10)
    parser.add_argument("--contender", default="mujoco-rk4")
    parser.add_argument("--logs", type=int, default=9)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", default="known-truth")
    given = parser.parse_args()
    tally = {"contender": given.contender, "parameters": 0, "within 5 %": 0, "covered": 0, "not identified": 0, "planted": 0, "named": 0,
             "found": [], "combinations": []}
    out = pathlib.Path(given.out).resolve()
    for k in range(given.first, given.models):
        rng, began = random.Random(1000 * given.seed + k), time.monotonic()
        work = Work(given, out / f"model{k}")
        chain = k % 10 < 7
        if chain:
            nominal = links_of(k % 10 + 1, rng)
            true = changed(nominal, rng)
            model, truth = work.write("model.xml", hinges(nominal)), work.write("truth.xml", hinges(true))
            logs = [work.swing(f"log{i}", truth, len(true), 3, rng) for i in range(given.logs)]
            contender = work.match(model, logs, given.contender, ["damping", "dry_friction", "mass"])
            truths = {}
            for i, each in enumerate(true, 1):
                truths |= {f"{name}:{element}{i}": (each[key], each[key]) for name, element, key in
                           (("damping", "hinge", "damping"), ("dry_friction", "hinge", "dry"), ("mass", "link", "mass"))}
        else:
            friction, ground = rng.uniform(0.15, 0.5), rng.uniform(-2e-3, 2e-3)
            logs = []
            for i in range(18):
                turn = [rng.gauss(0, 1) for _ in range(4)]
                turn = [x / math.sqrt(sum(y * y for y in turn)) for x in turn]
                velocity = [rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-0.3, 0.3), *(rng.uniform(-4, 4) for _ in range(3))]
                poses = work.poses(work.write(f"throw{i}.xml", box(friction, 0.2, turn, velocity, ground)), "mujoco-euler", 0.8)["box"]
                rows = []
                for t, x, y, z, *q in poses:
                    noise = [1, *(rng.gauss(0, ROTATION_NOISE / 2) for _ in range(3))]
                    rows.append([t, *(v + rng.gauss(0, POSITION_NOISE) for v in (x, y, z)), *product(noise, q)])
                header = "time," + ",".join(f"box.{c}" for c in ("x", "y", "z", "qw", "qx", "qy", "qz"))
                logs.append(work.write(f"toss{i}.csv", "\n".join([header, *(",".join(f"{x:.8f}" for x in row) for row in rows)]) + "\n"))
            model = work.write("model.xml", box(0.3, 0.2))
            contender = work.match(model, logs, "mujoco-euler", ["friction", "ground"], "--budget", "300")
            truths = {"friction": (friction, friction), "ground": (ground, SIDE)}
        judge(f"model {k}", contender, truths, tally)
        print(f"model {k}: {len(truths)} parameters, held out {contender['held_out']}, {time.monotonic() - began:.0f} s", flush=True)
    for k in range(given.planted):
        rng = random.Random(2000 * given.seed + k)
        work = Work(given, out / f"planted{k}")
        driven = k % 2 == 0
        links = links_of(1 + k % 3, rng)
        model = work.write("model.xml", hinges(links, gravity=not driven, friction=False))
        logs = [work.swing(f"log{i}", model, len(links), 3, rng, driven, start=0.0 if driven else 1.2) for i in range(3)]
        contender = work.match(model, logs, given.contender, ["damping", "mass", *(["gear"] if driven else [])])
        named = bool(contender["not_identified"])
        tally["planted"] += 1
        tally["named"] += named
        tally["combinations"].append([each["members"] for each in contender["not_identified"]])
        print(f"planted {k}: {'named' if named else 'NOT named'}: {[each['members'] for each in contender['not_identified']]}", flush=True)
    (out / "known-truth.json").write_text(json.dumps(tally, indent=1) + "\n")
    print(json.dumps({key: value for key, value in tally.items() if not isinstance(value, list)}))


if __name__ == "__main__":
    main()
