"""SAPIEN 3.0.3: a prism of 64 sides that is put down at rest rolls away, on a box and on a mesh.

It stands on an edge and has to tip onto a face, 5 mm aside, where it stays on a plane. On a box it rolls on from face to face, and
on a mesh further than one face, too.
"""

from scene import *

RADIUS, HALF = 0.1, 0.15


def ground(scene, kind):
    if kind == "plane":
        scene.plane(1.0)
    elif kind == "box":
        scene.ground(physx.PhysxCollisionShapeBox(np.array([0.5, 0.5, 0.1], dtype=np.float32), material(1.0)), [0, 0, -0.1])
    else:
        points = [(-0.5 + x / 20, -0.5 + y / 20, 0.0) for y in range(21) for x in range(21)]
        triangles = [each for y in range(20) for x in range(20) for a in [21 * y + x]
                     for each in ((a, a + 1, a + 21), (a + 1, a + 22, a + 21))]
        scene.ground(physx.PhysxCollisionShapeTriangleMesh(np.array(points, dtype=np.float32), np.array(triangles, dtype=np.uint32),
                                                           np.ones(3, dtype=np.float32), material(1.0)))


still_so = True
for solver in ("tgs", "pgs"):
    for h in (4e-3, 1e-3):
        way = {}
        for kind in ("plane", "box", "mesh"):
            scene = Scene(solver, h)
            ground(scene, kind)
            across = (3 * RADIUS**2 + 4 * HALF**2) / 12
            scene.free(prism(RADIUS, HALF, 64, 1.0, turned=0), [across, RADIUS**2 / 2, across], [0.03, 0.01, RADIUS],
                       turn=[math.cos(0.15), 0, 0, math.sin(0.15)])
            place = scene.position()
            way[kind] = math.hypot(*(scene.run(round(3 / h)).position() - place)[:2])
        print(f"{solver}, {1e3 * h:g} ms: a lying prism moves by {way['plane']:.4f} m within 3 s on a plane, {way['box']:.3f} m on a box, "
              f"{way['mesh']:.3f} m on a mesh")
        still_so = still_so and way["plane"] < 0.009 and way["box"] > 0.05 and way["mesh"] > 0.009
finish(still_so)
