#!/usr/bin/env python3
"""Compares the reference solution and contenders with Pinocchio on every robot that loads, without contacts.

    benchmarks/against_pinocchio.py PROGRAM [FILE...] [--page docs/lab/robots.md] [--jobs N]

PROGRAM is build/release/bin/assay_swing_states. FILEs are robots (default: all that `./assay robots` fetched). Run it with a
Python that has the packages of setup/pip/pinocchio.txt. Each robot starts with seeded joint rates and moves freely for 0.25 s,
without contacts, limits, dry friction and torques. Pinocchio computes the accelerations, Runge and Kutta's method integrates them
with steps that are halved until the end does not change. A URDF file is read by Pinocchio itself where it means the same joints;
else Pinocchio's model is built from what assay has read. With --page the table goes there, between its marks.
"""

import argparse
import concurrent.futures
import json
import math
import pathlib
import subprocess
import sys

import numpy as np
import pinocchio as pin

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "docs"))

from tables.common import table, updated  # noqa: E402
from tables.robots import PACKAGES, SWITCHES, cache, files_of  # noqa: E402

# Of each double-precision engine the integrators and joint solvers that treat a smooth robot differently.
CONTENDERS = ["mujoco-euler", "mujoco-implicitfast", "mujoco-rk4", "bullet-mb", "bullet-si-f64", "dart", "simbody-euler",
              "ode-step", "rapier-multibody-f64", "rapier-impulse-f64"]
LIMIT = 1e-4  # m, of a contender at the smallest timestep
FINE_MS = 1 / 64  # that timestep
SETTLED = 1e-11  # m: Pinocchio's integration ends when halving its step changes the end by less
MOST_STEPS = 1 << 17


