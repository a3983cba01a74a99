/* One Jolt world behind a C interface that is the same natively and as WebAssembly: everything that crosses it is a
   number or an array of structures of double and int32_t, which are laid out alike on x86-64 and on wasm32. No unit but
   SI; the world frame's z is the model's; quaternions are (w, x, y, z); a body's frame has its origin in the centre of
   mass. */
#pragma once

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  JOLT_SPHERE = 0,
  JOLT_CAPSULE = 1,
  JOLT_PLANE = 2,
  JOLT_BOX = 3,
  JOLT_CYLINDER = 4,
  JOLT_HULL = 5,
  JOLT_MESH = 6
};
enum { JOLT_HINGE = 0, JOLT_SLIDE = 1, JOLT_BALL = 2, JOLT_WELD = 3 };

typedef struct jolt_settings {
  double timestep;             /* s */
  double gravity[3];           /* m/s^2 */
  double baumgarte;            /* part of a position error that one step corrects */
  double penetration_slop;     /* m */
  double speculative_distance; /* m */
  double max_correction;       /* m, of one position iteration */
  double plane_half_extent;    /* m, beyond which a plane is not felt */
  double restitution;          /* of every contact; of two bodies Jolt takes the larger one */
  double restitution_speed;    /* m/s, slower impacts give nothing back */
  int32_t velocity_steps, position_steps, collision_steps;
  int32_t warm_start, pair_cache, gyroscopic;
  int32_t slow_turns;  /* keep turns of at most 1e-6 rad a step, which Jolt drops */
  int32_t inner_edges; /* bodies feel the edges between the triangles of a flat mesh */
} jolt_settings;

typedef struct jolt_body {
  double mass;         /* kg */
  double inertia[3];   /* principal moments about the centre of mass, kg m^2 */
  double q_inertia[4]; /* principal axes in the body frame */
  double p[3], q[4];   /* pose in the world */
  double v[3], w[3];   /* world frame */
} jolt_body;

/* Capsules and cylinders lie along their own y axis; a plane's normal is its own y axis. Planes and meshes belong to
   the world. A hull is given by points, a mesh by points and triangles, whose corners are numbers of points,
   counter-clockwise from outside; both lie in the list of numbers beside the shapes. */
typedef struct jolt_shape {
  double p[3], q[4]; /* in the body frame, in the world for static shapes */
  double radius, half_length;
  double half_size[3]; /* box */
  int32_t type;
  int32_t body;              /* -1: the world */
  int32_t first;             /* of its numbers: 3 a point, then 3 a triangle */
  int32_t points, triangles; /* how many */
  int32_t unused;
} jolt_shape;

typedef struct jolt_pair {
  double friction;
  int32_t shape_a, shape_b;
} jolt_pair;

/* A hinge's or slide's position is zero where the normals coincide or the points do. A ball uses the points only, a
   weld makes points, axes and normals coincide. Hinges and slides come first. */
typedef struct jolt_joint {
  double p_parent[3], axis_parent[3], normal_parent[3]; /* parent's body frame, the world's for parent -1 */
  double p_child[3], axis_child[3], normal_child[3];
  double lower, upper;               /* rad, in [-pi, 0] and [0, pi]; m, not positive and not negative */
  double stiffness, damping, target; /* of Jolt's own motor; no motor when these and armature are 0 */
  double armature, friction;         /* kg m^2, kg; the largest torque or force of dry friction, Nm, N */
  int32_t parent, child;
  int32_t limited;
  int32_t type;
} jolt_joint;

typedef struct jolt_body_state {
  double p[3], q[4], v[3], w[3];
} jolt_body_state;

/* What the engine says it holds. */
typedef struct jolt_body_view {
  double mass;
  double inertia[9]; /* world axes, row by row */
} jolt_body_view;

typedef struct jolt_joint_view {
  double p_child[3], axis_child[3]; /* child's body frame */
  double lower, upper;
  int32_t limited;
  int32_t unused;
} jolt_joint_view;

/* A contact point of the last step. */
typedef struct jolt_contact {
  double p[3];       /* world, where the step began */
  double normal[3];  /* from a to b */
  double gap;        /* m, when the step began */
  double impulse[3]; /* N s, on b */
  int32_t shape_a, shape_b;
} jolt_contact;

typedef struct jolt_world jolt_world;

/* Null when the engine refuses a shape. Hulls of more corners than Jolt allows (256) lose those that stand out least.
 */
jolt_world* jolt_create(const jolt_settings* settings, const jolt_body* bodies, int32_t body_count,
                        const jolt_shape* shapes, int32_t shape_count, const jolt_pair* pairs, int32_t pair_count,
                        const double* numbers, int32_t number_count, const jolt_joint* joints, int32_t joint_count);
void jolt_free(jolt_world* world);

/* `count` calls of the engine's step function. With slow_turns bodies then get the turns that Jolt dropped, once they
   add up to one that it makes. Not 0: the bits of JPH::EPhysicsUpdateError, a cache was too small; -1: the engine
   trapped (WebAssembly). */
int32_t jolt_step(jolt_world* world, int32_t count);

/* One for each body, in the order of creation. */
void jolt_read(jolt_world* world, jolt_body_state* out);

/* Nm about each hinge's axis or N along each slide's on the child, then Nm in world axes for each ball, 3 numbers; the
   opposite acts on the parent. Replaces what was set before, acts for one step. */
void jolt_set_torques(jolt_world* world, const double* torques);

void jolt_view(jolt_world* world, jolt_body_view* bodies, jolt_joint_view* joints, double* gravity);

/* From now on a step leaves what jolt_contacts reads. Not during a run. */
void jolt_keep_contacts(jolt_world* world);

/* Fills at most `room`; returns how many there are. Jolt has one friction for all points of a manifold: it is shared
   out by their normal impulses, and what it turns about the normal is left out. With several collision steps a step,
   those of the last one. -1: the engine trapped (WebAssembly). */
int32_t jolt_contacts(jolt_world* world, jolt_contact* out, int32_t room);

/* Major, minor, patch as 1000000, 1000, 1. */
int32_t jolt_version(void);

#ifdef __cplusplus
}
#endif
