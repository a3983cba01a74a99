// One world of Rapier. Included once a precision by lib.rs, which names the crate `rapier`.
//
// A rigid body's frame has its origin in the centre of mass: then a multibody's root, whose velocity Rapier takes for that
// of the frame's origin, moves rightly too.

use super::*;
use rapier::math::{Pose, Real, Rotation, Vector};
use rapier::geometry::{ContactData, ContactManifoldData, NEW_CONTACT_BIT};
use rapier::parry::query::{
    details::{ContactManifoldsWorkspace, NormalConstraints, ShapeCastOptions}, ClosestPoints, Contact, DefaultQueryDispatcher, NonlinearRigidMotion,
    PersistentQueryDispatcher, QueryDispatcher, ShapeCastHit, ShapeDistance, ShapeIntersection, Unsupported,
};
use rapier::parry::shape::Shape as ParryShape;
use rapier::prelude::*;
use rapier::utils::OrthonormalBasis;

const HINGE: c_int = 0;
const SLIDE: c_int = 1;

/// The free axis of a hinge or slide.
fn axis(joint: &JointSetup) -> JointAxis {
    if joint.kind == SLIDE {
        JointAxis::LinX
    } else {
        JointAxis::AngX
    }
}

fn free_axes(joint: &JointSetup) -> &'static [JointAxis] {
    match joint.kind {
        HINGE => &[JointAxis::AngX],
        SLIDE => &[JointAxis::LinX],
        _ => &[JointAxis::AngX, JointAxis::AngY, JointAxis::AngZ],
    }
}

fn vec3(v: &[f64; 3]) -> Vector {
    Vector::new(v[0] as Real, v[1] as Real, v[2] as Real)
}

fn rotation(q: &[f64; 4]) -> Rotation {
    Rotation::from_xyzw(q[0] as Real, q[1] as Real, q[2] as Real, q[3] as Real)
}

fn pose(p: &[f64; 3], q: &[f64; 4]) -> Pose {
    Pose::from_parts(vec3(p), rotation(q))
}

fn array3(v: Vector) -> [f64; 3] {
    [v.x as f64, v.y as f64, v.z as f64]
}

fn array4(q: Rotation) -> [f64; 4] {
    [q.x as f64, q.y as f64, q.z as f64, q.w as f64]
}

#[derive(Clone, Copy)]
enum Joint {
    Impulse(ImpulseJointHandle),
    Multibody(MultibodyJointHandle),
}

struct JointParts {
    parent: Option<RigidBodyHandle>, // none: the world
    child: RigidBodyHandle,
    frame: Pose, // in the child
    joint: Joint,
    made_from: JointSetup,
}

/// Which shapes may touch and with what friction, where Rapier's groups and rules cannot say it. The colliders'
/// user_data is the shape's number.
#[derive(Default)]
struct Pairs {
    friction: Vec<f64>,
    shapes: usize,
}

impl Pairs {
    fn friction(&self, colliders: &ColliderSet, a: ColliderHandle, b: ColliderHandle) -> f64 {
        self.friction[colliders[a].user_data as usize * self.shapes + colliders[b].user_data as usize]
    }
}

impl PhysicsHooks for Pairs {
    fn filter_contact_pair(&self, context: &PairFilterContext) -> Option<SolverFlags> {
        let friction = self.friction(context.colliders, context.collider1, context.collider2);
        (friction >= 0.0).then_some(SolverFlags::COMPUTE_RIGID_IMPULSES)
    }

    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        let friction = self.friction(context.colliders, context.collider1, context.collider2);
        if let Some(contacts) = context.rigid_mut() {
            *contacts.friction = friction as Real;
        }
    }
}

/// Before Parry's own dispatcher in a chain: has it find contact points anew in each step. Otherwise they are kept while
/// they move by less than 1 mm and 1 degree, so that a capsule at rest on a box rolls away.
struct FreshContacts;