class Robot:
    """What swing_states says of a model, with Pinocchio's model of the same robot."""

    def __init__(self, data, file):
        self.data = data
        self.own = file.endswith(".urdf") and self.read(file)
        if not self.own:
            self.build()
        self.work = self.model.createData()
        joints = list(self.model.joints)[1:]
        single = [joint for joint in joints if joint.nq == 1]
        self.single_q, self.single_v = [joint.idx_q for joint in single], [joint.idx_v for joint in single]
        self.others = [({2: "pair", 4: "ball", 7: "free"}[joint.nq], joint.idx_q, joint.idx_v) for joint in joints if joint.nq > 1]
        self.prepare_springs()
        self.reduce()

    # ---- Pinocchio's model

    def read(self, file):
        """Pinocchio's own reading of the URDF file; False where its joints are not those that assay has read."""
        free = [body for body in self.data["bodies"] if body["kind"] == "free"]
        try:
            self.model = pin.buildModelFromUrdf(file, *([pin.JointModelFreeFlyer()] if free else []))
        except (RuntimeError, ValueError):
            return False
        names = {joint["name"] for joint in self.data["joints"]}
        if self.data["balls"] or len(free) > 1 or set(self.model.names[1 + len(free):]) != names:
            return False
        by_name = {self.data["joints"][body["number"]]["name"]: b for b, body in enumerate(self.data["bodies"])
                   if body["kind"] in ("hinge", "slide")}
        self.joint_of = [0] * len(self.data["bodies"])
        for name, body in by_name.items():
            self.joint_of[body] = self.model.getJointId(name)
        for body in range(len(self.data["bodies"])):
            if self.data["bodies"][body]["kind"] == "free":
                self.joint_of[body] = 1
        # URDF has no armature, and of dampers Pinocchio's own reading counts
        damping = np.array(self.model.damping)
        for joint in self.data["joints"]:
            joint["damping"] = float(damping[self.model.joints[self.model.getJointId(joint["name"])].idx_v])
        self.model.armature = np.zeros(self.model.nv)
        return True

    def build(self):
        """The same tree, body by body."""
        self.model = pin.Model()
        self.model.gravity.linear = np.array(self.data["gravity"])
        self.joint_of = []
        armature = []
        for body in self.data["bodies"]:
            anchor = self.anchor(body)
            parent = 0 if body["parent"] < 0 else self.joint_of[body["parent"]]
            before = np.zeros(3) if body["parent"] < 0 else self.anchor(self.data["bodies"][body["parent"]])
            at = pin.SE3(pin.Quaternion(*body["q"]).toRotationMatrix(), np.array(body["p"]))
            kind = body["kind"]
            joint = self.data["joints"][body["number"]] if kind in ("hinge", "slide") else None
            axis = np.array(joint["axis"]) if joint else None
            own = {"hinge": lambda axis=axis: pin.JointModelRevoluteUnaligned(axis),
                   "slide": lambda axis=axis: pin.JointModelPrismaticUnaligned(axis),
                   "ball": pin.JointModelSpherical, "free": pin.JointModelFreeFlyer}[kind]()
            if kind == "free":
                placement = pin.SE3.Identity()
            else:
                placement = pin.SE3(np.eye(3), -before) * at * pin.SE3(np.eye(3), anchor)
            number = self.model.addJoint(parent, own, placement, f"{len(self.joint_of)} {body['name']}")
            inertia = pin.Inertia(body["mass"], np.array(body["cm"]) - anchor, np.array(body["inertia"]).reshape(3, 3))
            self.model.appendBodyToJoint(number, inertia, pin.SE3.Identity())
            self.joint_of.append(number)
            extra = joint["armature"] if joint else self.data["balls"][body["number"]]["armature"] if kind == "ball" else 0
            armature += [extra] * own.nv
        self.model.armature = np.array(armature)

    def anchor(self, body):
        if body["kind"] == "free":
            return np.zeros(3)
        return np.array(self.data["balls" if body["kind"] == "ball" else "joints"][body["number"]]["anchor"])

    # ---- couplings: a coupled joint's coordinate follows from others

    def reduce(self):
        """v = G z for independent z."""
        couplings = {c["joint"]: c for c in self.data["couplings"]}
        nv = self.model.nv
        columns = [self.at_v[joint] for joint in couplings]
        free = [i for i in range(nv) if i not in columns]
        self.free, self.G = free, np.zeros((nv, len(free)))
        for k, i in enumerate(free):
            self.G[i, k] = 1
        for _ in couplings:  # a coupled joint may lead another
            for joint, coupling in couplings.items():
                row = sum((term["coefficient"] * self.G[self.at_v[term["joint"]]] for term in coupling["terms"]),
                          np.zeros(len(free)))
                self.G[self.at_v[joint]] = row

    # ---- states

    def start(self):
        q, v = pin.neutral(self.model), np.zeros(self.model.nv)
        state = self.data["start"]
        for body, moving, number in zip(self.data["bodies"], state["bodies"], self.joint_of):
            joint = self.model.joints[number]
            turn = pin.Quaternion(*moving["q"])
            R = turn.toRotationMatrix()
            w = np.array(moving["w"])
            if body["kind"] == "free":
                arm = R @ np.array(body["cm"])
                q[joint.idx_q:joint.idx_q + 7] = [*(np.array(moving["p"]) - arm), *turn.coeffs()]
                v[joint.idx_v:joint.idx_v + 6] = [*(R.T @ (np.array(moving["v"]) - np.cross(w, arm))), *(R.T @ w)]
            elif body["kind"] == "ball":
                parent = state["bodies"][body["parent"]] if body["parent"] >= 0 else {"q": [1, 0, 0, 0], "w": [0, 0, 0]}
                q[joint.idx_q:joint.idx_q + 4] = ((pin.Quaternion(*parent["q"]) * pin.Quaternion(*body["q"])).inverse() * turn).coeffs()
                v[joint.idx_v:joint.idx_v + 3] = R.T @ (w - np.array(parent["w"]))
            else:
                at = state["position"][body["number"]] - self.data["joints"][body["number"]]["reference"]
                v[joint.idx_v] = state["velocity"][body["number"]]
                if joint.nq == 2:
                    q[joint.idx_q:joint.idx_q + 2] = [math.cos(at), math.sin(at)]
                else:
                    q[joint.idx_q] = at
        return q, v

    def centres(self, q):
        """Centres of mass of the bodies with mass, by body."""
        pin.forwardKinematics(self.model, self.work, q)
        return [self.work.oMi[number].act(self.model.inertias[number].lever) if body["mass"] > 0 else None
                for body, number in zip(self.data["bodies"], self.joint_of)]

    # ---- motion

    def prepare_springs(self):
        """Constants of forces(), by coordinate of the joints that have one."""
        count = len(self.data["joints"])
        self.at_q, self.at_v, self.paired = np.zeros(count, int), np.zeros(count, int), []
        for body, number in zip(self.data["bodies"], self.joint_of):
            if body["kind"] in ("hinge", "slide"):
                joint = self.model.joints[number]
                self.at_q[body["number"]], self.at_v[body["number"]] = joint.idx_q, joint.idx_v
                if joint.nq == 2:
                    self.paired.append(body["number"])
        get = lambda key: np.array([joint[key] for joint in self.data["joints"]])  # noqa: E731
        self.reference, self.stiffness, self.damping = get("reference"), get("stiffness"), get("damping")
        self.spring_reference = get("spring_reference")
        self.sprung_balls = [(self.data["balls"][body["number"]], self.model.joints[number])
                             for body, number in zip(self.data["bodies"], self.joint_of) if body["kind"] == "ball"
                             and (self.data["balls"][body["number"]]["stiffness"] or self.data["balls"][body["number"]]["damping"])]

    def forces(self, q, v):
        """Of springs, dampers and tendons."""
        tau = np.zeros(self.model.nv)
        position, speed = q[self.at_q] + self.reference, v[self.at_v]
        for joint in self.paired:
            position[joint] = math.atan2(q[self.at_q[joint] + 1], q[self.at_q[joint]]) + self.reference[joint]
        tau[self.at_v] = -self.stiffness * (position - self.spring_reference) - self.damping * speed
        for ball, joint in self.sprung_balls:
            turn = pin.Quaternion(q[joint.idx_q:joint.idx_q + 4])
            w, x, y, z = ball["spring_reference"]
            off = pin.log3((pin.Quaternion(w, x, y, z).inverse() * turn).toRotationMatrix())
            tau[joint.idx_v:joint.idx_v + 3] -= ball["stiffness"] * off + ball["damping"] * v[joint.idx_v:joint.idx_v + 3]
        for tendon in self.data["tendons"]:
            length = sum(term["coefficient"] * position[term["joint"]] for term in tendon["terms"])
            rate = sum(term["coefficient"] * speed[term["joint"]] for term in tendon["terms"])
            rest = min(max(length, tendon["rest_lower"]), tendon["rest_upper"])
            tension = -tendon["stiffness"] * (length - rest) - tendon["damping"] * rate
            for term in tendon["terms"]:
                tau[self.at_v[term["joint"]]] += term["coefficient"] * tension
        return tau

    def acceleration(self, q, v):
        tau = self.forces(q, v)
        if len(self.free) == self.model.nv:
            return pin.aba(self.model, self.work, q, v, tau)
        M = pin.crba(self.model, self.work, q)
        M = np.triu(M) + np.triu(M, 1).T
        h = pin.nonLinearEffects(self.model, self.work, q, v)
        return self.G @ np.linalg.solve(self.G.T @ M @ self.G, self.G.T @ (tau - h))

    def rate(self, q, v):
        """dq/dt, where q has quaternions (x, y, z, w) and pairs of cosine and sine."""
        dq = np.zeros(self.model.nq)
        dq[self.single_q] = v[self.single_v]
        for kind, a, b in self.others:
            if kind == "pair":
                dq[a], dq[a + 1] = -q[a + 1] * v[b], q[a] * v[b]
                continue
            turn, w = (a, v[b:b + 3]) if kind == "ball" else (a + 3, v[b + 3:b + 6])
            x, scalar = q[turn:turn + 3], q[turn + 3]
            cross = np.array([x[1] * w[2] - x[2] * w[1], x[2] * w[0] - x[0] * w[2], x[0] * w[1] - x[1] * w[0]])
            dq[turn:turn + 3] = (scalar * w + cross) / 2
            dq[turn + 3] = -x.dot(w) / 2
            if kind == "free":
                dq[a:a + 3] = pin.Quaternion(q[turn:turn + 4]).toRotationMatrix() @ v[b:b + 3]
        return dq

    def slope(self, q, v):
        q = pin.normalize(self.model, q)
        return self.rate(q, v), self.acceleration(q, v)

    def end(self, duration, steps):
        q, v = self.start()
        h = duration / steps
        for _ in range(steps):
            q1, v1 = self.slope(q, v)
            q2, v2 = self.slope(q + h / 2 * q1, v + h / 2 * v1)
            q3, v3 = self.slope(q + h / 2 * q2, v + h / 2 * v2)
            q4, v4 = self.slope(q + h * q3, v + h * v3)
            q = pin.normalize(self.model, q + h / 6 * (q1 + 2 * q2 + 2 * q3 + q4))
            v = v + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
            if not np.isfinite(v).all() or np.abs(v).max() > 1e8:
                return None
        return self.centres(q)

    def solution(self):
        """The end, and by how much the last halving changed it (m)."""
        steps, before = 256, None
        while steps <= MOST_STEPS:
            now = self.end(self.data["duration_s"], steps)
            change = math.inf if now is None or before is None else distance(now, before)
            if change < SETTLED:
                return now, change
            # fourth order: the steps that are enough are known
            if change < 1e-4:
                steps *= max(2, 2 ** math.ceil(math.log2(change / SETTLED) / 4))
            else:
                steps *= 4
            before = now
        return before, change

    def explicit_bound(self):
        """The largest timestep that explicit springs and dampers stand at the start, s."""
        q, v = self.start()
        M = pin.crba(self.model, self.work, q)
        M = np.triu(M) + np.triu(M, 1).T
        damping, stiffness = np.zeros(self.model.nv), np.zeros(self.model.nv)
        for body, number in zip(self.data["bodies"], self.joint_of):
            model = self.model.joints[number]
            if body["kind"] == "free":
                continue
            joint = self.data["balls" if body["kind"] == "ball" else "joints"][body["number"]]
            damping[model.idx_v:model.idx_v + model.nv] = joint["damping"]
            stiffness[model.idx_v:model.idx_v + model.nv] = joint["stiffness"]
        inverse = self.G @ np.linalg.inv(self.G.T @ M @ self.G) @ self.G.T
        fastest = max(abs(np.linalg.eigvals(inverse * damping)), default=0)
        stiffest = max(abs(np.linalg.eigvals(inverse * stiffness)), default=0)
        return min(2 / fastest if fastest else math.inf, 2 / math.sqrt(stiffest) if stiffest else math.inf)


