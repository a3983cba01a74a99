"""SuperDex 1.0.1: an articulation goes on otherwise from its own pose and rates than it did itself.

It keeps the velocities of its links' centres as differences of places, which its rates do not determine
(integrators_of_order_one.py), and with the default inertia a part of the rotation's rate that is no rotation. A double pendulum
swings for 0.25 s and goes on for 0.25 s, itself and as a new one that was given its pose and rates.
"""

from scene import *


def pendulum(integrator, newton_euler, h, q, v):
    scene = Scene(integrator, h)
    kind = dex.ArticulatedJointType.REVOLUTE
    actor = scene.scene.create_articulated_actor(
        joints=[dex.ArticulatedJointParams(type=kind, axis=[0, 1, 0]),
                dex.ArticulatedJointParams(type=kind, axis=[0, 0, 1], parent_link_from_joint=dex.TransformRT(
                    translation=[0.3, 0, 0]))],
        links=[dex.ArticulatedLinkParams(parent_link=i - 1, mass=1.0, center_of_mass=[0.15, 0, 0],
                                         moment_of_inertia=[0.001, 0, 0, 0.01, 0, 0.01]) for i in range(2)])
    dex.experimental.enable_newton_euler_inertia(actor, newton_euler)
    actor.set_articulated_pose_from_joints(np.array(q))
    actor.set_articulated_joint_velocities(np.array(v))
    return scene, actor


def apart(integrator, newton_euler, h):
    scene, itself = pendulum(integrator, newton_euler, h, [0.0, 0.0], [1.0, 1.0])
    scene.run(0.25)
    again, other = pendulum(integrator, newton_euler, h, pose(itself), rates(itself))
    scene.run(0.25)
    again.run(0.25)
    return np.abs(pose(itself) - pose(other)).max()


still_so = True
for integrator in ("BACKWARD_EULER", "BDF2", "SYMPLECTIC_DIRK22"):
    for newton_euler in (False, True):
        coarse, fine = apart(integrator, newton_euler, 1e-3), apart(integrator, newton_euler, 5e-4)
        print(f"{integrator:18} {'Newton-Euler' if newton_euler else 'default':12} apart by {coarse:.2e} rad at 1 ms, "
              f"{fine:.2e} at 0.5 ms")
        still_so = still_so and coarse > 1e-6
finish(still_so)
