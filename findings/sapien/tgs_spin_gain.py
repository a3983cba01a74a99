"""SAPIEN 3.0.3, enable_tgs: a free body gains 5e-7 of its spin in every step, as in PhysX 5.1; PhysX 5.6 does not.

A ball turns in empty space, without gravity, damping or contact. The gain is the same for every timestep and number of iterations,
so the error over a given time grows as the timestep shrinks.
"""

from scene import *

STEPS = 20000
still_so = True
for h in (1e-3, 1 / 64000):
    gain = {}
    for solver, iterations in (("pgs", 15), ("tgs", 4), ("tgs", 50)):
        scene = Scene(solver, h, (0, 0, 0), iterations)
        turn = np.array([0.9, 0.1, 0.3, 0.2])
        body = scene.free(None, [0.004] * 3, [0, 0, 0], turn=turn / np.linalg.norm(turn), spin=[1, 2, 3])
        scene.run(STEPS)
        gain[solver, iterations] = (np.linalg.norm(body.angular_velocity) / math.sqrt(14) - 1) / STEPS
    print(f"{1e3 * h:g} ms: gain of spin a step {gain['tgs', 4]:.1e} with TGS and 4 iterations, {gain['tgs', 50]:.1e} with 50, "
          f"{gain['pgs', 15]:.1e} with PGS")
    still_so = still_so and all(3e-7 < gain["tgs", n] < 8e-7 for n in (4, 50)) and abs(gain["pgs", 15]) < 1e-8
finish(still_so)
