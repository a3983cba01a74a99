"""Newton's SolverFeatherstone: the spin of a small or fast body is wrong, at every timestep. The error grows with its distance from
the world's origin and with its speed.

Its spatial inertias and velocities are taken about the world's origin, in single precision. There the moments of a small body are
the difference of large numbers: m r^2 of 1 mm is a millionth of m d^2 at 1 m. Without forces a ball keeps its spin, and the turning
of a body does not depend on the place. SolverSteel has neither error.
"""

from scene import *

SPIN = np.array([5.0, -10.0, 12.0])


def spun(solver, where, speed, moments, mass, spin, timestep):
    made = builder(gravity=0.0)
    body(made, mass, moments, "free")
    run = Run(made, solver, timestep)
    run.start([where, 0, 0, 0, 0, 0, 1], [0, speed, 0, *spin])
    for _ in range(round(0.1 / timestep)):
        run.step()
    return run.v[3:].astype(float)


still_so = True
for timestep in (1e-3, 0.5e-3):
    moments = 0.4 * 1e-3 * 1e-3**2 * np.array([1.0, 1.3, 1.8])
    errors = {}
    for solver in ("featherstone", "steel"):
        near, *far = (spun(solver, where, 0.0, moments, 1e-3, SPIN, timestep) for where in (0.0, 1.0, 10.0))
        errors[solver] = [float(np.linalg.norm(each - near)) for each in far]
        print(f"{1e3 * timestep:g} ms, {solver}: 1 g and 1 mm after 0.1 s: {errors[solver][0]:.3g} rad/s off at 1 m, "
              f"{errors[solver][1]:.3g} at 10 m")
    still_so = still_so and errors["featherstone"][0] > 0.1 and errors["steel"] == [0.0, 0.0]
    for solver in ("featherstone", "steel"):
        gain = spun(solver, 0.0, 300.0, 3 * [0.4 * 0.1**2], 1.0, [0, 0, 100.0], timestep)[2] / 100 - 1
        print(f"{1e3 * timestep:g} ms, {solver}: a ball of 1 kg and 0.1 m at 300 m/s gains {gain:.2e} of its spin in 0.1 s")
        still_so = still_so and (abs(gain) > 1e-3 if solver == "featherstone" else abs(gain) < 1e-5)
finish(still_so)
