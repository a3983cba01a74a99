"""The planar chain as a user of dartpy would write it: five links of 1 kg on hinges. Prints µs a step, a number a round."""

import dartpy as dart
import numpy as np

from direct_rounds import print_times

h, steps = 1e-3, 1000
world = dart.simulation.World("chain")
world.setTimeStep(h)
world.setGravity(np.zeros(3))
world.setNumSimulationThreads(1)
off = dart.simulation.DeactivationOptions()
off.mEnabled = False
world.setDeactivationOptions(off)
tree, parent = dart.dynamics.Skeleton("chain"), None
for i in range(5):
    joint, parent = tree.createRevoluteJointAndBodyNodePair(parent)
    joint.setName(f"hinge {i}")
    joint.setAxis([0.0, 1.0, 0.0])
    joint.setTransformFromParentBodyNode(dart.math.Isometry3(np.eye(3), np.array([0.3 if i else 0.0, 0.0, 0.0])))
    joint.setVelocity(0, 1.0)
    parent.setName(f"link {i}")
    parent.setInertia(dart.dynamics.Inertia(1.0, np.array([0.15, 0.0, 0.0]), np.diag([0.00125, 0.0263, 0.0263])))
world.addSkeleton(tree)


def run():
    for _ in range(steps):
        world.step()


print_times(run, steps)
