#!/usr/bin/env python3
"""Writes models/capsules-N.xml: N free capsules in a grid above a plane, turned at random with a fixed seed.

Usage: models/capsules.py N > models/capsules-N.xml
"""
import math
import random
import sys

RADIUS, HALF_LENGTH, MASS, FRICTION = 0.05, 0.1, 1.0, 0.7  # m, m (half of the cylinder), kg, -
SPACING = 0.31  # m: just more than the longest extent, so that no two touch at the start however they are turned
LOWEST = 0.3  # m: height of the lowest layer
SEED = 27


def orientation(generator):
    """A uniformly distributed unit quaternion (w, x, y, z), after Shoemake, Graphics Gems III (1992), p. 124."""
    u, a, b = generator.random(), 2 * math.pi * generator.random(), 2 * math.pi * generator.random()
    inner, outer = math.sqrt(1 - u), math.sqrt(u)
    return outer * math.cos(b), inner * math.sin(a), inner * math.cos(a), outer * math.sin(b)


def model(count):
    side = math.ceil(round(count ** (1 / 3), 9))
    generator = random.Random(SEED)
    bodies, states = [], []
    for i in range(count):
        layer, row, column = i // side**2, i // side % side, i % side
        x, y = (SPACING * (k - (side - 1) / 2) for k in (column, row))
        z = LOWEST + SPACING * layer
        shade = " ".join(f"{0.35 + 0.5 * k / max(side - 1, 1):.2f}" for k in (column, row, layer))
        bodies.append(
            f'    <body name="capsule{i + 1}" pos="{x:g} {y:g} {z:g}">\n'
            f"      <freejoint/>\n"
            f'      <geom name="shape{i + 1}" rgba="{shade} 1"/>\n'
            f"    </body>"
        )
        quaternion = " ".join(f"{q:.6f}" for q in orientation(generator))
        states.append(f"      {x:g} {y:g} {z:g} {quaternion}")
    nl = "\n"
    return f"""<!--
  {count} capsules: {6 * count} DOF. Free capsules fall from a grid onto a plane, each turned at random (uniformly, fixed seed), and
  pile up: many contacts between bodies that nothing else connects, what engines of games are made for. No two touch at the
  start. The keyframe holds the random orientations; the bodies' own poses are the upright grid. A capsule has radius
  {RADIUS} m, cylinder {2 * HALF_LENGTH} m, {MASS:g} kg and the exact inertia of that capsule; friction {FRICTION} everywhere.

  System of Erez, Tassa and Todorov (ICRA 2015), section IV.A; the paper gives no dimensions. Written by models/capsules.py {count}.
-->
<mujoco model="capsules-{count}">
  <option gravity="0 0 -9.81"/>
  <default>
    <geom type="capsule" size="{RADIUS} {HALF_LENGTH}" mass="{MASS:g}" condim="3" friction="{FRICTION}"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1" rgba="0.9 0.9 0.9 1"/>
{nl.join(bodies)}
  </worldbody>
  <keyframe>
    <key name="start" qpos="
{nl.join(states)}"/>
  </keyframe>
</mujoco>"""


if __name__ == "__main__":
    if len(sys.argv) != 2 or not sys.argv[1].isdigit() or int(sys.argv[1]) < 1:
        sys.exit(__doc__.strip())
    print(model(int(sys.argv[1])))
