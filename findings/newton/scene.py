"""Models run by Newton's API alone, for the programs of this folder."""

import os
import sys
import warnings

import newton
import numpy as np
import warp as wp

wp.config.quiet = True
wp.config.log_level = 40
wp.init()
wp.set_device("cpu")
warnings.simplefilter("ignore")


def builder(gravity=-9.81):
    made = newton.ModelBuilder(gravity=(0.0, 0.0, gravity))
    made.balance_inertia = False
    newton.solvers.SolverMuJoCo.register_custom_attributes(made)
    newton.solvers.SolverSteel.register_custom_attributes(made)
    return made


def body(made, mass, moments, joint, **values):
    """A body on a joint of its own to the world."""
    link = made.add_link(mass=mass, inertia=np.diag(moments).tolist(), lock_inertia=True)
    made.add_articulation([getattr(made, f"add_joint_{joint}")(*(() if joint == "free" else (-1,)), link, **values)])
    return link


def ball(made, link, radius):
    made.add_shape_sphere(link, radius=radius, cfg=newton.ModelBuilder.ShapeConfig(density=0.0))


class Run:
    def __init__(self, made, solver, timestep):
        self.model, self.timestep = made.finalize(device="cpu", skip_validation_inertia=True), timestep
        if solver == "featherstone":
            self.solver = newton.solvers.SolverFeatherstone(self.model, angular_damping=0.0)
        elif solver == "steel":
            self.model.steel.rigid_body_angular_damping.zero_()
            self.solver = newton.solvers.SolverSteel(self.model)
        else:
            self.solver = newton.solvers.SolverMuJoCo(self.model, integrator=solver)
        self.now, self.next, self.control = self.model.state(), self.model.state(), self.model.control()

    def start(self, q, v):
        for state in (self.now, self.next):
            state.joint_q.numpy()[:], state.joint_qd.numpy()[:] = q, v
            newton.eval_fk(self.model, state.joint_q, state.joint_qd, state)

    def step(self):
        self.solver.step(self.now, self.next, self.control, None, self.timestep)
        self.now, self.next = self.next, self.now

    @property
    def q(self):
        return self.now.joint_q.numpy()

    @property
    def v(self):
        return self.now.joint_qd.numpy()


def finish(still_so):
    """Status 0 while Newton behaves so."""
    print("as described" if still_so else "Newton does not behave so any more: mend the adapter's declaration")
    sys.stdout.flush()
    os._exit(0 if still_so else 1)