def distance(a, b):
    """The largest distance of a body's centre of mass."""
    return max(float(np.linalg.norm(np.array(x) - np.array(y))) for x, y in zip(a, b) if x is not None and y is not None)


def places(state):
    return [body["p"] for body in state["bodies"]]


def swing(program, file, contenders):
    """swing_states' answer, with the first of the switches that loads the file; else its refusal."""
    for options in ([], *SWITCHES):
        done = subprocess.run([program, file, *contenders, *options], capture_output=True, text=True, check=False)
        if done.returncode == 0:
            return json.loads(done.stdout)
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else f"status {done.returncode}"


def examine(program, file, contenders):
    data = swing(program, file, contenders)
    row = {"file": file, "why": data if isinstance(data, str) else "", "contenders": []}
    if isinstance(data, str):
        return row
    row["dof"], row["loops"] = data["dof"], data["loops"]
    if data["loops"]:
        row["why"] = "it has closed loops"
        return row
    robot = Robot(data, file)
    row["own"], row["bound_ms"] = bool(robot.own), 1000 * robot.explicit_bound()
    truth, row["settled"] = robot.solution()
    if truth is None or row["settled"] > 1e-8:
        row["why"] = "Pinocchio's integration does not settle"
        return row
    reference = data["reference"]
    if isinstance(reference, dict):
        row["reference"] = distance(places(reference), truth)
    else:
        row["reference_why"] = reference
    for contender in data["contenders"]:
        entry = {"name": contender["name"], "declared": contender["order"], "refused": contender["refused"],
                 "approximated": contender["approximated"], "failures": [], "errors": {}}
        for end in contender["ends"]:
            if "state" in end:
                error = distance(places(end["state"]), truth)
                entry["errors"][end["timestep_ms"]] = error if math.isfinite(error) else math.inf
            else:
                entry["failures"].append(end["failure"])
        row["contenders"].append(entry)
    return row


