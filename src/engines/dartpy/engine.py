"""DART 6: joint coordinates; contacts and limits as a linear complementarity problem, or as cones.

README.md says what is exact, what is approximated, what is refused and which defaults are overridden.
"""

import assay_adapter as assay

# name: its text, its friction cone, what it does in a step
SOLVERS = {
    "dantzig": ("Dantzig's LCP method, projected Gauss-Seidel where it fails", "pyramid, 4 sides, directions fixed by the normal"),
    "pgs": ("projected Gauss-Seidel, no warm start", "pyramid, 4 sides, directions fixed by the normal"),
    "nsgs": ("nonsmooth Gauss-Seidel over contacts", "elliptic"),
    "fbf": ("forward-backward-forward splitting", "elliptic"),
}
DETECTORS = ("ode", "bullet", "dart")
# What Python did not have before, or, of the detector dart, what let spheres fall through planes.
SINCE_6_20 = {("detector", "ode"), ("detector", "dart"), ("lcp", "pgs"), ("lcp", "nsgs"), ("lcp", "fbf"), ("split_impulse", True)}
LEAST_FRICTION = 1e-3  # DART treats pairs with at most this coefficient as frictionless


class Engine(assay.Engine):
    version = assay.pinned("dartpy", __file__)
    source = f"PyPI dartpy {version}, prebuilt"
    short = ".".join(version.split(".")[:2])

    def settings(self):
        return [
            assay.Setting(name="lcp", default="dantzig", choices=tuple(SOLVERS),
                          meaning="solver of contacts and joint limits: dantzig: direct, projected Gauss-Seidel where it fails "
                                  "(DART's default); pgs: only that; nsgs, fbf: with elliptic friction cones"),
            assay.Setting(name="pgs_iterations", default=50, minimum=1, maximum=1e6, role="iterations",
                          meaning="iterations of projected Gauss-Seidel (DART's own default is 30)", only_with={"lcp": "pgs"}),
            assay.Setting(name="pgs_tolerance", default=1e-3, minimum=0.0, maximum=1.0, only_with={"lcp": "pgs"},
                          meaning="projected Gauss-Seidel ends when no impulse changes by more than this part of it"),
            assay.Setting(name="cone_iterations", default=100, minimum=1, maximum=1e6,
                          meaning="most sweeps of nsgs and outer iterations of fbf (DART's own default)"),
            assay.Setting(name="cone_tolerance", default=1e-5, minimum=0.0, maximum=1.0,
                          meaning="at which nsgs and fbf stop before them (DART's own default)"),
            assay.Setting(name="split_impulse", default=False,
                          meaning="correct depths by impulses that add no speed (DART's own default is off)"),
            assay.Setting(name="detector", default="ode", choices=DETECTORS,
                          meaning="which library finds the contacts (DART's own default is FCL, which replaces capsules by "
                                  "spheres)"),
        ]

    def contenders(self):
        def contender(name, summary, **values):
            return assay.Contender(name=name, summary=summary, set=values)

        return [
            contender("dartpy", f"DART {self.short}, joint coordinates, Dantzig's LCP solver"),
            contender("dartpy-pgs", f"DART {self.short}, joint coordinates, projected Gauss-Seidel", lcp="pgs"),
            contender("dartpy-nsgs", f"DART {self.short}, joint coordinates, nonsmooth Gauss-Seidel with elliptic cones", lcp="nsgs"),
        ]

    def capabilities(self, settings):
        solver, cone = SOLVERS[settings["lcp"]]
        pgs = f"at most {settings['pgs_iterations']}, relative change {settings['pgs_tolerance']:g}"
        iterations = {"dantzig": f"direct; {pgs} where PGS steps in", "pgs": pgs}.get(
            settings["lcp"], f"at most {settings['cone_iterations']}, tolerance {settings['cone_tolerance']:g}")
        features = {name: assay.exact() for name in
                    ("slide", "ball", "massless", "dry-friction", "ball-dry-friction", "box", "cylinder")}
        features["tendon-spring"] = assay.approximated("explicit tension from the state at the step's start")
        for friction in ("torsional-friction", "rolling-friction"):
            features[friction] = assay.approximated("left out: contacts resist neither spin about their normal nor rolling")
        return assay.Capabilities(
            coordinates="joint", integrator="semi-implicit Euler", order=1, joint_solver="none (joint coordinates)",
            contact_solver=solver, contact_model="rigid, " + (
                "split impulses" if settings["split_impulse"] else "ERP 0.01, apart at most at 1 mm/s"),
            friction_cone=cone, friction_combine="the pair's coefficient: the smaller of two shapes, chosen to give it",
            contact=True, joint_limits=True, torques=True, springs="native",
            spring_note="DART's own, implicit in position and velocity at the step's end", iterations=iterations,
            sleep="off", speed_limits="none", other=f"contacts found by {settings['detector']}", features=features,
            deviations=deviations(settings))

    def check(self, model, settings):
        limitations = []
        if tuple(map(int, self.short.split("."))) < (6, 20):
            limitations += [assay.Limitation(element=f"setting {name}", what=assay.refused(
                f"DART {self.version} does not have it in Python: set detector=bullet, lcp=dantzig, split_impulse=off")) for name in ("detector", "lcp", "split_impulse")
                if (name, settings[name]) in SINCE_6_20]
        for joint in model.joints:
            if joint.stiffness < 0 or joint.damping < 0:
                limitations.append(assay.Limitation(
                    element=f"joint '{joint.name}' stiffness and damping",
                    what=assay.refused("DART's springs and dampers cannot be negative: choose another engine")))
        if settings["lcp"] in ("dantzig", "pgs") and any(pair.friction > 0 for pair in model.contacts):
            limitations.append(assay.Limitation(element="friction of contact pairs", what=assay.approximated(
                "a pyramid of four sides along directions that the contact's normal fixes: right along them, up to 1.41 times the "
                "coefficient between them: set lcp=nsgs")))
        slippery = ((pair, f", friction {pair.friction:g}") for pair in model.contacts if 0 < pair.friction <= LEAST_FRICTION)
        limitations.extend(assay.Limitation(element=element, what=assay.approximated(
            f"without friction: DART drops coefficients up to {LEAST_FRICTION:g}"))
            for element in assay.pair_elements(model, slippery))
        return limitations

    def create(self, model, state, settings):
        import dart_world

        return dart_world.Simulation(model, state, settings)


