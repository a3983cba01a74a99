"""Newton: robots as kernels of Warp, in single precision, here compiled for the CPU.

README.md says what is exact, what is approximated, what is refused and which defaults are overridden.
"""

import assay_adapter as assay
import mujoco_declared
from shape_friction import friction_of_shapes

# what is said of springs, who has them
SPRINGS = {
    "featherstone": ("explicit, with Newton's own springs and dampers", "native"),
    "steel": ("explicit torques of the adapter", "explicit"),
    "mujoco": (f"{mujoco_declared.SPRINGS} (Runge-Kutta: in each stage)", "native"),
}
EXACT = {
    "featherstone": ("slide", "ball", "ball-armature", "massless", "coupling"),
    "steel": ("slide", "ball", "ball-armature", "massless", "box", "cylinder", "ellipsoid", "hull", "height-field"),
    "mujoco": ("slide", "ball", "ball-spring", "ball-armature", "box", "cylinder", "ellipsoid", "hull", "height-field"),
}


class Engine(assay.Engine):
    version = assay.pinned("newton", __file__)
    source = (f"PyPI newton {version}, warp-lang {assay.pinned('warp-lang', __file__)}, mujoco-warp "
              f"{assay.pinned('mujoco-warp', __file__)}, mujoco {assay.pinned('mujoco', __file__)}")
    compiler = "Warp's LLVM, on this machine, when a model first needs a kernel"
    flags = "for this processor"

    def settings(self):
        mujoco = {"solver": "mujoco"}
        return [
            assay.Setting(name="solver", default="featherstone", choices=tuple(SPRINGS),
                          meaning="Newton's solver: SolverFeatherstone, SolverSteel (experimental), or SolverMuJoCo by MuJoCo Warp"),
            assay.Setting(name="iterations", default=0, minimum=0, role="iterations",
                          meaning="most iterations of the constraint solver in a step; 0: Newton's own, 12 of steel and 100 of mujoco"),
            assay.Setting(name="max_contacts", default=0, minimum=0, maximum=1000000,
                          meaning="contacts that there is room for, an outcome when there are more; 0: what the pairs can "
                                  "have, at most 8 a body and 8 more"),
            assay.Setting(name="integrator", default="implicitfast", choices=tuple(mujoco_declared.INTEGRATORS), only_with=mujoco,
                          meaning="implicit in velocity (Newton's own), semi-implicit Euler, or Runge-Kutta 4"),
            *mujoco_declared.settings_of_solver("solver_of_mujoco", "a pyramid inside Coulomb's cone or the cone itself", only_with=mujoco),
        ]

    def contenders(self):
        def contender(name, summary, **values):
            return assay.Contender(name=f"newton-{name}", summary=f"Newton on the CPU, {summary}", set=values)

        return [
            contender("featherstone", "SolverFeatherstone, without contacts and limits"),
            contender("steel", "SolverSteel (experimental), projected Gauss-Seidel", solver="steel"),
            contender("mujoco", "SolverMuJoCo by MuJoCo Warp, implicit in velocity", solver="mujoco"),
            contender("mujoco-rk4", "SolverMuJoCo by MuJoCo Warp, Runge-Kutta 4", solver="mujoco", integrator="rk4"),
        ]

    def capabilities(self, settings):
        solver = settings["solver"]
        note, springs = SPRINGS[solver]
        features = {name: assay.exact() for name in EXACT[solver]}
        features["tendon-spring"] = assay.approximated("explicit tension from the state at the step's start")
        facts = {"integrator": "semi-implicit Euler", "order": 1}
        if solver == "steel":
            facts = {**facts, "contact": True, "joint_limits": True,
                     "contact_solver": f"projected Gauss-Seidel, {settings['iterations'] or 12} sweeps",
                     "contact_model": "rigid, a fifth of a depth is corrected in a step",
                     "friction_cone": "circle, of friction patches with two anchors each",
                     "friction_combine": "mean of two, shapes' coefficients chosen so that each pair has its own",
                     "iterations": f"{settings['iterations'] or 12}"}
            features["coupling"] = assay.approximated("a row of the Gauss-Seidel solver, a fifth of its error is corrected in a step")
        if solver == "mujoco":
            integrator, order, _ = mujoco_declared.INTEGRATORS[settings["integrator"]]
            iterations = settings["iterations"] or 100
            facts = {"integrator": integrator, "order": order, "friction_combine": "explicit pairs",
                     "iterations": f"at most {iterations}, tolerance 1e-6",
                     **mujoco_declared.contact(settings["solver_of_mujoco"], settings["cone"], iterations)}
            features = mujoco_declared.features(EXACT[solver], ("coupling",), ("dry-friction", "ball-dry-friction"))
        return assay.Capabilities(
            precision="single", coordinates="joint", joint_solver="none (joint coordinates)", torques=True, armature=True,
            springs=springs, spring_note=note, sleep="off", other="the graphs of steps are captured before the run",
            features=features, deviations=deviations(settings), **facts)

    def check(self, model, settings):
        found, joints = [], model.joints
        followers = {coupling.joint for coupling in model.couplings}
        for coupling in model.couplings:
            if any(term.joint in followers for term in coupling.terms):
                found.append(assay.Limitation(element=f"coupling '{coupling.name}'", what=assay.refused(
                    f"Newton has no chains of couplings: couple '{joints[coupling.joint].name}' to the first joint of the chain")))
        if settings["solver"] == "steel" and friction_of_shapes(model) is None:
            found.append(assay.Limitation(element="friction of contact pairs", what=assay.refused(
                "SolverSteel takes the mean of two shapes' coefficients, and no coefficients give every pair its own: give all "
                "pairs of a body the same friction")))
        if settings["solver"] == "mujoco":
            found.extend(mujoco_declared.soft_limits_and_contacts(model, settings["cone"]))
        return found

    def create(self, model, state, settings):
        import newton_world

        return newton_world.Simulation(model, state, settings, friction_for(model, settings))

    def create_batch(self, model, worlds, settings, device):
        import newton_batch

        return newton_batch.Batch(model, worlds, settings, friction_for(model, settings), device)


def friction_for(model, settings):
    return friction_of_shapes(model) if settings["solver"] == "steel" else {}


# Shown by the programs of findings/newton. Bounds: 1.1 and 1.5 times what the tests measure.
SPIN = ("spatial inertias are taken about the world's origin, in single precision: the spin of a small or fast body is wrong, the more "
        "so the farther away it is (findings/newton/small_bodies_spin.py)")


def deviations(settings):
    """Departures that are Newton's own, or of the MuJoCo in it."""
    if settings["solver"] == "featherstone":
        return [assay.Deviation(test="fast-motion", bound=0.0045, reason=SPIN),
                assay.Deviation(test="spinning-bodies", bound=2.8, reason=SPIN)]
    if settings["solver"] == "mujoco":
        return mujoco_declared.deviations("newton", settings["cone"])
    return []
