"""A model as MuJoCo's compiler makes it, for the engines that take an mjModel: the same choices as the adapter in
src/engines/mujoco."""

import mujoco as mj
import numpy as np
from contact_room import dimension

MOST_FREEDOMS = 6  # in one body of MuJoCo's
EPSILON = 1e-14


def product(a, b):
    """Of quaternions (w, x, y, z)."""
    w, x, y, z = a
    return np.array([w * b[0] - x * b[1] - y * b[2] - z * b[3], w * b[1] + x * b[0] + y * b[3] - z * b[2],
                     w * b[2] - x * b[3] + y * b[0] + z * b[1], w * b[3] + x * b[2] - y * b[1] + z * b[0]])


def conjugate(q):
    return np.array([q[0], -q[1], -q[2], -q[3]])


def turned(q, v):
    """v rotated by the unit quaternion q."""
    u = np.asarray(q[1:])
    t = 2 * np.cross(u, v)
    return np.asarray(v) + q[0] * t + np.cross(u, t)


def unit(q):
    return np.asarray(q, dtype=float) / np.linalg.norm(q)


class Pose:
    def __init__(self, p=(0, 0, 0), q=(1, 0, 0, 0)):
        self.p, self.q = np.array(p, dtype=float), np.array(q, dtype=float)

    def __matmul__(self, other):
        return Pose(self.p + turned(self.q, other.p), product(self.q, other.q))

    def inverse(self):
        q = conjugate(self.q)
        return Pose(-turned(q, self.p), q)


def pose_of(X):
    return Pose(X.p, X.q)


def weld_frames(model, weld):
    """Where the weld holds its bodies, in each: as model/weld_frames.h, the centre of mass of the lighter body."""
    mass_a, mass_b = (0 if body < 0 else model.bodies[body].mass for body in (weld.body_a, weld.body_b))
    at_a = mass_b <= 0 or mass_a < mass_b if mass_a > 0 else weld.body_b < 0
    X_AB = pose_of(weld.X_AB)
    if at_a:
        X_BS = Pose((X_AB.inverse() @ Pose(model.bodies[weld.body_a].p_BBcm)).p)
    else:
        X_BS = Pose() if weld.body_b < 0 else Pose(model.bodies[weld.body_b].p_BBcm)
    return X_AB @ X_BS, X_BS


class Tree:
    """Which of MuJoCo's bodies carries each body's joint: a massless body with one child shares its child's, because MuJoCo's
    bodies have several joints and its compiler takes no moving body without mass."""

    def __init__(self, model):
        count = len(model.bodies)
        children, only_child = [0] * count, [-1] * count
        for i, body in enumerate(model.bodies):
            if body.parent >= 0:
                children[body.parent] += 1
                only_child[body.parent] = i
        ends = {body for hold in [*model.connects, *model.welds] for body in (hold.body_a, hold.body_b)}
        self.carrier, self.X_BC = [0] * count, [Pose() for _ in range(count)]
        self.parent, self.X_PC = [-1] * count, [Pose() for _ in range(count)]
        freedoms, turns, head = [0] * count, [False] * count, [0] * count
        for i in reversed(range(count)):  # a chain's end first
            body = model.bodies[i]
            is_ball, carrier = body.ball >= 0, i
            own = 3 if is_ball else 1
            if body.is_massless and not body.is_free and children[i] == 1 and i not in ends:
                following = self.carrier[only_child[i]]
                if freedoms[following] + own <= MOST_FREEDOMS and not (is_ball and turns[following]):
                    carrier = following
            self.carrier[i] = carrier
            if carrier != i:
                self.X_BC[i] = pose_of(model.bodies[only_child[i]].X_PB) @ self.X_BC[only_child[i]]
            head[carrier] = i
            freedoms[carrier] += own
            turns[carrier] = turns[carrier] or is_ball or (body.joint >= 0 and not model.joints[body.joint].is_slide)
        for i in range(count):
            if self.carrier[i] == i:
                first = model.bodies[head[i]]
                self.parent[i] = first.parent
                self.X_PC[i] = pose_of(first.X_PB) @ self.X_BC[head[i]] if head[i] != i else pose_of(first.X_PB)


def contact_of(pair):
    return (dimension(pair), pair.friction, pair.torsional, pair.rolling)


