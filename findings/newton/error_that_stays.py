"""Newton's SolverXPBD, SolverVBD and SolverSemiImplicit: the error of a chain on hinges does not shrink with the timestep.

Five links of 0.3 m swing for 0.256 s; the truth is SolverMuJoCo's Runge-Kutta at 1/4 ms. SolverSteel's error is a quarter at a
quarter of the timestep. Those of the others, which hold joints together by projections or springs, stay in millimetres, with SolverXPBD
for 50 iterations as for its own 2. So the engine newton has no contenders of these solvers.
"""

from scene import *

TIMESTEPS = (4e-3, 1e-3, 2.5e-4)
SOLVERS = {
    "rk4": lambda model: newton.solvers.SolverMuJoCo(model, integrator="rk4"),
    "SolverSteel": newton.solvers.SolverSteel,
    "SolverXPBD, 2 iterations": lambda model: newton.solvers.SolverXPBD(model, angular_damping=0.0),
    "SolverXPBD, 50 iterations": lambda model: newton.solvers.SolverXPBD(model, iterations=50, angular_damping=0.0),
    "SolverVBD": newton.solvers.SolverVBD,
    "SolverSemiImplicit": lambda model: newton.solvers.SolverSemiImplicit(model, angular_damping=0.0),
}


def end(name, timestep):
    made, parent, joints = builder(), -1, []
    for i in range(5):
        link = made.add_link(mass=1.0, inertia=np.diag([0.01, 0.01, 0.0012]).tolist(), lock_inertia=True)
        joints.append(made.add_joint_revolute(
            parent, link, axis=(0, 1, 0), parent_xform=wp.transform((0, 0, -0.15 if i else 0.0), wp.quat_identity()),
            child_xform=wp.transform((0, 0, 0.15), wp.quat_identity()), target_ke=0.0, target_kd=0.0))
        parent = link
    made.add_articulation(joints)
    if name == "SolverVBD":
        made.color()
    run = Run(made, "steel", timestep)
    run.solver = SOLVERS[name](run.model)
    run.start([1.4, 0, 0, 0, 0], 1.0)
    for _ in range(round(0.256 / timestep)):
        run.now.clear_forces()
        run.step()
    return run.now.body_q.numpy()[:, :3].astype(float)


truth, errors = end("rk4", TIMESTEPS[-1]), {}
for name in list(SOLVERS)[1:]:
    errors[name] = [float(np.linalg.norm(end(name, timestep) - truth, axis=1).mean()) for timestep in TIMESTEPS]
    print(f"{name}: " + ", ".join(f"{1e3 * error:.3g} mm at {1e3 * timestep:g} ms" for error, timestep in zip(errors[name], TIMESTEPS)))
steel = errors.pop("SolverSteel")
finish(steel[0] > 3.5 * steel[1] > 12 * steel[2] and all(error[2] > 1e-3 > 3 * steel[2] for error in errors.values()))
