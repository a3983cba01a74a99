# Bodies and joints of a stage as trees: which joint carries which body, and which ones close loops.
import math

from pxr import Gf, Usd, UsdPhysics

from geometry import AXES, Pose, angle_of, turn, turned_by

UNLIMITED = 1e10  # degrees or the file's lengths: importers write the largest float
ANGULAR, LINEAR = ("rotX", "rotY", "rotZ"), ("transX", "transY", "transZ")
TINY = 1e-4  # m, rad: what single precision makes of frames


class Axis:
    """A degree of freedom in the joint's frame: along or about `axis`, coordinate 0 where the frames coincide."""

    def __init__(self, name, axis, is_angular):
        self.name, self.axis, self.is_angular = name, axis, is_angular
        self.lower, self.upper = -math.inf, math.inf  # rad, m
        self.start, self.speed = 0.0, 0.0
        self.drive = None
        self.armature = self.damping = self.friction = self.stiffness = self.spring_reference = self.reference = 0.0
        self.effort = None  # of the joint itself: (lower, upper)
        self.margin = 0.0  # of its limits
        self.label = ""


class Joint:
    def __init__(self, prim):
        self.prim = prim
        self.kind = ""  # fixed, revolute, prismatic, spherical, generic, or another type's name
        self.bodies = [None, None]
        self.frames = [Pose(), Pose()]  # in the bodies
        self.axes = []  # of the coordinates, in the order from parent to child
        self.is_ball = False
        self.ball = None  # an Axis without direction, for its springs
        self.collides = False
        self.closes = False
        self.reversed = False  # the child is body 0


class Body:
    def __init__(self, prim, pose):
        self.prim, self.pose = prim, pose  # in the world
        self.name = ""
        self.is_kinematic = False
        self.joints = []  # those that carry it; empty for a root
        self.parent = None  # index; None: the world
        self.is_root = True
        self.X_PB = pose  # in the parent where all joints are at 0
        self.children = []


