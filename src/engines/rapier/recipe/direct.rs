// A world as a user of Rapier writes it: what the adapter's cost is measured against (benchmarks/direct_rapier.cc).

pub struct Direct {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
    hinges: Vec<(Option<RigidBodyHandle>, RigidBodyHandle, Vector)>, // parent, child, axis in the child
}

impl Direct {
    fn new(options: &Options, bodies: &[Body], hinges: &[JointSetup], shapes: &[ShapeSetup]) -> Self {
        let mut world = PhysicsWorld::new();
        world.gravity = vec3(&options.gravity);
        world.integration_parameters = parameters(options);
        world.narrow_phase = narrow_phase(options);
        let bodies: Vec<_> = bodies
            .iter()
            .map(|body| {
                let frame = rotation(&body.q_body_principal);
                let inertia = vec3(&body.inertia);
                world.insert_body(
                    RigidBodyBuilder::dynamic()
                        .pose(pose(&body.p_world_com, &body.q_world_body))
                        .linvel(vec3(&body.v_world_com))
                        .angvel(vec3(&body.w_world))
                        .additional_mass_properties(MassProperties::with_principal_inertia_frame(
                            Vector::ZERO,
                            body.mass,
                            inertia,
                            frame,
                        ))
                        .can_sleep(false)
                        .allow_fast_rotation(true)
                        .gyroscopic_forces_enabled(true),
                )
            })
            .collect();

        let mut parts = Vec::new();
        let mut joints = Vec::new();
        for hinge in hinges {
            let child = bodies[hinge.child as usize];
            let parent = (hinge.parent >= 0).then(|| bodies[hinge.parent as usize]);
            let root = parent.unwrap_or_else(|| world.insert_body(RigidBodyBuilder::fixed()));
            let joint = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
                .local_frame1(pose(&hinge.p_parent, &hinge.q_parent))
                .local_frame2(pose(&hinge.p_child, &hinge.q_child));
            if options.multibody != 0 {
                joints.extend(world.multibody_joints.insert(root, child, joint, true));
            } else {
                world.impulse_joints.insert(root, child, joint, true);
            }
            parts.push((parent, child, rotation(&hinge.q_child) * Vector::X));
        }

        for shape in shapes {
            let collider = if shape.body < 0 {
                ColliderBuilder::halfspace(rapier::na::Unit::new_unchecked(Vector::Z))
            } else {
                ColliderBuilder::capsule_z(shape.half_length, shape.radius)
            };
            let collider = collider
                .position(pose(&shape.p, &shape.q))
                .density(0.0)
                .friction(shape.friction)
                .friction_combine_rule(CoefficientCombineRule::Max);
            if shape.body < 0 {
                world.colliders.insert(collider);
            } else {
                let body = bodies[shape.body as usize];
                world.colliders.insert_with_parent(collider, body, &mut world.bodies);
            }
        }

        for body in &bodies {
            world.bodies[*body].recompute_mass_properties_from_colliders(&world.colliders);
        }
        for (handle, hinge) in joints.iter().zip(hinges) {
            let Some((multibody, id)) = world.multibody_joints.get_mut(*handle) else { continue };
            multibody.forward_kinematics(&world.bodies, true);
            multibody.damping_mut().fill(0.0);
            let Some(link) = multibody.link_mut(id) else { continue };
            let dof = link.assembly_id();
            link.joint.apply_displacement(&[hinge.position[0]]);
            multibody.generalized_velocity_mut()[dof] = hinge.velocity[0];
            multibody.forward_kinematics(&world.bodies, false);
            multibody.update_rigid_bodies(&mut world.bodies, true);
        }
        Self { world, bodies, hinges: parts }
    }

    fn run(&mut self, count: c_int) {
        for _ in 0..count {
            self.world.step();
        }
    }

    fn run_with_torques(&mut self, torques: &[f64], count: c_int) {
        for _ in 0..count {
            for body in &self.bodies {
                self.world.bodies[*body].reset_torques(false);
            }
            for ((parent, child, axis), torque) in self.hinges.iter().zip(torques) {
                let torque = *self.world.bodies[*child].rotation() * *axis * *torque;
                self.world.bodies[*child].add_torque(torque, false);
                if let Some(parent) = parent {
                    self.world.bodies[*parent].add_torque(-torque, false);
                }
            }
            self.world.step();
        }
    }
}

unsafe extern "C" fn direct_create(
    options: &Options,
    bodies: *const Body,
    body_count: c_int,
    hinges: *const JointSetup,
    hinge_count: c_int,
    shapes: *const ShapeSetup,
    shape_count: c_int,
) -> *mut Direct {
    unsafe fn slice<'a, T>(first: *const T, count: c_int) -> &'a [T] {
        if count == 0 {
            &[]
        } else {
            std::slice::from_raw_parts(first, count as usize)
        }
    }
    let world = Direct::new(options, slice(bodies, body_count), slice(hinges, hinge_count), slice(shapes, shape_count));
    Box::into_raw(Box::new(world))
}

unsafe extern "C" fn direct_destroy(world: *mut Direct) {
    drop(Box::from_raw(world));
}

unsafe extern "C" fn direct_run(world: &mut Direct, torques: *const f64, count: c_int) {
    if torques.is_null() {
        world.run(count);
    } else {
        let torques = std::slice::from_raw_parts(torques, world.hinges.len());
        world.run_with_torques(torques, count);
    }
}

unsafe extern "C" fn direct_positions(world: &Direct, out: *mut f64) {
    let out = std::slice::from_raw_parts_mut(out, 3 * world.bodies.len());
    for (handle, p) in world.bodies.iter().zip(out.chunks_exact_mut(3)) {
        p.copy_from_slice(&array3(world.world.bodies[*handle].translation()));
    }
}

const DIRECT_API: DirectApi<Direct> =
    DirectApi { create: direct_create, destroy: direct_destroy, run: direct_run, positions: direct_positions };