impl QueryDispatcher for FreshContacts {
    fn intersection_test(
        &self,
        _: &Pose,
        _: &dyn ParryShape,
        _: &dyn ParryShape,
    ) -> Result<ShapeIntersection, Unsupported> {
        Err(Unsupported)
    }
    fn distance(&self, _: &Pose, _: &dyn ParryShape, _: &dyn ParryShape) -> Result<ShapeDistance, Unsupported> {
        Err(Unsupported)
    }
    fn contact(
        &self,
        _: &Pose,
        _: &dyn ParryShape,
        _: &dyn ParryShape,
        _: Real,
    ) -> Result<Option<Contact>, Unsupported> {
        Err(Unsupported)
    }
    fn closest_points(
        &self,
        _: &Pose,
        _: &dyn ParryShape,
        _: &dyn ParryShape,
        _: Real,
    ) -> Result<ClosestPoints, Unsupported> {
        Err(Unsupported)
    }
    fn cast_shapes(
        &self,
        _: &Pose,
        _: Vector,
        _: &dyn ParryShape,
        _: &dyn ParryShape,
        _: ShapeCastOptions,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        Err(Unsupported)
    }
    fn cast_shapes_nonlinear(
        &self,
        _: &NonlinearRigidMotion,
        _: &dyn ParryShape,
        _: &NonlinearRigidMotion,
        _: &dyn ParryShape,
        _: Real,
        _: Real,
        _: bool,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        Err(Unsupported)
    }
}

impl PersistentQueryDispatcher<ContactManifoldData, ContactData> for FreshContacts {
    fn contact_manifolds(
        &self,
        _: &Pose,
        _: &dyn ParryShape,
        _: &dyn ParryShape,
        _: Real,
        manifolds: &mut Vec<ContactManifold>,
        _: &mut Option<ContactManifoldsWorkspace>,
    ) -> Result<(), Unsupported> {
        for manifold in manifolds {
            manifold.mark_shapes_deformed();
        }
        Err(Unsupported)
    }
    fn contact_manifold_convex_convex(
        &self,
        _: &Pose,
        _: &dyn ParryShape,
        _: &dyn ParryShape,
        _: Option<&dyn NormalConstraints>,
        _: Option<&dyn NormalConstraints>,
        _: Real,
        _: &mut ContactManifold,
    ) -> Result<(), Unsupported> {
        Err(Unsupported)
    }
}

fn narrow_phase(options: &Options) -> NarrowPhase {
    if options.contact_coherence != 0 {
        return NarrowPhase::new();
    }
    NarrowPhase::with_query_dispatcher(FreshContacts.chain(DefaultQueryDispatcher))
}

pub struct World {
    options: Options,
    physics: PhysicsWorld,
    pairs: Pairs,
    handles: Vec<RigidBodyHandle>, // by body
    joints: Vec<JointParts>,
    jointed: Vec<RigidBodyHandle>, // bodies that a joint's force acts on, each once
    torques_set: bool,             // since the last step
}

fn parameters(options: &Options) -> IntegrationParameters {
    let softness = |frequency: f64, ratio: f64| SpringCoefficients::new(frequency as Real, ratio as Real);
    IntegrationParameters {
        dt: options.timestep as Real,
        contact_softness: softness(options.contact_frequency, options.contact_damping_ratio),
        static_contact_softness: softness(options.static_contact_frequency, options.static_contact_damping_ratio),
        warmstart_coefficient: options.warmstart as Real,
        normalized_max_corrective_velocity: options.max_corrective_speed as Real,
        normalized_prediction_distance: options.prediction_distance as Real,
        normalized_max_linear_velocity: Real::MAX, // no limit
        num_solver_iterations: options.solver_iterations as usize,
        num_internal_pgs_iterations: options.pgs_iterations as usize,
        num_internal_stabilization_iterations: options.stabilization_iterations as usize,
        max_ccd_substeps: options.ccd_substeps as usize,
        contact_recycling: options.contact_recycling != 0,
        friction_in_bias_pass: options.friction_in_bias_pass != 0,
        warmstart_joints: options.warmstart_joints != 0,
        friction_model: if options.coulomb != 0 { FrictionModel::Coulomb } else { FrictionModel::Simplified },
        ..IntegrationParameters::default()
    }
}

fn turn(bodies: &mut RigidBodySet, joint: &JointParts, torque: Vector) {
    bodies[joint.child].add_torque(torque, false);
    if let Some(parent) = joint.parent {
        bodies[parent].add_torque(-torque, false);
    }
}

