"""SAPIEN 3.0.3, enable_tgs: an articulation's joint positions lag behind at small timesteps, as in PhysX 5.1 and 5.6.

A link turns about a hinge at 8 rad/s without gravity for 1 s. Its rate stays as it is; its angle is summed in float once an
iteration.
"""

from scene import *

still_so = True
for steps in (1000, 64000):
    off = {}
    for solver, iterations in (("pgs", 15), ("tgs", 1), ("tgs", 15), ("tgs", 50)):
        scene = Scene(solver, 1 / steps, (0, 0, 0), iterations)
        own = chain(scene, 1)
        own.qvel = np.array([8], dtype=np.float32)
        scene.run(steps)
        off[solver, iterations] = own.qpos[0] - 8
        still_so = still_so and own.qvel[0] == 8
    print(f"{1e3 / steps:g} ms: after 1 s at 8 rad/s the angle is wrong by {off['pgs', 15]:.1e} rad with PGS, by {off['tgs', 1]:.1e} rad "
          f"with TGS and 1 iteration, {off['tgs', 15]:.1e} with 15, {off['tgs', 50]:.1e} with 50")
    still_so = still_so and abs(off["tgs", 50]) > 10 * abs(off["pgs", 15]) and abs(off["tgs", 1]) < 5e-3
finish(still_so and abs(off["tgs", 50]) > 0.1 and abs(off["tgs", 15]) > 0.05)
