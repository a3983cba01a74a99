"""SAPIEN: PhysX 5.3.1 on the CPU, articulations in joint coordinates.

README.md says what is exact, what is approximated, what is refused and which defaults are overridden.
"""

import assay_adapter as assay
import sapien_shapes


class Engine(assay.Engine):
    version = assay.pinned("sapien", __file__)
    source = f"PyPI sapien {version} with PhysX 5.3.1, prebuilt"

    def settings(self):
        return [
            assay.Setting(name="solver", default="tgs", choices=("tgs", "pgs"),
                          meaning="constraint solver: temporal Gauss-Seidel, whose position iterations are substeps of rigid bodies "
                                  "(SAPIEN's own default), or projected Gauss-Seidel"),
            assay.Setting(name="position_iterations", default=15, minimum=1, maximum=255, role="iterations",
                          meaning="solver iterations that also correct positions (15 is ManiSkill's, 10 SAPIEN's own default)"),
            assay.Setting(name="velocity_iterations", default=1, minimum=0, maximum=255,
                          meaning="solver iterations after them that only set velocities (1 is SAPIEN's own default)"),
            assay.Setting(name="friction_every_iteration", default=True,
                          meaning="pgs: friction in every iteration instead of only the last three (SAPIEN's own default)"),
            assay.Setting(name="pd", default="explicit", choices=("explicit", "native"),
                          meaning="joint springs and dampers: explicit torque from the state at the step's start, or native: the "
                                  "joint's drive, implicit"),
            assay.Setting(name="contact_offset", default=0.02, unit="1", minimum=1e-6, maximum=10.0,
                          meaning="distance from which a shape makes contacts, over the mean size of the model's shapes (SAPIEN's "
                                  "own default is 0.01 m, ManiSkill's 0.02 m)"),
            assay.Setting(name="link_share", default=1e-5, minimum=1e-6, maximum=0.1,
                          meaning="part of a body's mass and inertia that each massless body before it borrows, because PhysX needs "
                                  "mass in every link"),
        ]

    def contenders(self):
        def contender(name, summary, **values):
            return assay.Contender(name=name, summary=f"SAPIEN (PhysX 5.3), articulations, {summary}, float", set=values)

        return [
            contender("sapien-tgs", "temporal Gauss-Seidel, 15 iterations"),
            contender("sapien-pgs", "projected Gauss-Seidel, 15 iterations", solver="pgs"),
            contender("sapien-tgs-native-pd", "temporal Gauss-Seidel, 15 iterations, springs by joint drives: as ManiSkill sets it",
                      pd="native"),
            contender("sapien-pgs-native-pd", "projected Gauss-Seidel, 15 iterations, springs by joint drives", solver="pgs",
                      pd="native"),
        ]

    def capabilities(self, settings):
        tgs, native = settings["solver"] == "tgs", settings["pd"] == "native"
        counts = f"{settings['position_iterations']} position and {settings['velocity_iterations']} velocity iterations"
        features = {name: assay.exact() for name in ("slide", "dry-friction", "box")}
        features["massless"] = assay.approximated(
            f"borrows {100 * settings['link_share']:g} % of the mass and inertia of the body that it leads to: exact at the "
            f"reference configuration, elsewhere accelerations differ by about that part; --set link_share changes it")
        features["cylinder"] = assay.approximated(
            f"a prism of {sapien_shapes.SIDES} sides, its radius within 0.1 %: it loses speed as it rolls, and one at rest rolls away")
        features["hull"] = assay.approximated("at most 255 vertices and 255 faces: PhysX puts a larger hull into a simpler one around it")
        features["height-field"] = assay.approximated("a mesh of its triangles: a surface without sides and base")
        features["torsional-friction"] = assay.approximated("contacts at one point do not resist spin about the normal")
        features["rolling-friction"] = assay.approximated("contacts do not resist rolling")
        features["connect"] = assay.approximated("a D6 joint between the bodies, by the constraint solver")
        features["weld"] = assay.approximated("three D6 joints between the bodies, by the constraint solver")
        features["ball"] = assay.refused("SAPIEN has no ball joints: three hinges with massless bodies between them stand for one")
        features["coupling"] = features["coupling-of-many"] = assay.refused(
            "SAPIEN couples joints of one chain alone, by springs: couple the actuators' targets, or choose another engine")
        features["tendon-limit"] = assay.refused("SAPIEN has tendons along a chain of links alone: choose another engine")
        features["ellipsoid"] = assay.refused("SAPIEN has none, and on a polyhedron it would not rock: replace it by a capsule or a mesh")
        features["tendon-spring"] = assay.approximated("explicit tension from the state at the step's start")
        return assay.Capabilities(
            precision="single", coordinates="joint",
            integrator="semi-implicit Euler" + (", rigid bodies in a substep each iteration" if tgs else ""), order=1,
            joint_solver="none (joint coordinates)", contact=True, joint_limits=True, torques=True, armature=True,
            contact_solver=f"{'temporal' if tgs else 'projected'} Gauss-Seidel, {counts}",
            contact_model="rigid, no slop; contacts and limits of articulations give way (PhysX's force mixing of 0.025)",
            friction_cone="Coulomb at up to two anchors a contact patch, which share its normal force" if tgs else
            "pyramid, 4 sides, at up to two anchors a contact patch, which share its normal force; first direction along the slip "
            "from 1 cm/s on",
            friction_combine="mean of two materials, chosen so that each pair has its own; else a shape has a copy for each of its "
                             "coefficients",
            iterations=counts, springs="native" if native else "explicit",
            spring_note="implicit drive of the joint, linear" if native else "explicit torques of the adapter",
            sleep="off", speed_limits="none", contact_forces="normal",
            contact_forces_note="PhysxCpuSystem.get_contacts(); PhysX 5.3 gives no friction",
            # findings/sapien/tgs_spin_gain.py, tgs_articulation_angle.py
            other="what turns freely gains 5e-7 of its spin a step; joint angles are summed up in float once an iteration" if tgs else "",
            features=features, deviations=deviations(settings))

    def check(self, model, settings):
        found = []
        for joint in model.joints:
            if joint.has_spring and joint.dry_friction > 0 and settings["pd"] == "native":
                found.append(assay.Limitation(element=f"joint '{joint.name}' dry friction", what=assay.refused(
                    "SAPIEN has one drive a joint, which the native spring takes: set pd=explicit")))
        apart = sapien_shapes.held_together(model)
        never, held = [], []
        for pair in model.contacts:
            bodies = model.shapes[pair.shape_a].body, model.shapes[pair.shape_b].body
            if sapien_shapes.are_neighbours(model, *bodies):
                never.append(pair)
            elif frozenset(bodies) in apart:
                held.append(pair)
        found += [assay.Limitation(element=element, what=assay.refused(
            "links of an articulation never touch their parent: exclude the pair")) for element in assay.pair_elements(model, never)]
        found += [assay.Limitation(element=element, what=assay.refused(
            "bodies that SAPIEN's joint holds together do not touch: exclude the pair"))
            for element in assay.pair_elements(model, held)]
        if settings["solver"] == "pgs" and any(pair.friction > 0 for pair in model.contacts):
            found.append(assay.Limitation(element="friction of contact pairs", what=assay.approximated(
                "two tangents, one at a time: along the slip from 1 cm/s on; of bodies at rest up to 1.41 times the coefficient "
                "between them: set solver=tgs")))
        if model.contacts and sapien_shapes.Parts(model).groups is None:
            found.append(assay.Limitation(element="contact pairs", what=assay.refused(
                "SAPIEN tells them apart by 32 bits, which do not suffice: let shapes touch that need not be apart")))
        return found

    def create(self, model, state, settings):
        import sapien_world

        return sapien_world.Simulation(model, state, settings)