impl World {
    fn new(options: &Options) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.gravity = vec3(&options.gravity);
        physics.integration_parameters = parameters(options);
        physics.narrow_phase = narrow_phase(options);
        Self {
            options: *options,
            physics,
            pairs: Pairs::default(),
            handles: Vec::new(),
            joints: Vec::new(),
            jointed: Vec::new(),
            torques_set: false,
        }
    }

    fn add_body(&mut self, body: &Body) {
        let mass_properties = MassProperties::with_principal_inertia_frame(
            Vector::ZERO,
            body.mass as Real,
            vec3(&body.inertia),
            rotation(&body.q_body_principal),
        );
        let rigid_body = RigidBodyBuilder::dynamic()
            .pose(pose(&body.p_world_com, &body.q_world_body))
            .linvel(vec3(&body.v_world_com))
            .angvel(vec3(&body.w_world))
            .additional_mass_properties(mass_properties)
            .can_sleep(false)
            .allow_fast_rotation(true)
            .gyroscopic_forces_enabled(self.options.gyroscopic != 0);
        self.handles.push(self.physics.insert_body(rigid_body));
    }

    fn add_joint(&mut self, setup: &JointSetup) -> Result<(), String> {
        let child = self.handles[setup.child as usize];
        let parent = usize::try_from(setup.parent).ok().map(|parent| self.handles[parent]);
        // A fixed body for each: the trees of a shared one would be one multibody.
        let root = parent.unwrap_or_else(|| self.physics.bodies.insert(RigidBodyBuilder::fixed()));

        let locked = match setup.kind {
            HINGE => JointAxesMask::LOCKED_REVOLUTE_AXES,
            SLIDE => JointAxesMask::LOCKED_PRISMATIC_AXES,
            _ => JointAxesMask::LOCKED_SPHERICAL_AXES,
        };
        let mut joint = GenericJointBuilder::new(locked)
            .local_frame1(pose(&setup.p_parent, &setup.q_parent))
            .local_frame2(pose(&setup.p_child, &setup.q_child))
            .softness(self.softness())
            .build();
        if setup.limited != 0 {
            joint.set_limits(axis(setup), [setup.lower as Real, setup.upper as Real]);
        }
        let joint = if self.options.multibody != 0 {
            let handle = self.physics.multibody_joints.insert(root, child, joint, true);
            Joint::Multibody(handle.ok_or("Rapier refused a multibody joint")?)
        } else {
            if self.options.native_springs != 0 && (setup.stiffness != 0.0 || setup.damping != 0.0) {
                joint.set_motor_model(axis(setup), MotorModel::ForceBased);
                joint.set_motor(
                    axis(setup),
                    setup.spring_position as Real,
                    0.0,
                    setup.stiffness as Real,
                    setup.damping as Real,
                );
            } else if setup.dry_friction != 0.0 {
                // a motor that wants to stand still, with no more than that force
                for free in free_axes(setup) {
                    joint.set_motor_model(*free, MotorModel::ForceBased);
                    joint.set_motor(*free, 0.0, 0.0, 0.0, 1e12);
                    joint.set_motor_max_force(*free, setup.dry_friction as Real);
                }
            }
            Joint::Impulse(self.physics.impulse_joints.insert(root, child, joint, true))
        };
        for body in parent.into_iter().chain([child]) {
            if !self.jointed.contains(&body) {
                self.jointed.push(body);
            }
        }
        self.joints.push(JointParts {
            parent,
            child,
            frame: pose(&setup.p_child, &setup.q_child),
            joint,
            made_from: *setup,
        });
        Ok(())
    }

    fn softness(&self) -> SpringCoefficients<Real> {
        SpringCoefficients::new(self.options.joint_frequency as Real, self.options.joint_damping_ratio as Real)
    }

    fn add_constraint(&mut self, setup: &ConstraintSetup) {
        let mut body = |index: c_int| match usize::try_from(index) {
            Ok(body) => self.handles[body],
            Err(_) => self.physics.bodies.insert(RigidBodyBuilder::fixed()),
        };
        let (a, b) = (body(setup.body_a), body(setup.body_b));
        let locked =
            if setup.weld != 0 { JointAxesMask::LOCKED_FIXED_AXES } else { JointAxesMask::LOCKED_SPHERICAL_AXES };
        let joint = GenericJointBuilder::new(locked)
            .local_frame1(pose(&setup.p_a, &setup.q_a))
            .local_frame2(pose(&setup.p_b, &setup.q_b))
            .softness(self.softness())
            .build();
        self.physics.impulse_joints.insert(a, b, joint, true);
    }

    fn add_shape(&mut self, shape: &ShapeSetup, points: Vec<Vector>, triangles: Vec<[u32; 3]>) -> Result<(), String> {
        let mut in_body = pose(&shape.p, &shape.q);
        let (radius, half_length) = (shape.radius as Real, shape.half_length as Real);
        let builder = match shape.kind {
            0 => ColliderBuilder::ball(radius),
            1 => ColliderBuilder::capsule_z(half_length, radius),
            2 => ColliderBuilder::halfspace(rapier::na::Unit::new_unchecked(Vector::Z)),
            3 => {
                let half = vec3(&shape.half_size);
                ColliderBuilder::cuboid(half.x, half.y, half.z)
            }
            4 => {
                // Rapier's lies along y
                let half = std::f64::consts::FRAC_1_SQRT_2;
                in_body *= pose(&[0.0; 3], &[half, 0.0, 0.0, half]);
                ColliderBuilder::cylinder(half_length, radius)
            }
            5 => ColliderBuilder::convex_mesh(points.clone(), &triangles)
                .or_else(|| ColliderBuilder::convex_hull(&points))
                .ok_or("Rapier makes no convex body of a mesh")?,
            _ => ColliderBuilder::trimesh_with_flags(points, triangles, TriMeshFlags::FIX_INTERNAL_EDGES)
                .map_err(|error| format!("Rapier makes no surface of a height field: {error}"))?,
        };
        let mut hooks = ActiveHooks::empty();
        hooks.set(ActiveHooks::FILTER_CONTACT_PAIRS, shape.filter_pairs != 0);
        hooks.set(ActiveHooks::MODIFY_SOLVER_CONTACTS, shape.look_up_friction != 0);
        let groups = InteractionGroups::new(
            Group::from_bits_retain(shape.groups),
            Group::from_bits_retain(shape.collides_with),
            InteractionTestMode::And,
        );
        let collider = builder
            .position(in_body)
            .density(0.0)
            .friction(shape.friction as Real)
            .friction_combine_rule(CoefficientCombineRule::Max)
            .restitution(self.options.restitution as Real)
            .collision_groups(groups)
            .active_hooks(hooks)
            .user_data(self.physics.colliders.len() as u128);
        match usize::try_from(shape.body) {
            Ok(body) => {
                let handle = self.handles[body];
                self.physics.colliders.insert_with_parent(collider, handle, &mut self.physics.bodies);
            }
            Err(_) => {
                self.physics.colliders.insert(collider);
            }
        }
        Ok(())
    }

    /// After this the world can be stepped and read.
    fn start(&mut self) -> Result<(), String> {
        // Rapier does this in a world's first step only; until then mass and centre of mass would read as zero.
        for handle in &self.handles {
            self.physics.bodies[*handle].recompute_mass_properties_from_colliders(&self.physics.colliders);
        }
        if self.options.multibody != 0 {
            self.start_multibodies()?;
        }
        Ok(())
    }

    fn start_multibodies(&mut self) -> Result<(), String> {
        // The first pass finds which roots are fixed, which changes the number of degrees of freedom.
        for parts in &self.joints {
            let Joint::Multibody(handle) = parts.joint else { continue };
            let (multibody, _) = self.physics.multibody_joints.get_mut(handle).ok_or("a multibody joint is gone")?;
            multibody.forward_kinematics(&self.physics.bodies, true);
            multibody.damping_mut().fill(0.0); // Rapier gives every joint 0.1 Nms/rad
        }
        for parts in &self.joints {
            let Joint::Multibody(handle) = parts.joint else { continue };
            let (multibody, id) = self.physics.multibody_joints.get_mut(handle).ok_or("a multibody joint is gone")?;
            let link = multibody.link_mut(id).ok_or("a multibody joint has no link")?;
            let dof = link.assembly_id();
            let from = &parts.made_from;
            let dofs = free_axes(from).len();
            let position = from.position.map(|number| number as Real);
            link.joint.apply_displacement(&position[..dofs]);
            if self.options.native_springs != 0 && dofs == 1 {
                link.joint.set_spring(axis(from) as usize, from.stiffness as Real, from.spring_position as Real);
                multibody.damping_mut()[dof] = from.damping as Real;
            }
            for k in 0..dofs {
                multibody.armature_mut()[dof + k] = from.armature as Real;
                multibody.frictions_mut()[dof + k] = from.dry_friction as Real;
                multibody.generalized_velocity_mut()[dof + k] = from.velocity[k] as Real;
            }
            if multibody.root().joint().ndofs() == 6 {
                let body = &self.physics.bodies[multibody.root().rigid_body_handle()];
                let (v, w) = (body.linvel(), body.angvel());
                let mut velocity = multibody.generalized_velocity_mut();
                velocity.as_mut_slice()[..6].copy_from_slice(&[v.x, v.y, v.z, w.x, w.y, w.z]);
            }
        }
        for parts in &self.joints {
            let Joint::Multibody(handle) = parts.joint else { continue };
            let (multibody, _) = self.physics.multibody_joints.get_mut(handle).ok_or("a multibody joint is gone")?;
            multibody.forward_kinematics(&self.physics.bodies, false);
            multibody.update_rigid_bodies(&mut self.physics.bodies, true);
        }
        Ok(())
    }

    fn step(&mut self, count: c_int) -> Result<(), String> {
        for _ in 0..count {
            self.physics.step_with_events(&self.pairs, &());
            // Rapier puts a body that is no longer finite back to its last pose and disables it, and goes on.
            if !self.physics.quarantine().is_empty() {
                return Err("a body's pose or velocity is no longer finite, and Rapier switched it off".into());
            }
            if self.torques_set {
                self.reset_torques(); // a torque stays until it is taken off
            }
        }
        Ok(())
    }

    fn reset_torques(&mut self) {
        for handle in &self.jointed {
            self.physics.bodies[*handle].reset_forces(false);
            self.physics.bodies[*handle].reset_torques(false);
        }
        self.torques_set = false;
    }

    fn set_torques(&mut self, torques: &[f64]) {
        if self.torques_set {
            self.reset_torques();
        }
        for (joint, torque) in self.joints.iter().zip(torques.chunks_exact(3)) {
            if torque.iter().all(|number| *number == 0.0) {
                continue;
            }
            self.torques_set = true;
            let child = *self.physics.bodies[joint.child].position();
            let axis = joint.frame.rotation * Vector::X;
            match joint.made_from.kind {
                SLIDE => {
                    // both forces act on one line
                    let force = child.rotation * axis * (torque[0] as Real);
                    let point = child * joint.frame.translation;
                    self.physics.bodies[joint.child].add_force_at_point(force, point, false);
                    if let Some(parent) = joint.parent {
                        self.physics.bodies[parent].add_force_at_point(-force, point, false);
                    }
                    continue;
                }
                HINGE => turn(&mut self.physics.bodies, joint, child.rotation * axis * (torque[0] as Real)),
                _ => {
                    let torque = Vector::new(torque[0] as Real, torque[1] as Real, torque[2] as Real);
                    turn(&mut self.physics.bodies, joint, child.rotation * torque);
                }
            }
        }
    }

    /// The velocity as the engine will go on from: a multibody's root has its own in the multibody.
    fn velocity(&self, handle: RigidBodyHandle) -> (Vector, Vector) {
        let body = &self.physics.bodies[handle];
        if let Some(link) = self.physics.multibody_joints.rigid_body_link(handle) {
            let multibody = self.physics.multibody_joints.get_multibody(link.multibody);
            if let Some(multibody) = multibody.filter(|m| link.id == 0 && m.root().joint().ndofs() == 6) {
                let v = multibody.generalized_velocity();
                return (Vector::new(v[0], v[1], v[2]), Vector::new(v[3], v[4], v[5]));
            }
        }
        (body.linvel(), body.angvel())
    }

    fn read_bodies(&self, out: &mut [State]) {
        for (handle, state) in self.handles.iter().zip(out) {
            let pose = self.physics.bodies[*handle].position();
            let (v, w) = self.velocity(*handle);
            state.p_world_com = array3(pose.translation);
            state.q_world_body = array4(pose.rotation);
            state.v_world_com = array3(v);
            state.w_world = array3(w);
        }
    }

    fn read_joints(&self, positions: &mut [f64], velocities: &mut [f64]) -> Result<(), String> {
        for (j, parts) in self.joints.iter().enumerate() {
            let Joint::Multibody(handle) = parts.joint else {
                return Err("impulse joints have no coordinates".into());
            };
            let (multibody, id) = self.physics.multibody_joints.get(handle).ok_or("a multibody joint is gone")?;
            let link = multibody.link(id).ok_or("a multibody joint has no link")?;
            positions[3 * j] = link.joint().coords()[axis(&parts.made_from) as usize] as f64;
            for k in 0..free_axes(&parts.made_from).len() {
                velocities[3 * j + k] = multibody.generalized_velocity()[link.assembly_id() + k] as f64;
            }
        }
        Ok(())
    }

    /// The points that the solver had in the last step, with what it left in them.
    fn read_contacts(&self, out: &mut [ContactPoint]) -> usize {
        let shape_of = |handle: ColliderHandle| self.physics.colliders[handle].user_data as c_int;
        let body_of = |handle: Option<RigidBodyHandle>| {
            handle.and_then(|h| self.handles.iter().position(|each| *each == h)).map_or(-1, |index| index as c_int)
        };
        let mut count = 0;
        for pair in self.physics.narrow_phase.contact_pairs() {
            for manifold in pair.solver_manifolds() {
                // the basis in which the solver counts friction, from the direction of its impulse on the first body
                let normal = manifold.data.normal;
                let direction = -normal;
                let tangent = direction.orthonormal_vector();
                let other = direction.cross(tangent);
                for solved in &manifold.data.solver_contacts {
                    let point = &manifold.points[(solved.contact_id[0] & !NEW_CONTACT_BIT) as usize];
                    count += 1;
                    let Some(found) = out.get_mut(count - 1) else { continue };
                    let friction = point.data.tangent_impulse;
                    *found = ContactPoint {
                        shape_a: shape_of(pair.collider1),
                        shape_b: shape_of(pair.collider2),
                        body_a: body_of(manifold.data.rigid_body1),
                        body_b: body_of(manifold.data.rigid_body2),
                        r_a: array3(point.data.solver_dp1),
                        r_b: array3(point.data.solver_dp2),
                        normal: array3(normal),
                        gap: point.dist as f64,
                        impulse: array3(normal * point.data.impulse - tangent * friction.x - other * friction.y),
                    };
                }
            }
        }
        count
    }

    fn view_bodies(&self, out: &mut [HeldBody]) {
        for (handle, held) in self.handles.iter().zip(out) {
            let body = &self.physics.bodies[*handle];
            let local = &body.mass_properties().local_mprops;
            held.mass = local.mass() as f64;
            held.inertia = array3(local.principal_inertia());
            held.q_body_principal = array4(local.principal_inertia_local_frame);
            held.p_world_com = array3(body.center_of_mass());
            held.q_world_body = array4(*body.rotation());
        }
    }

    fn view_joints(&self, out: &mut [HeldJoint]) -> Result<(), String> {
        for (parts, held) in self.joints.iter().zip(out) {
            let data = match parts.joint {
                Joint::Impulse(handle) => self.physics.impulse_joints.get(handle).map(|joint| &joint.data),
                Joint::Multibody(handle) => {
                    let joint = self.physics.multibody_joints.get(handle);
                    joint.and_then(|(multibody, id)| multibody.link(id)).map(|link| &link.joint.data)
                }
            };
            let data = data.ok_or("a joint is gone")?;
            let frame = *self.physics.bodies[parts.child].position() * data.local_frame2;
            held.p_world = array3(frame.translation);
            held.axis_world = array3(frame.rotation * Vector::X);
            held.limited = 0;
            if let Some(limits) = data.limits(axis(&parts.made_from)) {
                held.limited = 1;
                held.lower = limits.min as f64;
                held.upper = limits.max as f64;
            }
        }
        Ok(())
    }
}

