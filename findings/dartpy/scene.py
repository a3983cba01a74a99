"""Small worlds by dartpy's API alone, for the programs of this folder."""

import os
import sys

import dartpy as dart
import numpy as np

G = 9.81
SOLVERS = ("dantzig", "pgs", "nsgs")


def at(p, R=None):
    return dart.math.Isometry3(np.eye(3) if R is None else np.array(R, dtype=float), np.array(p, dtype=float))


class Scene:
    """Free bodies with one shape each, and the plane z = 0."""

    def __init__(self, solver, timestep, iterations=50):
        self.world = world = dart.simulation.World("scene")
        world.setTimeStep(timestep)
        world.setGravity([0, 0, -G])
        options = dart.simulation.DeactivationOptions()
        options.mEnabled = False
        world.setDeactivationOptions(options)
        constraints = world.getConstraintSolver()
        constraints.setCollisionDetector(dart.collision.OdeCollisionDetector())
        if solver == "pgs":
            other = dart.simulation.World("other").getConstraintSolver()
            for pgs in (other.getSecondaryBoxedLcpSolver(), constraints.getSecondaryBoxedLcpSolver()):
                pgs.setOption(dart.constraint.PgsBoxedLcpSolverOption(iterations))
            constraints.setBoxedLcpSolver(other.getSecondaryBoxedLcpSolver())
        elif solver == "nsgs":
            constraints.setBoxedLcpSolver(dart.constraint.NsgsFrictionSolver())
        self.joints = []
        ground = dart.dynamics.Skeleton("ground")
        ground.setMobile(False)
        self.shape(ground.createWeldJointAndBodyNodePair(None)[1], dart.dynamics.PlaneShape([0.0, 0.0, 1.0], 0.0))
        world.addSkeleton(ground)

    @staticmethod
    def shape(body, shape, R=None):
        node = body.createShapeNode(shape)
        node.createCollisionAspect()
        node.createDynamicsAspect()
        node.setRelativeTransform(at([0, 0, 0], R))
        return node

    def add(self, shape, mass, moments, place, velocity=(0, 0, 0), R=None):
        skeleton = dart.dynamics.Skeleton(f"body {len(self.joints)}")
        joint, body = skeleton.createFreeJointAndBodyNodePair(None)
        body.setInertia(dart.dynamics.Inertia(mass, [0, 0, 0], np.diag(moments)))
        self.shape(body, shape, R)
        joint.setPositions(dart.dynamics.FreeJoint.convertToPositions(at(place)))
        joint.setVelocities([0, 0, 0, *velocity])
        self.world.addSkeleton(skeleton)
        self.joints.append(joint)
        return body

    def run(self, steps):
        for _ in range(steps):
            self.world.step()
        return self

    def position(self, index=0):
        return np.array(dart.dynamics.FreeJoint.convertToTransform(self.joints[index].getPositions()).translation())


def capsule_moments(mass, radius, half, axis):
    """Of a homogeneous capsule whose cylinder is 2 half long."""
    cylinder = mass * 2 * half / (2 * half + 4 / 3 * radius)
    ends = mass - cylinder
    along = cylinder * radius**2 / 2 + ends * 2 / 5 * radius**2
    across = cylinder * (radius**2 / 4 + half**2 / 3) + ends * (2 / 5 * radius**2 + half**2 + 3 / 4 * half * radius)
    return [along if i == axis else across for i in range(3)]


def finish(still_so):
    """Status 0 while DART behaves so."""
    print("as described" if still_so else "DART does not behave so any more: mend the adapter's declaration")
    sys.stdout.flush()
    os._exit(0 if still_so else 1)
