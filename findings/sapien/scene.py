"""Small worlds by SAPIEN's API alone, for the programs of this folder."""

import math
import os
import sys

import numpy as np

# `import sapien` needs a renderer's packages
sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../src/engines/sapien"))
import sapien_import

sapien, physx = sapien_import.load()
G = 9.81
MOST = 1e16  # of speeds


def material(friction):
    return physx.PhysxMaterial(friction, friction, 0.0)


def tilted(tangent, degrees=0.0):
    """Gravity of a slope that falls towards an angle from x."""
    angle, towards = math.atan(tangent), math.radians(degrees)
    return [G * math.sin(angle) * math.cos(towards), G * math.sin(angle) * math.sin(towards), -G * math.cos(angle)]


class Scene:
    def __init__(self, solver, timestep, gravity=(0, 0, -G), iterations=15):
        physx.set_scene_config(gravity=np.array(gravity, dtype=np.float32), enable_tgs=solver == "tgs")
        physx.set_body_config(iterations, 1, 0.0)
        self.system = physx.PhysxCpuSystem()
        self.system.timestep = timestep
        self.scene = sapien.Scene([self.system])
        self.bodies = []

    def add(self, component, place=(0, 0, 0), turn=(1, 0, 0, 0)):
        entity = sapien.Entity()
        entity.add_component(component)
        entity.pose = sapien.Pose(np.array(place, dtype=np.float32), np.array(turn, dtype=np.float32))
        self.scene.add_entity(entity)
        return component

    def shape(self, made, offset=0.004, turn=(1, 0, 0, 0), place=(0, 0, 0)):
        made.local_pose = sapien.Pose(np.array(place, dtype=np.float32), np.array(turn, dtype=np.float32))
        made.contact_offset = offset
        return made

    def ground(self, made, place=(0, 0, 0)):
        body = physx.PhysxRigidStaticComponent()
        body.attach(self.shape(made))
        return self.add(body, place)

    def plane(self, friction):
        body = physx.PhysxRigidStaticComponent()
        body.attach(self.shape(physx.PhysxCollisionShapePlane(material(friction)), turn=(math.sqrt(0.5), 0, -math.sqrt(0.5), 0)))
        return self.add(body)

    def free(self, made, moments, place, velocity=(0, 0, 0), turn=(1, 0, 0, 0), spin=(0, 0, 0)):
        """A body of 1 kg with a shape, or without one."""
        body = physx.PhysxRigidDynamicComponent()
        body.mass, body.inertia = 1.0, np.array(moments, dtype=np.float32)
        body.linear_damping = body.angular_damping = 0.0
        body.max_linear_velocity = body.max_angular_velocity = MOST
        if made is not None:
            body.attach(self.shape(made))
        self.add(body, place, turn)
        body.linear_velocity, body.angular_velocity = np.array(velocity, dtype=np.float32), np.array(spin, dtype=np.float32)
        self.bodies.append(body)
        return body

    def run(self, steps):
        for _ in range(steps):
            self.system.step()
        return self

    def position(self, index=0):
        return np.array(self.bodies[index].entity_pose.p, dtype=float)


def chain(scene, links, keep_defaults=False):
    """A planar chain of capsules of 1 kg and 0.3 m on hinges along y, its first hinge in the origin; its articulation."""
    made, across = [physx.PhysxArticulationLinkComponent(None)], [math.sqrt(0.5), 0, 0, math.sqrt(0.5)]  # turns x onto y
    made[0].joint.type = "fixed"
    half = 0.15
    for i in range(links):
        link = physx.PhysxArticulationLinkComponent(made[-1])
        link.mass, link.inertia = 1.0, np.array([0.00125, 0.0263, 0.0263], dtype=np.float32)
        link.cmass_local_pose = sapien.Pose()
        joint = link.joint
        joint.type = "revolute_unwrapped"
        joint.pose_in_parent = sapien.Pose([0 if i == 0 else half, 0, 0], across)
        joint.pose_in_child = sapien.Pose([-half, 0, 0], across)
        joint.set_limits([[-math.inf, math.inf]])
        if not keep_defaults:
            link.linear_damping = link.angular_damping = joint.friction = 0.0
            link.max_linear_velocity = link.max_angular_velocity = joint.max_velocity = MOST
        made.append(link)
    for link in made:
        scene.add(link)
    return made[0].articulation


def prism(radius, half, sides, friction, turned=0.5):
    """A lying cylinder's prism along y, on a face or, with `turned` 0, on an edge."""
    angles = [2 * math.pi * (i + turned) / sides for i in range(sides)]
    points = [(radius / half * math.cos(a), y, radius / half * math.sin(a)) for a in angles for y in (-1.0, 1.0)]
    return physx.PhysxCollisionShapeConvexMesh(np.array(points, dtype=np.float32), np.full(3, half, dtype=np.float32), material(friction))


def finish(still_so):
    """Status 0 while SAPIEN behaves so."""
    print("as described" if still_so else "SAPIEN does not behave so any more: mend the adapter's declaration")
    sys.stdout.flush()
    os._exit(0 if still_so else 1)
