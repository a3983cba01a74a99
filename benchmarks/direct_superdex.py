"""The planar chain as a user of SuperDex would write it: five links of 1 kg on hinges. Prints µs a step, a number a round."""

import os

os.environ["SUPERDEX_PRECISION"] = "fp64"

import numpy as np
import superdex.physics as dex

from direct_rounds import print_times

h, steps = 1e-3, 1000
dex.initialize(num_worker_threads=0)
scene = dex.create_scene("chain")
scene.set_gravity([0.0, 0.0, 0.0])
solver = scene.get_solver_params()
solver.non_linear_solver.max_iter = 50
solver.non_linear_solver.abs_tol = 1e-12
solver.non_linear_solver.rel_tol = 1e-15
solver.experimental_eval.fitted_saturation_hessian = dex.SaturationHessianParams.all(False)
solver.experimental_eval.implicit_normal_force_for_dissipation = True
scene.set_solver_params(solver)
# A capsule's of 0.05 and 0.3 m, as in models/planar-chain.xml: the motion decides how many iterations a step takes.
links = [dex.ArticulatedLinkParams(parent_link=i - 1, mass=1.0, center_of_mass=[0.15, 0, 0],
                                   moment_of_inertia=[0.0012045455, 0, 0, 0.011943182, 0, 0.011943182]) for i in range(5)]
joints = [dex.ArticulatedJointParams(type=dex.ArticulatedJointType.REVOLUTE, axis=[0, 1, 0],
                                     parent_link_from_joint=dex.TransformRT(translation=[0.3 if i else 0, 0, 0]))
          for i in range(5)]
chain = scene.create_articulated_actor(joints=joints, links=links)
chain.set_articulated_joint_velocities(np.ones(5))


def run():
    for _ in range(steps):
        scene.step(h)


print_times(run, steps)
