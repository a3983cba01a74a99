#!/usr/bin/env python3
"""How often `assay explain` names a cause that was put in, and how often it finds one where there is none.

    benchmarks/seeded_causes.py [--program ./assay] [--seeded 100] [--unchanged 100] [--robots NAME,...] [--out FILE.json]

A seeded pair is two copies of one contender on one robot, the second with one change (`--change-b`). It counts as a hit when the
first cause of the answer is that change's. An unchanged pair is the same without the change: "no difference" is right. Seeds,
contenders and robots are combined in a fixed order that takes each of them about as often. Pairs whose change moves nothing by more than
rounding are counted apart: they are no misses and no hits.
"""

import argparse
import collections
import json
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
CART_POLE = ROOT / "examples/cart-pole-policy"
POLICY = ["--policy-config", str(CART_POLE / "policy.toml"), "--seconds", "2"]
RANDOM = ["--control", "random", "--timestep", "2", "--seconds", "1"]
HOLD = ["--control", "hold", "--timestep", "2", "--seconds", "0.6"]

# robot: its model, how it is driven, contenders, and changes with the cause that is to be named first
ROBOTS = {
    "cart-pole": (str(CART_POLE / "cart_pole.xml"), POLICY,
                  ["mujoco-euler", "bullet-mb", "dart", "simbody-euler", "ode-step", "rapier-multibody-f64", "mujoco-rk4", "ode-quick"],
                  [("delay=1", "control delay"), ("gear:slider=-1", "gear"), ("order=slider,hinge", "joint order"),
                   ("mass:pole=1.5", "mass"), ("damping:hinge=+0.05", "damping"), ("damping:slider=+0.5", "damping")]),
    "finger": ("finger", RANDOM, ["mujoco-implicitfast", "mujoco-euler", "dart", "simbody-euler", "bullet-mb", "drake-discrete"],
               [("damping=2", "damping"), ("damping=off", "damping"), ("stiffness=0.5", "stiffness"), ("dampers=explicit", "damping law"),
                ("gear:middle=-1", "gear"), ("order=knuckle,middle", "joint order"), ("delay=1", "control delay"),
                ("mass:distal=2", "mass"), ("inertia:proximal=3", "inertia")]),
    "spatial-chain": ("spatial-chain", RANDOM, ["mujoco-euler", "dart", "simbody-euler", "ode-step", "bullet-mb", "physx-art-tgs", "jolt-f64"],
                      [("gear:hinge3=-1", "gear"), ("order=hinge2,hinge4", "joint order"), ("order=reversed", "joint order"),
                       ("delay=1", "control delay"), ("mass:link3=1.3", "mass"), ("inertia:link5=2", "inertia"),
                       ("damping:hinge2=+0.5", "damping"), ("armature:hinge3=+0.05", "armature")]),
    "humanoid": ("humanoid", HOLD, ["mujoco-euler", "dart", "bullet-mb"],
                 [("friction=0.3", "contact friction"), ("contacts=off", "contacts"), ("gear:left_knee=-1", "gear"),
                  ("delay=1", "control delay"), ("mass:torso=1.5", "mass"), ("order=left_knee,left_ankle", "joint order"),
                  ("armature:right_knee=+0.2", "armature"), ("damping:left_knee=+5", "damping")]),
}
# of one engine's settings: (robot, contender, change, cause)
SETTINGS = [
    ("humanoid", "mujoco-euler", "set:cone=elliptic", "friction model"),
    ("humanoid", "mujoco-euler", "set:contact_timeconst=0.04", "contact softness"),
    ("finger", "mujoco-euler", "set:pd=explicit", "damping law"), ("finger", "mujoco-implicitfast", "set:pd=explicit", "damping law"),
    ("finger", "dart", "set:pd=explicit", "damping law"), ("finger", "simbody-euler", "set:pd=explicit", "damping law"),
    ("finger", "mujoco-euler", "set:euler_damping=off", "damping law"), ("spatial-chain", "mujoco-euler", "set:integrator=rk4", "integrator"),
]


