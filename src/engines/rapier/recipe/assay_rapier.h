/* Rapier's API as far as the adapter needs it, for C++. The library has two tables of functions, one a precision;
 * numbers are doubles in both, SI units, quaternions (x, y, z, w).
 *
 * A world is built in this order: bodies, joints, constraints, shapes, start; indices count from 0 in the order of the
 * calls. A function that returns int returns 0, or 1 when Rapier panicked or switched off a body: then error() has the
 * reason, the world may only be destroyed. */
#ifndef ASSAY_RAPIER_H_
#define ASSAY_RAPIER_H_

#ifdef __cplusplus
extern "C" {
#endif

typedef struct RapierWorld RapierWorld;

typedef struct RapierOptions {
  double timestep;
  double gravity[3];
  int multibody;      /* joints as multibody joints (joint coordinates) instead of impulse joints */
  int native_springs; /* springs and dampers of hinges and slides by Rapier; otherwise they are ignored */
  int solver_iterations, pgs_iterations, stabilization_iterations;
  double contact_frequency, contact_damping_ratio;               /* Hz, 1 */
  double static_contact_frequency, static_contact_damping_ratio; /* contacts with what is fixed */
  double joint_frequency, joint_damping_ratio;
  double max_corrective_speed; /* m/s */
  double prediction_distance;  /* m */
  double restitution;          /* of every contact */
  double warmstart;            /* of contacts, 0 to 1 */
  int warmstart_joints;
  int contact_recycling;
  int contact_coherence; /* contact points are kept while they move by less than 1 mm and 1 degree */
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

enum { RAPIER_HINGE = 0, RAPIER_SLIDE = 1, RAPIER_BALL = 2 };

typedef struct RapierJoint {
  int kind;
  int parent; /* -1: the world */
  int child;
  /* The joint's frame in the axes of each body, from its centre of mass; x is the axis. They coincide at position 0. */
  double p_parent[3], q_parent[4], p_child[3], q_child[4];
  int limited;
  double lower, upper;
  double stiffness, spring_position, damping;
  double armature;     /* multibody joints only */
  double dry_friction; /* N, or Nm about each axis that is free */
  /* At the start; multibody joints only. A hinge and a slide have one number; of a ball joint they are the rotation
   * vector and the velocity of the child's frame in the parent's. */
  double position[3], velocity[3];
} RapierJoint;

/* Holds two frames together: all of them, or their origins only. */
typedef struct RapierConstraint {
  int body_a, body_b; /* -1: the world */
  int weld;
  double p_a[3], q_a[4], p_b[3], q_b[4]; /* from the centres of mass, in the bodies' axes */
} RapierConstraint;

enum {
  RAPIER_SPHERE = 0,
  RAPIER_CAPSULE = 1,
  RAPIER_PLANE = 2,
  RAPIER_BOX = 3,
  RAPIER_CYLINDER = 4,
  RAPIER_CONVEX = 5, /* closed convex surface of triangles */
  RAPIER_MESH = 6    /* surface of triangles */
};

typedef struct RapierShape {
  int type;
  int body; /* -1: fixed to the world */
  /* In the body's axes from its centre of mass, or in the world. z is the axis of a capsule and a cylinder and a
   * plane's normal. */
  double p[3], q[4];
  double radius, half_length, half_size[3];
  const double* points; /* three numbers each */
  int point_count;
  const int* triangles; /* three points each */
  int triangle_count;
  double friction;                    /* the larger of two shapes' acts, unless the table of pairs is asked */
  unsigned groups, collides_with;     /* bits */
  int filter_pairs, look_up_friction; /* ask the table of pairs */
} RapierShape;

typedef struct RapierState {
  double p_world_com[3], q_world_body[4], v_world_com[3], w_world[3];
} RapierState;

/* A contact point of the last step. */
typedef struct RapierContact {
  int shape_a, shape_b; /* in the order of the calls of add_shape */
  int body_a, body_b;   /* -1: fixed to the world */
  /* Where the force acts, in world axes: from the centre of mass of each body where the step began, or from the world's
   * origin. */
  double r_a[3], r_b[3];
  double normal[3]; /* from a to b */
  double gap;       /* when the step began */
  /* On b, N s, over all substeps. Across the normal only with coulomb: Rapier gives no friction of its other model. */
  double impulse[3];
} RapierContact;

typedef struct RapierHeldBody {
  double mass, inertia[3], q_body_principal[4], p_world_com[3], q_world_body[4];
} RapierHeldBody;

typedef struct RapierHeldJoint {
  double p_world[3], axis_world[3];
  int limited;
  double lower, upper;
} RapierHeldJoint;

typedef struct RapierApi {
  const char* version;
  const char* (*error)(void);                   /* of this thread's last failure */
  RapierWorld* (*create)(const RapierOptions*); /* null: failed */
  void (*destroy)(RapierWorld*);
  int (*add_body)(RapierWorld*, const RapierBody*);
  int (*add_joint)(RapierWorld*, const RapierJoint*);
  int (*add_constraint)(RapierWorld*, const RapierConstraint*);
  int (*add_shape)(RapierWorld*, const RapierShape*);
  /* shapes x shapes: the pair's friction, negative where the two may not touch. */
  int (*set_pairs)(RapierWorld*, const double*, int shapes);
  int (*start)(RapierWorld*);
  int (*step)(RapierWorld*, int count);
  /* Three a joint: of a hinge the torque about its axis on the child, of a slide the force along it, of a ball joint
   * the torque in the child's axes; the opposite acts on the parent. For the next step alone. */
  int (*set_torques)(RapierWorld*, const double*);
  /* All bodies. The velocities of bodies on multibody joints are only right for a tree's first body. */
  int (*read_bodies)(const RapierWorld*, RapierState*);
  /* Three a joint, as at the start; multibody joints only. The position of a ball joint is not given. */
  int (*read_joints)(const RapierWorld*, double* positions, double* velocities);
  /* Fills at most `room`; `count` gets how many there are. */
  int (*read_contacts)(const RapierWorld*, RapierContact*, int room, int* count);
  int (*view_bodies)(const RapierWorld*, RapierHeldBody*);
  int (*view_joints)(const RapierWorld*, RapierHeldJoint*);
  void (*view_gravity)(const RapierWorld*, double*);
} RapierApi;

extern const RapierApi assay_rapier_f32, assay_rapier_f64;

/* For benchmarks: a world in double precision as a user of Rapier writes it in Rust, and its loop. Hinges without
 * limits and springs; capsules in their body's centre of mass, and planes. */
typedef struct RapierDirect RapierDirect;
typedef struct RapierDirectApi {
  RapierDirect* (*create)(const RapierOptions*, const RapierBody*, int, const RapierJoint*, int, const RapierShape*,
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