// ---- for C ---------------------------------------------------------------------------------------------------------

// SAFETY of what follows: pointers come from the header's callers and point to as many elements as the header says.

extern "C" fn create(options: &Options) -> *mut World {
    guarded(|| Ok(Box::into_raw(Box::new(World::new(options))))).unwrap_or(std::ptr::null_mut())
}

unsafe extern "C" fn destroy(world: *mut World) {
    guarded(|| Ok(drop(Box::from_raw(world))));
}

extern "C" fn add_body(world: &mut World, body: &Body) -> c_int {
    status(guarded(|| Ok(world.add_body(body))))
}

extern "C" fn add_joint(world: &mut World, joint: &JointSetup) -> c_int {
    status(guarded(|| world.add_joint(joint)))
}

extern "C" fn add_constraint(world: &mut World, constraint: &ConstraintSetup) -> c_int {
    status(guarded(|| Ok(world.add_constraint(constraint))))
}

unsafe extern "C" fn add_shape(world: &mut World, shape: &ShapeSetup) -> c_int {
    let mut points = Vec::new();
    for i in 0..shape.point_count as usize {
        let p = shape.points.add(3 * i);
        points.push(vec3(&[*p, *p.add(1), *p.add(2)]));
    }
    let mut triangles = Vec::new();
    for i in 0..shape.triangle_count as usize {
        let t = shape.triangles.add(3 * i);
        triangles.push([*t as u32, *t.add(1) as u32, *t.add(2) as u32]);
    }
    status(guarded(|| world.add_shape(shape, points, triangles)))
}