class Plan:
    """How contacts are found: by MuJoCo's broad phase where each two bodies collide with all of their shapes or with none,
    with the friction that MuJoCo's rules give, and from a list of pairs otherwise."""

    def __init__(self, model, tree):
        self.shapes = sorted({shape for pair in model.contacts for shape in (pair.shape_a, pair.shape_b)})
        # of each shape the smallest of its pairs: if any give every pair its own as the larger of two, these do
        self.contact = {}
        for pair in model.contacts:
            of_pair = contact_of(pair)
            for shape in (pair.shape_a, pair.shape_b):
                self.contact[shape] = tuple(map(min, self.contact.get(shape, of_pair), of_pair))
        self.apart, self.filter_parents = [], True
        self.broad_phase = bool(model.contacts) and self.try_broad_phase(model, tree)
        if not self.broad_phase:
            self.apart, self.filter_parents = [], True

    def try_broad_phase(self, model, tree):
        shapes, wanted = {}, {}
        for shape in self.shapes:
            body = model.shapes[shape].body
            shapes[body] = shapes.get(body, 0) + 1
        for pair in model.contacts:
            a, b = model.shapes[pair.shape_a], model.shapes[pair.shape_b]
            if tuple(map(max, self.contact[pair.shape_a], self.contact[pair.shape_b])) != contact_of(pair):
                return False
            key = (min(a.body, b.body), max(a.body, b.body))
            wanted[key] = wanted.get(key, 0) + 1

        def related(a, b):
            return a >= 0 and tree.parent[b] == a

        for (a, b), count in wanted.items():
            if a == b or count != shapes[a] * shapes[b]:
                return False
            if related(a, b):
                self.filter_parents = False
        bodies = sorted(shapes)
        for i, a in enumerate(bodies):
            for b in bodies[i + 1:]:
                if (a, b) not in wanted and not (self.filter_parents and related(a, b)):
                    self.apart.append((a, b))
        return True


def principal(I):
    """Moments that MuJoCo takes (it refuses A + B < C, which the last digit of a flat body's may say), and their axes."""
    moments, axes = np.linalg.eigh(np.array(I))
    if np.linalg.det(axes) < 0:
        axes[:, 2] *= -1
    largest = int(np.argmax(moments))
    others = moments.sum() - moments[largest]
    if others < moments[largest] < others * (1 + EPSILON):
        moments[largest] = others
    q = np.zeros(4)
    mj.mju_mat2Quat(q, axes.flatten())
    return moments, q


def body_label(body):
    return "world" if body < 0 else f"body{body}"


GEOMS = {"sphere": mj.mjtGeom.mjGEOM_SPHERE, "capsule": mj.mjtGeom.mjGEOM_CAPSULE, "plane": mj.mjtGeom.mjGEOM_PLANE,
         "box": mj.mjtGeom.mjGEOM_BOX, "cylinder": mj.mjtGeom.mjGEOM_CYLINDER, "ellipsoid": mj.mjtGeom.mjGEOM_ELLIPSOID,
         "hull": mj.mjtGeom.mjGEOM_MESH, "height-field": mj.mjtGeom.mjGEOM_HFIELD}


def size_of(shape):
    if shape.type == "plane":
        return [0, 0, 1]  # spacing of drawn grid lines; the plane is infinite
    if shape.type in ("box", "ellipsoid"):
        return shape.half_size
    return [shape.radius, shape.half_length, 0]


