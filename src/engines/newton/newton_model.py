"""A model as Newton's builder makes it, and what Newton holds of it."""

import numpy as np
import warp_kernels  # noqa: F401  (sets the device that Newton's kernels are compiled for)
import warp as wp
import newton
from contact_room import dimension

RAW = 1  # mode of `mujoco:solreflimit`: the value as MuJoCo takes it
LIMIT = (0.02, 1.0)  # time constant in s and damping ratio of limits, as of contacts
SIZES = {"sphere": lambda shape: {"radius": shape.radius},
         "capsule": lambda shape: {"radius": shape.radius, "half_height": shape.half_length},
         "cylinder": lambda shape: {"radius": shape.radius, "half_height": shape.half_length},
         "box": lambda shape: dict(zip(("hx", "hy", "hz"), shape.half_size)),
         "ellipsoid": lambda shape: dict(zip(("rx", "ry", "rz"), shape.half_size))}


ROUNDING = 1e-6  # of moments in single precision, relative


def inertia_in_single(I):
    """An inertia whose moments MuJoCo takes after rounding to single precision: it refuses A + B < C, and flat bodies have
    A + B = C."""
    moments, axes = np.linalg.eigh(np.array(I, dtype=float))
    largest = int(np.argmax(moments))
    others = moments.sum() - moments[largest]
    if not others * (1 - ROUNDING) < moments[largest] < others * (1 + ROUNDING):
        return tuple(map(tuple, I))
    moments[largest] = others * (1 - ROUNDING)
    return tuple(map(tuple, (axes * moments @ axes.T).tolist()))


def xyzw(q):
    return [q[1], q[2], q[3], q[0]]


def wxyz(q):
    return [q[3], q[0], q[1], q[2]]


def rotation(q):
    """Of a quaternion (x, y, z, w)."""
    x, y, z, w = np.asarray(q, dtype=float) / np.linalg.norm(np.asarray(q, dtype=float))
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def in_order(model):
    """The bodies, tree by tree, because an articulation's joints follow one another; parents come before children."""
    root = []
    for i, body in enumerate(model.bodies):
        root.append(i if body.parent < 0 else root[body.parent])
    return sorted(range(len(model.bodies)), key=lambda i: (root[i], i)), root


