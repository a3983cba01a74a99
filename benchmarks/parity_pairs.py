#!/usr/bin/env python3
"""Seeded pairs of files for `assay parity A B`: how often the one difference between two files is named first, and
whether two files of one robot raise an alarm.

    benchmarks/parity_pairs.py [--cases 100] [--same 100] [--seed 1] [--kind mjcf-mjcf|urdf-mjcf|urdf-urdf] [--keep DIR]

Random robots (trees of hinges and slides, links fixed to others, boxes, cylinders and spheres) are written as URDF and
as MJCF with other frames, order and names of elements. A case changes one number of the second file: masses, inertias,
gains, damping, friction, armature, limits by 1 %, places by 1 mm, axes and orientations by 0.5 degrees.
ASSAY_PROGRAM names the program.
"""

import argparse
import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = os.environ.get("ASSAY_PROGRAM") or str(ROOT / "assay")


# ---- rotations and poses: (w, x, y, z), p ----------------------------------------------------------------------------


def product(a, b):
    w, x, y, z = a
    v, p, q, r = b
    return (w * v - x * p - y * q - z * r, w * p + x * v + y * r - z * q, w * q - x * r + y * v + z * p, w * r + x * q - y * p + z * v)


def turned(q, v):
    w, x, y, z = product(product(q, (0, *v)), (q[0], -q[1], -q[2], -q[3]))
    return [x, y, z]


def compose(a, b):
    (qa, pa), (qb, pb) = a, b
    return product(qa, qb), [s + t for s, t in zip(pa, turned(qa, pb))]


def inverse(a):
    q, p = a
    back = (q[0], -q[1], -q[2], -q[3])
    return back, [-s for s in turned(back, p)]


def rotation(axis, angle):
    n = math.sqrt(sum(s * s for s in axis))
    return (math.cos(angle / 2), *(math.sin(angle / 2) * s / n for s in axis))


def matrix(q):
    columns = [turned(q, e) for e in ([1, 0, 0], [0, 1, 0], [0, 0, 1])]
    return [[columns[j][i] for j in range(3)] for i in range(3)]


def rpy_of(q):
    m = matrix(q)
    return [math.atan2(m[2][1], m[2][2]), -math.asin(max(-1, min(1, m[2][0]))), math.atan2(m[1][0], m[0][0])]


def quat_of(rpy):
    x, y, z = rpy
    return product(product(rotation([0, 0, 1], z), rotation([0, 1, 0], y)), rotation([1, 0, 0], x))


def rotated_tensor(q, tensor):
    m = matrix(q)
    return [[sum(m[i][k] * tensor[k][n] * m[j][n] for k in range(3) for n in range(3)) for j in range(3)] for i in range(3)]


def text(values, digits=9):
    return " ".join(f"{v:.{digits}g}" for v in values)


# ---- a random robot --------------------------------------------------------------------------------------------------