# Shown by the programs of findings/sapien. Bounds: 1.5 to 2 times what the tests measure.
SLOWLY = ("a cylinder is a prism, and PhysX's prisms lose more speed at their edges than rigid ones "
          "(findings/sapien/prism_rolls_slowly.py)")
ROLLS_OFF = ("a cylinder is a prism, which PhysX lets roll from face to face on boxes, hulls and meshes "
             "(findings/sapien/prism_rolls_off.py)")
FAR = ("each iteration adds a substep's way to positions in float, so that bodies that touch something lag behind far from the origin "
       "(findings/sapien/tgs_far_from_origin.py)")
TANGENTS = ("friction is bounded along two tangents one at a time, which the normal fixes up to a slip of 1 cm/s: a body at rest holds up "
            "to 1.41 times the friction (findings/sapien/pgs_friction_axes.py)")


def deviations(settings):
    """Departures that are PhysX's own."""
    found = [("rolling-slows", 1.05, "contacts do not resist rolling"), ("cylinder-rolls", 0.15, SLOWLY),
             ("cylinders-at-rest", 1.05, ROLLS_OFF), ("cylinders-on-field", 1.05, ROLLS_OFF),
             ("distances", 1.05, FAR) if settings["solver"] == "tgs" else ("friction-directions", 0.3, TANGENTS)]
    return [assay.Deviation(test=test, bound=bound, reason=reason) for test, bound, reason in found]
