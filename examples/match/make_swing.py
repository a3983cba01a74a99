#!/usr/bin/env python3
"""Writes swing.csv: the pendulum of pendulum.xml with known damping and friction, as a sensor would log it."""

import math
import random
import sys

INERTIA, WEIGHT = 0.0626, 0.102 * 9.81   # kg m^2, N m: those of pendulum.xml
DAMPING, FRICTION = 0.06, 0.12           # N m s, N m: the truth, which the model does not have
STEP, RATE, LENGTH = 1e-4, 200, 6        # s, Hz, s
ANGLE_NOISE, TORQUE_NOISE = 3e-4, 5e-3   # rad, N m


def swing(seed=1):
    noise, angle, velocity, rows = random.Random(seed), 1.2, 0.0, []
    for i in range(int(LENGTH / STEP)):
        time = i * STEP
        torque = 0.8 * math.sin(3.5 * time) + 0.4 * math.sin(6.1 * time + 1)
        if i % int(1 / (RATE * STEP)) == 0:
            rows.append((time, angle + noise.gauss(0, ANGLE_NOISE), torque + noise.gauss(0, TORQUE_NOISE)))
        force = torque - WEIGHT * math.sin(angle) - DAMPING * velocity - FRICTION * math.tanh(velocity / 0.005)
        velocity += STEP * force / INERTIA
        angle += STEP * velocity
    return rows


def main():
    with open(sys.argv[1] if len(sys.argv) > 1 else "swing.csv", "w") as file:
        print("time,hinge,hinge.torque", file=file)
        for row in swing():
            print(*(f"{x:.6f}" for x in row), sep=",", file=file)


if __name__ == "__main__":
    main()
