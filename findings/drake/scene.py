"""What the programs beside this one share: a plant with shapes on a plane, by Drake's API alone."""

import logging
import os
import sys

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import AddContactMaterial, Box, Capsule, HalfSpace, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import QuaternionFloatingJoint, SpatialInertia, UnitInertia
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder

logging.getLogger("drake").setLevel(logging.ERROR)
G = 9.81
APPROXIMATIONS = ("sap", "similar", "lagged")


class Scene:
    """Free bodies with one shape each, and a half space z < 0 in the axes of `gravity`."""

    def __init__(self, approximation, timestep, gravity=(0, 0, -G), friction=0.5):
        self.builder = DiagramBuilder()
        self.plant, self.graph = AddMultibodyPlant(MultibodyPlantConfig(
            time_step=timestep, contact_model="point", discrete_contact_approximation=approximation,
            adjacent_bodies_collision_filters=False, use_sampled_output_ports=False), self.builder)
        self.plant.mutable_gravity_field().set_gravity_vector(gravity)
        self.properties = ProximityProperties()
        AddContactMaterial(friction=CoulombFriction(friction, friction), properties=self.properties)
        self.joints = []

    def floor(self):
        self.plant.RegisterCollisionGeometry(self.plant.world_body(), RigidTransform(), HalfSpace(), "floor",
                                             self.properties)

    def add(self, shape, mass, moments, X_BG=RigidTransform()):
        name = str(len(self.joints))
        body = self.plant.AddRigidBody(name, SpatialInertia(mass, [0, 0, 0], UnitInertia(*(m / mass for m in moments))))
        self.joints.append(self.plant.AddJoint(
            QuaternionFloatingJoint(name, self.plant.world_frame(), body.body_frame())))
        self.plant.RegisterCollisionGeometry(body, X_BG, shape, name, self.properties)
        return body

    def start(self, positions, velocities):
        self.plant.Finalize()
        self.simulator = Simulator(self.builder.Build())
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        for joint, p, v in zip(self.joints, positions, velocities):
            joint.SetPose(self.context, RigidTransform(p))
            joint.set_translational_velocity(self.context, v)
        self.simulator.Initialize()
        return self

    def until(self, time):
        self.simulator.AdvanceTo(time)
        return self

    def position(self, index=0):
        return self.joints[index].GetPose(self.context).translation()

    def rotation(self, index=0):
        return self.joints[index].GetPose(self.context).rotation()


def capsule_moments(mass, radius, half, axis):
    """Of a homogeneous capsule whose cylinder is 2 half long."""
    cylinder = mass * 2 * half / (2 * half + 4 / 3 * radius)
    ends = mass - cylinder
    along = cylinder * radius**2 / 2 + ends * 2 / 5 * radius**2
    across = cylinder * (radius**2 / 4 + half**2 / 3) + ends * (2 / 5 * radius**2 + half**2 + 3 / 4 * half * radius)
    return [along if i == axis else across for i in range(3)]


def finish(still_so):
    """Status 0 while Drake behaves so."""
    print("as described" if still_so else "Drake does not behave so any more: mend the adapter's declaration")
    sys.stdout.flush()
    os._exit(0 if still_so else 1)