class Built:
    """`engine`, a model of Newton, and where assay's bodies, joints and pairs of shapes are in it. `friction` has the
    coefficient of each shape whose solver takes the mean of two. With `worlds` the engine's model has so many copies, worlds of
    their own; coordinates are those of the first."""

    def __init__(self, model, solver, friction, contacts, worlds=0, device="cpu"):
        self.source, self.is_steel, self.is_mujoco = model, solver == "steel", solver == "mujoco"
        self.builder = builder = self.new_builder()
        order, root = in_order(model)
        self.body_of, self.joint_of_body, trees = {}, {}, {}
        for i in order:
            body = model.bodies[i]
            # a free body's frame lies in its centre of mass, so that its joint's coordinates are those of assay
            com = (0.0, 0.0, 0.0) if body.is_free else tuple(body.p_BBcm)
            self.body_of[i] = builder.add_link(mass=body.mass, com=com, inertia=inertia_in_single(body.I_BBcm_B),
                                               lock_inertia=True)
            self.joint_of_body[i] = self.add_joint(i)
            # couplings act within an articulation alone
            trees.setdefault(0 if model.couplings else root[i], []).append(self.joint_of_body[i])
        for joints in trees.values():
            builder.add_articulation(joints)
        for coupling in model.couplings:
            self.add_coupling(coupling)
        self.add_shapes(friction)
        if self.is_mujoco:
            self.add_pairs_of_mujoco()
        if worlds:
            builder = self.new_builder()
            builder.replicate(self.builder, worlds)
            shapes = self.builder.shape_count
            self.pairs = [(a + world * shapes, b + world * shapes) for world in range(worlds) for a, b in self.pairs]
        self.engine = builder.finalize(device=device, skip_validation_inertia=True)
        self.contacts_of_world = contacts
        self.engine.rigid_contact_max = contacts * max(1, worlds)
        if self.is_steel:
            self.engine.steel.rigid_body_angular_damping.zero_()  # of free bodies: 0.05/s otherwise
            for each in (self.engine.joint_limit_lower, self.engine.joint_limit_upper):
                bounds = each.numpy()  # finite ones have rows in every step, and the builder's largest are 1e10
                bounds[abs(bounds) > 1e9] *= np.inf
                each.assign(bounds)
        self.find_coordinates()

    def new_builder(self):
        builder = newton.ModelBuilder(gravity=tuple(self.source.gravity))
        builder.balance_inertia = False
        if self.is_steel:
            newton.solvers.SolverSteel.register_custom_attributes(builder)
        if self.is_mujoco:
            newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
        return builder

    def offset(self, i):
        """From the origin of the body's frame in assay to that in Newton, in the body's axes."""
        return np.array(self.source.bodies[i].p_BBcm) if i >= 0 and self.source.bodies[i].is_free else np.zeros(3)

    def add_joint(self, i):
        body, child = self.source.bodies[i], self.body_of[i]
        if body.is_free:
            return self.builder.add_joint_free(child)
        joint = self.source.balls[body.ball] if body.ball >= 0 else self.source.joints[body.joint]
        q = xyzw(body.X_PB.q)
        p_PJ = np.array(body.X_PB.p) + rotation(q) @ np.array(joint.p_BJ) - self.offset(body.parent)
        parent = self.body_of[body.parent] if body.parent >= 0 else -1
        has_springs = not self.is_steel  # SolverSteel has no springs of joints
        common = {"parent_xform": wp.transform(tuple(p_PJ), wp.quat(*q)),
                  "child_xform": wp.transform(tuple(joint.p_BJ), wp.quat_identity()), "armature": joint.armature,
                  "friction": joint.dry_friction, "stiffness": joint.stiffness if has_springs else 0.0,
                  "damping": joint.damping if has_springs else 0.0}
        if body.ball >= 0:
            made = self.builder.add_joint_ball(parent, child, **common)
            start = self.builder.joint_q_start[made]
            self.builder.joint_rest_q[start:start + 4] = xyzw(joint.spring_reference)
            return made
        if joint.limited:
            common["limit_lower"], common["limit_upper"] = joint.lower - joint.reference, joint.upper - joint.reference
            if self.is_mujoco:
                common["custom_attributes"] = {"mujoco:solreflimit": [wp.vec2(*LIMIT)], "mujoco:solreflimit_mode": [RAW]}
        add = self.builder.add_joint_prismatic if joint.is_slide else self.builder.add_joint_revolute
        return add(parent, child, axis=tuple(joint.axis_B), rest_q=joint.spring_reference - joint.reference, target_ke=0.0,
                   target_kd=0.0, **common)

    def add_coupling(self, coupling):
        """Newton counts positions from the reference."""
        joints, term = self.source.joints, coupling.terms[0]
        offset = coupling.offset - joints[coupling.joint].reference + term.coefficient * joints[term.joint].reference
        self.builder.set_joint_mimic(self.joint_of_body[joints[coupling.joint].body],
                                     self.joint_of_body[joints[term.joint].body], coeffs=(offset, term.coefficient))

    def add_shapes(self, friction):
        model, self.shape_of = self.source, {}
        for index in sorted({shape for pair in model.contacts for shape in (pair.shape_a, pair.shape_b)}):
            shape = model.shapes[index]
            cfg = newton.ModelBuilder.ShapeConfig(density=0.0, mu=friction.get(index, 1.0))
            if self.is_mujoco:
                cfg.collision_group = 0  # explicit pairs alone
            place = wp.transform(tuple(np.array(shape.X_BS.p) - self.offset(shape.body)), wp.quat(*xyzw(shape.X_BS.q)))
            common = {"xform": place, "cfg": cfg}
            body = self.body_of[shape.body] if shape.body >= 0 else -1
            if shape.type == "plane":
                made = self.builder.add_shape_plane(plane=None, body=body, width=0.0, length=0.0, **common)
            elif shape.type == "hull":
                hull = model.hulls[shape.data]
                mesh = newton.Mesh(np.array(hull.vertices, dtype=np.float32), np.array(hull.faces, dtype=np.int32).flatten(),
                                   compute_inertia=False)
                made = self.builder.add_shape_convex_hull(body, mesh=mesh, **common)
            elif shape.type == "height-field":
                field = model.height_fields[shape.data]
                heights = np.reshape(np.array(field.heights, dtype=np.float32), (field.rows, field.columns))
                made = self.builder.add_shape_heightfield(heightfield=newton.Heightfield(
                    data=heights, nrow=field.rows, ncol=field.columns, hx=field.half_x, hy=field.half_y), **common)
            else:
                add = getattr(self.builder, f"add_shape_{shape.type}")
                made = add(body, **SIZES[shape.type](shape), **common)
            self.shape_of[index] = made
        self.pairs = sorted((min(a, b), max(a, b)) for a, b in (
            (self.shape_of[pair.shape_a], self.shape_of[pair.shape_b]) for pair in model.contacts))

    def add_pairs_of_mujoco(self):
        for pair in self.source.contacts:
            self.builder.add_custom_values(**{
                "mujoco:pair_geom1": self.shape_of[pair.shape_a], "mujoco:pair_geom2": self.shape_of[pair.shape_b],
                "mujoco:pair_world": -1, "mujoco:pair_condim": dimension(pair),
                "mujoco:pair_friction": [pair.friction, pair.friction, pair.torsional, pair.rolling, pair.rolling]})

    def find_coordinates(self):
        model, engine = self.source, self.engine
        q_start, v_start = engine.joint_q_start.numpy(), engine.joint_qd_start.numpy()

        def starts(bodies):
            joints = [self.joint_of_body[i] for i in bodies]
            return [np.array([each[joint] for joint in joints], dtype=int) for each in (q_start, v_start)]

        self.joints = np.array([self.joint_of_body[each.body] for each in model.joints], dtype=int)
        self.joint_q, self.joint_v = starts([each.body for each in model.joints])
        self.reference = np.array([each.reference for each in model.joints], dtype=float)
        self.free = [i for i, body in enumerate(model.bodies) if body.is_free]
        self.free_q, self.free_v = starts(self.free)
        self.ball_q, self.ball_v = starts([each.body for each in model.balls])

    def write(self, state, q, v):
        """Newton's coordinates of a state of assay's."""
        q[self.joint_q], v[self.joint_v] = state.position - self.reference, state.velocity
        for i, start, rate in zip(self.free, self.free_q, self.free_v):
            row = state.bodies[i]
            q[start:start + 3], q[start + 3:start + 7], v[rate:rate + 6] = row[:3], xyzw(row[3:7]), row[7:13]
        for row, start, rate in zip(state.balls, self.ball_q, self.ball_v):
            turn = xyzw(row[:4])
            # Newton's rates are in the axes of the joint's parent
            q[start:start + 4], v[rate:rate + 3] = turn, rotation(turn) @ row[4:7]

    def read(self, q, v):
        """assay's state of Newton's coordinates."""
        bodies, balls = np.zeros((len(self.source.bodies), 13)), np.zeros((len(self.source.balls), 7))
        for i, start, rate in zip(self.free, self.free_q, self.free_v):
            turn = q[start + 3:start + 7]
            bodies[i] = [*q[start:start + 3], *wxyz(turn / np.linalg.norm(turn)), *v[rate:rate + 6]]
        for row, start, rate in zip(balls, self.ball_q, self.ball_v):
            turn = q[start:start + 4] / np.linalg.norm(q[start:start + 4])
            row[:4], row[4:] = wxyz(turn), rotation(turn).T @ v[rate:rate + 3]
        return {"position": q[self.joint_q] + self.reference, "velocity": v[self.joint_v], "bodies": bodies, "balls": balls}

    def view(self, state):
        """Read from the arrays of Newton's model, with the bodies where Newton's own kinematics puts them."""
        engine, placed = self.engine, self.engine.state()
        newton.eval_fk(engine, state.joint_q, state.joint_qd, placed)
        pose = placed.body_q.numpy().astype(float)
        mass, inertia, local = (each.numpy().astype(float) for each in (engine.body_mass, engine.body_inertia, engine.body_com))
        bodies = np.array([self.body_of[i] for i in range(len(self.source.bodies))], dtype=int)
        com, moments, anchor, axis = [], [], [], []
        for b in bodies:
            R = rotation(pose[b, 3:])
            com.append(pose[b, :3] + R @ local[b])
            moments.append(R @ inertia[b] @ R.T)
        child, X_c = engine.joint_child.numpy(), engine.joint_X_c.numpy().astype(float)
        axes = engine.joint_axis.numpy().astype(float)
        for joint, dof in zip(self.joints, self.joint_v):
            R = rotation(pose[child[joint], 3:])
            anchor.append(pose[child[joint], :3] + R @ X_c[joint, :3])
            axis.append(R @ rotation(X_c[joint, 3:]) @ axes[dof])
        lower, upper = (each.numpy().astype(float)[self.joint_v] for each in (engine.joint_limit_lower, engine.joint_limit_upper))
        return {"gravity": engine.gravity.numpy().reshape(-1, 3)[0], "mass": mass[bodies], "com": com, "inertia": moments,
                "anchor": np.reshape(anchor, (-1, 3)), "axis": np.reshape(axis, (-1, 3)),
                "lower": np.where(lower > -1e9, lower + self.reference, -np.inf),
                "upper": np.where(upper < 1e9, upper + self.reference, np.inf)}
