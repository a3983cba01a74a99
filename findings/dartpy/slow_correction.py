"""DART 6.20: a body stays in the ground after an impact, as in 6.12, and Python cannot set the numbers that decide it.

A ball of 1 kg and 0.1 m reaches a plane at 3 m/s in steps of 4 and 1 ms, at several phases of a step. DART stops it where it then
is, up to a step's way deep, and corrects the depth at 1 mm/s at most: 0.12 s later nearly all of it is left, with any solver.
"""

from scene import *

still_so = True
for solver in SOLVERS:
    for h in (4e-3, 1e-3):
        deepest = 0
        for phase in range(20):
            scene = Scene(solver, h)
            scene.add(dart.dynamics.SphereShape(0.1), 1.0, [0.004] * 3, [0, 0, 0.1 + 3 * h * (1.5 + phase / 20)], [0, 0, -3])
            deepest = max(deepest, 1 - scene.run(round(0.12 / h)).position()[2] / 0.1)
        print(f"{solver}, {1e3 * h:g} ms: {deepest:.4f} radii deep 0.12 s later, a step's way is {3 * h / 0.1:.4f}")
        still_so = still_so and 0.7 < deepest / (3 * h / 0.1) < 1.1
still_so = still_so and not hasattr(dart.constraint, "ContactConstraint")
finish(still_so)
