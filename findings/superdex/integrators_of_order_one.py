"""SuperDex 1.0.1: every integrator is of first order on an articulation whose centres of mass move on circles.

A stage takes the velocity of a link's centre as the difference of two places over the stage's time, while the pose is combined
in joint coordinates. On a curved path the two differ by a term of first order. A pendulum falls from rest for 0.256 s. The
order is that of the error in the angle between steps of 2 and 1 ms.
"""

from scene import *

COM, I, START, T = 0.3, 0.02, 0.3, 0.256


def exact():
    state, n = np.array([START, 0.0]), 4096
    slope = lambda y: np.array([y[1], G * COM * np.cos(y[0]) / (I + COM**2)])
    for _ in range(n):
        h = T / n
        a = slope(state)
        b = slope(state + h / 2 * a)
        c = slope(state + h / 2 * b)
        d = slope(state + h * c)
        state = state + h / 6 * (a + 2 * b + 2 * c + d)
    return state[0]


def error(integrator, h):
    scene = Scene(integrator, h)
    actor = scene.link("REVOLUTE", com=(COM, 0, 0), moments=(0.01, I, I), axis=[0, 1, 0])
    actor.set_articulated_pose_from_joints(np.array([START]))
    scene.run(T)
    return abs(pose(actor)[0] - truth)


truth, orders = exact(), []
for integrator in INTEGRATORS:
    coarse, fine = error(integrator, 2e-3), error(integrator, 1e-3)
    orders.append(np.log2(coarse / fine))
    print(f"{integrator:18} {coarse:.2e} rad at 2 ms, {fine:.2e} at 1 ms, order {orders[-1]:.2f}")
finish(all(0.9 < order < 1.2 for order in orders))
