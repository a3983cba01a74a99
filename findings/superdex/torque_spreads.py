"""SuperDex 1.0.1: with BDF2 a torque of one step goes on to change the rate in later steps, because the method takes the rate
from two steps. The sum is right.

A balanced wheel gets 1 Nm for one step.
"""

from scene import *

I, TORQUE, H = 0.02, 1.0, 1e-3
right, shares = TORQUE * H / I, {}
for integrator in ("BACKWARD_EULER", "BDF2", "SYMPLECTIC_DIRK22"):
    scene = Scene(integrator, H, gravity=(0, 0, 0))
    wheel = scene.link("REVOLUTE", moments=(0.01, I, 0.01), axis=[0, 1, 0])
    dex.experimental.enable_newton_euler_inertia(wheel, True)
    for _ in range(4):
        scene.scene.step(H)
    seen = []
    for step in range(12):
        wheel.set_external_forces_on_dofs(np.array([0], dtype=np.int32), np.array([TORQUE if step == 0 else 0.0]))
        scene.scene.step(H)
        seen.append(rates(wheel)[0] / right)
    shares[integrator] = seen
    print(f"{integrator:18} rate over torque h / I after 1, 2, 3, 12 steps: " +
          ", ".join(f"{seen[k]:.6f}" for k in (0, 1, 2, 11)))
finish(abs(shares["BDF2"][0] - 2 / 3) < 1e-3 and abs(shares["BDF2"][1] - 8 / 9) < 1e-3 and
       abs(shares["BDF2"][-1] - 1) < 1e-3 and all(abs(shares[each][0] - 1) < 1e-6 for each in shares if each != "BDF2"))
