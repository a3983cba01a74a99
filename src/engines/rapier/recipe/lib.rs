//! Rapier behind a C interface (assay_rapier.h), once a precision. The engine itself is the crates rapier3d and
//! rapier3d-f64; nothing of them is changed.

use std::cell::RefCell;
use std::ffi::{c_char, c_int, c_uint, CString};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Once;

// ---- assay_rapier.h ------------------------------------------------------------------------------------------------

#[repr(C)]
#[derive(Clone, Copy)]
pub struct Options {
    timestep: f64,
    gravity: [f64; 3],
    multibody: c_int,
    native_springs: c_int,
    solver_iterations: c_int,
    pgs_iterations: c_int,
    stabilization_iterations: c_int,
    contact_frequency: f64,
    contact_damping_ratio: f64,
    static_contact_frequency: f64,
    static_contact_damping_ratio: f64,
    joint_frequency: f64,
    joint_damping_ratio: f64,
    max_corrective_speed: f64,
    prediction_distance: f64,
    restitution: f64,
    warmstart: f64,
    warmstart_joints: c_int,
    contact_recycling: c_int,
    contact_coherence: c_int,
    friction_in_bias_pass: c_int,
    coulomb: c_int,
    gyroscopic: c_int,
    ccd_substeps: c_int,
}

#[repr(C)]
pub struct Body {
    mass: f64,
    inertia: [f64; 3],
    q_body_principal: [f64; 4],
    p_world_com: [f64; 3],
    q_world_body: [f64; 4],
    v_world_com: [f64; 3],
    w_world: [f64; 3],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct JointSetup {
    kind: c_int,
    parent: c_int,
    child: c_int,
    p_parent: [f64; 3],
    q_parent: [f64; 4],
    p_child: [f64; 3],
    q_child: [f64; 4],
    limited: c_int,
    lower: f64,
    upper: f64,
    stiffness: f64,
    spring_position: f64,
    damping: f64,
    armature: f64,
    dry_friction: f64,
    position: [f64; 3],
    velocity: [f64; 3],
}

#[repr(C)]
pub struct ConstraintSetup {
    body_a: c_int,
    body_b: c_int,
    weld: c_int,
    p_a: [f64; 3],
    q_a: [f64; 4],
    p_b: [f64; 3],
    q_b: [f64; 4],
}

#[repr(C)]
pub struct ShapeSetup {
    kind: c_int,
    body: c_int,
    p: [f64; 3],
    q: [f64; 4],
    radius: f64,
    half_length: f64,
    half_size: [f64; 3],
    points: *const f64,
    point_count: c_int,
    triangles: *const c_int,
    triangle_count: c_int,
    friction: f64,
    groups: c_uint,
    collides_with: c_uint,
    filter_pairs: c_int,
    look_up_friction: c_int,
}

#[repr(C)]
pub struct State {
    p_world_com: [f64; 3],
    q_world_body: [f64; 4],
    v_world_com: [f64; 3],
    w_world: [f64; 3],
}

#[repr(C)]
pub struct ContactPoint {
    shape_a: c_int,
    shape_b: c_int,
    body_a: c_int,
    body_b: c_int,
    r_a: [f64; 3],
    r_b: [f64; 3],
    normal: [f64; 3],
    gap: f64,
    impulse: [f64; 3],
}

#[repr(C)]
pub struct HeldBody {
    mass: f64,
    inertia: [f64; 3],
    q_body_principal: [f64; 4],
    p_world_com: [f64; 3],
    q_world_body: [f64; 4],
}

#[repr(C)]
pub struct HeldJoint {
    p_world: [f64; 3],
    axis_world: [f64; 3],
    limited: c_int,
    lower: f64,
    upper: f64,
}

#[repr(C)]
pub struct Api<W> {
    version: *const c_char,
    error: extern "C" fn() -> *const c_char,
    create: extern "C" fn(&Options) -> *mut W,
    destroy: unsafe extern "C" fn(*mut W),
    add_body: extern "C" fn(&mut W, &Body) -> c_int,
    add_joint: extern "C" fn(&mut W, &JointSetup) -> c_int,
    add_constraint: extern "C" fn(&mut W, &ConstraintSetup) -> c_int,
    add_shape: unsafe extern "C" fn(&mut W, &ShapeSetup) -> c_int,
    set_pairs: unsafe extern "C" fn(&mut W, *const f64, c_int) -> c_int,
    start: extern "C" fn(&mut W) -> c_int,
    step: extern "C" fn(&mut W, c_int) -> c_int,
    set_torques: unsafe extern "C" fn(&mut W, *const f64) -> c_int,
    read_bodies: unsafe extern "C" fn(&W, *mut State) -> c_int,
    read_joints: unsafe extern "C" fn(&W, *mut f64, *mut f64) -> c_int,
    read_contacts: unsafe extern "C" fn(&W, *mut ContactPoint, c_int, &mut c_int) -> c_int,
    view_bodies: unsafe extern "C" fn(&W, *mut HeldBody) -> c_int,
    view_joints: unsafe extern "C" fn(&W, *mut HeldJoint) -> c_int,
    view_gravity: unsafe extern "C" fn(&W, *mut f64),
}

// The tables hold pointers to functions and to a constant text.
unsafe impl<W> Sync for Api<W> {}

#[repr(C)]
pub struct DirectApi<D> {
    create: unsafe extern "C" fn(
        &Options,
        *const Body,
        c_int,
        *const JointSetup,
        c_int,
        *const ShapeSetup,
        c_int,
    ) -> *mut D,
    destroy: unsafe extern "C" fn(*mut D),
    run: unsafe extern "C" fn(&mut D, *const f64, c_int),
    positions: unsafe extern "C" fn(&D, *mut f64),
}

const VERSION: &[u8] = b"0.36.1\0";

// ---- failures ------------------------------------------------------------------------------------------------------

thread_local! {
    static ERROR: RefCell<CString> = RefCell::new(CString::default());
}

extern "C" fn error() -> *const c_char {
    ERROR.with(|e| e.borrow().as_ptr())
}

fn set_error(text: String) {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    ERROR.with(|e| *e.borrow_mut() = text);
}

/// Runs `action`; a panic ends here, as its message and place in ERROR, and never reaches C++.
fn guarded<T>(action: impl FnOnce() -> Result<T, String>) -> Option<T> {
    static HOOK: Once = Once::new();
    // The default hook would print; this one keeps message and place for the caller.
    HOOK.call_once(|| std::panic::set_hook(Box::new(|info| set_error(info.to_string().replace('\n', " ")))));
    match catch_unwind(AssertUnwindSafe(action)) {
        Ok(Ok(value)) => Some(value),
        Ok(Err(text)) => {
            set_error(text);
            None
        }
        Err(_) => None,
    }
}

fn status(outcome: Option<()>) -> c_int {
    c_int::from(outcome.is_none())
}

// ---- the two precisions --------------------------------------------------------------------------------------------

mod single {
    use rapier3d as rapier;
    include!("world.rs");
    #[no_mangle]
    pub static assay_rapier_f32: super::Api<World> = API;
}

mod double {
    use rapier3d_f64 as rapier;
    include!("world.rs");
    include!("direct.rs");
    #[no_mangle]
    pub static assay_rapier_f64: super::Api<World> = API;
    #[no_mangle]
    pub static assay_rapier_direct: super::DirectApi<Direct> = DIRECT_API;
}