class Robot:
    """Links with joints; link 0 is the root. `fixed` links have no joint."""

    def __init__(self, rng, full):
        self.full = full  # with what URDF does not hold: armature, drives, friction of contacts
        self.free = rng.random() < 0.5
        count = rng.randint(4, 9)
        self.links = []
        for i in range(count):
            parent = -1 if i == 0 else rng.choice([i - 1, rng.randrange(i)])
            kind = "root" if i == 0 else "fixed" if i > 1 and rng.random() < 0.2 else "prismatic" if rng.random() < 0.2 else "revolute"
            mass = rng.uniform(0.3, 4)
            moments = [mass * rng.uniform(0.002, 0.004) for _ in range(3)]
            turn = rotation([rng.gauss(0, 1) for _ in range(3)], rng.uniform(0, 3))
            half = [rng.uniform(0.01, 0.05) for _ in range(3)]
            lower, upper = -rng.uniform(0.4, 2.5), rng.uniform(0.4, 2.5)
            self.links.append({
                "name": f"part{i}", "joint": f"turn{i}", "parent": parent, "kind": kind,
                "pose": (quat_of([rng.uniform(-1.4, 1.4) for _ in range(3)]), [rng.choice([-1, 1]) * rng.uniform(0.08, 0.25) for _ in range(3)]),
                "axis": turned(rotation([rng.gauss(0, 1) for _ in range(3)], rng.uniform(0, 3)), [0, 0, 1]),
                "lower": lower, "upper": upper, "damping": rng.uniform(0.1, 1), "friction": rng.uniform(0.05, 0.5),
                "effort": rng.uniform(5, 80), "velocity": rng.uniform(2, 10), "armature": rng.uniform(0.005, 0.05),
                "mass": mass, "centre": [rng.uniform(-0.05, 0.05) for _ in range(3)],
                "inertia": rotated_tensor(turn, [[moments[0], 0, 0], [0, moments[1], 0], [0, 0, moments[2]]]),
                "shape": rng.choice(["box", "cylinder", "sphere"]), "half": half,
                "kp": rng.uniform(20, 200), "kv": rng.uniform(1, 10), "gear": rng.uniform(1, 3), "slide": rng.uniform(0.9, 1.4),
            })

    def carrier(self, i):
        """The link with a joint that a fixed one is part of; the root where it is the world's."""
        while self.links[i]["kind"] == "fixed":
            i = self.links[i]["parent"]
        return i

    def moves(self, i):
        return self.free or self.carrier(i) != 0


NAMES = {
    "same": (lambda joint: joint, lambda link: link),
    "suffixed": (lambda joint: f"{joint}_joint", lambda link: f"base/{link}_link"),
    "other": (lambda joint: "m" + "".join(chr(97 + int(c)) for c in joint[4:]), lambda link: "b" + "".join(chr(97 + int(c)) for c in link[4:])),
}


def shape_sizes(link):
    """Of both formats: MJCF's type and size, URDF's element and attributes."""
    x, y, z = link["half"]
    if link["shape"] == "box":
        return [x, y, z], ("box", {"size": text([2 * x, 2 * y, 2 * z])})
    if link["shape"] == "cylinder":
        return [x, z], ("cylinder", {"radius": text([x]), "length": text([2 * z])})
    return [x], ("sphere", {"radius": text([x])})


def urdf(robot, rng, names="same"):
    joint_name, link_name = NAMES[names]
    root = ET.Element("robot", name="robot")
    elements = []
    for i, link in enumerate(robot.links):
        e = ET.Element("link", name=link_name(link["name"]))
        inertial = ET.SubElement(e, "inertial")
        ET.SubElement(inertial, "origin", xyz=text(link["centre"]), rpy="0 0 0")
        ET.SubElement(inertial, "mass", value=text([link["mass"]]))
        t = link["inertia"]
        ET.SubElement(inertial, "inertia", ixx=text([t[0][0]]), iyy=text([t[1][1]]), izz=text([t[2][2]]), ixy=text([t[0][1]]), ixz=text([t[0][2]]), iyz=text([t[1][2]]))
        collision = ET.SubElement(e, "collision")
        ET.SubElement(collision, "origin", xyz=text(link["centre"]), rpy="0 0 0")
        tag, attributes = shape_sizes(link)[1]
        ET.SubElement(ET.SubElement(collision, "geometry"), tag, attributes)
        elements.append(e)
        if i == 0:
            if robot.free:
                elements.append(ET.Element("link", name="world_link"))
                j = ET.Element("joint", name="base_joint", type="floating")
                ET.SubElement(j, "parent", link="world_link")
                ET.SubElement(j, "child", link=link_name(link["name"]))
                elements.append(j)
            continue
        j = ET.Element("joint", name=joint_name(link["joint"]), type=link["kind"])
        ET.SubElement(j, "parent", link=link_name(robot.links[link["parent"]]["name"]))
        ET.SubElement(j, "child", link=link_name(link["name"]))
        q, p = link["pose"]
        ET.SubElement(j, "origin", xyz=text(p), rpy=text(rpy_of(q)))
        if link["kind"] != "fixed":
            ET.SubElement(j, "axis", xyz=text(link["axis"]))
            ET.SubElement(j, "dynamics", damping=text([link["damping"]]), friction=text([link["friction"]]))
            ET.SubElement(j, "limit", lower=text([link["lower"]]), upper=text([link["upper"]]), effort=text([link["effort"]]), velocity=text([link["velocity"]]))
        elements.append(j)
    rng.shuffle(elements)
    root.extend(elements)
    return root


