// One world of Rapier. Included once a precision by lib.rs, which names the crate `rapier`.
//
// A rigid body's frame has its origin in the centre of mass: then a multibody's root, whose velocity Rapier takes for that
// of the frame's origin, moves rightly too.

use super::*;
use rapier::math::{Pose, Real, Rotation, Vector};
use rapier::prelude::*;

const AXIS: usize = JointAxis::AngX as usize;

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

struct HingeParts {
    parent: Option<RigidBodyHandle>, // none: the world
    child: RigidBodyHandle,
    axis: Vector, // in the child
    joint: Joint,
    made_from: Hinge,
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

pub struct World {
    options: Options,
    physics: PhysicsWorld,
    pairs: Pairs,
    handles: Vec<RigidBodyHandle>, // by body
    hinges: Vec<HingeParts>,
    hinged: Vec<RigidBodyHandle>, // bodies that a hinge's torque acts on, each once
    torques_set: bool,            // since the last step
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

impl World {
    fn new(options: &Options) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.gravity = vec3(&options.gravity);
        physics.integration_parameters = parameters(options);
        Self {
            options: *options,
            physics,
            pairs: Pairs::default(),
            handles: Vec::new(),
            hinges: Vec::new(),
            hinged: Vec::new(),
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

    fn add_hinge(&mut self, hinge: &Hinge) -> Result<(), String> {
        let child = self.handles[hinge.child as usize];
        let parent = usize::try_from(hinge.parent).ok().map(|parent| self.handles[parent]);
        // A fixed body for each: the trees of a shared one would be one multibody.
        let root = parent.unwrap_or_else(|| self.physics.bodies.insert(RigidBodyBuilder::fixed()));

        let mut joint = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
            .local_frame1(pose(&hinge.p_parent, &hinge.q_parent))
            .local_frame2(pose(&hinge.p_child, &hinge.q_child))
            .softness(SpringCoefficients::new(
                self.options.joint_frequency as Real,
                self.options.joint_damping_ratio as Real,
            ))
            .build();
        if hinge.limited != 0 {
            joint.set_limits(JointAxis::AngX, [hinge.lower as Real, hinge.upper as Real]);
        }
        let joint = if self.options.multibody != 0 {
            let handle = self.physics.multibody_joints.insert(root, child, joint, true);
            Joint::Multibody(handle.ok_or("Rapier refused a multibody joint")?)
        } else {
            if self.options.native_springs != 0 && (hinge.stiffness != 0.0 || hinge.damping != 0.0) {
                joint.set_motor_model(JointAxis::AngX, MotorModel::ForceBased);
                joint.set_motor(
                    JointAxis::AngX,
                    hinge.spring_angle as Real,
                    0.0,
                    hinge.stiffness as Real,
                    hinge.damping as Real,
                );
            }
            Joint::Impulse(self.physics.impulse_joints.insert(root, child, joint, true))
        };
        for body in parent.into_iter().chain([child]) {
            if !self.hinged.contains(&body) {
                self.hinged.push(body);
            }
        }
        self.hinges.push(HingeParts {
            parent,
            child,
            axis: rotation(&hinge.q_child) * Vector::X,
            joint,
            made_from: *hinge,
        });
        Ok(())
    }

    fn add_shape(&mut self, shape: &ShapeSetup) {
        let in_body = pose(&shape.p, &shape.q);
        let radius = shape.radius as Real;
        let builder = match shape.kind {
            0 => ColliderBuilder::ball(radius),
            1 => ColliderBuilder::capsule_z(shape.half_length as Real, radius),
            _ => ColliderBuilder::halfspace(rapier::na::Unit::new_unchecked(Vector::Z)),
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
            .restitution(0.0)
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
        for hinge in &self.hinges {
            let Joint::Multibody(handle) = hinge.joint else { continue };
            let (multibody, _) = self.physics.multibody_joints.get_mut(handle).ok_or("a multibody joint is gone")?;
            multibody.forward_kinematics(&self.physics.bodies, true);
            multibody.damping_mut().fill(0.0); // Rapier gives every joint 0.1 Nms/rad
        }
        for hinge in &self.hinges {
            let Joint::Multibody(handle) = hinge.joint else { continue };
            let (multibody, id) = self.physics.multibody_joints.get_mut(handle).ok_or("a multibody joint is gone")?;
            let link = multibody.link_mut(id).ok_or("a multibody joint has no link")?;
            let dof = link.assembly_id();
            let from = &hinge.made_from;
            link.joint.apply_displacement(&[from.angle as Real]);
            if self.options.native_springs != 0 {
                link.joint.set_spring(AXIS, from.stiffness as Real, from.spring_angle as Real);
                multibody.damping_mut()[dof] = from.damping as Real;
            }
            multibody.armature_mut()[dof] = from.armature as Real;
            multibody.generalized_velocity_mut()[dof] = from.rate as Real;
            if multibody.root().joint().ndofs() == 6 {
                let body = &self.physics.bodies[multibody.root().rigid_body_handle()];
                let (v, w) = (body.linvel(), body.angvel());
                let mut velocity = multibody.generalized_velocity_mut();
                velocity.as_mut_slice()[..6].copy_from_slice(&[v.x, v.y, v.z, w.x, w.y, w.z]);
            }
        }
        for hinge in &self.hinges {
            let Joint::Multibody(handle) = hinge.joint else { continue };
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
        for handle in &self.hinged {
            self.physics.bodies[*handle].reset_torques(false);
        }
        self.torques_set = false;
    }

    fn set_torques(&mut self, torques: &[f64]) {
        if self.torques_set {
            self.reset_torques();
        }
        for (hinge, torque) in self.hinges.iter().zip(torques) {
            if *torque == 0.0 {
                continue;
            }
            let torque = *self.physics.bodies[hinge.child].rotation() * hinge.axis * (*torque as Real);
            self.physics.bodies[hinge.child].add_torque(torque, false);
            if let Some(parent) = hinge.parent {
                self.physics.bodies[parent].add_torque(-torque, false);
            }
            self.torques_set = true;
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

    fn read_hinges(&self, angles: &mut [f64], rates: &mut [f64]) -> Result<(), String> {
        for (j, hinge) in self.hinges.iter().enumerate() {
            let Joint::Multibody(handle) = hinge.joint else {
                return Err("impulse joints have no coordinates".into());
            };
            let (multibody, id) = self.physics.multibody_joints.get(handle).ok_or("a multibody joint is gone")?;
            let link = multibody.link(id).ok_or("a multibody joint has no link")?;
            angles[j] = link.joint().coords()[AXIS] as f64;
            rates[j] = multibody.generalized_velocity()[link.assembly_id()] as f64;
        }
        Ok(())
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

    fn view_hinges(&self, out: &mut [HeldHinge]) -> Result<(), String> {
        for (hinge, held) in self.hinges.iter().zip(out) {
            let data = match hinge.joint {
                Joint::Impulse(handle) => self.physics.impulse_joints.get(handle).map(|joint| &joint.data),
                Joint::Multibody(handle) => {
                    let joint = self.physics.multibody_joints.get(handle);
                    joint.and_then(|(multibody, id)| multibody.link(id)).map(|link| &link.joint.data)
                }
            };
            let data = data.ok_or("a joint is gone")?;
            let frame = *self.physics.bodies[hinge.child].position() * data.local_frame2;
            held.p_world = array3(frame.translation);
            held.axis_world = array3(frame.rotation * Vector::X);
            held.limited = 0;
            if let Some(limits) = data.limits(JointAxis::AngX) {
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

extern "C" fn add_hinge(world: &mut World, hinge: &Hinge) -> c_int {
    status(guarded(|| world.add_hinge(hinge)))
}

extern "C" fn add_shape(world: &mut World, shape: &ShapeSetup) -> c_int {
    status(guarded(|| Ok(world.add_shape(shape))))
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
    let torques = std::slice::from_raw_parts(torques, world.hinges.len());
    status(guarded(|| Ok(world.set_torques(torques))))
}

unsafe extern "C" fn read_bodies(world: &World, out: *mut State) -> c_int {
    let out = std::slice::from_raw_parts_mut(out, world.handles.len());
    status(guarded(|| Ok(world.read_bodies(out))))
}

unsafe extern "C" fn read_hinges(world: &World, angles: *mut f64, rates: *mut f64) -> c_int {
    let angles = std::slice::from_raw_parts_mut(angles, world.hinges.len());
    let rates = std::slice::from_raw_parts_mut(rates, world.hinges.len());
    status(guarded(|| world.read_hinges(angles, rates)))
}

unsafe extern "C" fn view_bodies(world: &World, out: *mut HeldBody) -> c_int {
    let out = std::slice::from_raw_parts_mut(out, world.handles.len());
    status(guarded(|| Ok(world.view_bodies(out))))
}

unsafe extern "C" fn view_hinges(world: &World, out: *mut HeldHinge) -> c_int {
    let out = std::slice::from_raw_parts_mut(out, world.hinges.len());
    status(guarded(|| world.view_hinges(out)))
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
    add_hinge,
    add_shape,
    set_pairs,
    start,
    step,
    set_torques,
    read_bodies,
    read_hinges,
    view_bodies,
    view_hinges,
    view_gravity,
};
