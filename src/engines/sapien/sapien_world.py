"""One running scene of SAPIEN."""

import math

import assay_adapter as assay
import numpy as np
import sapien_import
import sapien_shapes
from lent_mass import Bodies, rotation_of

sapien, physx = sapien_import.load()

NO_LIMIT = 1e16  # of speeds: beyond what any motion reaches, and its square is still a float
MOST = 3e38  # about the largest float
X_ALONG_Z = (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0)  # turns x onto z


def quaternion_of(R):
    """(w, x, y, z) by the largest of its four squares."""
    squares = np.array([np.trace(R), *np.diag(R)])
    k = int(np.argmax(squares))
    if k == 0:
        q = np.array([1 + squares[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        i, j, l = k - 1, k % 3, (k + 1) % 3
        q = np.zeros(4)
        q[0] = R[l, j] - R[j, l]
        q[1 + i] = 1 + R[i, i] - R[j, j] - R[l, l]
        q[1 + j] = R[j, i] + R[i, j]
        q[1 + l] = R[l, i] + R[i, l]
    return q / np.linalg.norm(q)


def x_to(axis):
    """A rotation that turns x onto an axis."""
    axis = np.array(axis) / np.linalg.norm(axis)
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    y = np.cross(axis, other)
    y /= np.linalg.norm(y)
    return np.column_stack([axis, y, np.cross(axis, y)])


class Frame:
    """Of numbers in double precision: SAPIEN's are floats."""

    __slots__ = ("R", "p")

    def __init__(self, R, p):
        self.R, self.p = R, np.asarray(p, dtype=float)

    @staticmethod
    def of(pose):
        return Frame(rotation_of(pose.q), pose.p)

    def __matmul__(self, other):
        return Frame(self.R @ other.R, self.p + self.R @ other.p)

    def inverse(self):
        return Frame(self.R.T, -self.R.T @ self.p)

    def pose(self):
        return sapien.Pose(self.p.astype(np.float32), quaternion_of(self.R).astype(np.float32))


IDENTITY = Frame(np.eye(3), np.zeros(3))


class Tree:
    """An articulation: of a model's joints, their places among its coordinates."""

    __slots__ = ("articulation", "joints", "root")

    def __init__(self, articulation, joints, root):
        self.articulation, self.joints, self.root = articulation, np.array(joints, dtype=int), root


class Simulation:
    def __init__(self, model, state, settings):
        self.model, self.settings = model, settings
        physx.set_scene_config(gravity=np.array(model.gravity, dtype=np.float32), enable_tgs=settings["solver"] == "tgs",
                               enable_pcm=True, enable_ccd=False, enable_enhanced_determinism=False,
                               enable_friction_every_iteration=settings["friction_every_iteration"], cpu_workers=0)
        physx.set_body_config(settings["position_iterations"], settings["velocity_iterations"], 0.0)  # never sleeps
        self.system = physx.PhysxCpuSystem()
        self.system.timestep = settings.timestep
        self.scene = sapien.Scene([self.system])
        self.held = Bodies(model, settings["link_share"])
        # PhysX's frame of a body is its centre of mass with principal axes
        self.inner, self.moments = [], []
        for centre, inertia in zip(self.held.centre, self.held.inertia):
            moments, axes = np.linalg.eigh(inertia)
            if np.linalg.det(axes) < 0:
                axes[:, 2] *= -1
            self.inner.append(Frame(axes, centre))
            self.moments.append(moments)
        self.bodies, self.entities, self.trees, self.single = [], [], [], []
        self.joints = [None] * len(model.joints)
        self.make_bodies()
        self.make_shapes()
        self.make_constraints()
        self.enter(state)
        self.step = self.system.step
        self.rows = np.zeros((len(model.bodies), 13))
        self.position, self.velocity = np.zeros(len(model.joints)), np.zeros(len(model.joints))
        self.reference = np.array([joint.reference for joint in model.joints])
        self.set_state(state)

    # ---- what there is

    def make_bodies(self):
        """Every tree with joints is an articulation, on a link in the world's origin where its root has a joint. A free body
        without children is no articulation."""
        model = self.model
        root_of, jointed = [], set()
        for i, body in enumerate(model.bodies):
            root_of.append(i if body.parent < 0 else root_of[body.parent])
            if not body.is_free:
                jointed.add(root_of[i])
        self.ground_links, links = {}, {}
        for i, body in enumerate(model.bodies):
            if root_of[i] not in jointed:
                made = physx.PhysxRigidDynamicComponent()
                self.single.append(i)
            elif body.parent >= 0:
                made = physx.PhysxArticulationLinkComponent(self.bodies[body.parent])
            elif body.is_free:
                made = physx.PhysxArticulationLinkComponent(None)
            else:
                ground = physx.PhysxArticulationLinkComponent(None)
                ground.joint.type = "fixed"
                self.ground_links[i] = ground
                made = physx.PhysxArticulationLinkComponent(ground)
            self.bodies.append(made)
            self.prepare(made, i)
            if not body.is_free:
                self.make_joint(made.joint, body)
            links.setdefault(root_of[i], []).append(i)
        self.members = {root: links[root] for root in sorted(jointed)}

    def prepare(self, made, i):
        made.mass = self.held.mass[i]
        made.inertia = self.moments[i].astype(np.float32)
        made.cmass_local_pose = sapien.Pose()
        made.linear_damping = made.angular_damping = 0.0
        made.max_linear_velocity = made.max_angular_velocity = NO_LIMIT
        made.max_depenetration_velocity = NO_LIMIT

    def make_joint(self, made, body):
        own = self.model.joints[body.joint]
        self.joints[body.joint] = made
        on_body = Frame(x_to(own.axis_B), own.p_BJ)
        on_parent = Frame.of(body.X_PB) @ on_body
        if body.parent >= 0:
            on_parent = self.inner[body.parent].inverse() @ on_parent
        made.type = "prismatic" if own.is_slide else "revolute_unwrapped"
        made.pose_in_parent, made.pose_in_child = on_parent.pose(), (self.inner[self.index(body)].inverse() @ on_body).pose()
        made.friction = 0.0
        made.max_velocity = MOST
        lower, upper = (own.lower, own.upper) if own.limited else (-math.inf, math.inf)
        made.set_limits(np.array([[lower - own.reference, upper - own.reference]], dtype=np.float32))
        made.set_armature(np.array([own.armature], dtype=np.float32))
        if own.has_spring and self.settings["pd"] == "native":
            made.set_drive_properties(own.stiffness, own.damping, MOST, "force")
            made.set_drive_target(own.spring_reference - own.reference)
        elif own.dry_friction > 0:  # a damper that stops the joint within a step, with no more than that force
            made.set_drive_properties(0.0, 1e20, own.dry_friction, "force")

    def index(self, body):
        return self.model.joints[body.joint].body

    def make_shapes(self):
        model = self.model
        parts = sapien_shapes.Parts(model)
        if parts.groups is None:
            raise assay.Unsupported("SAPIEN's collision groups cannot tell the model's contact pairs apart")
        self.offset = self.settings["contact_offset"] * sapien_shapes.mean_extent(model)
        self.shape_of, self.ground, materials = {}, physx.PhysxRigidStaticComponent(), {}
        for (index, friction), groups in zip(parts.of, parts.groups):
            if friction not in materials:
                materials[friction] = physx.PhysxMaterial(friction, friction, 0.0)
            shape = model.shapes[index]
            made, inner = self.make_shape(shape, materials[friction])
            frame = Frame.of(shape.X_BS) @ inner
            if shape.body >= 0:
                frame = self.inner[shape.body].inverse() @ frame
            made.local_pose = frame.pose()
            made.contact_offset, made.rest_offset = self.offset, 0.0
            made.set_collision_groups(groups)
            (self.bodies[shape.body] if shape.body >= 0 else self.ground).attach(made)
            self.shape_of[made] = index

    def make_shape(self, shape, material):
        """The shape, and its frame in the model's."""
        along = Frame(rotation_of(X_ALONG_Z), np.zeros(3))
        if shape.type == "sphere":
            return physx.PhysxCollisionShapeSphere(shape.radius, material), IDENTITY
        if shape.type == "capsule":
            return physx.PhysxCollisionShapeCapsule(shape.radius, shape.half_length, material), along
        if shape.type == "plane":
            return physx.PhysxCollisionShapePlane(material), along
        if shape.type == "box":
            return physx.PhysxCollisionShapeBox(np.array(shape.half_size, dtype=np.float32), material), IDENTITY
        if shape.type == "height-field":
            vertices, triangles = sapien_shapes.field_mesh(self.model.height_fields[shape.data])
            return physx.PhysxCollisionShapeTriangleMesh(np.array(vertices, dtype=np.float32), np.array(triangles, dtype=np.uint32),
                                                         np.ones(3, dtype=np.float32), material), IDENTITY
        vertices = np.array(sapien_shapes.prism(shape) if shape.type == "cylinder" else self.model.hulls[shape.data].vertices)
        # about the origin and 2 m large, because PhysX's tolerances for making a hull are lengths
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        centre, half = (low + high) / 2, (high - low).max() / 2
        return (physx.PhysxCollisionShapeConvexMesh(((vertices - centre) / half).astype(np.float32), np.full(3, half, dtype=np.float32),
                                                    material), Frame(np.eye(3), centre))

    def make_constraints(self):
        self.constraints = []
        for each in self.model.connects:
            at_a, at_b = Frame(np.eye(3), each.p_A), Frame(np.eye(3), each.p_B)
            self.hold(each.body_a, at_a, each.body_b, at_b, "xyz")
        for each in self.model.welds:
            # six rows of three joints, because SAPIEN cannot lock the rotations of one
            between = Frame.of(each.X_AB)
            at_b, reach = self.weld_place(each, between)
            for axes, way in (("xyz", (0, 0, 0)), ("yz", (reach, 0, 0)), ("z", (0, reach, 0))):
                on_b = at_b @ Frame(np.eye(3), way)
                self.hold(each.body_a, between @ on_b, each.body_b, on_b, axes)

    def weld_place(self, weld, between):
        """Where a weld holds, in body b: the centre of mass of the lighter body, and a radius of its inertia."""
        a, b = weld.body_a, weld.body_b
        held = self.held
        at_a = b < 0 or a >= 0 and held.mass[a] < held.mass[b]
        lighter = a if at_a else b
        centre = Frame(np.eye(3), held.centre[lighter])
        at_b = between.inverse() @ centre if at_a else centre
        return Frame(np.eye(3), at_b.p), math.sqrt(np.trace(held.inertia[lighter]) / 2 / held.mass[lighter])

    def hold(self, a, at_a, b, at_b, axes):
        """Locks ways between two bodies along axes of a frame that both carry. One of them may be the world."""
        carrier, other = (a, b) if b < 0 else (b, a)
        on_carrier, on_other = (at_a, at_b) if carrier == a else (at_b, at_a)
        joint = physx.PhysxDriveComponent(self.bodies[carrier])
        joint.pose_in_child = (self.inner[carrier].inverse() @ on_carrier).pose()
        joint.pose_in_parent = (on_other if other < 0 else self.inner[other].inverse() @ on_other).pose()
        for axis in axes:
            getattr(joint, f"set_limit_{axis}")(0.0, 0.0)
        self.constraints.append((carrier, other, joint))

    # ---- its state

    def enter(self, state):
        """Everything into the scene; a body is placed before, because some of PhysX's structures begin there."""
        def add(component, frame, more=()):
            entity = sapien.Entity()
            entity.add_component(component)
            for each in more:
                entity.add_component(each)
            entity.pose = frame.pose()
            self.entities.append(entity)
            self.scene.add_entity(entity)

        if self.ground.collision_shapes:
            add(self.ground, IDENTITY)
        for _, other, joint in self.constraints:
            if other >= 0:
                joint.parent = self.bodies[other]
        for i, body in enumerate(self.bodies):
            if i in self.ground_links:
                add(self.ground_links[i], IDENTITY)
            add(body, self.frame_in(state, i), [joint for carrier, _, joint in self.constraints if carrier == i])
        for root, members in self.members.items():
            articulation = self.bodies[root].articulation
            number = {link: k for k, link in enumerate(each.child_link for each in articulation.active_joints)}
            at = [None] * len(number)
            for i in members:
                if not self.model.bodies[i].is_free:
                    at[number[self.bodies[i]]] = self.model.bodies[i].joint
            self.trees.append(Tree(articulation, at, root if self.model.bodies[root].is_free else -1))

    def frame_in(self, state, i):
        row = state.bodies[i]
        R = rotation_of(row[3:7])
        shift = self.held.centre[i] - np.array(self.model.bodies[i].p_BBcm)
        return Frame(R @ self.inner[i].R, row[:3] + R @ shift)

    def velocity_in(self, state, i):
        """Of PhysX's centre of mass, which is another than the model's for a massless body."""
        row = state.bodies[i]
        shift = rotation_of(row[3:7]) @ (self.held.centre[i] - np.array(self.model.bodies[i].p_BBcm))
        return (row[7:10] + np.cross(row[10:13], shift)).astype(np.float32), row[10:13].astype(np.float32)

    def set_state(self, state):
        for i in self.single:
            self.bodies[i].linear_velocity, self.bodies[i].angular_velocity = self.velocity_in(state, i)
        for tree in self.trees:
            own, root = tree.articulation, tree.root
            if root >= 0:
                own.root_pose = self.frame_in(state, root).pose()
                own.root_linear_velocity, own.root_angular_velocity = self.velocity_in(state, root)
            own.qpos = (state.position - self.reference)[tree.joints].astype(np.float32)
            own.qvel = state.velocity[tree.joints].astype(np.float32)

    def set_torques(self, torques):
        for tree in self.trees:
            tree.articulation.qf = torques[tree.joints].astype(np.float32)

    def advance(self, count):
        step = self.step
        for _ in range(count):
            step()

    def read_state(self):
        for tree in self.trees:
            own = tree.articulation
            self.position[tree.joints], self.velocity[tree.joints] = own.qpos, own.qvel
            if tree.root >= 0:
                self.read_body(tree.root, own.root_pose, own.root_linear_velocity, own.root_angular_velocity)
        for i in self.single:
            body = self.bodies[i]
            self.read_body(i, body.entity_pose, body.linear_velocity, body.angular_velocity)
        return {"position": self.position + self.reference, "velocity": self.velocity, "bodies": self.rows}

    def read_body(self, i, pose, velocity, spin):
        row = self.rows[i]
        R = rotation_of(pose.q) @ self.inner[i].R.T
        shift = R @ (np.array(self.model.bodies[i].p_BBcm) - self.held.centre[i])
        row[:3], row[3:7] = pose.p + shift, quaternion_of(R)
        row[7:10], row[10:13] = velocity + np.cross(spin, shift), spin

    # ---- contacts

    def keep_contacts(self):
        pass  # SAPIEN always keeps them

    def contacts(self):
        rows = []
        for contact in self.system.get_contacts():
            first, second = (self.shape_of[shape] for shape in contact.shapes)
            sign = 1.0 if first > second else -1.0  # normal and impulse are those of the first shape
            for point in contact.points:
                rows.append([min(first, second), max(first, second), *point.position, *(sign * point.normal), point.separation,
                             *(sign * point.impulse)])
        return sorted(rows)  # SAPIEN's order is that of addresses

    def view(self):
        held = self.held
        mass, com, inertia = [], [], []
        for body in self.bodies:
            pose = body.entity_pose
            R = rotation_of(pose.q)
            mass.append(body.mass)
            com.append(pose.p)
            inertia.append(R @ np.diag(body.inertia) @ R.T)
        for i, lender in enumerate(held.lender):
            if lender >= 0:
                mass[lender] += mass[i]
                mass[i] = 0.0
        inertia = [each / kept for each, kept in zip(inertia, held.kept)]
        anchor, axis, lower, upper = [], [], [], []
        for joint, reference in zip(self.joints, self.reference):
            pose = joint.global_pose
            anchor.append(pose.p)
            axis.append(rotation_of(pose.q)[:, 0])
            (low, high), = joint.limits
            lower.append(low + reference)
            upper.append(high + reference)
        return {"gravity": self.system.config.gravity, "mass": mass, "com": com, "inertia": inertia, "anchor": anchor, "axis": axis,
                "lower": lower, "upper": upper}