def mjcf(robot, rng, names="same", reframed=True):
    joint_name, link_name = NAMES[names]
    root = ET.Element("mujoco", model="robot")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    world = ET.SubElement(root, "worldbody")
    if robot.full:
        ET.SubElement(world, "geom", name="ground", type="plane", size="0 0 1", pos="0 0 -5", friction="0.1")
    frames = []  # of the body in the link's
    for link in robot.links:
        frames.append((quat_of([rng.uniform(-1.4, 1.4) for _ in range(3)]), [rng.uniform(-0.1, 0.1) for _ in range(3)]) if reframed else ((1, 0, 0, 0), [0, 0, 0]))
    if not robot.free:
        frames[0] = ((1, 0, 0, 0), [0, 0, 0])
    bodies = {}
    order = list(range(len(robot.links)))
    children = {i: [k for k, link in enumerate(robot.links) if link["parent"] == i] for i in order}
    actuated = []

    def add(i, parent):
        link = robot.links[i]
        pose = ((1, 0, 0, 0), [0, 0, 0]) if i == 0 else link["pose"]
        before = frames[link["parent"]] if i > 0 else ((1, 0, 0, 0), [0, 0, 0])
        q, p = compose(compose(inverse(before), pose), frames[i])
        body = ET.SubElement(parent, "body", name=link_name(link["name"]), pos=text(p), quat=text(q))
        bodies[i] = body
        to_body = inverse(frames[i])
        if i == 0 and robot.free:
            ET.SubElement(body, "freejoint", name="base")
        if i > 0 and link["kind"] != "fixed":
            joint = ET.SubElement(body, "joint", name=joint_name(link["joint"]), type="slide" if link["kind"] == "prismatic" else "hinge", pos=text(to_body[1]),
                                  axis=text(turned(to_body[0], link["axis"])), range=text([link["lower"], link["upper"]]), damping=text([link["damping"]]),
                                  frictionloss=text([link["friction"]]))
            if robot.full:
                joint.set("armature", text([link["armature"]]))
            actuated.append(i)
        t = rotated_tensor(to_body[0], link["inertia"])
        centre = [s + c for s, c in zip(to_body[1], turned(to_body[0], link["centre"]))]
        ET.SubElement(body, "inertial", pos=text(centre), mass=text([link["mass"]]), fullinertia=text([t[0][0], t[1][1], t[2][2], t[0][1], t[0][2], t[1][2]]))
        geom = ET.SubElement(body, "geom", type=link["shape"], size=text(shape_sizes(link)[0]), pos=text(centre), quat=text(to_body[0]))
        if robot.full:
            geom.set("friction", text([link["slide"]]))
        rest = children[i][:]
        rng.shuffle(rest)
        for child in rest:
            add(child, body)

    add(0, world)
    actuators = ET.SubElement(root, "actuator")
    rng.shuffle(actuated)
    for i in actuated:
        link = robot.links[i]
        joint = joint_name(link["joint"])
        limit = text([-link["effort"], link["effort"]])
        if not robot.full:
            ET.SubElement(actuators, "motor", name=joint, joint=joint, forcerange=limit)
        elif i % 2 == 0:
            ET.SubElement(actuators, "position", name=joint, joint=joint, kp=text([link["kp"]]), kv=text([link["kv"]]), forcerange=limit)
        else:
            ET.SubElement(actuators, "motor", name=joint, joint=joint, gear=text([link["gear"]]), ctrlrange=limit)
    return root