# Shown by the programs of findings/dartpy. Bounds: 1.5 times what the tests measure.
SLOW = ("depths are corrected by a hundredth a step, at most at 1 mm/s, and Python cannot set it "
        "(findings/dartpy/slow_correction.py)")
LOAD = ("an iterative solver does not carry a load of a thousand times the mass that bears it "
        "(findings/dartpy/stack_mass_ratio.py)")
BOXES = ("50 iterations of projected Gauss-Seidel do not carry a stack of ten boxes; --set pgs_iterations=200 does "
         "(findings/dartpy/stack_of_boxes.py)")
PYRAMID = ("friction is up to 1.41 times too strong between the directions that the normal fixes "
           "(findings/dart/friction_pyramid.cc)")
STACK = {"pgs": 0.2, "nsgs": 0.09}


def deviations(settings):
    """Departures that are DART's own."""
    found = [assay.Deviation(test="inelastic-impact", bound=0.19, reason=SLOW),
             assay.Deviation(test="rolling-slows", bound=1.05, reason="contacts do not resist rolling")]
    if settings["lcp"] in ("dantzig", "pgs"):
        found.append(assay.Deviation(test="friction-directions", bound=0.44, reason=PYRAMID))
    if settings["lcp"] in STACK:
        found.append(assay.Deviation(test="stack-1000", bound=STACK[settings["lcp"]], reason=LOAD))
    if settings["lcp"] == "pgs" and settings["pgs_iterations"] < 200:
        found.append(assay.Deviation(test="stacks-at-rest", bound=3, reason=BOXES))
    return found
