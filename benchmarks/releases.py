#!/usr/bin/env python3
"""Robots through the releases of engines: `assay bisect` on each pair of a contender and a robot, for the table of docs/releases.md.

    benchmarks/releases.py --out results/releases-DATE [--program ./assay] [--contenders drake-sap,...] [--robots humanoid,...]
                           [--seeds 5] [--quick] [--no-set-up]

OUT gets CONTENDER-ROBOT.json.xz, what `assay bisect --json` prints; what is there is not run again. Releases that are not set up
are set up first, unless --no-set-up is given. A robot that a contender refuses is said and left out. Motion alone: other work on
the machine makes it slow, and not wrong. `docs/update.py releases OUT` makes the table.
"""

import argparse
import json
import lzma
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# The paper's systems, and the robots of the examples: the second word is what the program calls them.
ROBOTS = {name: name for name in ("planar-chain", "spatial-chain", "humanoid", "astronaut", "rolling", "sliding-box", "box-stack",
                                  "capsules-27", "four-bar", "finger", "grasp", "joint-stops", "rimless-wheel", "tipping-box")}
ROBOTS |= {"quadruped": "examples/quadruped-policy/quadruped.xml", "arm": "examples/arm-reach-policy/arm.xml",
           "cart-pole": "examples/cart-pole-policy/cart_pole.xml"}
CONTENDERS = ("mujoco-euler", "drake-sap", "dartpy", "sapien-tgs")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--program", default=str(ROOT / "assay"))
    parser.add_argument("--contenders", default=",".join(CONTENDERS))
    parser.add_argument("--robots", default=",".join(ROBOTS))
    parser.add_argument("--seeds", default="5")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--no-set-up", action="store_true")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    failed = 0
    for contender in given.contenders.split(","):
        for robot in given.robots.split(","):
            out = given.out / f"{contender}-{robot}.json.xz"
            if out.exists():
                continue
            if robot not in ROBOTS:
                sys.exit(f"--robots has '{robot}', which is none of {', '.join(ROBOTS)}")
            options = [word for word, on in (("--quick", given.quick), ("--no-set-up", given.no_set_up)) if on]
            for seeds in ([given.seeds], ["1"]):  # one start where none can be perturbed
                done = subprocess.run([given.program, "bisect", ROBOTS[robot], "--contender", contender, "--json", "--seeds", *seeds, *options],
                                      cwd=ROOT, capture_output=True, text=True)
                if "give --seeds 1" not in done.stderr:
                    break
            if done.returncode not in (0, 1):
                failed += 1
                print(f"{contender} on {robot}: {done.stderr.strip().splitlines()[-1]}", flush=True)
                continue
            found = json.loads(done.stdout)
            out.write_bytes(lzma.compress(done.stdout.encode(), preset=9))
            motions = sum(not change["rounding"] for change in found["changes"])
            print(f"{contender} on {robot}: {len(found['changes'])} changes, {motions} of the motion", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