# ---- one change ------------------------------------------------------------------------------------------------------


def scale(element, attribute, factor=1.01, index=None):
    values = [float(v) for v in element.get(attribute).split()]
    element.set(attribute, text([v * factor if index is None or k == index else v for k, v in enumerate(values)]))


def shift(element, attribute, rng, size=0.001, across=None):
    """By `size` in a random direction, square to `across`."""
    d = [rng.gauss(0, 1) for _ in range(3)]
    if across:
        along = sum(a * b for a, b in zip(d, across)) / sum(a * a for a in across)
        d = [a - along * b for a, b in zip(d, across)]
    n = math.sqrt(sum(s * s for s in d))
    values = [float(v) for v in element.get(attribute).split()]
    element.set(attribute, text([v + size * s / n for v, s in zip(values, d)]))


def tilt(vector, rng, degrees=0.5):
    d = [rng.gauss(0, 1) for _ in range(3)]
    along = sum(a * b for a, b in zip(d, vector)) / sum(a * a for a in vector)
    return turned(rotation([a - along * b for a, b in zip(d, vector)], math.radians(degrees)), vector)


MASSES = {"mass": ["mass"], "inertia": ["inertia", "mass", "centre of mass"], "centre": ["centre of mass", "mass", "inertia"]}


def change_urdf(root, robot, rng, names):
    """Changes one number: (link, what may be named first)."""
    joint_name, link_name = NAMES[names]
    links = {e.get("name"): e for e in root.findall("link")}
    joints = {e.get("name"): e for e in root.findall("joint")}
    what = rng.choice(["mass", "inertia", "centre", "damping", "friction", "lower", "upper", "effort", "velocity", "axis", "place", "turn", "shape"])
    if what in ("mass", "inertia", "centre", "shape"):
        i = rng.choice([k for k in range(len(robot.links)) if robot.moves(k)])
        inertial = links[link_name(robot.links[i]["name"])].find("inertial")
        if what == "mass":
            scale(inertial.find("mass"), "value")
        elif what == "inertia":
            for attribute in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"):
                scale(inertial.find("inertia"), attribute)
        elif what == "centre":
            shift(inertial.find("origin"), "xyz", rng)
        else:
            shape = links[link_name(robot.links[i]["name"])].find("collision/geometry")[0]
            scale(shape, "size" if shape.tag == "box" else "radius")
            return "body", robot.carrier(i), ["collision shape"], what
        lumped = any(link["kind"] == "fixed" and robot.carrier(k) == robot.carrier(i) for k, link in enumerate(robot.links))
        # of a part of a body the mass moves the centre of the whole, and the centre its inertia
        return "body", robot.carrier(i), MASSES[what] if not lumped else ["mass", "centre of mass", "inertia"], what
    i = rng.choice([k for k in range(1, len(robot.links)) if robot.links[k]["kind"] != "fixed"])
    joint = joints[joint_name(robot.links[i]["joint"])]
    if what in ("damping", "friction"):
        scale(joint.find("dynamics"), what)
        return "joint", i, ["damping" if what == "damping" else "dry friction"], what
    if what in ("lower", "upper", "effort", "velocity"):
        scale(joint.find("limit"), what)
        return "joint", i, [f"{what} limit"], what
    if what == "axis":
        joint.find("axis").set("xyz", text(tilt(robot.links[i]["axis"], rng)))
        return "joint", i, ["axis"], what
    origin = joint.find("origin")
    if what == "place":
        shift(origin, "xyz", rng)
        return "joint", i, ["offset", "zero position"], what
    q = quat_of([float(v) for v in origin.get("rpy").split()])
    origin.set("rpy", text(rpy_of(product(q, rotation([rng.gauss(0, 1) for _ in range(3)], math.radians(0.5))))))
    return "joint", i, ["orientation", "zero position"], what


