/* One Jolt world behind a C interface that is the same natively and as WebAssembly: everything that crosses it is a
   number or an array of structures of double and int32_t, which are laid out alike on x86-64 and on wasm32. No unit but
   SI; the world frame's z is the model's; quaternions are (w, x, y, z); a body's frame has its origin in the centre of
   mass. */
#pragma once

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { JOLT_SPHERE = 0, JOLT_CAPSULE = 1, JOLT_PLANE = 2 };

typedef struct jolt_settings {
  double timestep;             /* s */
  double gravity[3];           /* m/s^2 */
  double baumgarte;            /* part of a position error that one step corrects */
  double penetration_slop;     /* m */
  double speculative_distance; /* m */
  double max_correction;       /* m, of one position iteration */
  double plane_half_extent;    /* m, beyond which a plane is not felt */
  int32_t velocity_steps, position_steps, collision_steps;
  int32_t warm_start, pair_cache, gyroscopic;
} jolt_settings;

typedef struct jolt_body {
  double mass;         /* kg */
  double inertia[3];   /* principal moments about the centre of mass, kg m^2 */
  double q_inertia[4]; /* principal axes in the body frame */
  double p[3], q[4];   /* pose in the world */
  double v[3], w[3];   /* world frame */
} jolt_body;

/* A capsule lies along its own y axis; a plane's normal is its own y axis and it belongs to the world. */
typedef struct jolt_shape {
  double p[3], q[4]; /* in the body frame, in the world for static shapes */
  double radius, half_length;
  int32_t type;
  int32_t body; /* -1: the world */
} jolt_shape;

typedef struct jolt_pair {
  double friction;
  int32_t shape_a, shape_b;
} jolt_pair;

/* Angle zero where the normals coincide. */
typedef struct jolt_hinge {
  double p_parent[3], axis_parent[3], normal_parent[3]; /* parent's body frame, the world's for parent -1 */
  double p_child[3], axis_child[3], normal_child[3];
  double lower, upper;               /* rad, in [-pi, 0] and [0, pi] */
  double stiffness, damping, target; /* of Jolt's own motor; no motor when both are 0 */
  int32_t parent, child;
  int32_t limited;
  int32_t unused;
} jolt_hinge;

typedef struct jolt_body_state {
  double p[3], q[4], v[3], w[3];
} jolt_body_state;

/* What the engine says it holds. */
typedef struct jolt_body_view {
  double mass;
  double inertia[9]; /* world axes, row by row */
} jolt_body_view;

typedef struct jolt_hinge_view {
  double p_child[3], axis_child[3]; /* child's body frame */
  double lower, upper;
  int32_t limited;
  int32_t unused;
} jolt_hinge_view;

typedef struct jolt_world jolt_world;

/* Null when the engine refuses a shape. */
jolt_world* jolt_create(const jolt_settings* settings, const jolt_body* bodies, int32_t body_count,
                        const jolt_shape* shapes, int32_t shape_count, const jolt_pair* pairs, int32_t pair_count,
                        const jolt_hinge* hinges, int32_t hinge_count);
void jolt_free(jolt_world* world);

/* `count` calls of the engine's step function. Not 0: the bits of JPH::EPhysicsUpdateError, a cache was too small; -1:
   the engine trapped (WebAssembly). */
int32_t jolt_step(jolt_world* world, int32_t count);

/* One for each body, in the order of creation. */
void jolt_read(jolt_world* world, jolt_body_state* out);

/* Nm about each hinge's axis on the child, the opposite on the parent; replaces what was set before, acts for one step.
 */
void jolt_set_torques(jolt_world* world, const double* torques);

void jolt_view(jolt_world* world, jolt_body_view* bodies, jolt_hinge_view* hinges, double* gravity);

/* Major, minor, patch as 1000000, 1000, 1. */
int32_t jolt_version(void);

#ifdef __cplusplus
}
#endif
