"""Drake: joint coordinates; contacts as a convex problem in discrete steps, or integrators for smooth motion.

README.md says what is exact, what is approximated, what is refused and which defaults are overridden.
"""

import assay_adapter as assay

# name: text, order. The fixed steps of the error-controlled ones are those of the same formula.
INTEGRATORS = {
    "discrete": ("semi-implicit Euler", 1),
    "runge_kutta2": ("Runge-Kutta 2", 2),
    "runge_kutta3": ("Runge-Kutta 3", 3),
    "radau3": ("Radau IIA, implicit, order 3", 3),
    "implicit_euler": ("implicit Euler", 1),
    "cenic": ("CENIC, convex and error-controlled", 1),
}
WITH_ERROR_CONTROL = ("runge_kutta3", "radau3", "implicit_euler", "cenic")
SHAPES = ("box", "cylinder", "ellipsoid", "hull")
LEFT_OUT = "left out: contacts resist neither spin about their normal nor rolling"


class Engine(assay.Engine):
    version = assay.pinned("drake", __file__)
    source = f"PyPI drake {version}, prebuilt"

    def settings(self):
        discrete = {"integrator": "discrete"}
        return [
            assay.Setting(name="integrator", default="discrete", choices=tuple(INTEGRATORS),
                          meaning="discrete: a plant in discrete time, whose step solves for contacts and limits; the "
                                  "others integrate smooth motion and have neither"),
            assay.Setting(name="accuracy", default=0.0, minimum=0.0, maximum=1.0,
                          meaning="error control of runge_kutta3, radau3, implicit_euler and cenic: the relative error of a "
                                  "step, which is divided until it is within it; 0: steps of the timestep (cenic: 0.001)"),
            assay.Setting(name="contact_approximation", default="sap", choices=("sap", "similar", "lagged"),
                          only_with=discrete,
                          meaning="Drake's convex approximation of contact: sap; similar and lagged, whose dissipation "
                                  "is that of Hunt and Crossley (lagged is Drake's own default)"),
            assay.Setting(name="point_stiffness", default=1e6, unit="N/m", minimum=1.0, maximum=1e12,
                          role="contact_softness", only_with=discrete,
                          meaning="stiffness of each shape's contacts; two in series give half of it (1e6 is Drake's own "
                                  "default)"),
            assay.Setting(name="relaxation_time", default=0.1, unit="s", minimum=0.0, maximum=1e3,
                          only_with={**discrete, "contact_approximation": "sap"},
                          meaning="linear dissipation of contacts with sap (0.1 is Drake's own default)"),
            assay.Setting(name="dissipation", default=50.0, unit="s/m", minimum=0.0, maximum=1e6, only_with=discrete,
                          meaning="Hunt and Crossley's dissipation of contacts with similar and lagged (50 is Drake's own "
                                  "default)"),
            assay.Setting(name="stiction_tolerance", default=1e-4, unit="m/s", minimum=1e-9, maximum=1.0,
                          only_with=discrete,
                          meaning="speed at which a contact that sticks may slip, with similar and lagged (Drake's own "
                                  "default)"),
            assay.Setting(name="near_rigid_threshold", default=1.0, minimum=0.0, maximum=1e3, only_with=discrete,
                          meaning="softens contacts that are stiffer than a step can resolve; 0: off (1 is Drake's own "
                                  "default)"),
        ]

    def contenders(self):
        def contender(name, summary, **values):
            return assay.Contender(name=name, summary=summary, set=values)

        return [
            contender("drake-sap", "Drake, discrete steps, SAP contacts with linear dissipation"),
            contender("drake-similar", "Drake, discrete steps, 'similar' contacts", contact_approximation="similar"),
            contender("drake-lagged", "Drake, discrete steps, 'lagged' contacts (Drake's own default)",
                      contact_approximation="lagged"),
            contender("drake-rk2", "Drake, continuous, Runge-Kutta 2, without contacts", integrator="runge_kutta2"),
            contender("drake-rk3", "Drake, continuous, Runge-Kutta 3, without contacts", integrator="runge_kutta3"),
            contender("drake-radau3", "Drake, continuous, implicit Radau of order 3, without contacts",
                      integrator="radau3"),
            contender("drake-implicit-euler", "Drake, continuous, implicit Euler, without contacts",
                      integrator="implicit_euler"),
        ]

    def capabilities(self, settings):
        discrete = settings["integrator"] == "discrete"
        text, order = INTEGRATORS[settings["integrator"]]
        if settings["accuracy"] > 0 and settings["integrator"] in WITH_ERROR_CONTROL:
            text += f", error-controlled, accuracy {settings['accuracy']:g}, steps up to the timestep"
        features = {"slide": assay.exact(), "massless": assay.exact(),
                    "tendon-spring": assay.approximated("explicit tension from the state at the step's start")}
        values = {}
        if discrete:
            approximation = settings["contact_approximation"]
            for shape in SHAPES:
                features[shape] = assay.approximated("one contact point a pair, where the shapes overlap most")
            for friction in ("torsional-friction", "rolling-friction"):
                features[friction] = assay.approximated(LEFT_OUT)
            for constraint in ("coupling", "connect", "weld"):
                features[constraint] = assay.approximated("a constraint of SAP, as stiff as a step can resolve")
            dissipation = (f"relaxation time {settings['relaxation_time']:g} s" if approximation == "sap"
                           else f"Hunt-Crossley dissipation {settings['dissipation']:g} s/m")
            values = {
                "contact": True, "joint_limits": True,
                "contact_solver": f"SAP (convex, Newton's method), '{approximation}' approximation",
                "contact_model": f"compliant point contact, {dissipation}, "
                                 f"{settings['point_stiffness']:g} N/m a shape",
                "friction_cone": "elliptic, regularised",
                "friction_combine": "harmonic mean of equal coefficients: a shape has a copy for each of its coefficients",
                "iterations": "until optimality 1e-6 (Newton's method with line search)",
                "contact_forces": "all",
                "contact_forces_note": "ContactResults of the step's own solution, times the timestep",
            }
        return assay.Capabilities(
            coordinates="joint", integrator=text, order=order, joint_solver="none (joint coordinates)", torques=True,
            armature=True, springs="native",
            spring_note="stiffness explicit, damping implicit in velocity" if discrete else "evaluated in each stage",
            speed_limits="none", other="one contact point a pair of shapes, capsules too" if discrete else "",
            features=features, deviations=deviations(settings), **values)

    def check(self, model, settings):
        limitations = []
        if settings["accuracy"] > 0 and settings["integrator"] not in WITH_ERROR_CONTROL:
            limitations.append(assay.Limitation(
                element="setting accuracy", what=assay.refused(
                    f"{settings['integrator']} has no error control: set integrator to {', '.join(WITH_ERROR_CONTROL)}")))
        for joint in model.joints:
            if joint.stiffness < 0 or joint.damping < 0:
                limitations.append(assay.Limitation(
                    element=f"joint '{joint.name}' stiffness and damping",
                    what=assay.refused("Drake's springs and dampers cannot be negative: choose another engine")))
        for coupling in model.couplings:
            if len(coupling.terms) == 1 and coupling.terms[0].coefficient == 0:
                limitations.append(assay.Limitation(
                    element=f"coupling '{coupling.name}'", what=assay.refused("its ratio is 0: leave it out")))
        return limitations

    def create(self, model, state, settings):
        import drake_world

        return drake_world.Simulation(model, state, settings)