class Robot:
    def __init__(self, scene):
        self.scene = scene
        self.bodies, self.index = [], {}
        self.fixed = set()  # paths of rigid bodies that are switched off
        for prim in scene.prims():
            if not prim.HasAPI(UsdPhysics.RigidBodyAPI):
                continue
            if not scene.value(prim, "physics:rigidBodyEnabled", True):
                self.fixed.add(prim.GetPath())
                scene.note_each("bodies whose rigidBodyEnabled is false are fixed to the world", prim)
                continue
            body = Body(prim, scene.pose(prim))
            body.is_kinematic = bool(scene.value(prim, "physics:kinematicEnabled", False))
            if body.is_kinematic:
                scene.note_each("kinematic bodies stay where they are", prim)
            self.index[prim.GetPath()] = len(self.bodies)
            self.bodies.append(body)
        self.joints = []
        for prim in scene.prims():
            if prim.IsA(UsdPhysics.Joint):
                self.add_joint(prim)
        self.by_path = {joint.prim.GetPath(): joint for joint in self.joints}
        self.poses = [body.pose for body in self.bodies]

    def body_of(self, prim):
        """The body that a prim moves with; None: it does not move."""
        while prim and not prim.IsPseudoRoot():
            if prim.GetPath() in self.index:
                return self.index[prim.GetPath()]
            if prim.GetPath() in self.fixed:
                return None
            prim = prim.GetParent()
        return None

    # ---- joints

    def end(self, joint, which):
        """The body of one side and the joint's frame in it; false where the file names none that there is."""
        scene, prim = self.scene, joint.prim
        targets = scene.targets(prim, f"physics:body{which}")
        position = Gf.Vec3d(*scene.value(prim, f"physics:localPos{which}", (0, 0, 0)))
        rotation = Gf.Quatd(scene.value(prim, f"physics:localRot{which}", Gf.Quatf(1)))
        if rotation.GetLength() == 0:
            rotation = Gf.Quatd(1)
        if len(targets) > 1:
            scene.note_each(f"of several targets of physics:body{which} the first is taken", prim)
        if not targets:
            joint.frames[which] = scene.turned * Pose(rotation, position * scene.metre)
            return True
        target = scene.stage.GetPrimAtPath(targets[0])
        if not target:
            scene.refuse(prim, f"has physics:body{which} = <{targets[0]}>, which is not there", "name a prim with PhysicsRigidBodyAPI")
            return False
        body = self.body_of(target)
        frame, scale, _ = scene.frame(target)
        frame = frame * Pose(rotation, Gf.Vec3d(*(position[i] * scale[i] * scene.metre for i in range(3))))
        joint.bodies[which] = body
        joint.frames[which] = frame if body is None else self.bodies[body].pose.inverse() * frame
        return True

    def add_joint(self, prim):
        scene = self.scene
        if not scene.value(prim, "physics:jointEnabled", True):
            scene.note_each("joints whose jointEnabled is false are left out", prim)
            return
        joint = Joint(prim)
        if not self.end(joint, 0) or not self.end(joint, 1):
            return
        if joint.bodies[0] == joint.bodies[1]:
            scene.note_each("joints whose sides do not move against each other are left out", prim)
            return
        kinds = {
            "PhysicsFixedJoint": "fixed",
            "PhysicsRevoluteJoint": "revolute",
            "PhysicsPrismaticJoint": "prismatic",
            "PhysicsSphericalJoint": "spherical",
            "PhysicsJoint": "generic",
        }
        kind = str(prim.GetTypeName())
        joint.kind = kinds.get(kind, kind)
        joint.collides = bool(scene.value(prim, "physics:collisionEnabled", False))
        joint.closes = bool(scene.value(prim, "physics:excludeFromArticulation", False))
        for name in ("physics:breakForce", "physics:breakTorque"):
            if scene.value(prim, name, math.inf) < UNLIMITED:
                scene.note_each(f"joints do not break: {name} is ignored", prim)
        if joint.kind not in kinds.values():
            scene.unsupported(
                prim,
                f"is a joint of the type '{kind}'",
                "use a fixed, revolute, prismatic, spherical or generic one",
                "leaves it out",
            )
            return
        self.read_axes(joint)
        self.joints.append(joint)

    def read_axes(self, joint):
        scene, prim = self.scene, joint.prim
        if joint.kind in ("revolute", "prismatic"):
            token = str(scene.value(prim, "physics:axis", "X"))
            angular = joint.kind == "revolute"
            axis = Axis("angular" if angular else "linear", AXES.get(token, AXES["X"]), angular)
            self.limit(prim, axis, scene.value(prim, "physics:lowerLimit"), scene.value(prim, "physics:upperLimit"))
            joint.axes = [axis]
        elif joint.kind == "spherical":
            joint.is_ball = True
            joint.ball = Axis("angular", AXES["X"], True)
            cones = [scene.value(prim, f"physics:coneAngle{i}Limit", -1.0) for i in (0, 1)]
            scene.value(prim, "physics:axis")
            if any(0 <= each < UNLIMITED for each in cones) and min(cones) < 180:
                scene.unsupported(
                    prim, f"has a cone limit of {cones[0]:g} and {cones[1]:g} degrees", "remove it", "lets the joint turn freely"
                )
        elif joint.kind == "generic":
            self.read_generic(joint)
        for axis in joint.axes + ([joint.ball] if joint.ball else []):
            self.read_passive(prim, axis)

    def limit(self, prim, axis, lower, upper):
        unit = math.pi / 180 if axis.is_angular else self.scene.metre
        lower, upper = (-math.inf if lower is None else lower), (math.inf if upper is None else upper)
        if lower > upper:
            self.scene.refuse(prim, f"has a lower limit of {lower:g} above its upper limit of {upper:g}", "swap them")
            return
        axis.lower = lower * unit if lower > -UNLIMITED else -math.inf
        axis.upper = upper * unit if upper < UNLIMITED else math.inf

    def read_generic(self, joint):
        """A limit whose low is above its high locks that direction; without a limit it is free."""
        scene, prim = self.scene, joint.prim
        free = {}
        for name in LINEAR + ANGULAR:
            axis = Axis(name, AXES[name[-1]], name in ANGULAR)
            if scene.has(prim, f"PhysicsLimitAPI:{name}"):
                low = scene.value(prim, f"limit:{name}:physics:low", -math.inf)
                high = scene.value(prim, f"limit:{name}:physics:high", math.inf)
                if low >= high:
                    if low == high and low != 0:
                        scene.unsupported(
                            prim, f"is locked at {low:g} in {name}", "move its frames there and lock it at 0", "locks it at 0"
                        )
                    continue
                self.limit(prim, axis, low, high)
            free[name] = axis
        if scene.has(prim, "PhysicsLimitAPI:distance"):
            scene.unsupported(prim, "limits a distance", "remove that limit", "ignores it")
        turns = [free[name] for name in ANGULAR if name in free]
        slides = [free[name] for name in LINEAR if name in free]
        bare = all(math.isinf(each.lower) and math.isinf(each.upper) for each in turns)
        driven = any(scene.has(prim, f"PhysicsDriveAPI:{each.name}") for each in turns)
        if len(turns) == 3 and bare and not driven:
            joint.is_ball, joint.ball = True, turns[0]
            turns = []
        elif len(turns) == 3 or (len(turns) == 2 and "rotX" not in free):
            scene.note_each("joints that turn about several axes are hinges about z, y and x in turn (PhysX: twist and swing)", prim)
        # the swing comes before the twist about x
        joint.axes = slides + turns[::-1]

    def read_passive(self, prim, axis):
        """Springs, losses and inertia along a coordinate. Angular values of UsdPhysics, PhysX and Newton are per degree;
        those of MuJoCo's schema are per radian, but its references are degrees."""
        value, scene = lambda name, fallback=None: self.scene.value(prim, name, fallback), self.scene
        kilogram, metre = scene.kilogram, scene.metre
        inertia = kilogram * metre**2 if axis.is_angular else kilogram
        degree = math.pi / 180 if axis.is_angular else metre
        force = kilogram * metre**2 if axis.is_angular else kilogram * metre
        rate = inertia / (math.pi / 180) if axis.is_angular else kilogram  # of damping and stiffness
        by_axis = f"physxJointAxis:{axis.name}:"
        axis.armature = inertia * first(value("mjc:armature"), value("newton:armature"), value(by_axis + "armature"), value("physxJoint:armature"), 0.0)
        of_mjc = value("mjc:damping")
        axis.damping = (
            of_mjc * inertia if of_mjc is not None else rate * first(value("newton:damping"), value(by_axis + "viscousFrictionCoefficient"), 0.0)
        )
        static = value(by_axis + "staticFrictionEffort")
        dynamic = value(by_axis + "dynamicFrictionEffort")
        axis.friction = force * first(value("mjc:frictionloss"), value("newton:friction"), dynamic, static, 0.0)
        if static is not None and dynamic is not None and abs(static - dynamic) > 1e-6:
            scene.note_each("the static friction effort is not used, as engines have one: the dynamic one is", prim)
        if (loss := value("physxJoint:jointFriction", 0.0)) != 0:
            scene.note_each(f"the joint friction {loss:g} is left out: PhysX scales it by the joint's load, and it is no torque", prim)
        axis.stiffness = value("mjc:stiffness", 0.0) * inertia
        axis.spring_reference = value("mjc:springref", 0.0) * degree
        axis.reference = value("mjc:ref", 0.0) * degree
        axis.margin = value("mjc:margin", 0.0) * (1 if axis.is_angular else metre)
        for name, names in (
            ("armature", axis.armature), ("damping", axis.damping), ("friction", axis.friction), ("stiffness", axis.stiffness)
        ):
            if names < 0:
                scene.refuse(prim, f"has a negative {name} of {names:g}", "make it 0 or more")
        speed = first(value("newton:velocityLimit"), value(by_axis + "maxJointVelocity"), value("physxJoint:maxJointVelocity"), math.inf)
        if speed < UNLIMITED:
            scene.note_each("limits of joints' speeds are not applied", prim)
        low, high = value("mjc:actuatorfrcrange:min", 0.0), value("mjc:actuatorfrcrange:max", 0.0)
        limited = value("mjc:actuatorfrclimited", "auto")
        if limited == "true" or (limited == "auto" and low < high):
            axis.effort = (low * force, high * force)
        value("mjc:actuatorgravcomp")
        axis.start = value(f"state:{axis.name}:physics:position", value(f"newton:{axis.name}:position"))
        axis.start = axis.start * degree if axis.start is not None else None
        axis.speed = value(f"state:{axis.name}:physics:velocity", value(f"newton:{axis.name}:velocity", 0.0)) * degree
        if scene.has(prim, f"PhysicsDriveAPI:{axis.name}"):
            axis.drive = self.read_drive(prim, axis, rate, degree, force)

    def read_drive(self, prim, axis, rate, degree, force):
        value = lambda name, fallback: self.scene.value(prim, f"drive:{axis.name}:physics:{name}", fallback)
        drive = {
            "stiffness": value("stiffness", 0.0) * rate,
            "damping": value("damping", 0.0) * rate,
            "position": value("targetPosition", 0.0) * degree,
            "velocity": value("targetVelocity", 0.0) * degree,
            "most": math.inf,
        }
        most = value("maxForce", math.inf)
        if most < UNLIMITED:
            drive["most"] = most * force
        kind = str(value("type", "force"))
        if min(drive["stiffness"], drive["damping"]) < 0:
            self.scene.refuse(prim, f"has a drive with a negative gain ({axis.name})", "make stiffness and damping 0 or more")
            return None
        if kind == "acceleration" and (drive["stiffness"] or drive["damping"]):
            self.scene.unsupported(
                prim,
                f"has a drive of the type 'acceleration' ({axis.name}), whose gains PhysX scales by the inertia it finds",
                "give gains of the type 'force'",
                "leaves the drive out",
            )
            return None
        return drive

    # ---- trees

    def build(self):
        """Gives every body its parent and its joints; the joints that are left close loops."""
        count = len(self.bodies)
        links = [[] for _ in range(count)]
        of_world, targets = [], set()
        for joint in self.joints:
            if joint.closes:
                continue
            for side in (0, 1):
                if joint.bodies[side] is not None:
                    links[joint.bodies[side]].append(joint)
            if None in joint.bodies:
                of_world.append(joint)
            if joint.bodies[1] is not None:
                targets.add(joint.bodies[1])
        done, used = [False] * count, set()
        order = []

        def walk(start):
            queue = [start]
            while queue:
                body = queue.pop(0)
                order.append(body)
                for joint in links[body]:
                    other = joint.bodies[1] if joint.bodies[0] == body else joint.bodies[0]
                    if joint in used or other is None or done[other] or self.bodies[other].is_kinematic:
                        continue
                    self.hang(other, body, joint)
                    used.add(joint)
                    done[other] = True
                    queue.append(other)

        for i, body in enumerate(self.bodies):
            if body.is_kinematic:
                done[i] = True
        for joint in of_world:
            body = joint.bodies[0] if joint.bodies[1] is None else joint.bodies[1]
            if not done[body]:
                self.hang(body, None, joint)
                used.add(joint)
                done[body] = True
                walk(body)
        for i, body in enumerate(self.bodies):
            if body.is_kinematic:
                walk(i)
        roots = [i for i, body in enumerate(self.bodies) if body.prim.HasAPI(UsdPhysics.ArticulationRootAPI)]
        roots += [i for i in range(count) if i not in targets] + list(range(count))
        for i in roots:
            if not done[i]:
                done[i] = True
                walk(i)
        self.compose(used)
        self.loops = [j for j in self.joints if j not in used]
        for i, body in enumerate(self.bodies):
            if body.parent is not None:
                self.bodies[body.parent].children.append(i)
        self.place(order)

    def hang(self, child, parent, joint):
        body = self.bodies[child]
        body.parent, body.is_root, body.joints = parent, False, [joint]
        joint.reversed = joint.bodies[0] == child

    def compose(self, used):
        """Several joints of one coordinate between the same two bodies move it in turn, where the file says so: MuJoCo's
        schema, or Newton's jointsAddMobility. Elsewhere they close a loop."""
        for joint in self.joints:
            if joint in used or joint.closes or joint.kind not in ("revolute", "prismatic"):
                continue
            for body in self.bodies:
                if not body.joints or set(joint.bodies) != set(body.joints[0].bodies) or joint.bodies[0] != body.joints[0].bodies[0]:
                    continue
                if self.adds_mobility(joint) and all(each.kind in ("revolute", "prismatic") for each in body.joints):
                    joint.reversed = body.joints[0].reversed
                    body.joints.append(joint)
                    body.joints.sort(key=self.joints.index)
                    used.add(joint)
                break

    def adds_mobility(self, joint):
        if self.scene.has(joint.prim, "MjcJointAPI"):
            return True
        above = joint.prim
        while above and not above.IsPseudoRoot():
            if self.scene.value(above, "newton:jointsAddMobility", False):
                return True
            above = above.GetParent()
        return False

    def place(self, order):
        """Where bodies are while all joints are at 0, and from the poses in the file where the joints start."""
        for i in order:
            body = self.bodies[i]
            if not body.joints:
                body.X_PB = body.pose
                continue
            joint = body.joints[0]
            in_parent, in_child = (joint.frames[1], joint.frames[0]) if joint.reversed else (joint.frames[0], joint.frames[1])
            body.X_PB = in_parent * in_child.inverse()
            parent = Pose() if body.parent is None else self.bodies[body.parent].pose
            self.start(body, joint, (parent * in_parent).inverse() * body.pose * in_child)

    def start(self, body, joint, moved):
        """Coordinates by which the joint's frames are apart in the file. In a reversed joint both are exchanged."""
        if joint.reversed:
            moved = moved.inverse()
        left = moved
        if len(body.joints) > 1:
            return  # composed joints start at 0
        found = []
        slides = [axis for axis in joint.axes if not axis.is_angular]
        turns = [axis for axis in joint.axes if axis.is_angular]
        for axis in slides:
            found.append(Gf.Dot(left.translation, axis.axis))
        offset = left.translation - sum((axis.axis * q for axis, q in zip(slides, found)), Gf.Vec3d(0))
        rotation = left.rotation
        for axis in turns:  # z, y, x: each takes its own part, the last one what is left
            angle = turned_by(rotation, axis.axis) if len(turns) == 1 else euler(rotation, axis.name)
            found.append(angle)
            rotation = turn(axis.axis, -angle) * rotation
        joint.ball_start = rotation if joint.is_ball else None
        apart = offset.GetLength(), 0.0 if joint.is_ball else angle_of(rotation)
        if max(apart) > 10 * TINY:
            self.scene.note_each(
                "bodies do not lie where their joint's frames put them: the frames decide "
                f"({apart[0]:.2g} m and {math.degrees(apart[1]):.2g} degrees apart)",
                joint.prim,
            )
        for axis, at in zip(slides + turns, found):
            if axis.start is None:
                axis.start = at if abs(at) > TINY else 0.0
            elif abs(axis.start - at) > 10 * TINY and max(apart) <= 10 * TINY and abs(at) > 10 * TINY:
                self.scene.note_each("joints start at the state in the file, which is not that of their bodies' poses", joint.prim)
            # MuJoCo's coordinate is its reference where the frames coincide
            axis.start += axis.reference


def euler(rotation, name):
    """The first angle of a rotation in turns about z, y, x; that is repeated with what is left of it."""
    x, y, z = (rotation.Transform(AXES[each]) for each in "XYZ")
    if name == "rotZ":
        return math.atan2(x[1], x[0])
    if name == "rotY":
        return math.atan2(-x[2], math.hypot(x[0], x[1]))
    return math.atan2(y[2], z[2])


def first(*values):
    return next(value for value in values if value is not None)
