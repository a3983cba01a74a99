"""DART 6.20: iterative solvers do not carry a load of a thousand times the mass that bears it. Dantzig's method does.

A bar of 1000 kg lies across two of 1 kg, capsules with a radius of 0.1 m: how far it sinks in 0.5 s at 1 ms, relative to the radius.
"""

from scene import *

radius, half, ways = 0.1, 0.5, {}
ALONG_X, ALONG_Y = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
for solver in SOLVERS:
    scene = Scene(solver, 1e-3)
    for x in (-0.3, 0.3):
        scene.add(dart.dynamics.CapsuleShape(radius, 2 * half), 1.0, capsule_moments(1.0, radius, half, 1), [x, 0, radius],
                  R=ALONG_Y)
    scene.add(dart.dynamics.CapsuleShape(radius, 2 * half), 1000.0, capsule_moments(1000.0, radius, half, 0),
              [0, 0, 3 * radius], R=ALONG_X)
    ways[solver] = np.linalg.norm(scene.run(500).position(2) - [0, 0, 3 * radius]) / radius
    print(f"{solver}: {ways[solver]:.5f} radii")
finish(ways["dantzig"] < 1e-3 and min(ways["pgs"], ways["nsgs"]) > 0.02)
