"""SuperDex 1.0.1: a wheel that spins without any torque loses speed with the default inertia, at first order in the timestep
with every integrator. With Newton's and Euler's inertia it gains some, at second order; with the symplectic ones it keeps it.

The wheel turns about a hinge through its centre of mass at 10 rad/s, and at 120 rad/s, for 0.1 s.
"""

from scene import *

T = 0.1


def loss(integrator, newton_euler, rate, h):
    scene = Scene(integrator, h, gravity=(0, 0, 0))
    wheel = scene.link("REVOLUTE", moments=(0.01, 0.02, 0.01), axis=[0, 1, 0], rates=[rate])
    dex.experimental.enable_newton_euler_inertia(wheel, newton_euler)
    scene.run(T)
    return 1 - rates(wheel)[0] / rate


still_so = True
for newton_euler in (False, True):
    print("Newton's and Euler's inertia" if newton_euler else "default inertia")
    for integrator in INTEGRATORS:
        coarse, fine, fast = (loss(integrator, newton_euler, *each) for each in ((10.0, 1e-3), (10.0, 5e-4), (120.0, 1e-3)))
        order = np.log2(abs(coarse / fine))
        print(f"  {integrator:18} {100 * coarse:.3g} % lost at 1 ms, {100 * fine:.3g} % at 0.5 ms, order {order:.2f}; "
              f"at 120 rad/s {100 * fast:.3g} %")
        if newton_euler and "SYMPLECTIC" in integrator:
            still_so = still_so and abs(coarse) < 1e-9 and abs(fast) < 1e-9
        else:
            still_so = still_so and abs(order - (2 if newton_euler else 1)) < 0.2 and abs(fast) > (1e-4 if newton_euler else 0.2)
finish(still_so)
