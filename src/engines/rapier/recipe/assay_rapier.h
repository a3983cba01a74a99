/* Rapier's API as far as the adapter needs it, for C++. The library has two tables of functions, one a precision;
 * numbers are doubles in both, SI units, quaternions (x, y, z, w).
 *
 * A world is built in this order: bodies, hinges, shapes, start; indices count from 0 in the order of the calls. A
 * function that returns int returns 0, or 1 when Rapier panicked or switched off a body: then error() has the reason,
 * the world may only be destroyed. */
#ifndef ASSAY_RAPIER_H_
#define ASSAY_RAPIER_H_

#ifdef __cplusplus
extern "C" {
#endif

typedef struct RapierWorld RapierWorld;

typedef struct RapierOptions {
  double timestep;
  double gravity[3];
  int multibody;      /* hinges as multibody joints (joint coordinates) instead of impulse joints */
  int native_springs; /* hinges' springs and dampers by Rapier; otherwise they are ignored */
  int solver_iterations, pgs_iterations, stabilization_iterations;
  double contact_frequency, contact_damping_ratio;               /* Hz, 1 */
  double static_contact_frequency, static_contact_damping_ratio; /* contacts with what is fixed */
  double joint_frequency, joint_damping_ratio;
  double max_corrective_speed; /* m/s */
  double prediction_distance;  /* m */
  double warmstart;            /* of contacts, 0 to 1 */
  int warmstart_joints;
  int contact_recycling;
  int friction_in_bias_pass;
  int coulomb; /* a friction constraint a contact point, instead of one a manifold */
  int gyroscopic;
  int ccd_substeps;
} RapierOptions;

typedef struct RapierBody {
  double mass, inertia[3]; /* principal moments about the centre of mass */
  double q_body_principal[4];
  double p_world_com[3], q_world_body[4], v_world_com[3], w_world[3];
} RapierBody;

typedef struct RapierHinge {
  int parent; /* -1: the world */
  int child;
  /* The joint's frame in the axes of each body, from its centre of mass; x is the axis. They coincide at angle 0. */
  double p_parent[3], q_parent[4], p_child[3], q_child[4];
  int limited;
  double lower, upper;
  double stiffness, spring_angle, damping;
  double armature;    /* multibody joints only */
  double angle, rate; /* at the start; multibody joints only */
} RapierHinge;

enum { RAPIER_SPHERE = 0, RAPIER_CAPSULE = 1, RAPIER_PLANE = 2 };

typedef struct RapierShape {
  int type;
  int body; /* -1: fixed to the world */
  /* In the body's axes from its centre of mass, or in the world. z is a capsule's axis and a plane's normal. */
  double p[3], q[4];
  double radius, half_length;
  double friction;                    /* the larger of two shapes' acts, unless the table of pairs is asked */
  unsigned groups, collides_with;     /* bits */
  int filter_pairs, look_up_friction; /* ask the table of pairs */
} RapierShape;

typedef struct RapierState {
  double p_world_com[3], q_world_body[4], v_world_com[3], w_world[3];
} RapierState;

typedef struct RapierHeldBody {
  double mass, inertia[3], q_body_principal[4], p_world_com[3], q_world_body[4];
} RapierHeldBody;

typedef struct RapierHeldHinge {
  double p_world[3], axis_world[3];
  int limited;
  double lower, upper;
} RapierHeldHinge;

typedef struct RapierApi {
  const char* version;
  const char* (*error)(void);                   /* of this thread's last failure */
  RapierWorld* (*create)(const RapierOptions*); /* null: failed */
  void (*destroy)(RapierWorld*);
  int (*add_body)(RapierWorld*, const RapierBody*);
  int (*add_hinge)(RapierWorld*, const RapierHinge*);
  int (*add_shape)(RapierWorld*, const RapierShape*);
  /* shapes x shapes: the pair's friction, negative where the two may not touch. */
  int (*set_pairs)(RapierWorld*, const double*, int shapes);
  int (*start)(RapierWorld*);
  int (*step)(RapierWorld*, int count);
  /* One a hinge, about the axis on the child, the opposite on the parent; for the next step alone. */
  int (*set_torques)(RapierWorld*, const double*);
  /* All bodies. The velocities of bodies on multibody joints are only right for a tree's first body. */
  int (*read_bodies)(const RapierWorld*, RapierState*);
  int (*read_hinges)(const RapierWorld*, double* angles, double* rates); /* multibody joints only */
  int (*view_bodies)(const RapierWorld*, RapierHeldBody*);
  int (*view_hinges)(const RapierWorld*, RapierHeldHinge*);
  void (*view_gravity)(const RapierWorld*, double*);
} RapierApi;

extern const RapierApi assay_rapier_f32, assay_rapier_f64;

/* For benchmarks: a world in double precision as a user of Rapier writes it in Rust, and its loop. Hinges without
 * limits and springs; capsules in their body's centre of mass, and planes. */
typedef struct RapierDirect RapierDirect;
typedef struct RapierDirectApi {
  RapierDirect* (*create)(const RapierOptions*, const RapierBody*, int, const RapierHinge*, int, const RapierShape*,
                          int);
  void (*destroy)(RapierDirect*);
  void (*run)(RapierDirect*, const double* torques, int count); /* torques may be null */
  void (*positions)(const RapierDirect*, double*);
} RapierDirectApi;

extern const RapierDirectApi assay_rapier_direct;

#ifdef __cplusplus
}
#endif

#endif
