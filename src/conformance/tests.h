// The tests of the suite. Each runs the contender on a model of its own. conformance.cc has their names, meanings and
// required capabilities.
#pragma once

#include "conformance/subject.h"

namespace assay::conformance {

inline constexpr double kStep = 1e-3;  // s, of every test that needs no other timestep

// ---- the interface's promises (interface_tests.cc) -----------------------------------------------------------------
Verdict readback(const Subject& subject);
Verdict state_round_trip(const Subject& subject);
Verdict determinism(const Subject& subject);
Verdict independence(const Subject& subject);
Verdict batches(const Subject& subject);
Verdict restart(const Subject& subject);
Verdict torque_for_one_step(const Subject& subject);
Verdict tree_readback(const Subject& subject);
Verdict tree_round_trip(const Subject& subject);
Verdict declared_features(const Subject& subject);

// ---- smooth motions against closed forms and the error-controlled solution (smooth_tests.cc) -----------------------
Verdict free_fall(const Subject& subject);
Verdict gravity_direction(const Subject& subject);
Verdict fast_motion(const Subject& subject);
Verdict torque_free_top(const Subject& subject);
Verdict pendulum_period(const Subject& subject);
Verdict constant_torque(const Subject& subject);
Verdict torque_reaction(const Subject& subject);
Verdict spring_damper(const Subject& subject);
Verdict armature(const Subject& subject);
Verdict planar_chain(const Subject& subject);
Verdict spatial_chain(const Subject& subject);
Verdict oblique_trees_converge(const Subject& subject);

// ---- slides, ball joints, several joints in a row, dry friction (joint_tests.cc) -----------------------------------
Verdict slide_force(const Subject& subject);
Verdict slide_spring(const Subject& subject);
Verdict slide_armature(const Subject& subject);
Verdict slide_limit(const Subject& subject);
Verdict planar_root(const Subject& subject);
Verdict massless_joints(const Subject& subject);
Verdict conical_pendulum(const Subject& subject);
Verdict ball_spring(const Subject& subject);
Verdict ball_armature(const Subject& subject);
Verdict ball_limit(const Subject& subject);
Verdict dry_friction(const Subject& subject);
Verdict ball_dry_friction(const Subject& subject);
Verdict random_trees(const Subject& subject);
Verdict random_massless_trees(const Subject& subject);

// ---- couplings, connects, welds, tendons (constraint_tests.cc) ------------------------------------------------------
Verdict coupling(const Subject& subject);
Verdict coupling_of_many(const Subject& subject);
Verdict connect(const Subject& subject);
Verdict weld(const Subject& subject);
Verdict tendon_spring(const Subject& subject);
Verdict tendon_limit(const Subject& subject);
Verdict tendon_dry_friction(const Subject& subject);

// ---- shapes beyond balls, capsules and planes (shape_tests.cc) ------------------------------------------------------
Verdict box_slides(const Subject& subject);
Verdict box_tips(const Subject& subject);
Verdict hull_slides(const Subject& subject);
Verdict hull_tips(const Subject& subject);
Verdict cylinder_rolls(const Subject& subject);
Verdict ellipsoid_rocks(const Subject& subject);
Verdict resting_shapes(const Subject& subject);
Verdict height_field(const Subject& subject);
Verdict torsional_friction(const Subject& subject);
Verdict rolling_friction(const Subject& subject);

// ---- Coulomb friction (friction_tests.cc) ---------------------------------------------------------------------------
Verdict friction_of_links(const Subject& subject);
Verdict friction_directions(const Subject& subject);
Verdict distances(const Subject& subject);

// ---- limits and contact (contact_tests.cc) --------------------------------------------------------------------------
Verdict joint_limit(const Subject& subject);
Verdict wide_range(const Subject& subject);
Verdict sliding_capsule(const Subject& subject);
Verdict sphere_rolls(const Subject& subject);
Verdict resting_height(const Subject& subject);
Verdict bodies_collide(const Subject& subject);
Verdict armature_impact(const Subject& subject);
Verdict friction_per_pair(const Subject& subject);
Verdict excluded_pairs(const Subject& subject);
Verdict contact_compliance(const Subject& subject);
Verdict restitution(const Subject& subject);

// ---- what rests and what moves slowly, at every timestep (rest_tests.cc) --------------------------------------------
Verdict bodies_at_rest(const Subject& subject);
Verdict cylinders_at_rest(const Subject& subject);
Verdict bodies_on_field(const Subject& subject);
Verdict cylinders_on_field(const Subject& subject);
Verdict stacks_at_rest(const Subject& subject);
Verdict slow_rotations(const Subject& subject);
Verdict near_equilibrium(const Subject& subject);

// ---- what holds bodies, and the engine's own actuators (attachment_tests.cc) ----------------------------------------
Verdict welds_hold(const Subject& subject);
Verdict connects_hold(const Subject& subject);
Verdict couplings_apart(const Subject& subject);
Verdict limits_under_load(const Subject& subject);
Verdict rolling_slows(const Subject& subject);
Verdict height_field_edges(const Subject& subject);
Verdict actuator_laws(const Subject& subject);
Verdict velocity_gain(const Subject& subject);

// ---- forces of contacts (force_tests.cc) ----------------------------------------------------------------------------
Verdict contact_forces(const Subject& subject);
Verdict forces_of_boxes(const Subject& subject);

// ---- what scales away in tests of one size (wide_tests.cc) ----------------------------------------------------------
Verdict spinning_bodies(const Subject& subject);
Verdict wide_trees(const Subject& subject);
Verdict far_from_origin(const Subject& subject);
Verdict inelastic_impact(const Subject& subject);
Verdict beyond_limit(const Subject& subject);
Verdict stick_and_slip(const Subject& subject);
Verdict stack_of_ten(const Subject& subject);
Verdict stack_of_thousand(const Subject& subject);

}  // namespace assay::conformance