# Shown by the programs of findings/drake. Bounds: 1.5 times what the tests measure, but of stacks, whose boxes fall any way.
ONE_POINT = ("a pair of shapes has one contact point, so a box rocks and turns on a face "
             "(findings/drake/one_contact_point.py)")
STACK = ("a pair of shapes has one contact point, which jumps from corner to corner: stacks of boxes sway and sink into themselves "
         "(findings/drake/stack_sways.py)")
GIVES_WAY = ("contacts have one stiffness whatever they carry and close slowly after an impact "
             "(findings/drake/contacts_give_way.py)")
HOPS = "light bodies hop, because the stiffness of contacts does not follow the mass (findings/drake/light_capsule_hops.py)"
LAGGED = ("friction is bounded by the normal force of the step before: bodies whose contact point jumps are braked three times "
          "too strongly (findings/drake/lagged_friction.py)")
ROUNDING = ("the last step of a call ends at the time asked for, others at sums of steps "
            "(findings/drake/continuous_steps.py)")
JACOBIAN = "the Jacobian of earlier steps is used again: hidden state (findings/drake/continuous_steps.py)"
CONTACT_DEVIATIONS = {
    "sap": (("resting-shapes", 4.1e-3, ONE_POINT), ("box-slides", 0.35, ONE_POINT), ("hull-slides", 0.35, ONE_POINT),
            ("box-tips", 0.3, ONE_POINT), ("inelastic-impact", 0.12, GIVES_WAY), ("stack-1000", 0.71, GIVES_WAY),
            ("stick-and-slip", 0.74, HOPS), ("forces-of-boxes", 0.06, ONE_POINT)),
    "similar": (("box-slides", 0.28, ONE_POINT), ("hull-slides", 0.34, ONE_POINT), ("box-tips", 0.3, ONE_POINT),
                ("inelastic-impact", 0.16, GIVES_WAY), ("stack-1000", 0.25, GIVES_WAY), ("stick-and-slip", 0.25, HOPS),
                ("forces-of-boxes", 0.06, ONE_POINT)),
    "lagged": (("box-slides", 0.6, LAGGED), ("hull-slides", 0.61, LAGGED), ("box-tips", 0.28, ONE_POINT),
               ("sliding-capsule", 1.0, LAGGED), ("friction-per-pair", 4.4, LAGGED), ("far-from-origin", 4.0, LAGGED),
               ("stick-and-slip", 0.15, LAGGED), ("inelastic-impact", 0.16, GIVES_WAY), ("stack-1000", 0.25, GIVES_WAY),
               ("forces-of-boxes", 0.42, LAGGED), ("friction-of-links", 0.9, LAGGED), ("friction-directions", 0.83, LAGGED),
               ("distances", 1.05, LAGGED)),
}
CONTINUOUS_DEVIATIONS = {
    "runge_kutta2": (("batches", 100, ROUNDING),),
    "runge_kutta3": (("batches", 100, ROUNDING),),
    "radau3": (("batches", 100, ROUNDING), ("restart", 1e-7, JACOBIAN)),
    "implicit_euler": (("batches", 100, ROUNDING), ("restart", 3e-9, JACOBIAN)),
}


def deviations(settings):
    """Departures that are Drake's own."""
    found = (CONTACT_DEVIATIONS[settings["contact_approximation"]] if settings["integrator"] == "discrete"
             else CONTINUOUS_DEVIATIONS.get(settings["integrator"], ()))
    if settings["integrator"] == "discrete":
        found = (*found, ("rolling-slows", 1.05, LEFT_OUT), ("stacks-at-rest", 3, STACK))
    return [assay.Deviation(test=test, bound=bound, reason=reason) for test, bound, reason in found]
