"""Genesis: the rigid solver of Genesis World, compiled by Quadrants, here for the CPU.

README.md says what is exact, what is approximated, what is refused and which defaults are overridden.
"""

import assay_adapter as assay
import mujoco_declared
from contact_pairs import friction_of_shapes, masks_of

# text, what is said of dampers
INTEGRATORS = {
    "approximate_implicitfast": ("implicit in joint damping; single free bodies by the implicit midpoint rule",
                                 "stiffness explicit, damping implicit in velocity, also for the constraint forces"),
    "implicitfast": ("implicit in joint damping; single free bodies by the implicit midpoint rule",
                     "stiffness explicit, damping implicit in velocity"),
    "euler": ("semi-implicit Euler", "stiffness explicit, damping implicit in velocity"),
}
SOLVERS = {"newton": "Newton", "cg": "conjugate gradients"}
CONES = {"pyramidal": "pyramid inside the cone, 4 sides",
         "elliptic": "elliptic; with Newton's method friction is bounded by the normal force that a contact has"}
LEAST_FRICTION = 0.01
EXACT = ("slide", "ball", "ball-armature", "massless", "box", "cylinder", "ellipsoid", "hull")


class Engine(assay.Engine):
    version = assay.pinned("genesis-world", __file__)
    source = (f"PyPI genesis-world {version}, quadrants {assay.pinned('quadrants', __file__)}, torch "
              f"{assay.pinned('torch', __file__)}, models compiled by mujoco-core {assay.pinned('mujoco-core', __file__)}")
    compiler = "Quadrants' LLVM, on this machine, when a kernel is first needed"
    flags = "for this processor, fast-math, as gs.init() sets them"

    def settings(self):
        return [
            assay.Setting(name="precision", default="double", choices=("double", "single"),
                          meaning="gs.init(precision): numbers of 64 bits, or of 32, which Genesis has by itself"),
            assay.Setting(name="integrator", default="approximate_implicitfast", choices=tuple(INTEGRATORS),
                          meaning="Genesis' own default, the same without its approximation, or semi-implicit Euler"),
            assay.Setting(name="solver", default="newton", choices=tuple(SOLVERS), meaning="constraint solver"),
            assay.Setting(name="cone", default="pyramidal", choices=tuple(CONES),
                          meaning="friction cone: a pyramid inside Coulomb's cone (Genesis' default), or the cone itself"),
            assay.Setting(name="iterations", default=25, minimum=1, role="iterations",
                          meaning="most iterations of the constraint solver in a step"),
            assay.Setting(name="tolerance", default=0.0, minimum=0.0, role="tolerance",
                          meaning="scaled improvement below which the constraint solver stops; 0: Genesis' own, 1e-9 in double "
                                  "and 1e-6 in single precision"),
            assay.Setting(name="constraint_timeconst", default=0.01, minimum=1e-6, unit="s", role="contact_softness",
                          meaning="time constant of contacts and limits; Genesis raises it to two timesteps"),
            assay.Setting(name="static_arrays", default=False,
                          meaning="gs.init(performance_mode): kernels are compiled for each model, which takes long, and step "
                                  "faster; otherwise once for all models"),
        ]

    def contenders(self):
        return [assay.Contender(name="genesis", summary="Genesis on the CPU, its own integrator and Newton solver, in double precision")]

    def capabilities(self, settings):
        integrator, springs = INTEGRATORS[settings["integrator"]]
        tolerance = settings["tolerance"] or (1e-9 if settings["precision"] == "double" else 1e-6)
        features = {name: assay.exact() for name in EXACT}
        features["tendon-spring"] = assay.approximated("explicit tension from the state at the step's start")
        for name in ("coupling", "connect", "weld"):
            features[name] = assay.approximated("soft constraint with the time constant of contacts")
        for name in ("dry-friction", "ball-dry-friction"):
            features[name] = assay.approximated("soft constraint with the time constant of contacts: it creeps")
        for name in ("torsional-friction", "rolling-friction"):
            features[name] = assay.approximated("soft, in one friction cone with sliding: a contact that slides resists spin less")
        return assay.Capabilities(
            precision=settings["precision"], coordinates="joint", integrator=integrator, order=1,
            joint_solver="none (joint coordinates)", contact=True, joint_limits=True, torques=True, armature=True,
            springs="native", spring_note=springs,
            contact_solver=f"{SOLVERS[settings['solver']]}, at most {settings['iterations']} iterations",
            contact_model=f"soft: time constant {settings['constraint_timeconst']:g} s (at least 2 timesteps), damping ratio 1, "
                          "impedance 0.9 to 0.95 over 0.001 m",
            friction_cone=CONES[settings["cone"]], friction_combine=f"larger of two, as the model's pairs, at least {LEAST_FRICTION}",
            iterations=f"at most {settings['iterations']}, tolerance {tolerance:g}", sleep="off (hibernation)",
            other="joint limits are soft as contacts", features=features, deviations=deviations(settings))

    def check(self, model, settings):
        found = mujoco_declared.soft_limits_and_contacts(model, settings["cone"])

        def add(element, what):
            found.append(assay.Limitation(element=element, what=what))

        ends = {body for hold in [*model.connects, *model.welds] for body in (hold.body_a, hold.body_b)}
        children = [[] for _ in model.bodies]
        for i, body in enumerate(model.bodies):
            if body.parent >= 0:
                children[body.parent].append(i)
        for i, body in enumerate(model.bodies):
            if not body.is_massless or body.is_free:
                continue
            if len(children[i]) != 1 or i in ends:
                add(f"body '{body.name}'", assay.refused(
                    "Genesis takes a massless body only between two joints of one body: give it a mass"))
            elif body.ball >= 0 or model.bodies[children[i][0]].ball >= 0:
                add(f"body '{body.name}'", assay.refused(
                    "Genesis takes no ball joint beside other joints of one body: give the massless body a mass"))
        welded = {frozenset((hold.body_a, hold.body_b)) for hold in model.welds}

        def carrier(i):  # a massless body's joints and shapes are its child's in Genesis
            while i >= 0 and model.bodies[i].is_massless and len(children[i]) == 1:
                i = children[i][0]
            return i

        carriers = [carrier(i) for i in range(len(model.bodies))]

        def inside(pair):
            a, b = model.shapes[pair.shape_a].body, model.shapes[pair.shape_b].body
            return (carriers[a] if a >= 0 else a) == (carriers[b] if b >= 0 else b) or frozenset((a, b)) in welded

        for element in assay.pair_elements(model, filter(inside, model.contacts)):
            add(element, assay.refused("Genesis has no contacts within a body or between welded bodies: leave the pair out"))
        if any(pair.friction < LEAST_FRICTION for pair in model.contacts):
            add("friction of contact pairs", assay.approximated(f"at least {LEAST_FRICTION}, Genesis' lower bound"))
        if friction_of_shapes(model) is None:
            add("friction of contact pairs", assay.refused(
                "Genesis takes the larger of two shapes' coefficients, and no coefficients give every pair its own: give all pairs "
                "of a body the same friction"))
        if masks_of(model) is None:
            add("contact pairs", assay.refused("Genesis chooses pairs by bit masks, and 31 bits do not say which of these collide: "
                                               "exclude fewer pairs"))
        return found

    def create(self, model, state, settings):
        import genesis_world

        return genesis_world.Simulation(model, state, settings)

    def create_batch(self, model, worlds, settings, device):
        import genesis_batch

        return genesis_batch.Batch(model, worlds, settings, device)


def deviations(settings):
    """Contacts as soft as MuJoCo's, but for their time constant, each shown by a program of findings/genesis. Bounds: 1.1 and 1.5
    times what the tests measure."""
    rebound = ("a contact is a critically damped spring that only pushes: a body leaves it with exp(-2) = 0.135 of its speed (0.174 at "
               "4 ms; findings/genesis/contact_rebound.py)")
    mass_ratio = ("a contact is as soft as the lighter body on it is light: a bar sinks into bars of a thousandth of its mass "
                  "(findings/genesis/contact_mass_ratio.py)")
    found = [assay.Deviation(test="inelastic-impact", bound=0.2, reason=rebound),
             assay.Deviation(test="stack-1000", bound=0.55, reason=mass_ratio)]
    if settings["cone"] == "pyramidal":
        found.append(assay.Deviation(test="friction-directions", bound=0.31, reason=(
            "the friction pyramid lies inside Coulomb's cone, as MuJoCo's: up to 29 % less friction between its axes "
            "(findings/mujoco/pyramidal_cone.cc)")))
    return found
