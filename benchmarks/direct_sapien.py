"""The planar chain as a user of SAPIEN would write it: five links of 1 kg on hinges. Prints µs a step, a number a round."""

import math
import os
import sys

import numpy as np

from direct_rounds import print_times

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../src/engines/sapien"))
import sapien_import  # the package's own import needs a renderer's packages

sapien, physx = sapien_import.load()
h, steps = 1e-3, 1000
physx.set_scene_config(gravity=np.zeros(3, dtype=np.float32), enable_tgs=sys.argv[1] == "tgs")
physx.set_body_config(15, 1, 0.0)
system = physx.PhysxCpuSystem()
system.timestep = h
scene = sapien.Scene([system])
links, across = [physx.PhysxArticulationLinkComponent(None)], [math.sqrt(0.5), 0, 0, math.sqrt(0.5)]  # turns x onto y
links[0].joint.type = "fixed"
for i in range(5):
    link = physx.PhysxArticulationLinkComponent(links[-1])
    link.mass, link.inertia = 1.0, np.array([0.00125, 0.0263, 0.0263], dtype=np.float32)
    link.cmass_local_pose = sapien.Pose()
    link.linear_damping = link.angular_damping = 0.0
    link.joint.type = "revolute_unwrapped"
    link.joint.pose_in_parent = sapien.Pose([0.15 if i else 0.0, 0, 0], across)
    link.joint.pose_in_child = sapien.Pose([-0.15, 0, 0], across)
    link.joint.set_limits([[-math.inf, math.inf]])
    link.joint.friction = 0.0
    links.append(link)
for link in links:
    entity = sapien.Entity()
    entity.add_component(link)
    scene.add_entity(entity)
links[0].articulation.qvel = np.ones(5, dtype=np.float32)


def run():
    for _ in range(steps):
        system.step()


print_times(run, steps)
