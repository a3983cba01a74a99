"""SuperDex 1.0.1: in steps that are longer than an impact a ball leaves the ground faster than the damping of its contact says,
with all integrators but backward Euler, and with some faster than it came.

A ball of 1 kg and 0.1 m reaches a plane at 3 m/s, at 20 phases of a step of 4 and 1 ms. With a normal damping of 10 s/m it should
leave at 0.1 m/s at most, 3 % of its speed.
"""

from scene import *

SPEED = 3.0
CONTACT = {"penalty_coefficient": 3e10, "penalty_smoothing_half_distance": 1e-5, "penalty_threshold_default": 0.0,
           "normal_viscous_damping_coefficient": 10.0}


def fastest(integrator, h):
    most = 0
    for phase in range(20):
        scene = Scene(integrator, h, gravity=(0, 0, 0))
        evaluation = scene.scene.get_solver_params()
        evaluation.experimental_eval.implicit_normal_force_for_dissipation = True
        scene.scene.set_solver_params(evaluation)
        ball = scene.ball(1.0, 0.1, (0, 0, 0.1 + SPEED * h * (1.5 + phase / 20)), (0, 0, -SPEED), CONTACT)
        scene.run(0.05)
        most = max(most, ball.get_linear_velocity()[2] / SPEED)
    return most


found = {}
for integrator in ("BACKWARD_EULER", "BDF2", "DIRK22", "SYMPLECTIC_DIRK22"):
    found[integrator] = [fastest(integrator, h) for h in (4e-3, 1e-3)]
    print(f"{integrator:18} leaves with {100 * found[integrator][0]:.1f} % of its speed at most at 4 ms, "
          f"{100 * found[integrator][1]:.1f} % at 1 ms", flush=True)
finish(max(found["BACKWARD_EULER"]) < 0.05 and all(found[each][0] > 0.1 for each in found if each != "BACKWARD_EULER"))
