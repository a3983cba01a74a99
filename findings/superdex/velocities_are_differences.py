"""SuperDex 1.0.1: velocities are differences of places over the timestep, so they carry the rounding of a place times the
number of steps, the more the smaller the timestep is.

A body is thrown and falls for 0.5 s, far from the origin and near it, without turning. Its velocity should be right to a few
units in the last place. So should be the rate of a balanced wheel after a torque of 1 Nm for a step; Newton's and Euler's inertia
leaves more there.
"""

from scene import *

V, T = np.array([1.0, 2.0, 3.0]), 0.5


def error(integrator, far, h):
    scene = Scene(integrator, h)
    body = scene.link("FREE", rates=[*V, 0, 0, 0])
    place = np.zeros(6)
    place[0:3] = far
    body.set_articulated_pose_from_joints(place)
    scene.run(T)
    return np.abs(rates(body)[0:3] - V - np.array([0, 0, -G * T])).max()


still_so = True
for integrator in ("BACKWARD_EULER", "BDF2", "SYMPLECTIC_DIRK22"):
    for far in (0.0, 10.0):
        errors = [error(integrator, far, h) for h in (4e-3, 1e-3, 2.5e-4)]
        print(f"{integrator:18} {far:4.0f} m away: " + ", ".join(f"{each:.1e}" for each in errors) + " m/s at 4, 1, 1/4 ms")
    still_so = still_so and errors[-1] > 1e-11 and errors[-1] > 4 * errors[0]
    if integrator == "BDF2":  # a torque spreads over its steps: torque_spreads.py
        continue
    scene = Scene(integrator, 1e-3, gravity=(0, 0, 0))
    wheel = scene.link("REVOLUTE", moments=(0.01, 0.02, 0.01), axis=[0, 1, 0])
    dex.experimental.enable_newton_euler_inertia(wheel, True)
    wheel.set_articulated_pose_from_joints(np.array([0.7]))
    wheel.set_external_forces_on_dofs(np.array([0], dtype=np.int32), np.array([1.0]))
    scene.run(1e-3)
    wheel.clear_external_forces()
    scene.run(20e-3)
    off = abs(rates(wheel)[0] - 1e-3 / 0.02)
    print(f"{integrator:18} wheel: {off:.1e} rad/s")
    still_so = still_so and off > 1e-11
finish(still_so)