def asked(program, robot, contender, seed, change):
    """The answer about two copies of a contender, or a sentence why there is none."""
    model, options, _, _ = ROBOTS[robot]
    command = [program, "explain", model, contender, contender, *options, "--seeds", "6", "--json"]
    if options[0] == "--control" and options[1] == "random":
        command[command.index("random")] = f"random,seed={seed}"
    if change:
        command += ["--change-b", change]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200)
    return json.loads(done.stdout) if done.returncode == 0 else (done.stderr.strip().splitlines() or ["no message"])[-1]


def in_turns(lists):
    """One of each list in turns, so that a part of the whole has all of them."""
    rows = [list(each) for each in lists]
    while any(rows):
        for row in rows:
            if row:
                yield row.pop(0)


def seeded(chosen):
    """(robot, contender, change, cause); contenders of a robot take turns over its changes."""
    by_robot = []
    for robot, (_, _, contenders, changes) in ROBOTS.items():
        if robot not in chosen:
            continue
        count = len(contenders) * len(changes)
        # so that a step changes both
        pairs = [(robot, contenders[i % len(contenders)], *changes[(i + i // len(contenders)) % len(changes)]) for i in range(count)]
        by_robot.append(dict.fromkeys(pairs))
    return in_turns([*by_robot, [row for row in SETTINGS if row[0] in chosen]])


def unchanged(chosen):
    by_robot = []
    for robot, (_, _, contenders, _) in ROBOTS.items():
        if robot not in chosen:
            continue
        by_robot.append([(robot, contender, "", "") for contender in contenders] * 5)
    return in_turns(by_robot)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=str(ROOT / "assay"))
    parser.add_argument("--seeded", type=int, default=100)
    parser.add_argument("--unchanged", type=int, default=100)
    parser.add_argument("--robots", default=",".join(ROBOTS), help="which (default: all)")
    parser.add_argument("--out", type=pathlib.Path, help="every answer, as JSON")
    options = parser.parse_args()
    listed = subprocess.run([options.program, "engines", "--json"], capture_output=True, text=True, check=True)
    chosen = options.robots.split(",")
    known = {row["contender"] for row in json.loads(listed.stdout)["contenders"]}
    counts, by_cause, answers = collections.Counter(), collections.defaultdict(collections.Counter), []
    begin = time.monotonic()
    for kind, wanted, pairs in (("seeded", options.seeded, seeded(chosen)), ("unchanged", options.unchanged, unchanged(chosen))):
        for robot, contender, change, cause in pairs:
            if counts[kind] >= wanted:
                break
            if contender not in known:
                continue
            found = asked(options.program, robot, contender, counts[kind] % 7, change)
            name = f"{robot} {contender} {change}".strip()
            if isinstance(found, str):  # the contender refuses the robot, or a pair cannot run
                print(f"left out: {name}: {found}", flush=True)
                counts[f"{kind} left out"] += 1
                continue
            answers.append({"kind": kind, "robot": robot, "contender": contender, "change": change, "cause": cause, "answer": found})
            if kind == "seeded" and found["verdict"] == "no difference":
                print(f"no effect: {name}", flush=True)
                counts["seeded without effect"] += 1
                continue
            first = found["advice"][0]["cause"] if found["advice"] else found["verdict"]
            right = first == cause if kind == "seeded" else found["verdict"] == "no difference"
            counts[kind] += 1
            counts[f"{kind} right"] += right
            by_cause[cause or "unchanged"][right] += 1
            if not right:
                print(f"wrong: {name}: {first}, not {cause or 'no difference'}", flush=True)
    for cause, rights in sorted(by_cause.items()):
        print(f"{cause}: {rights[True]} of {sum(rights.values())}")
    print(f"seeded causes named first: {counts['seeded right']} of {counts['seeded']} "
          f"({counts['seeded without effect']} more moved nothing, {counts['seeded left out']} could not run)")
    print(f"unchanged pairs found to be no difference: {counts['unchanged right']} of {counts['unchanged']} "
          f"({counts['unchanged left out']} could not run)")
    print(f"{time.monotonic() - begin:.0f} s")
    if options.out:
        options.out.write_text(json.dumps(answers, indent=1))
    return 0 if counts["seeded right"] >= 0.9 * counts["seeded"] and counts["unchanged right"] >= 0.98 * counts["unchanged"] else 1


if __name__ == "__main__":
    sys.exit(main())
