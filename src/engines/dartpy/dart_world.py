"""One running DART world."""

import dartpy as dart
import numpy as np

import assay_adapter as assay

NO_MASS = 1e-100  # of a massless body, kg and kg m^2: rounds away beside any other


def rotation_of(q):
    w, x, y, z = np.asarray(q, dtype=float) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def quaternion_of(R):
    """(w, x, y, z) by the largest of its four squares."""
    trace = np.trace(R)
    squares = np.array([trace, R[0, 0], R[1, 1], R[2, 2]])
    k = int(np.argmax(squares))
    if k == 0:
        q = np.array([1 + trace, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        i, j, l = (k - 1, k % 3, (k + 1) % 3)
        q = np.zeros(4)
        q[0] = R[l, j] - R[j, l]
        q[1 + i] = 1 + R[i, i] - R[j, j] - R[l, l]
        q[1 + j] = R[j, i] + R[i, j]
        q[1 + l] = R[l, i] + R[i, l]
    return q / np.linalg.norm(q)


def isometry(p, R=None):
    return dart.math.Isometry3(np.eye(3) if R is None else R, np.asarray(p, dtype=float))


def dart_shape(shape):
    dynamics = dart.dynamics
    if shape.type == "sphere":
        return dynamics.SphereShape(shape.radius)
    if shape.type == "capsule":
        return dynamics.CapsuleShape(shape.radius, 2 * shape.half_length)
    if shape.type == "cylinder":
        return dynamics.CylinderShape(shape.radius, 2 * shape.half_length)
    if shape.type == "box":
        return dynamics.BoxShape([2 * half for half in shape.half_size])
    return dynamics.PlaneShape([0.0, 0.0, 1.0], 0.0)


def inertia_of(body, origin):
    if body.is_massless:
        return dart.dynamics.Inertia(NO_MASS, np.zeros(3), NO_MASS * np.eye(3))
    return dart.dynamics.Inertia(body.mass, body.p_BBcm - origin, body.I_BBcm_B)


def parts_of(model):
    """The shapes as DART gets them: (shape, friction). DART takes the smaller coefficient of two shapes. Where the largest of
    a shape's coefficients gives every pair its own, a shape is one part; otherwise it has a part for each of them. Also the
    pairs of parts that may touch."""
    largest = {}
    for pair in model.contacts:
        for shape in (pair.shape_a, pair.shape_b):
            largest[shape] = max(largest.get(shape, 0.0), pair.friction)
    if all(min(largest[pair.shape_a], largest[pair.shape_b]) == pair.friction for pair in model.contacts):
        part = {shape: (shape, friction) for shape, friction in largest.items()}
        return sorted(part.values()), {(part[pair.shape_a], part[pair.shape_b]) for pair in model.contacts}
    pairs = {((pair.shape_a, pair.friction), (pair.shape_b, pair.friction)) for pair in model.contacts}
    return sorted({part for pair in pairs for part in pair}), pairs


class Simulation:
    def __init__(self, model, state, settings):
        self.model, self.settings = model, settings
        self.world = world = dart.simulation.World("assay")
        world.setTimeStep(settings.timestep)
        world.setGravity(np.array(model.gravity))
        if hasattr(world, "setNumSimulationThreads"):  # since 6.20; before there is one
            world.setNumSimulationThreads(1)
        if hasattr(world, "setDeactivationOptions"):  # since 6.19; before nothing sleeps
            off = dart.simulation.DeactivationOptions()
            off.mEnabled = False
            world.setDeactivationOptions(off)
        self.make_solver()
        self.trees, self.bodies, self.joints = [], [], [None] * len(model.joints)
        self.balls, self.free = [None] * len(model.balls), []
        self.make_bodies()
        self.make_shapes()
        for tree in self.trees:  # with their shapes: those added later are visited in the order of their addresses
            world.addSkeleton(tree)
        self.make_filter()
        self.set_state(state)
        self.step = world.step
        self.rows = np.zeros((len(model.bodies), 13))
        self.ball_rows = np.zeros((len(model.balls), 7))
        self.reference = np.array([joint.reference for joint in model.joints])

    def make_solver(self):
        settings, solver = self.settings, self.world.getConstraintSolver()
        detector = {"ode": "OdeCollisionDetector", "bullet": "BulletCollisionDetector", "dart": "DARTCollisionDetector"}
        solver.setCollisionDetector(getattr(dart.collision, detector[settings["detector"]])())
        option = dart.constraint.PgsBoxedLcpSolverOption(settings["pgs_iterations"], 1e-6, settings["pgs_tolerance"])
        kind = settings["lcp"]
        if hasattr(solver, "getSecondaryBoxedLcpSolver"):  # since 6.20; check() refuses what older ones lack
            solver.setSplitImpulseEnabled(settings["split_impulse"])
            solver.getSecondaryBoxedLcpSolver().setOption(option)
        if kind == "pgs":  # another object than the secondary one: DART ignores the same one
            primary = dart.simulation.World("other").getConstraintSolver().getSecondaryBoxedLcpSolver()
            primary.setOption(option)
            solver.setBoxedLcpSolver(primary)
        elif kind == "nsgs":
            options = dart.constraint.NsgsFrictionSolver.Options()
            options.maxSweeps, options.tolerance = settings["cone_iterations"], settings["cone_tolerance"]
            solver.setBoxedLcpSolver(dart.constraint.NsgsFrictionSolver(options))
        elif kind == "fbf":
            options = dart.constraint.FbfFrictionSolver.Options()
            options.maxOuterIterations, options.tolerance = settings["cone_iterations"], settings["cone_tolerance"]
            solver.setBoxedLcpSolver(dart.constraint.FbfFrictionSolver(options))

    def make_bodies(self):
        """One skeleton a tree. A body's frame is the MJCF body's, with its origin in the centre of mass if the body is free:
        its joint holds the velocity of that point only if the joint's frame is the body's
        (findings/dartpy/free_joint_velocity.py)."""
        model, skeletons = self.model, []
        self.origin = [np.array(body.p_BBcm) * body.is_free for body in model.bodies]
        for i, body in enumerate(model.bodies):
            if body.parent < 0:
                self.trees.append(dart.dynamics.Skeleton(f"tree {i}"))
                self.trees[-1].enableSelfCollisionCheck()
                self.trees[-1].enableAdjacentBodyCheck()
            skeletons.append(self.trees[-1] if body.parent < 0 else skeletons[body.parent])
            skeleton, parent = skeletons[i], None if body.parent < 0 else self.bodies[body.parent]
            if body.is_free:
                joint, made = skeleton.createFreeJointAndBodyNodePair(parent)
                self.free.append((i, joint))
            elif body.ball >= 0:
                ball = model.balls[body.ball]
                joint, made = skeleton.createBallJointAndBodyNodePair(parent)
                self.place(joint, body, ball.p_BJ)
                for k in range(3):
                    joint.setCoulombFriction(k, ball.dry_friction)
                self.balls[body.ball] = joint
            else:
                own = model.joints[body.joint]
                create = (skeleton.createPrismaticJointAndBodyNodePair if own.is_slide
                          else skeleton.createRevoluteJointAndBodyNodePair)
                joint, made = create(parent)
                self.place(joint, body, own.p_BJ)
                joint.setAxis(own.axis_B)
                self.set_properties(joint, own)
                self.joints[body.joint] = joint
            joint.setName(f"joint {i}")
            made.setName(f"body {i}")
            made.setInertia(inertia_of(body, self.origin[i]))
            self.bodies.append(made)

    def place(self, joint, body, p_BJ):
        R = rotation_of(body.X_PB.q)
        shift = self.origin[body.parent] if body.parent >= 0 else np.zeros(3)
        joint.setTransformFromChildBodyNode(isometry(p_BJ))
        joint.setTransformFromParentBodyNode(isometry(body.X_PB.p + R @ p_BJ - shift, R))

    @staticmethod
    def set_properties(joint, own):
        if own.limited:
            joint.setPositionLowerLimit(0, own.lower - own.reference)
            joint.setPositionUpperLimit(0, own.upper - own.reference)
        joint.setLimitEnforcement(own.limited)
        joint.setCoulombFriction(0, own.dry_friction)
        joint.setSpringStiffness(0, own.stiffness)
        joint.setRestPosition(0, own.spring_reference - own.reference)
        joint.setDampingCoefficient(0, own.damping)

    def make_shapes(self):
        """DART's filter from Python knows bodies, not shapes: parts with other partners lie on bodies of their own, which
        are welded to the one that they belong to and have no mass."""
        model = self.model
        parts, pairs = parts_of(model)
        partners = {part: frozenset(b for pair in pairs for a, b in (pair, pair[::-1]) if a == part) for part in parts}
        ground = dart.dynamics.Skeleton("world")
        ground.setMobile(False)
        self.holder_of, holders, used = {}, {}, set()
        for part in parts:
            shape = model.shapes[part[0]]
            key = (shape.body, partners[part])
            if key not in holders:
                if shape.body in used or shape.body < 0:
                    skeleton = ground if shape.body < 0 else self.bodies[shape.body].getSkeleton()
                    parent = None if shape.body < 0 else self.bodies[shape.body]
                    joint, made = skeleton.createWeldJointAndBodyNodePair(parent)
                    joint.setName(f"weld {len(holders)}")
                    made.setName(f"holder {len(holders)}")
                    made.setInertia(dart.dynamics.Inertia(NO_MASS, np.zeros(3), NO_MASS * np.eye(3)))
                else:
                    made = self.bodies[shape.body]
                holders[key] = made
                used.add(shape.body)
            node = holders[key].createShapeNode(dart_shape(shape))
            node.createCollisionAspect()
            node.createDynamicsAspect()
            shift = self.origin[shape.body] if shape.body >= 0 else np.zeros(3)
            node.setRelativeTransform(isometry(shape.X_BS.p - shift, rotation_of(shape.X_BS.q)))
            node.getDynamicsAspect().setFrictionCoeff(part[1])
            node.getDynamicsAspect().setRestitutionCoeff(0.0)
            self.holder_of[part] = holders[key]
        self.allowed = {frozenset((self.holder_of[a].getName(), self.holder_of[b].getName())) for a, b in pairs}
        self.holders = list(holders.values())
        if ground.getNumBodyNodes() > 0:
            self.trees.append(ground)

    def make_filter(self):
        option = self.world.getConstraintSolver().getCollisionOption()
        option.maxNumContacts = 1 << 24  # beyond DART's 1000 a pair has one contact point only
        bodies = option.collisionFilter
        for i, a in enumerate(self.holders):
            for b in self.holders[:i]:
                if frozenset((a.getName(), b.getName())) not in self.allowed:
                    bodies.addBodyNodePairToBlackList(a, b)

    def set_state(self, state):
        for i, joint in self.free:
            row = state.bodies[i]
            R = rotation_of(row[3:7])
            joint.setPositions(dart.dynamics.FreeJoint.convertToPositions(isometry(row[:3], R)))
            joint.setVelocities(np.concatenate([row[10:13], row[7:10]]))
        for joint, own, q, v in zip(self.joints, self.model.joints, state.position, state.velocity):
            joint.setPosition(0, q - own.reference)
            joint.setVelocity(0, v)
        for joint, row in zip(self.balls, state.balls):
            joint.setPositions(dart.dynamics.BallJoint.convertToPositions(rotation_of(row[:4])))
            joint.setVelocities(row[4:])

    def set_torques(self, torques):
        for joint, torque in zip(self.joints, torques):  # DART forgets them after the step
            joint.setForce(0, torque)

    def advance(self, count):
        step = self.step
        for _ in range(count):
            step()

    def read_state(self):
        for i, joint in self.free:
            row, X = self.rows[i], dart.dynamics.FreeJoint.convertToTransform(joint.getPositions())
            twist = joint.getVelocities()
            row[:3], row[3:7] = X.translation(), quaternion_of(X.rotation())
            row[7:10], row[10:13] = twist[3:], twist[:3]
        for row, joint in zip(self.ball_rows, self.balls):
            row[:4] = quaternion_of(dart.dynamics.BallJoint.convertToRotation(joint.getPositions()))
            row[4:] = joint.getVelocities()
        return {"position": np.array([joint.getPosition(0) for joint in self.joints]) + self.reference,
                "velocity": np.array([joint.getVelocity(0) for joint in self.joints]),
                "balls": self.ball_rows, "bodies": self.rows}

    def view(self):
        mass, com, inertia = [], [], []
        for body in self.bodies:
            own = body.getInertia()
            R = body.getWorldTransform().rotation()
            mass.append(own.getMass() if own.getMass() > NO_MASS else 0.0)
            com.append(body.getCOM())
            inertia.append(R @ own.getMoment() @ R.T)
        anchor, axis, lower, upper = [], [], [], []
        for joint, reference in zip(self.joints, self.reference):
            X = joint.getChildBodyNode().getWorldTransform().multiply(joint.getTransformFromChildBodyNode())
            anchor.append(X.translation())
            axis.append(X.rotation() @ joint.getAxis())
            limited = joint.areLimitsEnforced()
            lower.append(joint.getPositionLowerLimit(0) + reference if limited else -np.inf)
            upper.append(joint.getPositionUpperLimit(0) + reference if limited else np.inf)
        return {"gravity": self.world.getGravity(), "mass": mass, "com": com, "inertia": inertia, "anchor": anchor,
                "axis": axis, "lower": lower, "upper": upper}