unsafe extern "C" fn set_pairs(world: &mut World, friction: *const f64, shapes: c_int) -> c_int {
    let shapes = shapes as usize;
    let friction = std::slice::from_raw_parts(friction, shapes * shapes).to_vec();
    world.pairs = Pairs { friction, shapes };
    0
}

extern "C" fn start(world: &mut World) -> c_int {
    status(guarded(|| world.start()))
}

extern "C" fn step(world: &mut World, count: c_int) -> c_int {
    status(guarded(|| world.step(count)))
}

unsafe extern "C" fn set_torques(world: &mut World, torques: *const f64) -> c_int {
    let torques = std::slice::from_raw_parts(torques, 3 * world.joints.len());
    status(guarded(|| Ok(world.set_torques(torques))))
}

unsafe extern "C" fn read_bodies(world: &World, out: *mut State) -> c_int {
    let out = std::slice::from_raw_parts_mut(out, world.handles.len());
    status(guarded(|| Ok(world.read_bodies(out))))
}

unsafe extern "C" fn read_joints(world: &World, positions: *mut f64, velocities: *mut f64) -> c_int {
    let positions = std::slice::from_raw_parts_mut(positions, 3 * world.joints.len());
    let velocities = std::slice::from_raw_parts_mut(velocities, 3 * world.joints.len());
    status(guarded(|| world.read_joints(positions, velocities)))
}

