"""MuJoCo Warp: MuJoCo's equations as kernels of Warp, in single precision, here compiled for the CPU.

README.md says what is exact, what is approximated, what is refused and which defaults are overridden.
"""

import assay_adapter as assay

# text, order, what is said of springs
INTEGRATORS = {
    "euler": ("semi-implicit Euler", 1, "stiffness explicit, damping implicit in velocity"),
    "rk4": ("Runge-Kutta 4", 4, "evaluated in each of the four stages"),
    "implicitfast": ("implicit in velocity, without Coriolis derivatives", 1, "stiffness explicit, damping implicit in velocity"),
}
EXACT = ("slide", "ball", "ball-spring", "ball-armature", "massless", "box", "cylinder", "ellipsoid", "hull", "height-field")
SOFT = ("coupling", "coupling-of-many", "connect", "weld", "ball-limit", "tendon-limit")
FRICTION = ("dry-friction", "ball-dry-friction", "tendon-dry-friction")


class Engine(assay.Engine):
    version = assay.pinned("mujoco-warp", __file__)
    source = (f"PyPI mujoco-warp {version}, warp-lang {assay.pinned('warp-lang', __file__)}, models compiled by mujoco-core "
              f"{assay.pinned('mujoco-core', __file__)}")
    compiler = "Warp's LLVM, on this machine, when a model first needs a kernel"
    flags = "for this processor"

    def settings(self):
        return [
            assay.Setting(name="integrator", default="euler", choices=tuple(INTEGRATORS),
                          meaning="semi-implicit Euler, Runge-Kutta 4, or implicit in velocity"),
            assay.Setting(name="solver", default="newton", choices=("newton", "cg"), meaning="constraint solver"),
            assay.Setting(name="cone", default="pyramidal", choices=("pyramidal", "elliptic"),
                          meaning="friction cone: a pyramid inside Coulomb's cone (MuJoCo's default) or the cone itself"),
            assay.Setting(name="iterations", default=100, minimum=1, role="iterations",
                          meaning="most iterations of the constraint solver in a step"),
            assay.Setting(name="tolerance", default=1e-8, minimum=0.0, role="tolerance",
                          meaning="scaled improvement below which the constraint solver stops; MuJoCo Warp raises it to 1e-6"),
            assay.Setting(name="max_contacts", default=0, minimum=0, maximum=1000000,
                          meaning="contacts that there is room for, an outcome when there are more; 0: what the pairs can "
                                  "have, at most 8 a body and 8 more. A step's cost grows with it"),
        ]

    def contenders(self):
        def contender(name, summary, **values):
            return assay.Contender(name=name, summary=summary, set=values)

        return [
            contender("mujoco-warp", "MuJoCo Warp on the CPU, semi-implicit Euler, Newton solver"),
            contender("mujoco-warp-rk4", "MuJoCo Warp on the CPU, Runge-Kutta 4, Newton solver", integrator="rk4"),
        ]

    def capabilities(self, settings):
        integrator, order, springs = INTEGRATORS[settings["integrator"]]
        features = {name: assay.exact() for name in EXACT}
        features["tendon-spring"] = assay.approximated("explicit tension from the state at the step's start")
        for name in SOFT:
            features[name] = assay.approximated("soft constraint with MuJoCo's default stiffness")
        for name in FRICTION:
            features[name] = assay.approximated("soft constraint with MuJoCo's default stiffness: it creeps")
        for name in ("torsional-friction", "rolling-friction"):
            features[name] = assay.approximated(
                "soft, in one friction cone with sliding: a contact that slides resists spin less")
        return assay.Capabilities(
            precision="single", coordinates="joint", integrator=integrator, order=order,
            joint_solver="none (joint coordinates)", torques=True, armature=True, springs="native", spring_note=springs,
            contact=True, joint_limits=True,
            contact_solver=f"{ {'newton': 'Newton', 'cg': 'conjugate gradients'}[settings['solver']]}, at most "
                           f"{settings['iterations']} iterations",
            contact_model="soft: time constant 0.02 s (at least 2 timesteps), damping ratio 1, impedance 0.9 to 0.95 over 0.001 m",
            friction_cone="elliptic" if settings["cone"] == "elliptic" else "pyramid inside the cone, 4 sides",
            friction_combine="larger of two, as the model's pairs; explicit pairs where they differ",
            iterations=f"at most {settings['iterations']}, tolerance {settings['tolerance']:g}", sleep="off",
            other="joint limits are soft: time constant 0.02 s, damping ratio 1; the graph of a step is captured before the run",
            features=features, deviations=deviations(settings))

    def create(self, model, state, settings):
        import warp_world

        return warp_world.Simulation(model, state, settings)


# Shown by the programs of findings/mujoco-warp. Bounds: 1.1 and 1.5 times what the tests measure, as for MuJoCo itself.
REBOUND = ("a contact is a critically damped spring that only pushes: a body leaves it with exp(-2) = 0.135 of its speed (0.155 at "
           "4 ms; findings/mujoco-warp/contact_rebound.py)")
MASS_RATIO = ("a contact is as soft as the lighter body on it is light: a bar goes through bars of a thousandth of its mass "
              "(findings/mujoco-warp/contact_mass_ratio.py)")


def deviations(settings):
    """Departures that are MuJoCo's own."""
    return [assay.Deviation(test="inelastic-impact", bound=0.17, reason=REBOUND),
            assay.Deviation(test="stack-1000", bound=3.1, reason=MASS_RATIO)]
