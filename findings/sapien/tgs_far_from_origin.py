"""SAPIEN 3.0.3, enable_tgs: far from the origin bodies that touch something lag behind or stand still, as in PhysX 5.1.

A ball glides at 1 m/s along x on a plane without friction, at 0, 1000 and 10,000 m from the origin, in steps of 1 ms. Each
position iteration adds a substep's way to the position, which is rounded to a float: multiples of 6e-5 m at 1000 m, and of
1e-3 m at 10,000 m, where a substep of 15 goes 7e-5 m. Without TGS a step adds its way once.
"""

from scene import *

still_so = True
for far in (0.0, 1e3, 1e4):
    part = {}
    for solver, iterations in (("pgs", 15), ("tgs", 15), ("tgs", 50)):
        scene = Scene(solver, 1e-3, iterations=iterations)
        scene.plane(0.0)
        scene.free(physx.PhysxCollisionShapeSphere(0.1, material(0.0)), [0.004] * 3, [far, 0, 0.1], [1, 0, 0])
        part[solver, iterations] = (scene.run(500).position()[0] - far) / 0.5
    print(f"at {far:g} m: {part['pgs', 15]:.3f} of the way with PGS, {part['tgs', 15]:.3f} with TGS and 15 iterations, "
          f"{part['tgs', 50]:.3f} with 50")
    still_so = still_so and part["pgs", 15] > 0.9 and (part["tgs", 50] < 0.1 if far > 0 else part["tgs", 50] > 0.99)
    still_so = still_so and (part["tgs", 15] < 0.1 if far > 5e3 else part["tgs", 15] > 0.85)
finish(still_so)