unsafe extern "C" fn read_contacts(world: &World, out: *mut ContactPoint, room: c_int, count: &mut c_int) -> c_int {
    let out = std::slice::from_raw_parts_mut(out, room as usize);
    status(guarded(|| {
        *count = world.read_contacts(out) as c_int;
        Ok(())
    }))
}

unsafe extern "C" fn view_bodies(world: &World, out: *mut HeldBody) -> c_int {
    let out = std::slice::from_raw_parts_mut(out, world.handles.len());
    status(guarded(|| Ok(world.view_bodies(out))))
}

unsafe extern "C" fn view_joints(world: &World, out: *mut HeldJoint) -> c_int {
    let out = std::slice::from_raw_parts_mut(out, world.joints.len());
    status(guarded(|| world.view_joints(out)))
}

unsafe extern "C" fn view_gravity(world: &World, out: *mut f64) {
    std::slice::from_raw_parts_mut(out, 3).copy_from_slice(&array3(world.physics.gravity));
}

const API: Api<World> = Api {
    version: VERSION.as_ptr().cast(),
    error,
    create,
    destroy,
    add_body,
    add_joint,
    add_constraint,
    add_shape,
    set_pairs,
    start,
    step,
    set_torques,
    read_bodies,
    read_joints,
    read_contacts,
    view_bodies,
    view_joints,
    view_gravity,
};