def change_mjcf(root, robot, rng, names):
    joint_name, link_name = NAMES[names]
    bodies = {e.get("name"): e for e in root.iter("body")}
    choices = ["mass", "inertia", "centre", "damping", "friction", "lower", "upper", "effort", "axis", "anchor", "place", "turn", "shape"]
    if robot.full:
        choices += ["armature", "kp", "kv", "gear", "contact"]
    what = rng.choice(choices)
    if what in ("mass", "inertia", "centre", "shape", "contact"):
        i = rng.choice([k for k in range(len(robot.links)) if robot.moves(k)])
        body = bodies[link_name(robot.links[i]["name"])]
        inertial = body.find("inertial")
        if what == "mass":
            scale(inertial, "mass")
        elif what == "inertia":
            scale(inertial, "fullinertia")
        elif what == "centre":
            shift(inertial, "pos", rng)
        elif what == "contact":
            scale(body.find("geom"), "friction", index=0)
            return "body", robot.carrier(i), ["contact friction"], what
        else:
            scale(body.find("geom"), "size", index=0)
            return "body", robot.carrier(i), ["collision shape"], what
        lumped = any(link["kind"] == "fixed" and robot.carrier(k) == robot.carrier(i) for k, link in enumerate(robot.links))
        return "body", robot.carrier(i), MASSES[what] if not lumped else ["mass", "centre of mass", "inertia"], what
    i = rng.choice([k for k in range(1, len(robot.links)) if robot.links[k]["kind"] != "fixed"])
    link = robot.links[i]
    body = bodies[link_name(link["name"])]
    joint = body.find("joint")
    actuator = next(e for e in root.find("actuator") if e.get("joint") == joint.get("name"))
    if what in ("damping", "friction", "armature"):
        attribute = {"friction": "frictionloss"}.get(what, what)
        scale(joint, attribute)
        return "joint", i, [{"friction": "dry friction"}.get(what, what)], what
    if what in ("lower", "upper"):
        scale(joint, "range", index=0 if what == "lower" else 1)
        return "joint", i, [f"{what} limit"], what
    if what == "axis":
        joint.set("axis", text(tilt([float(v) for v in joint.get("axis").split()], rng)))
        return "joint", i, ["axis"], what
    if what == "anchor" and link["kind"] == "revolute":
        shift(joint, "pos", rng, across=[float(v) for v in joint.get("axis").split()])
        return "joint", i, ["anchor"], what
    if what == "turn":
        q = [float(v) for v in body.get("quat").split()]
        # about the anchor, so that the joint stays where it is
        anchor = [float(v) for v in joint.get("pos").split()]
        new = product(q, rotation([rng.gauss(0, 1) for _ in range(3)], math.radians(0.5)))
        before, after = turned(q, anchor), turned(new, anchor)
        body.set("quat", text(new))
        body.set("pos", text([float(v) + a - b for v, a, b in zip(body.get("pos").split(), before, after)]))
        return "joint", i, ["orientation", "zero position"], what
    if what in ("kp", "kv", "gear", "effort"):
        attribute = what
        if actuator.tag == "position":
            attribute = what if what in ("kp", "kv") else "forcerange"
        elif what != "effort" and robot.full:
            attribute = "gear"
        else:
            attribute = "ctrlrange" if robot.full else "forcerange"
        scale(actuator, attribute)
        named = {"kp": "position gain (kp)", "kv": "velocity gain (kv)", "gear": "gear", "forcerange": "force range", "ctrlrange": "control range"}[attribute]
        if not robot.full:
            return "joint", i, ["effort limit", "force range, lower", "force range, upper"], "effort"
        return "actuator", i, [named, f"{named}, lower", f"{named}, upper"], attribute
    shift(body, "pos", rng)
    return "joint", i, ["offset", "zero position"], "place"


# ---- pairs -----------------------------------------------------------------------------------------------------------


