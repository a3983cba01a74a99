"""DART 6.20: a free joint's velocities are in the world's axes, and not those of its own frame if that is not the body's.

In 6.12 they were in the body's axes. A body with its centre of mass off its origin is turned about z and gets the rates w and
the velocity v; its joint's frame lies in the centre of mass. The centre should move at v. It moves at v + w x (R c - c).
"""

from scene import *

c, w, v = np.array([0.1, 0.05, -0.02]), np.array([0.5, 0.6, 0.7]), np.array([1.0, 2.0, 3.0])
R = np.array([[np.cos(0.7), -np.sin(0.7), 0], [np.sin(0.7), np.cos(0.7), 0], [0, 0, 1]])


def velocity_of_centre(offset):
    skeleton = dart.dynamics.Skeleton("body")
    joint, body = skeleton.createFreeJointAndBodyNodePair(None)
    joint.setTransformFromChildBodyNode(at(offset))
    body.setInertia(dart.dynamics.Inertia(1.0, offset, np.diag([0.1, 0.2, 0.25])))
    joint.setPositions(dart.dynamics.FreeJoint.convertToPositions(at([0, 0, 0], R)))
    joint.setVelocities(np.concatenate([w, v]))
    return body.getCOMLinearVelocity(), body.getAngularVelocity()


own, rates = velocity_of_centre([0, 0, 0])
moved, _ = velocity_of_centre(c)
print(f"frame of the joint = body's: v off by {np.abs(own - v).max():.1e}, rates by {np.abs(rates - w).max():.1e}")
print(f"frame at the centre: v off by {np.abs(moved - v).max():.4f} m/s, from v + w x (R c - c) by "
      f"{np.abs(moved - v - np.cross(w, R @ c - c)).max():.1e}")
finish(np.abs(own - v).max() < 1e-12 and np.abs(rates - w).max() < 1e-12 and np.abs(moved - v).max() > 0.01)
