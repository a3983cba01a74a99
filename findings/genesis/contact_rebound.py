"""Genesis: a ball leaves the ground with a seventh of its speed, at 4 ms up to a sixth, as in MuJoCo, whose contacts it has.

A contact is a critically damped spring that only pushes: its force ends at two time constants, where a ball has exp(-2) = 0.135 of
its speed outwards (../mujoco/contact_rebound.cc).
"""

from scene import *

BALL = """<mujoco><worldbody><geom type="plane" size="0 0 1"/>
  <body pos="0 0 0.102"><freejoint/><geom type="sphere" size="0.1" mass="1"/></body></worldbody></mujoco>"""
SPEED, PHASES, still_so = 2.0, 10, True
for h in (4e-3, 1e-3):
    run, largest = Run(BALL, h), 0.0
    for phase in range(PHASES):  # of the impact within a step
        _, v = run.roll([0, 0, -SPEED, 0, 0, 0], round(0.06 / h), height=0.102 + phase / PHASES * h * SPEED)
        largest = max(largest, v[:, 2].max())
    print(f"{1e3 * h:g} ms: leaves with up to {largest / SPEED:.4f} of the speed; exp(-2) = {np.exp(-2):.4f}")
    still_so = still_so and 0.08 < largest / SPEED < 0.2
finish(still_so)