def pair(kind, seed, changed):
    """Both files' elements and, with `changed`, what differs: (noun, link, parameters, what)."""
    rng = random.Random(seed)
    robot = Robot(rng, full=kind == "mjcf-mjcf")
    names = rng.choice(list(NAMES))
    first = urdf(robot, rng) if kind.startswith("urdf") else mjcf(robot, rng, reframed=rng.random() < 0.5)
    second = mjcf(robot, rng, names) if kind.endswith("-mjcf") else urdf(robot, rng, names)
    difference = None
    if changed:
        change = change_mjcf if kind.endswith("-mjcf") else change_urdf
        difference = change(second, robot, rng, names)
    return robot, first, second, difference


def write(root, path):
    ET.indent(root)
    path.write_text(ET.tostring(root, encoding="unicode"))
    return str(path)


def compared(folder, first, second, kind):
    of_a, of_b = kind.split("-")
    a = write(first, folder / f"a.{'urdf' if of_a == 'urdf' else 'xml'}")
    b = write(second, folder / f"b.{'urdf' if of_b == 'urdf' else 'xml'}")
    done = subprocess.run([PROGRAM, "parity", a, b, "--json"], capture_output=True, text=True)
    if done.returncode not in (0, 1) or not done.stdout:
        raise SystemExit(f"assay parity {a} {b}: {done.stderr}")
    return json.loads(done.stdout)


def named_first(robot, result, difference):
    """Whether the difference is the first of the list, and what is."""
    noun, link, parameters, _ = difference
    if not result["differences"]:
        return False, "nothing"
    first = result["differences"][0]
    name = robot.links[link]["name"] if noun == "body" else robot.links[link]["joint"]
    return first["element"] == f"{noun} '{name}'" and first["parameter"] in parameters and not result["findings"], f"{first['element']}: {first['parameter']}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100, help="pairs with one difference")
    parser.add_argument("--same", type=int, default=100, help="pairs without one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=["mjcf-mjcf", "urdf-mjcf", "urdf-urdf"], action="append")
    parser.add_argument("--keep", help="folder that keeps the pairs that fail")
    options = parser.parse_args()
    kinds = options.kind or ["mjcf-mjcf", "urdf-mjcf", "urdf-urdf"]
    named, by_what, alarms = 0, {}, 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)

        def keep(name):
            if options.keep:
                target = pathlib.Path(options.keep) / name
                target.mkdir(parents=True, exist_ok=True)
                for file in folder.iterdir():
                    (target / file.name).write_bytes(file.read_bytes())
            for file in folder.iterdir():
                file.unlink()

        for n in range(options.cases):
            kind, seed = kinds[n % len(kinds)], 1000 * options.seed + n
            robot, first, second, difference = pair(kind, seed, True)
            right, seen = named_first(robot, compared(folder, first, second, kind), difference)
            named += right
            counts = by_what.setdefault(difference[3], [0, 0])
            counts[0] += right
            counts[1] += 1
            if not right:
                print(f"case {seed} {kind}: {difference[3]} of {difference[0]} {difference[1]} not named first, but {seen}")
                keep(f"case-{seed}")
            for file in folder.iterdir():
                file.unlink()
        for n in range(options.same):
            kind, seed = kinds[n % len(kinds)], 1000 * options.seed + 500 + n
            robot, first, second, _ = pair(kind, seed, False)
            result = compared(folder, first, second, kind)
            if result["verdict"] != "same":
                alarms += 1
                worst = (result["findings"] + result["differences"])[0]
                print(f"same {seed} {kind}: alarm {worst['element']}: {worst.get('parameter', worst.get('what'))} {worst.get('words', '')}")
                keep(f"same-{seed}")
    if options.cases:
        print(f"named first: {named} of {options.cases}")
        print("  " + ", ".join(f"{what} {right} of {count}" for what, (right, count) in sorted(by_what.items())))
    if options.same:
        print(f"false alarms: {alarms} of {options.same} pairs of one robot")
    return 0 if named >= 0.95 * options.cases and alarms == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
