"""DART 6.20: 50 iterations of projected Gauss-Seidel do not carry a stack of ten boxes. 200 do, and so do the other solvers.

Boxes of 1 kg and 0.1 m, each 1 mm aside and turned by 0.02 rad in turns, friction 1, 4 ms: how far any of them is aside after 1.5 s.
"""

from scene import *

HALF, BOXES = 0.05, 10


def way_aside(solver, iterations=50):
    scene = Scene(solver, 4e-3, iterations)
    starts = []
    for i in range(BOXES):
        sign = 1 if i % 2 == 0 else -1
        starts.append([1e-3 * sign, 5e-4 * sign, HALF * (2 * i + 1)])
        scene.add(dart.dynamics.BoxShape([2 * HALF] * 3), 1.0, [(2 * HALF)**2 / 6] * 3, starts[i])
        c, s = np.cos(0.02), np.sin(0.02 * sign)
        scene.joints[i].setPositions(dart.dynamics.FreeJoint.convertToPositions(at(starts[i], [[c, -s, 0], [s, c, 0], [0, 0, 1]])))
    scene.run(375)
    return max(np.linalg.norm((scene.position(i) - start)[:2]) for i, start in enumerate(starts))


ways = {(solver, 50): way_aside(solver) for solver in SOLVERS}
ways["pgs", 200] = way_aside("pgs", 200)
for (solver, iterations), way in ways.items():
    print(f"{solver}{f', {iterations} iterations' if solver == 'pgs' else ''}: {way:.4f} m aside")
finish(ways["pgs", 50] > 0.1 and ways["pgs", 200] < 0.01 and max(ways["dantzig", 50], ways["nsgs", 50]) < 0.025)
