"""What holds of MuJoCo's equations in whatever code computes them: MuJoCo Warp, MJX, Newton's SolverMuJoCo."""

import assay_adapter as assay

SPRINGS = "stiffness explicit, damping implicit in velocity"
# text, order, what is said of springs
INTEGRATORS = {
    "euler": ("semi-implicit Euler", 1, SPRINGS),
    "rk4": ("Runge-Kutta 4", 4, "evaluated in each of the four stages"),
    "implicitfast": ("implicit in velocity, without Coriolis derivatives", 1, SPRINGS),
}
EXACT = ("slide", "ball", "ball-spring", "ball-armature", "massless", "box", "cylinder", "ellipsoid", "hull", "height-field")
SOFT = ("coupling", "coupling-of-many", "connect", "weld", "ball-limit", "tendon-limit")
FRICTION = ("dry-friction", "ball-dry-friction", "tendon-dry-friction")
CONES = {"pyramidal": "pyramid inside the cone, 4 sides", "elliptic": "elliptic"}
SOLVERS = {"newton": "Newton", "cg": "conjugate gradients"}


def settings_of_solver(solver="solver", cone_meaning="a pyramid inside Coulomb's cone (MuJoCo's default) or the cone itself", **only):
    """The choice of solver and cone; `only` as `assay.Setting` takes it."""
    return [
        assay.Setting(name=solver, default="newton", choices=tuple(SOLVERS), meaning="constraint solver", **only),
        assay.Setting(name="cone", default="pyramidal", choices=tuple(CONES), meaning=f"friction cone: {cone_meaning}", **only),
    ]


def features(exact=EXACT, soft=SOFT, friction=FRICTION):
    """A fidelity for each feature named, and for those that all of MuJoCo's codes have."""
    found = {name: assay.exact() for name in exact}
    found["tendon-spring"] = assay.approximated("explicit tension from the state at the step's start")
    for name in soft:
        found[name] = assay.approximated("soft constraint with MuJoCo's default stiffness")
    for name in friction:
        found[name] = assay.approximated("soft constraint with MuJoCo's default stiffness: it creeps")
    for name in ("torsional-friction", "rolling-friction"):
        found[name] = assay.approximated("soft, in one friction cone with sliding: a contact that slides resists spin less")
    return found


def contact(solver, cone, iterations):
    """Arguments of `assay.Capabilities` for contacts and limits."""
    return {
        "contact": True, "joint_limits": True, "contact_solver": f"{SOLVERS[solver]}, at most {iterations} iterations",
        "contact_model": "soft: time constant 0.02 s (at least 2 timesteps), damping ratio 1, impedance 0.9 to 0.95 over 0.001 m",
        "friction_cone": CONES[cone],
    }


def capabilities(engine, settings, precision, remark):
    """Of a code with MuJoCo's own settings; `remark` ends what is said of it."""
    integrator, order, springs = INTEGRATORS[settings["integrator"]]
    return assay.Capabilities(
        precision=precision, coordinates="joint", integrator=integrator, order=order, joint_solver="none (joint coordinates)",
        torques=True, armature=True, springs="native", spring_note=springs,
        friction_combine="larger of two, as the model's pairs; explicit pairs where they differ",
        iterations=f"at most {settings['iterations']}, tolerance {settings['tolerance']:g}", sleep="off",
        other=f"joint limits are soft: time constant 0.02 s, damping ratio 1; {remark}", features=features(),
        deviations=deviations(engine, settings["cone"]), **contact(settings["solver"], settings["cone"], settings["iterations"]))


def soft_limits_and_contacts(model, cone):
    """What check() says of every code with MuJoCo's soft constraints: mujoco/engine.cc has the same."""
    found = []
    if model.contacts:
        found.append(assay.Limitation(element="contacts", what=assay.approximated(
            "soft constraints: bodies sink in a little and friction creeps")))
        if cone == "pyramidal":
            found.append(assay.Limitation(element="friction", what=assay.approximated(
                "a four-sided pyramid inside Coulomb's cone: up to 29 % less friction between its axes; --set cone=elliptic is exact")))
    found.extend(assay.Limitation(element=f"limit of joint '{joint.name}'", what=assay.approximated(
        "soft constraint: the limit gives way a little under load")) for joint in model.joints if joint.limited)
    return found


def pyramid(cone):
    """The declared deviation of a friction pyramid, if `cone` says that there is one. The bound is 1.05 times its closed form."""
    if cone != "pyramidal":
        return []
    return [assay.Deviation(test="friction-directions", bound=0.31, reason=(
        "the friction pyramid lies inside Coulomb's cone: up to 29 % less friction between its axes "
        "(findings/mujoco/pyramidal_cone.cc)"))]


def deviations(engine, cone):
    """MuJoCo's own departures, each shown by a program of findings/ENGINE. Bounds: 1.1 and 1.5 times what the tests measure."""
    rebound = ("a contact is a critically damped spring that only pushes: a body leaves it with exp(-2) = 0.135 of its speed (0.155 "
               f"at 4 ms; findings/{engine}/contact_rebound.py)")
    mass_ratio = ("a contact is as soft as the lighter body on it is light: a bar goes through bars of a thousandth of its mass "
                  f"(findings/{engine}/contact_mass_ratio.py)")
    limit = ("a ball joint's limit is as soft as the mean of the inverse inertias about its axes is large, as in MuJoCo "
             "(findings/mujoco/ball_limit_mean_inertia.cc)")
    coupling = "a coupling is as soft as the sum of its joints' inverse inertias without their ratio is large"
    rolling = ("rolling friction brakes slow balls in proportion to their rate, as in MuJoCo "
               "(findings/mujoco/rolling_friction_viscous.cc)")
    edges = ("bodies with flat sides or edges catch on the inner edges of a height field's prisms, as in MuJoCo "
             "(findings/mujoco/height_field_edges.cc)")
    return [assay.Deviation(test="inelastic-impact", bound=0.17, reason=rebound),
            assay.Deviation(test="stack-1000", bound=3.1, reason=mass_ratio),
            assay.Deviation(test="limits-under-load", bound=0.25, reason=limit),
            assay.Deviation(test="coupling-distances", bound=0.05, reason=coupling),
            assay.Deviation(test="rolling-slows", bound=0.75, reason=rolling),
            assay.Deviation(test="height-field-edges", bound=1.1, reason=edges), *pyramid(cone)]