def errors_of(entry):
    """(timestep in ms, error in m), the smallest timestep first."""
    return sorted((float(timestep), error) for timestep, error in entry["errors"].items())


def order_of(entry, settled):
    """Observed between the two timesteps; None where Pinocchio's own error, rounding or a declared approximation hides it."""
    if len(entry["errors"]) < 2 or any("borrows" in text or "gives way" in text for text in entry["approximated"]):
        return None  # the error of lent mass and of soft couplings does not depend on the step
    (fine_ms, fine), (coarse_ms, coarse) = errors_of(entry)[:2]
    if not math.isfinite(coarse) or fine < max(1e-10, 100 * settled):
        return None
    return math.log(coarse / fine) / math.log(coarse_ms / fine_ms)


def failing(entry, settled):
    """Why a contender does not agree; empty when it does."""
    if not entry["errors"] or errors_of(entry)[0][0] > FINE_MS:
        return entry["failures"][0]
    fine = errors_of(entry)[0][1]
    if not fine < LIMIT:
        return f"{fine:.1e} m"
    order = order_of(entry, settled)
    if order is not None and order < entry["declared"] - 0.3:
        return f"order {order:.1f} instead of {entry['declared']}, {fine:.1e} m"
    return ""


def tables(rows, roots):
    ran = [row for row in rows if not row["why"]]
    names = [name for name in CONTENDERS if any(entry["name"] == name for row in ran for entry in row["contenders"])]
    head = ["contender", "robots", "agree", "largest error of these", "order, median", "declared", "do not"]
    lines = []
    notes = []
    for name in names:
        taken = [(row, entry) for row in ran for entry in row["contenders"] if entry["name"] == name and not entry["refused"]]
        if not taken:
            continue
        good, orders, worst = [], [], 0.0
        for row, entry in taken:
            why = failing(entry, row["settled"])
            if why:
                bound = f" (explicit bound {row['bound_ms']:.2g} ms)" if row["bound_ms"] < 1 / 32 else ""
                approximated = "; it declares: " + entry["approximated"][0] if entry["approximated"] else ""
                notes.append([name, f"`{pathlib.Path(row['file']).name}`", why.replace("|", "\\|") + bound + approximated])
                continue
            good.append(row)
            worst = max(worst, errors_of(entry)[0][1])
            order = order_of(entry, row["settled"])
            if order is not None:
                orders.append(order)
        lines.append([f"`{name}`", len(taken), len(good), f"{worst:.1e} m" if good else "–",
                      f"{sorted(orders)[len(orders) // 2]:.2f}" if orders else "–", taken[0][1]["declared"], len(taken) - len(good)])
    with_reference = [row for row in ran if "reference" in row]
    own = [row for row in ran if row["own"]]
    least = [sum(1 for entry in row["contenders"] if not entry["refused"] and not failing(entry, row["settled"])) for row in ran]
    unsettled = sum("settle" in row["why"] for row in rows)
    text = (f"Of {len(rows)} files {len(ran)} are compared: {len(rows) - len(ran) - unsettled} do not load or have closed loops, and Pinocchio's "
            f"integration does not settle for {unsettled}.\nPinocchio reads {len(own)} of them by itself; its models of the others are built from what assay has "
            "read, so these compare dynamics alone.\n"
            f"The reference solution is within {max((row['reference'] for row in with_reference), default=0):.1e} m of Pinocchio on "
            f"all {len(with_reference)} that have one.\nAt least {min(least, default=0)} contenders agree on every robot.\n\n")
    text += table(head, lines)
    if notes:
        text += "\nWhere a contender takes a robot and does not agree, with the first approximation that it declares:\n\n" + table(["contender", "file", "at 1/64 ms"], notes)
    left = [row for row in rows if row["why"] == "it has closed loops" or "settle" in row["why"]]
    if left:
        text += "\nNot compared: " + "; ".join(f"`{pathlib.Path(row['file']).name}`, because {row['why']}" for row in left) + ".\n"
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("files", nargs="*")
    parser.add_argument("--contenders", nargs="+", default=CONTENDERS)
    parser.add_argument("--robots", type=pathlib.Path, default=cache() / "robots", help="folder of the packages")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", type=pathlib.Path, help="write what was found to this file, or read it if it exists")
    parser.add_argument("--page", type=pathlib.Path)
    options = parser.parse_args()
    files = options.files
    if not files:
        for package in PACKAGES:
            files += files_of(package, options.robots)[1]
    known = json.loads(options.json.read_text()) if options.json and options.json.exists() else {}
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        jobs = {pool.submit(examine, options.program, file, options.contenders): file for file in files if file not in known}
        for job in concurrent.futures.as_completed(jobs):
            try:
                row = job.result()
            except Exception as error:  # noqa: BLE001: one robot does not end the others
                row = {"file": jobs[job], "why": f"{type(error).__name__}: {error}", "contenders": []}
            known[row["file"]] = row
            bad = [f"{entry['name']} {failing(entry, row['settled'])}" for entry in row["contenders"]
                   if not entry["refused"] and failing(entry, row["settled"])]
            print(pathlib.Path(row["file"]).name, row["why"] or f"reference {row.get('reference', row.get('reference_why'))}",
                  "; ".join(bad), file=sys.stderr, flush=True)
            if options.json:
                options.json.write_text(json.dumps(known))
    rows = [known[file] for file in files]
    for row in rows:
        row["contenders"] = [entry for entry in row["contenders"] if entry["name"] in options.contenders]
    text = tables(rows, options.robots)
    if options.page:
        options.page.write_text(updated(options.page.read_text(encoding="utf-8"), {"pinocchio": "\n" + text + "\n"}), encoding="utf-8")
    else:
        print(text)
    compared = [entry for row in rows if not row["why"] for entry in row["contenders"] if not entry["refused"]]
    return 0 if compared else 1


if __name__ == "__main__":
    sys.exit(main())
