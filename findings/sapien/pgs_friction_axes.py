"""SAPIEN 3.0.3 without enable_tgs: the friction of a body at rest holds up to 1.41 times the material's, as in PhysX 5.1.

A box lies on slopes of 1.1 to 1.5 times its friction of 0.5. Each friction anchor is bounded along two tangents, one at a time,
which the normal fixes while the body slips slower than 1 cm/s. With TGS the sum is bounded, and the box slides.
"""

from scene import *

still_so = True
for share in (1.1, 1.2, 1.3, 1.5):
    speed = {}
    for solver, degrees in (("pgs", 0), ("pgs", 45), ("tgs", 45)):
        scene = Scene(solver, 1e-3, tilted(0.5 * share, degrees), iterations=50)
        scene.ground(physx.PhysxCollisionShapeBox(np.array([5, 5, 1], dtype=np.float32), material(0.5)), [0, 0, -1])
        box = scene.free(physx.PhysxCollisionShapeBox(np.array([0.1, 0.1, 0.05], dtype=np.float32), material(0.5)),
                         [0.0042, 0.0042, 0.0067], [0, 0, 0.05])
        scene.run(500)
        speed[solver, degrees] = math.hypot(*box.linear_velocity[:2])
    angle = math.atan(0.5 * share)
    rigid = G * (math.sin(angle) - 0.5 * math.cos(angle)) * 0.5
    print(f"slope of {share:g} times the friction: {speed['pgs', 0]:.4f} m/s along an axis, {speed['pgs', 45]:.4f} at 45 degrees, "
          f"{speed['tgs', 45]:.4f} with TGS; rigid {rigid:.4f}")
    still_so = still_so and abs(speed["pgs", 0] / rigid - 1) < 0.1 and abs(speed["tgs", 45] / rigid - 1) < 0.1
    still_so = still_so and (speed["pgs", 45] < 0.01 if share < 1.41 else speed["pgs", 45] > 0.5 * rigid)
finish(still_so)
