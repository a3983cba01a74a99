"""SuperDex: implicit integration in joint coordinates, with compliant contact at the quadrature points of surface meshes.

README.md says what is exact, what is approximated, what is refused and which defaults are overridden.
"""

import assay_adapter as assay

INTEGRATORS = {
    "backward_euler": "backward Euler",
    "bdf2": "BDF2",
    "bdf3": "BDF3",
    "dirk22": "DIRK22",
    "dirk23": "DIRK23",
    "dirk33": "DIRK33",
    "symplectic_dirk12": "implicit midpoint",
    "symplectic_dirk22": "symplectic DIRK22",
}
SHAPES = ("box", "cylinder", "ellipsoid", "hull", "height-field")
LEFT_OUT = "left out: contacts resist neither spin about their normal nor rolling"


class Engine(assay.Engine):
    version = assay.pinned("superdex-physics", __file__)
    source = f"PyPI superdex-physics and superdex-physics-fp64 {version}, prebuilt"

    def settings(self):
        return [
            assay.Setting(name="integrator", default="backward_euler", choices=tuple(INTEGRATORS),
                          meaning="SuperDex's IntegrationMethod (backward_euler is SuperDex's own default, bdf2 what its "
                                  "makers recommend for accuracy)"),
            assay.Setting(name="inertia", default="incremental_potential",
                          choices=("incremental_potential", "newton_euler"),
                          meaning="how a step writes the inertia of rotation: incremental_potential, which brakes what spins "
                                  "(SuperDex's own default), or newton_euler"),
            assay.Setting(name="iterations", default=50, minimum=1, maximum=1e6, role="iterations",
                          meaning="most iterations of Newton's method in a stage (SuperDex's own default is 4)"),
            assay.Setting(name="tolerance", default=1e-12, minimum=0.0, maximum=1.0, role="tolerance",
                          meaning="residual of each actor at which they stop, relative to its inertia's and weight's scale "
                                  "(SuperDex's own default is 1e-3)"),
            assay.Setting(name="exact_hessian", default=True,
                          meaning="Newton's method with the derivatives of friction and saturation themselves instead of fitted "
                                  "ones (SuperDex's own default is off)"),
            assay.Setting(name="implicit_friction", default=True,
                          meaning="friction and damping of contacts by the pressure at a stage's end, not at its start "
                                  "(SuperDex's own default is off)"),
            assay.Setting(name="contact_stiffness", default=3e10, unit="Pa/m", minimum=1.0, maximum=1e15,
                          role="contact_softness", meaning="pressure of contacts by their depth (1e9 is SuperDex's own default)"),
            assay.Setting(name="contact_smoothing", default=1e-5, unit="m", minimum=0.0, maximum=1.0,
                          meaning="half of the depth over which contacts reach their stiffness (SuperDex's own default is "
                                  "5e-3)"),
            assay.Setting(name="contact_threshold", default=0.0, unit="m", minimum=0.0, maximum=1.0,
                          meaning="distance at which contacts begin to push (SuperDex's own default is 1e-3)"),
            assay.Setting(name="contact_damping", default=10.0, unit="s/m", minimum=0.0, maximum=1e9,
                          meaning="damping along a contact's normal, by its pressure: a body leaves at most at the inverse of "
                                  "it (SuperDex's own default is 0)"),
            assay.Setting(name="friction_velocity", default=1e-3, unit="m/s", minimum=1e-9, maximum=1.0,
                          meaning="speed up to which a contact that sticks may slip (SuperDex's own default is 1e-2)"),
            assay.Setting(name="joint_friction_velocity", default=1e-5, unit="rad/s or m/s", minimum=1e-12, maximum=1.0,
                          meaning="speed up to which a joint that sticks may slip (SuperDex's own default is 1e-3)"),
            assay.Setting(name="limit_stiffness", default=1e6, unit="Nm/rad or N/m", minimum=0.0, maximum=1e15,
                          meaning="stiffness of joint limits (SuperDex's own default is 100)"),
            assay.Setting(name="limit_damping", default=1e4, unit="Nms/rad or Ns/m", minimum=0.0, maximum=1e15,
                          meaning="damping of joint limits (SuperDex's own default is 0)"),
            assay.Setting(name="constraint_stiffness", default=1e8, unit="N/m or Nm/rad", minimum=0.0, maximum=1e15,
                          meaning="stiffness of connects and welds (SuperDex's own default is 1e6)"),
            assay.Setting(name="constraint_damping", default=1e6, unit="Ns/m or Nms/rad", minimum=0.0, maximum=1e15,
                          meaning="damping of connects and welds (SuperDex's own default is 0)"),
            assay.Setting(name="mesh_cells", default=12, minimum=4, maximum=128,
                          meaning="triangles along a quarter of a circle or half of an edge: SuperDex touches at quadrature "
                                  "points of surface meshes"),
        ]

    def contenders(self):
        def contender(name, summary, **values):
            return assay.Contender(name=name, summary=summary, set=values)

        return [
            contender("superdex", "SuperDex, backward Euler (SuperDex's own default)"),
            contender("superdex-bdf2", "SuperDex, BDF2 (what its makers recommend for accuracy)", integrator="bdf2",
                      inertia="newton_euler"),
            contender("superdex-symplectic", "SuperDex, symplectic DIRK22 with Newton's and Euler's inertia, without contacts",
                      integrator="symplectic_dirk22", inertia="newton_euler"),
        ]

    def capabilities(self, settings):
        features = {name: assay.exact() for name in ("slide", "ball", "ball-spring", "ball-armature", "massless", "dry-friction")}
        features["ball-dry-friction"] = assay.approximated("bounded by its norm, not about each axis")
        for constraint in ("connect", "weld"):
            features[constraint] = assay.approximated(
                f"springs of {settings['constraint_stiffness']:g} N/m with dampers")
        features["tendon-spring"] = assay.approximated("explicit tension from the state at the step's start")
        integrator, order = settings["integrator"], ""
        if settings["inertia"] == "newton_euler":
            order = ", Newton's and Euler's inertia"
        values = {}
        if not integrator.startswith("symplectic"):
            for shape in SHAPES:
                features[shape] = assay.approximated("triangles for its own points; for others' points a grid of distances")
            features["box"] = assay.exact()
            features["cylinder"] = assay.approximated(
                f"a prism of {20 * settings['mesh_cells']} sides, which rolls onto the nearest one when it is put down")
            for friction in ("torsional-friction", "rolling-friction"):
                features[friction] = assay.approximated(LEFT_OUT)
            values = {
                "contact": True,
                "contact_solver": "Newton's method on the whole step, line search",
                "contact_model": f"compliant, {settings['contact_stiffness']:g} Pa/m over the surface, Hunt-Crossley damping "
                                 f"{settings['contact_damping']:g} s/m",
                "friction_cone": f"elliptic, regularised below {settings['friction_velocity']:g} m/s",
                "other": "contacts at the quadrature points of triangles, of balls and capsules, too",
                "friction_combine": "the pair's coefficient, set for each pair",
            }
        if integrator == "backward_euler":
            values.update(contact_forces="all",
                          contact_forces_note="the solution's at each quadrature point, times the timestep")
        return assay.Capabilities(
            coordinates="joint", integrator=INTEGRATORS[integrator] + order, order=1,
            joint_solver="none (joint coordinates)", joint_limits=True, torques=True, armature=True, springs="native",
            spring_note="SuperDex's own constraints, implicit in each stage",
            iterations=f"at most {settings['iterations']} a stage, residual {settings['tolerance']:g}",
            sleep="off (SuperDex's own default)", speed_limits="none", features=features, deviations=deviations(settings),
            **values)

    def check(self, model, settings):
        limitations = []
        for joint in [*model.joints, *model.balls]:
            if joint.stiffness < 0 or joint.damping < 0:
                limitations.append(assay.Limitation(
                    element=f"joint '{joint.name}' stiffness and damping",
                    what=assay.refused("SuperDex's springs and dampers cannot be negative: choose another engine")))
        return limitations

    def create(self, model, state, settings):
        import superdex_world

        return superdex_world.Simulation(model, state, settings)


