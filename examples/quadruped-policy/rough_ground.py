#!/usr/bin/env python3
"""Writes rough.xml: the quadruped of this folder on a floor with half-buried logs, seeded.

Logs are capsules of the world, across the way: a foot is a ball, and balls against capsules and planes are exact in every engine.

    python3 rough_ground.py --seed 1 --height 0.05
"""

import argparse
import math
import pathlib
import random

HERE = pathlib.Path(__file__).resolve().parent
FIRST, LAST, STEP = 0.45, 7.0, 0.22  # m, of the logs' middles along the way; the robot starts at 0
HALF_LENGTH, RADIUS = 1.5, 0.1  # m
AWRY = 0.25  # rad, about the vertical
SLOPE = 0.012  # rad, along a log


def logs(seed, height):
    """A line for each log; their tops are between 0 and `height` m over the floor in the middle."""
    draw = random.Random(seed).uniform
    for i in range(int((LAST - FIRST) / STEP) + 1):
        x = FIRST + STEP * i + draw(-0.3, 0.3) * STEP
        top, yaw, slope = draw(0, height), draw(-AWRY, AWRY), draw(-SLOPE, SLOPE)
        along = (-math.sin(yaw) * math.cos(slope), math.cos(yaw) * math.cos(slope), math.sin(slope))
        middle = (x, 0, top - RADIUS)
        ends = [c + side * HALF_LENGTH * a for side in (-1, 1) for c, a in zip(middle, along)]
        yield f'    <geom name="log_{i}" class="log" fromto="{" ".join(f"{end:.4f}" for end in ends)}"/>\n'


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--height", type=float, default=0.05, help="m, of the highest log")
    parser.add_argument("--out", type=pathlib.Path, default=HERE / "rough.xml")
    options = parser.parse_args()
    options.out.write_text(f"""<!--
  The quadruped on a floor with half-buried logs, whose tops are up to {1e3 * options.height:g} mm high. Written by
  rough_ground.py --seed {options.seed} --height {options.height:g}.
-->
<mujoco model="quadruped-rough">
  <include file="quadruped.xml"/>
  <default>
    <default class="log">
      <geom type="capsule" size="{RADIUS:g}" condim="3" friction="0.8" contype="1" conaffinity="0" rgba="0.72 0.6 0.48 1"/>
    </default>
  </default>
  <worldbody>
{"".join(logs(options.seed, options.height))}  </worldbody>
</mujoco>
""")


if __name__ == "__main__":
    main()