class Compiled:
    """`mujoco`, an MjModel, and where the model's parts are in it. `set_options(option)` sets what MuJoCo's option has,
    gravity apart."""

    def __init__(self, model, set_options):
        self.model, self.tree = model, Tree(model)
        self.spec = spec = mj.MjSpec()
        spec.compiler.degree = False
        spec.compiler.inertiafromgeom = mj.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
        spec.compiler.usethread = False
        spec.option.gravity = model.gravity
        set_options(spec.option)
        self.plan = plan = Plan(model, self.tree)
        if not plan.filter_parents:
            spec.option.disableflags |= mj.mjtDisableBit.mjDSBL_FILTERPARENT
        self.bodies, self.massless, self.sites = {}, [], 0
        for i in range(len(model.bodies)):
            self.add_joint(i)
        self.add_shape_data()
        for shape in plan.shapes:
            self.add_shape(shape)
        self.add_pairs()
        for i, coupling in enumerate(model.couplings):
            self.add_coupling(i, coupling)
        for connect in model.connects:
            self.add_hold(mj.mjtEq.mjEQ_CONNECT, connect.body_a, Pose(connect.p_A), connect.body_b, Pose(connect.p_B))
        for weld in model.welds:
            X_AS, X_BS = weld_frames(model, weld)
            self.add_hold(mj.mjtEq.mjEQ_WELD, weld.body_a, X_AS, weld.body_b, X_BS)
        for i, tendon in enumerate(model.tendons):
            self.add_tendon(i, tendon)
        self.mujoco = spec.compile()
        self.find_addresses()
        self.set_what_a_spec_cannot_say()

    def body(self, index):
        return self.spec.worldbody if index < 0 else self.bodies[self.tree.carrier[index]]

    def add_joint(self, index):
        """Of body `index`, after the MuJoCo body that it moves where that one is not there yet."""
        own, carrier = self.model.bodies[index], self.tree.carrier[index]
        if carrier not in self.bodies:
            self.bodies[carrier] = self.add_body(carrier)
        X_CB, name = self.tree.X_BC[index].inverse(), f"joint of {index}"
        if own.is_free:
            self.bodies[carrier].add_joint(name=name, type=mj.mjtJoint.mjJNT_FREE, align=mj.mjtAlignFree.mjALIGNFREE_FALSE)
            return
        part = self.model.balls[own.ball] if own.ball >= 0 else self.model.joints[own.joint]
        joint = self.bodies[carrier].add_joint(name=name, pos=X_CB.p + turned(X_CB.q, part.p_BJ))
        joint.margin = 0
        joint.stiffness[0], joint.damping[0] = part.stiffness, part.damping
        joint.armature, joint.frictionloss = part.armature, part.dry_friction
        joint.limited = mj.mjtLimited.mjLIMITED_TRUE if part.limited else mj.mjtLimited.mjLIMITED_FALSE
        if own.ball >= 0:
            joint.type = mj.mjtJoint.mjJNT_BALL
            joint.range = [0, part.upper]
            return
        joint.type = mj.mjtJoint.mjJNT_SLIDE if part.is_slide else mj.mjtJoint.mjJNT_HINGE
        joint.axis = turned(X_CB.q, part.axis_B)
        joint.ref, joint.springref = part.reference, part.spring_reference
        joint.range = [part.lower, part.upper if part.lower < part.upper else part.lower + 1]

    def add_body(self, carrier):
        X_PC, own = self.tree.X_PC[carrier], self.model.bodies[carrier]
        body = self.body(self.tree.parent[carrier]).add_body(name=body_label(carrier), pos=X_PC.p, quat=X_PC.q)
        body.explicitinertial = True
        if own.is_massless:  # MuJoCo's compiler takes no moving body without mass, its engine does
            body.mass, body.inertia = 1, [1, 1, 1]
            self.massless.append(carrier)
        else:
            body.mass, body.ipos = own.mass, own.p_BBcm
            body.inertia, body.iquat = principal(own.I_BBcm_B)
        return body

    def add_shape_data(self):
        model, added = self.model, set()
        for index in self.plan.shapes:
            shape = model.shapes[index]
            if shape.data < 0 or (shape.type, shape.data) in added:
                continue
            added.add((shape.type, shape.data))
            if shape.type == "hull":
                hull = model.hulls[shape.data]
                self.spec.add_mesh(name=f"hull{shape.data}", inertia=mj.mjtMeshInertia.mjMESH_INERTIA_CONVEX, maxhullvert=-1,
                                   uservert=np.array(hull.vertices, dtype=float).flatten(),
                                   userface=np.array(hull.faces, dtype=int).flatten())
            elif shape.type == "height-field":  # heights are scaled to a range of 0 to 1, and there is no flat field
                field = model.height_fields[shape.data]
                low = min(field.heights)
                extent = max(field.heights) - low
                self.spec.add_hfield(name=f"field{shape.data}", nrow=field.rows, ncol=field.columns, size=[
                    field.half_x, field.half_y, extent or 1, max(field.base + low, 1e-6)],
                    userdata=[(height - low) / (extent or 1) for height in field.heights])

    def add_shape(self, index):
        shape = self.model.shapes[index]
        dimensions, friction, torsional, rolling = self.plan.contact[index]
        collides = 1 if self.plan.broad_phase else 0
        geom = self.body(shape.body).add_geom(name=f"shape{index}", type=GEOMS[shape.type], pos=shape.X_BS.p,
                                              quat=shape.X_BS.q, condim=dimensions, contype=collides, conaffinity=collides)
        if shape.type == "hull":  # MuJoCo moves a mesh to its principal axes and the geom the other way
            geom.meshname = f"hull{shape.data}"
        elif shape.type == "height-field":
            geom.hfieldname = f"field{shape.data}"
            geom.pos = (pose_of(shape.X_BS) @ Pose([0, 0, min(self.model.height_fields[shape.data].heights)])).p
        else:
            geom.size = size_of(shape)
        geom.friction[0] = friction
        if dimensions > 3:
            geom.friction[1:] = torsional, rolling

    def add_pairs(self):
        if self.plan.broad_phase:
            for a, b in self.plan.apart:
                self.spec.add_exclude(bodyname1=body_label(a), bodyname2=body_label(b))
            return
        for contact in self.model.contacts:
            pair = self.spec.add_pair(geomname1=f"shape{contact.shape_a}", geomname2=f"shape{contact.shape_b}",
                                      condim=dimension(contact), margin=0, gap=0)
            pair.friction[0] = pair.friction[1] = contact.friction
            if pair.condim > 3:
                pair.friction[2] = contact.torsional
                pair.friction[3] = pair.friction[4] = contact.rolling

    def joint_label(self, joint):
        return f"joint of {self.model.joints[joint].body}"

    def add_path(self, terms, name):
        """A fixed tendon, which names each joint once."""
        coefficients = {}
        for joint, coefficient in terms:
            coefficients[joint] = coefficients.get(joint, 0) + coefficient
        tendon = self.spec.add_tendon(name=name)
        for joint, coefficient in sorted(coefficients.items()):
            tendon.wrap_joint(self.joint_label(joint), coefficient)
        return tendon

    def add_coupling(self, index, coupling):
        """MuJoCo counts positions in an equality from those at the reference."""
        joints = self.model.joints
        equality = self.spec.add_equality()
        data = np.zeros(len(equality.data))
        data[0] = coupling.offset - joints[coupling.joint].reference + sum(
            term.coefficient * joints[term.joint].reference for term in coupling.terms)
        if len(coupling.terms) > 1:
            self.add_path([(coupling.joint, 1), *((term.joint, -term.coefficient) for term in coupling.terms)],
                          f"coupling{index}")
            equality.type, equality.name1 = mj.mjtEq.mjEQ_TENDON, f"coupling{index}"
            equality.objtype = mj.mjtObj.mjOBJ_TENDON
        else:
            equality.type, equality.name1 = mj.mjtEq.mjEQ_JOINT, self.joint_label(coupling.joint)
            equality.objtype = mj.mjtObj.mjOBJ_JOINT
            if coupling.terms:
                equality.name2, data[1] = self.joint_label(coupling.terms[0].joint), coupling.terms[0].coefficient
        equality.data = data

    def add_hold(self, kind, body_a, X_AS, body_b, X_BS):
        """A connect or weld of a frame of one body to a frame of another."""
        equality = self.spec.add_equality(type=kind, objtype=mj.mjtObj.mjOBJ_SITE)
        equality.name1, equality.name2 = self.add_site(body_a, X_AS), self.add_site(body_b, X_BS)

    def add_site(self, body, X_BS):
        name = f"site{self.sites}"
        self.sites += 1
        self.body(body).add_site(name=name, pos=X_BS.p, quat=X_BS.q)
        return name

    def add_tendon(self, index, tendon):
        """Without its spring: the host adds its tension to the torques."""
        if not tendon.terms or not (tendon.limited or tendon.dry_friction):
            return
        made = self.add_path([(term.joint, term.coefficient) for term in tendon.terms], f"tendon{index}")
        made.limited = mj.mjtLimited.mjLIMITED_TRUE if tendon.limited else mj.mjtLimited.mjLIMITED_FALSE
        made.range, made.margin, made.frictionloss = [tendon.lower, tendon.upper], 0, tendon.dry_friction

    def find_addresses(self):
        model, m = self.model, self.mujoco
        joint = [m.joint(f"joint of {i}") for i in range(len(model.bodies))]
        qpos, dof = [j.qposadr[0] for j in joint], [j.dofadr[0] for j in joint]
        self.body_id = [-1 if body.is_massless else m.body(body_label(i)).id for i, body in enumerate(model.bodies)]
        self.joint_id = np.array([joint[each.body].id for each in model.joints], dtype=int)
        self.joint_qpos = np.array([qpos[each.body] for each in model.joints], dtype=int)
        self.joint_dof = np.array([dof[each.body] for each in model.joints], dtype=int)
        self.balls = [(qpos[ball.body], dof[ball.body], self.tree.X_BC[ball.body].q) for ball in model.balls]
        self.free = [(i, qpos[i], dof[i], np.array(body.p_BBcm)) for i, body in enumerate(model.bodies) if body.is_free]

    def set_what_a_spec_cannot_say(self):
        m = self.mujoco
        if self.massless:
            for carrier in self.massless:
                m.body(body_label(carrier)).mass[:] = 0
                m.body(body_label(carrier)).inertia[:] = 0
            mj.mj_setConst(m, mj.MjData(m))
        for id, joint in zip(self.joint_id, self.model.joints):
            if joint.limited:
                m.jnt_range[id, 1] = joint.upper  # may be the lower one
        for (qpos, _, q_BC), ball in zip(self.balls, self.model.balls):
            m.qpos_spring[qpos:qpos + 4] = product(product(conjugate(q_BC), ball.spring_reference), q_BC)

    # ---- state ---------------------------------------------------------------------------------------------------------

    def coordinates(self, state):
        """qpos and qvel."""
        q, v = np.array(self.mujoco.qpos0), np.zeros(self.mujoco.nv)
        q[self.joint_qpos], v[self.joint_dof] = state.position, state.velocity
        for (qpos, dof, q_BC), row in zip(self.balls, state.balls):
            q[qpos:qpos + 4] = product(product(conjugate(q_BC), row[:4]), q_BC)
            v[dof:dof + 3] = turned(conjugate(q_BC), row[4:])
        for i, qpos, dof, p_BBcm in self.free:
            row = state.bodies[i]
            offset = turned(row[3:7], p_BBcm)
            q[qpos:qpos + 3], q[qpos + 3:qpos + 7] = row[:3] - offset, row[3:7]
            v[dof:dof + 3] = row[7:10] - np.cross(row[10:13], offset)
            v[dof + 3:dof + 6] = turned(conjugate(row[3:7]), row[10:13])
        return q, v

    def read(self, q, v):
        """What read_state() gives, of qpos and qvel of any precision."""
        q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
        bodies, balls = np.zeros((len(self.model.bodies), 13)), np.zeros((len(self.balls), 7))
        for row, (qpos, dof, q_BC) in zip(balls, self.balls):
            row[:4] = product(product(q_BC, unit(q[qpos:qpos + 4])), conjugate(q_BC))
            row[4:] = turned(q_BC, v[dof:dof + 3])
        for i, qpos, dof, p_BBcm in self.free:
            row = bodies[i]
            row[3:7] = unit(q[qpos + 3:qpos + 7])
            row[10:13] = turned(row[3:7], v[dof + 3:dof + 6])
            offset = turned(row[3:7], p_BBcm)
            row[:3], row[7:10] = q[qpos:qpos + 3] + offset, v[dof:dof + 3] + np.cross(row[10:13], offset)
        return {"position": q[self.joint_qpos], "velocity": v[self.joint_dof], "balls": balls, "bodies": bodies}

    def view(self, held, q):
        """Of an MjModel whose numbers were read from the engine, at qpos `q`."""
        data = mj.MjData(held)
        data.qpos[:] = q
        mj.mj_kinematics(held, data)
        mass, com, inertia = [], [], []
        for id in self.body_id:
            mass.append(held.body_mass[id] if id >= 0 else 0.0)
            com.append(data.xipos[id].copy())
            R = data.ximat[id].reshape(3, 3)
            inertia.append(R @ np.diag(held.body_inertia[id]) @ R.T)
        ids = self.joint_id
        slide = held.jnt_type[ids] == mj.mjtJoint.mjJNT_SLIDE
        way = np.where(slide, data.qpos[self.joint_qpos] - held.qpos0[self.joint_qpos], 0.0)
        limited = held.jnt_limited[ids] != 0
        return {"gravity": held.opt.gravity, "mass": mass, "com": com, "inertia": inertia,
                "anchor": data.xanchor[ids] + way[:, None] * data.xaxis[ids], "axis": data.xaxis[ids],
                "lower": np.where(limited, held.jnt_range[ids, 0], -np.inf),
                "upper": np.where(limited, held.jnt_range[ids, 1], np.inf)}