# Shown by the programs of findings/superdex. Bounds: 1.5 times what the tests measure.
BRAKES = "what spins is braked at first order in the timestep (findings/superdex/spinning_brakes.py)"
GAINS = "what spins gains speed at second order in the timestep (findings/superdex/spinning_brakes.py)"
ROUNDING = ("velocities are differences of places over the timestep, with their rounding "
            "(findings/superdex/velocities_are_differences.py)")
HIDDEN = "links keep velocities that joint rates do not determine: hidden state (findings/superdex/hidden_state.py)"
SPREADS = "BDF2 spreads a torque of one step over the next ones (findings/superdex/torque_spreads.py)"
REBOUNDS = "a ball leaves an impact that is shorter than a step faster than damping says (findings/superdex/impacts_rebound.py)"
SIDES = "the cylinder is a prism, which rolls onto a side: 2.6 mm wide at 0.1 m"
DEVIATIONS = {
    "backward_euler": (("free-fall", 6e-10, ROUNDING), ("gravity-direction", 6e-10, ROUNDING), ("fast-motion", 0.74, BRAKES),
                       ("restart", 5.5e-4, HIDDEN), ("torque-for-one-step", 3e-5, BRAKES), ("sphere-rolls", 0.034, BRAKES),
                       ("contact-forces", 0.018, BRAKES), ("rolling-slows", 1.5, LEFT_OUT),
                       ("cylinders-at-rest", 2.7e-3, SIDES), ("cylinders-on-field", 2.7e-3, SIDES)),
    "bdf2": (("free-fall", 6.5e-10, ROUNDING), ("gravity-direction", 5.5e-10, ROUNDING), ("fast-motion", 1.6e-3, GAINS),
             ("restart", 3.9e-4, HIDDEN), ("torque-for-one-step", 0.63, SPREADS), ("inelastic-impact", 0.62, REBOUNDS),
             ("rolling-slows", 1.5, LEFT_OUT), ("cylinders-at-rest", 2.7e-3, SIDES), ("cylinders-on-field", 2.7e-3, SIDES)),
    "symplectic_dirk22": (("free-fall", 1.8e-9, ROUNDING), ("gravity-direction", 2e-9, ROUNDING), ("restart", 3.3e-4, HIDDEN),
                          ("torque-for-one-step", 6e-8, ROUNDING), ("slide-force", 1.2e-10, ROUNDING),
                          ("slide-armature", 1.7e-10, ROUNDING)),
}


def deviations(settings):
    """Departures that are SuperDex's own."""
    return [assay.Deviation(test=test, bound=bound, reason=reason)
            for test, bound, reason in DEVIATIONS.get(settings["integrator"], ())]
