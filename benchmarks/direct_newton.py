"""The planar chain as a user of Newton would write it, its steps captured as a graph on the CPU. Prints µs a step, a number a
round."""

import sys

import newton
import warp as wp

from direct_rounds import print_times

wp.set_device("cpu")
h, steps, captured = 1e-3, 1024, 32
kind = sys.argv[1]
builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
if kind == "steel":
    newton.solvers.SolverSteel.register_custom_attributes(builder)
elif kind == "mujoco":
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
joints, parent = [], -1
for i in range(5):
    link = builder.add_link(mass=1.0, com=(0.15, 0.0, 0.0), lock_inertia=True,
                            inertia=((0.00125, 0.0, 0.0), (0.0, 0.0263, 0.0), (0.0, 0.0, 0.0263)))
    joints.append(builder.add_joint_revolute(
        parent, link, parent_xform=wp.transform((0.3 if i else 0.0, 0.0, 0.0), wp.quat_identity()), axis=(0.0, 1.0, 0.0), target_ke=0.0,
        target_kd=0.0))
    parent = link
builder.add_articulation(joints)
model = builder.finalize()
before, after, control = model.state(), model.state(), model.control()
before.joint_qd.fill_(1.0)
newton.eval_fk(model, before.joint_q, before.joint_qd, before)
if kind == "steel":
    solver = newton.solvers.SolverSteel(model, enable_joint_limits=True, articulation_constraint_max=1, free_body_constraint_max=1)
elif kind == "mujoco":
    solver = newton.solvers.SolverMuJoCo(model, integrator="implicitfast", nconmax=1, njmax=1)
else:
    solver = newton.solvers.SolverFeatherstone(model, angular_damping=0.0)


def two_steps():
    solver.step(before, after, control, None, h)
    solver.step(after, before, control, None, h)


two_steps()  # compiles
with wp.ScopedCapture() as capture:
    for _ in range(captured // 2):
        two_steps()


def run():
    for _ in range(steps // captured):
        wp.capture_launch(capture.graph)


print_times(run, steps)
