"""Newton's SolverMuJoCo: a ball leaves the ground with a ninth to a seventh of its speed, as in MuJoCo itself.

With the stiffness and damping that Newton gives shapes by default (2500 and 100: a time constant of 0.02 s and a damping ratio of 1)
a contact is a critically damped spring that only pushes: its force ends at two time constants, where a ball has exp(-2) = 0.135 of
its speed outwards (../mujoco/contact_rebound.cc).
"""

from scene import *

SPEED, still_so = 2.0, True
for solver in ("implicitfast", "rk4"):
    for h in (4e-3, 1e-3):
        made = builder()
        ball(made, body(made, 1.0, 3 * [0.004], "free"), 0.1)
        made.add_ground_plane(cfg=newton.ModelBuilder.ShapeConfig(density=0.0))
        run = Run(made, solver, h)
        run.start([0, 0, 0.102, 0, 0, 0, 1], [0, 0, -SPEED, 0, 0, 0])
        largest = 0.0
        for _ in range(round(0.12 / h)):
            run.step()
            largest = max(largest, float(run.v[2]))
        print(f"{solver}, {1e3 * h:g} ms: leaves with {largest / SPEED:.4f} of the speed; exp(-2) = {np.exp(-2):.4f}")
        still_so = still_so and 0.08 < largest / SPEED < 0.17
finish(still_so)
