# Writes the robot as MJCF, which the program reads like every other one. Angles are radians, bodies have explicit inertia.
import math
import re
from xml.sax.saxutils import quoteattr

from pxr import Gf, Sdf, Tf, Usd, UsdPhysics

import geometry
from geometry import AXES, Pose
from shapes import Shapes

BITS = 30  # of contype and conaffinity
MOST_PAIRS = 50_000
FAR = 1e6  # rad, m: a bound where MJCF needs one and the file has none

# Elements of simulations that no engine here is given, by the type or applied schema that stands for them.
FOREIGN = re.compile(
    r"^(PhysxTendon\w*|PhysxParticle\w*|PhysxDeformable\w*|OmniPhysicsDeformable\w*|PhysicsDeformable\w*|PhysxAutoParticle\w*|"
    r"PhysxVehicle\w*|PhysxSurfaceVelocityAPI|PhysxForceAPI|PhysxCharacterControllerAPI|PhysxPhysicsGearJoint|"
    r"PhysicsAttachment|PhysxPhysicsAttachment|NewtonActuator)"
)


def numbers(*values):
    """As short as they can be read back; what turning frames leaves of 0 is 0."""
    return " ".join(repr(each).removesuffix(".0") if abs(each) > 1e-14 else "0" for value in values for each in parts(value))


def parts(value):
    if isinstance(value, Gf.Quatd):
        return [value.GetReal(), *value.GetImaginary()]
    try:
        return [float(each) for each in value]
    except TypeError:
        return [float(value)]


def element(tag, closed=True, **attributes):
    words = " ".join(f"{key.rstrip('_')}={quoteattr(str(value))}" for key, value in attributes.items() if value is not None)
    return f"<{tag}{' ' if words else ''}{words}{'/' if closed else ''}>"


class Document:
    def __init__(self, scene, robot, name):
        self.scene, self.robot = scene, robot
        self.lines = []
        self.taken = {}
        self.places = {}
        self.assets, self.sites = [], {}
        self.shapes = Shapes(scene, robot.body_of, robot.poses)
        self.model_name = name

    def name(self, kind, prim, ending=""):
        own = (prim.GetDisplayName() or prim.GetName()) + ending
        taken = self.taken.setdefault(kind, set())
        result, above = own, prim.GetParent()
        while result in taken and above and not above.IsPseudoRoot():
            result = f"{above.GetName()}_{result}"
            above = above.GetParent()
        count = 2
        while result in taken:
            result, count = f"{own}_{count}", count + 1
        taken.add(result)
        self.places[f"{kind} '{result}'"] = f"<{prim.GetPath()}>"
        return result

    def text(self):
        scene, robot = self.scene, self.robot
        for body in robot.bodies:
            body.name = self.name("body", body.prim)
        for i, body in enumerate(robot.bodies):
            body.mass = self.shapes.mass_of(i, body.prim)
        self.gravity = self.read_gravity()
        self.pairs = self.contacts()
        world = []
        for shape in self.shapes.list:
            if shape.body is None:
                world.append("    " + self.geom(shape))
        bodies = []
        for i, body in enumerate(robot.bodies):
            if body.parent is None:
                self.write_body(i, 2, bodies)
        tendons = self.read_tendons()
        actuators, equalities = self.actuators(), self.equalities()
        # what loops hold bodies by stands in the bodies
        bodies = [line for each in bodies for line in (each if isinstance(each, list) else [each])]
        world += self.sites.get(None, [])
        self.foreign()
        key = self.keyframe()
        lines = [
            f"<mujoco model={quoteattr(self.model_name)}>",
            "  " + element("compiler", angle="radian", autolimits="false", inertiafromgeom="false", **self.compiler),
            f'  <option gravity="{numbers(self.gravity)}"><flag filterparent="disable"/></option>',
        ]
        if self.assets:
            lines += ["  <asset>", *self.assets, "  </asset>"]
        lines += ["  <worldbody>", *world, *bodies, "  </worldbody>"]
        for tag, inner in (("contact", self.pairs), ("tendon", tendons), ("equality", equalities), ("actuator", actuators), ("keyframe", key)):
            if inner:
                lines += [f"  <{tag}>", *("    " + each for each in inner), f"  </{tag}>"]
        return "\n".join(lines) + "\n</mujoco>\n"

    # ---- the scene

    def read_compiler(self, scenes):
        """What MuJoCo does to masses when it reads the file."""
        words = {"settotalmass": ("setTotalMass", -1.0), "boundmass": ("boundMass", 0.0), "boundinertia": ("boundInertia", 0.0)}
        found = {key: self.scene.value(prim, f"mjc:compiler:{name}", none) for prim in scenes for key, (name, none) in words.items()}
        result = {key: numbers(value) for key, value in found.items() if value > 0}
        if any(self.scene.value(prim, "mjc:compiler:balanceInertia", False) for prim in scenes):
            result["balanceinertia"] = "true"
        return result

    def read_gravity(self):
        scene = self.scene
        scenes = [prim for prim in scene.prims() if prim.GetTypeName() == "PhysicsScene"]
        self.compiler = self.read_compiler(scenes[:1])
        down = -AXES[scene.up]
        size = 9.81
        if scenes:
            prim = scenes[0]
            if len(scenes) > 1:
                scene.note_each("of several scenes the first gives gravity", prim)
            direction = Gf.Vec3d(*scene.value(prim, "physics:gravityDirection", (0, 0, 0)))
            if direction.GetLength() > 0:
                down = direction.GetNormalized()
            given = scene.value(prim, "physics:gravityMagnitude", -math.inf)
            if given >= 0:
                size = given * scene.metre
            if not scene.value(prim, "newton:gravityEnabled", True) or not scene.value(prim, "mjc:flag:gravity", True):
                size = 0.0
        else:
            scene.note("the file has no PhysicsScene: gravity is 9.81 m/s^2 downwards")
        moving = [body for body in self.robot.bodies if not body.is_kinematic]
        without = [body for body in moving if self.scene.value(body.prim, "physxRigidBody:disableGravity", False)]
        for body in self.robot.bodies:
            body.compensation = self.scene.value(body.prim, "mjc:body:gravcomp", 0.0) or (1.0 if body in without else 0.0)
        if without and len(without) == len(moving):
            scene.note("gravity is 0, because every body has physxRigidBody:disableGravity")
            size = 0.0
            for body in without:
                body.compensation = 0.0
        return scene.turned.rotation.Transform(down) * size

    def foreign(self):
        for prim in self.scene.prims():
            for each in [str(prim.GetTypeName()), *self.scene.schemas(prim)]:
                if FOREIGN.match(each):
                    self.scene.unsupported(prim, f"has {each}, which is not supported", "remove it", "leaves it out")
                    break

    # ---- bodies

    def write_body(self, number, depth, lines):
        body, indent = self.robot.bodies[number], "  " * depth
        pose = body.X_PB
        lines.append(
            indent
            + element(
                "body",
                False,
                name=body.name,
                pos=numbers(pose.translation),
                quat=numbers(pose.rotation),
                mocap="true" if body.is_kinematic else None,
                gravcomp=f"{body.compensation:g}" if body.compensation else None,
            )
        )
        mass, centre, inertia = body.mass
        if mass > 0:
            full = [inertia[i][j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
            lines.append(indent + "  " + element("inertial", mass=numbers(mass), pos=numbers(centre), fullinertia=numbers(full)))
        if body.is_root and not body.is_kinematic:
            body.free = self.name("joint", body.prim)
            lines.append(indent + "  " + element("freejoint", name=body.free))
        for joint in body.joints:
            lines += [indent + "  " + each for each in self.joint(joint)]
        for shape in self.shapes.list:
            if shape.body == number:
                lines.append(indent + "  " + self.geom(shape))
        lines.append(self.sites.setdefault(number, []))
        for child in body.children:
            self.write_body(child, depth + 1, lines)
        lines.append(indent + "</body>")

    def joint(self, joint):
        frame = joint.frames[0 if joint.reversed else 1]
        sign = -1 if joint.reversed else 1
        axes = joint.axes[::-1] if joint.reversed else joint.axes
        several = len(axes) + joint.is_ball > 1
        lines = []
        for axis in axes:
            axis.label = self.name("joint", joint.prim, f"_{axis.name}" if several else "")
            limited = not (math.isinf(axis.lower) and math.isinf(axis.upper))
            lines.append(
                element(
                    "joint",
                    name=axis.label,
                    type="hinge" if axis.is_angular else "slide",
                    pos=numbers(frame.translation),
                    axis=numbers(frame.rotation.Transform(axis.axis) * sign),
                    limited="true" if limited else "false",
                    range=numbers(max(axis.lower, -FAR), min(axis.upper, FAR)) if limited else None,
                    ref=numbers(axis.reference) if axis.reference else None,
                    margin=numbers(axis.margin) if axis.margin else None,
                    **self.passive(axis),
                )
            )
        if joint.is_ball:
            joint.ball.label = self.name("joint", joint.prim, "_ball" if several else "")
            lines.append(element("joint", name=joint.ball.label, type="ball", pos=numbers(frame.translation), **self.passive(joint.ball)))
        return lines

    @staticmethod
    def passive(axis):
        given = {"armature": axis.armature, "damping": axis.damping, "frictionloss": axis.friction, "stiffness": axis.stiffness}
        if axis.stiffness:
            given["springref"] = axis.spring_reference
        words = {key: numbers(value) for key, value in given.items() if value}
        if axis.effort:
            words |= {"actuatorfrclimited": "true", "actuatorfrcrange": numbers(axis.effort)}
        return words

    # ---- shapes and contacts

    def geom(self, shape):
        shape.name = shape.name if hasattr(shape, "name") else self.name("geom", shape.prim)
        attributes = {"name": shape.name, "type": shape.kind}
        if shape.kind == "mesh":
            points, triangles = shape.mesh
            mesh = self.name("mesh", shape.prim)
            vertices = " ".join(f"{x:.9g}" for point in points for x in point)
            faces = " ".join(str(i) for triangle in triangles for i in triangle)
            self.assets.append("    " + element("mesh", name=mesh, inertia="convex", vertex=vertices, face=faces))
            attributes["mesh"] = mesh
        else:
            attributes["size"] = numbers(shape.size)
        attributes |= {"pos": numbers(shape.pose.translation), "quat": numbers(shape.pose.rotation)}
        if (colour := self.colour(shape.prim)) is not None:
            attributes["rgba"] = f"{colour[0]:g} {colour[1]:g} {colour[2]:g} 1"
        if shape.margin:
            attributes["margin"] = numbers(shape.margin)
        if shape.priority:
            attributes["priority"] = shape.priority
        attributes |= {"condim": shape.condim, "friction": numbers(shape.friction)}
        attributes |= {"contype": shape.kinds[0], "conaffinity": shape.kinds[1]}
        return element("geom", **attributes)

    def margin(self, prim):
        given = [self.scene.value(prim, name, 0.0) for name in ("mjc:margin", "newton:contactMargin", "physxCollision:restOffset")]
        return next((each for each in given if each and math.isfinite(each)), 0.0) * self.scene.metre

    @staticmethod
    def colour(prim):
        colours = prim.GetAttribute("primvars:displayColor").Get()
        return colours[0] if colours else None

    def contacts(self):
        """Which shapes touch: MuJoCo's filter by bodies where it can say it, else all pairs one by one; and the pairs whose
        friction is not the larger one of their shapes."""
        scene, shapes = self.scene, self.shapes.list
        for shape in shapes:
            material = shape.material
            shape.condim = scene.value(shape.prim, "mjc:condim", 3)
            shape.friction = (material.friction, material.torsional or 0.005, material.rolling or 0.0001)
            shape.combine = "max" if scene.has(shape.prim, "MjcCollisionAPI") else material.combine
            shape.kinds = (1, 1)
            shape.priority = scene.value(shape.prim, "mjc:priority", 0)
            shape.margin = self.margin(shape.prim)
        apart = self.bodies_apart()
        alone = self.trees_without_own_contacts()
        filtered, by_shape = self.filtered_pairs(apart)
        groups = None
        if any(prim.IsA(UsdPhysics.CollisionGroup) for prim in scene.prims()):
            groups = UsdPhysics.CollisionGroup.ComputeCollisionGroupTable(scene.stage)
            for prim in scene.prims():
                if prim.IsA(UsdPhysics.CollisionGroup):
                    for each in prim.GetAuthoredProperties():
                        scene.read.add((prim.GetPath(), each.GetName()))
        pairs = []
        listed = bool(by_shape) or groups is not None or len(alone) >= BITS
        if not listed:
            bits = {tree: 1 << (n + 1) for n, tree in enumerate(alone)}
            everything = (1 << BITS) - 1
            for shape in shapes:
                own = bits.get(self.tree_of(shape.body)) if shape.body is not None else None
                if bits:
                    shape.kinds = (own, everything & ~own) if own else (1, everything)
            for a, b in sorted(filtered):
                pairs.append(element("exclude", body1=self.robot.bodies[a].name, body2=self.robot.bodies[b].name))
        # one material: MuJoCo's larger friction of the two is that of the file
        if not listed and len({(s.friction[0], s.combine == "multiply" and s.friction[0] != 1) for s in shapes}) <= 1:
            if not any(s.combine == "multiply" and s.friction[0] != 1 for s in shapes):
                return pairs
        for shape in shapes:
            shape.kinds = (0, 0) if listed else shape.kinds
            shape.name = self.name("geom", shape.prim)
        welds = [self.weld_of(i) for i in range(len(self.robot.bodies))]
        fused = [None if shape.body is None else welds[shape.body] for shape in shapes]
        trees = [None if shape.body is None else self.tree_of(shape.body) for shape in shapes]
        of_group = self.groups_of(shapes, groups) if groups else [()] * len(shapes)
        enabled = {}  # by the groups of both
        for i, a in enumerate(shapes):
            for k in range(i + 1, len(shapes)):
                b = shapes[k]
                friction = combined(a, b)
                if not listed and (a.priority != b.priority or friction == max(a.friction[0], b.friction[0])):
                    continue
                key = (a.body, b.body) if None in (a.body, b.body) or a.body < b.body else (b.body, a.body)
                if fused[i] == fused[k] or key in filtered:
                    continue
                if trees[i] is not None and trees[i] == trees[k] and trees[i] in alone:
                    continue
                if by_shape and frozenset((a.prim.GetPath(), b.prim.GetPath())) in by_shape:
                    continue
                both = of_group[i], of_group[k]
                if both not in enabled:
                    enabled[both] = all(groups.IsCollisionEnabled(g, h) for g in both[0] for h in both[1])
                if not enabled[both]:
                    continue
                others = [max(a.friction[n], b.friction[n]) for n in (1, 2, 2)]
                words = {"condim": max(a.condim, b.condim), "friction": numbers(friction, friction, *others)}
                if a.margin or b.margin:
                    words["margin"] = numbers(a.margin + b.margin)
                pairs.append(element("pair", geom1=a.name, geom2=b.name, **words))
                if len(pairs) > MOST_PAIRS:
                    scene.refuse(a.prim, f"and others make more than {MOST_PAIRS} pairs that may touch", "give them one physics material, or filter bodies instead of shapes")
                    return []
        return pairs

    @staticmethod
    def groups_of(shapes, table):
        """The paths of each shape's collision groups."""
        queries = {}
        for group in table.GetGroups() if shapes else ():
            prim = shapes[0].prim.GetStage().GetPrimAtPath(group)
            queries[group] = UsdPhysics.CollisionGroup(prim).GetCollidersCollectionAPI().ComputeMembershipQuery()
        return [tuple(g for g, query in queries.items() if query.IsPathIncluded(shape.prim.GetPath())) for shape in shapes]

    def weld_of(self, i):
        """The first body upwards that moves against its parent; None: it is fixed to the world."""
        while i is not None:
            body = self.robot.bodies[i]
            if body.is_kinematic:
                return None
            if body.is_root or any(joint.axes or joint.is_ball for joint in body.joints):
                return i
            i = body.parent
        return None

    def tree_of(self, i):
        while self.robot.bodies[i].parent is not None:
            i = self.robot.bodies[i].parent
        return i

    def bodies_apart(self):
        """Pairs of bodies that a joint keeps from touching; in files with MuJoCo's schema all that is welded to them."""
        pairs = {tuple(sorted(joint.bodies)) for joint in self.robot.joints if not joint.collides and None not in joint.bodies}
        if not any(schema in ("MjcSceneAPI", "MjcCollisionAPI") for prim in self.scene.prims() for schema in self.scene.schemas(prim)):
            return pairs
        together = {}
        for i in range(len(self.robot.bodies)):
            together.setdefault(self.weld_of(i), []).append(i)
        sides = [(together[self.weld_of(a)], together[self.weld_of(b)]) for a, b in pairs]
        return {tuple(sorted((a, b))) for some, others in sides for a in some for b in others if a != b}

    def trees_without_own_contacts(self):
        scene, alone = self.scene, []
        for prim in scene.prims():
            if not prim.HasAPI(UsdPhysics.ArticulationRootAPI):
                continue
            if scene.value(prim, "newton:selfCollisionEnabled", scene.value(prim, "physxArticulation:enabledSelfCollisions", True)):
                continue
            if prim.IsA(UsdPhysics.Joint):
                joint = self.robot.by_path.get(prim.GetPath())
                bodies = [each for each in joint.bodies if each is not None] if joint else []
            else:
                path = prim.GetPath()
                bodies = [i for i, body in enumerate(self.robot.bodies) if body.prim.GetPath().HasPrefix(path)]
            for i in bodies:
                if (tree := self.tree_of(i)) not in alone:
                    alone.append(tree)
        return alone

    def filtered_pairs(self, apart):
        """Adds pairs of bodies to `apart`; pairs of shapes that are not whole bodies are the second result."""
        scene, by_shape = self.scene, set()
        below = {}

        def side(path):
            prim = scene.stage.GetPrimAtPath(path)
            if not prim:
                return [], []
            bodies = [i for i, body in enumerate(self.robot.bodies) if body.prim.GetPath().HasPrefix(path)]
            if path not in below:
                below[path] = [shape.prim.GetPath() for shape in self.shapes.list if shape.prim.GetPath().HasPrefix(path)]
            return bodies, below[path]

        for prim in scene.prims():
            if not prim.HasAPI(UsdPhysics.FilteredPairsAPI):
                continue
            for target in scene.targets(prim, "physics:filteredPairs"):
                (bodies, shapes), (other_bodies, other_shapes) = side(prim.GetPath()), side(target)
                whole = lambda some, paths: all(self.robot.body_of(scene.stage.GetPrimAtPath(p)) in some for p in paths)
                if bodies and other_bodies and whole(bodies, shapes) and whole(other_bodies, other_shapes):
                    apart |= {tuple(sorted((a, b))) for a in bodies for b in other_bodies if a != b}
                else:
                    by_shape |= {frozenset((a, b)) for a in shapes for b in other_shapes if a != b}
        return apart, by_shape

    # ---- constraints and actuators

    def equalities(self):
        lines = []
        for joint in self.robot.joints:
            lines += self.mimics(joint)
        for joint in self.robot.loops:
            lines += self.loop(joint)
        return lines

    def axis_by_path(self, path, which=None):
        joint = self.robot.by_path.get(path)
        if joint is None or joint in self.robot.loops:
            return None
        named = [axis for axis in joint.axes if which in (None, axis.name)]
        return named[0] if len(named) == 1 or (named and which is None and len(joint.axes) == 1) else (joint.axes[0] if len(joint.axes) == 1 else None)

    def couple(self, prim, axis, leader_path, which, offset, factor, more=()):
        leader = self.axis_by_path(leader_path, which)
        if axis is None or leader is None:
            self.scene.unsupported(prim, f"mimics <{leader_path}>, which is no joint of one coordinate", "name one that is", "lets it move freely")
            return []
        coefficients = [offset, factor, *more][:5]
        coefficients += [0] * (5 - len(coefficients))
        name = self.name("equality", prim)
        return [element("joint", name=name, joint1=axis.label, joint2=leader.label, polycoef=numbers(*coefficients))]

    def mimics(self, joint):
        scene, prim, lines = self.scene, joint.prim, []
        own = self.axis_by_path(prim.GetPath())
        unit = math.pi / 180 if own is None or own.is_angular else scene.metre
        if targets := scene.targets(prim, "newton:mimicJoint"):
            if scene.value(prim, "newton:mimicEnabled", True):
                more = [scene.value(prim, f"mjc:coef{i}", 0.0) for i in (2, 3, 4)]
                offset, factor = scene.value(prim, "newton:mimicCoef0", 0.0) * unit, scene.value(prim, "newton:mimicCoef1", 1.0)
                lines += self.couple(prim, own, targets[0], None, offset, factor, more)
        elif scene.has(prim, "MjcEqualityJointAPI") and (targets := scene.targets(prim, "mjc:target")):
            defaults = (0.0, 1.0, 0.0, 0.0, 0.0)
            coefficients = [scene.value(prim, f"mjc:coef{i}", each) for i, each in enumerate(defaults)]
            lines += self.couple(prim, own, targets[0], None, *coefficients[:2], coefficients[2:])
        for schema in scene.schemas(prim):
            if not schema.startswith("PhysxMimicJointAPI:"):
                continue
            which = schema.split(":")[1]
            begin = f"physxMimicJoint:{which}:"
            axis = self.axis_by_path(prim.GetPath(), which)
            # PhysX: own coordinate + gearing x other's + offset = 0
            gearing, offset = scene.value(prim, begin + "gearing", 1.0), scene.value(prim, begin + "offset", 0.0)
            other = scene.value(prim, begin + "referenceJointAxis", "rotX")
            for target in scene.targets(prim, begin + "referenceJoint")[:1]:
                size = math.pi / 180 if axis is None or axis.is_angular else scene.metre
                lines += self.couple(prim, axis, target, str(other), -offset * size, -gearing)
        return lines

    def loop(self, joint):
        scene, prim = self.scene, joint.prim
        if joint.kind not in ("fixed", "spherical", "revolute"):
            scene.unsupported(
                prim, f"closes a loop by a {joint.kind} joint", "close it by a fixed, spherical or revolute one", "leaves it out"
            )
            return []
        if any(axis.drive or not math.isinf(axis.lower) or not math.isinf(axis.upper) for axis in joint.axes):
            scene.unsupported(
                prim,
                "closes a loop and has limits or a drive",
                "give those to a joint of the tree, and mark this one excludeFromArticulation",
                "ignores its limits and drive",
            )
        lines = []
        # two points of its axis hold a hinge
        reach = 0.05
        offsets = [Gf.Vec3d(0)] if joint.kind != "revolute" else [joint.axes[0].axis * s for s in (-reach, reach)]
        if joint.kind == "revolute":
            scene.note_each("hinges that close a loop are two points of their axis, 0.1 m apart", prim)
        for n, offset in enumerate(offsets):
            ending = f"_{n}" if len(offsets) > 1 else ""
            name = self.name("equality", prim, ending)
            sites = []
            for which in (0, 1):
                site = self.name("site", prim, f"{ending}_side{which}")
                frame = joint.frames[which] * Pose(None, offset)
                self.sites.setdefault(joint.bodies[which], []).append(
                    "    " + element("site", name=site, pos=numbers(frame.translation), quat=numbers(frame.rotation), size="0.001")
                )
                sites.append(site)
            tag = "weld" if joint.kind == "fixed" else "connect"
            lines.append(element(tag, name=name, site1=sites[0], site2=sites[1]))
        return lines

    def read_tendons(self):
        """Of MuJoCo's schema those that are sums of joints."""
        scene, lines = self.scene, []
        self.tendons = {}
        for prim in scene.prims():
            if prim.GetTypeName() != "MjcTendon":
                continue
            value = lambda name, fallback: scene.value(prim, "mjc:" + name, fallback)
            if (kind := value("type", "spatial")) != "fixed":
                scene.unsupported(prim, f"is a tendon of the type '{kind}'", "make it a fixed one", "leaves it out")
                continue
            path, factors = scene.targets(prim, "mjc:path"), list(value("path:coef", ()))
            order = list(value("path:indices", ())) or range(len(path))
            axes = [self.axis_by_path(path[i]) if i < len(path) else None for i in order]
            if len(factors) != len(axes) or None in axes:
                scene.unsupported(
                    prim,
                    f"has {len(path)} joints and {len(factors)} coefficients",
                    "name a joint of one coordinate for each coefficient",
                    "leaves it out",
                )
                continue
            words = {"name": self.name("tendon", prim)}
            for name in ("stiffness", "damping", "frictionloss", "armature", "margin"):
                if given := value(name, 0.0):
                    words[name] = numbers(given)
            for name, begin in (("range", ""), ("actuatorfrcrange", "actuatorfrc")):
                low, high = value(name + ":min", 0.0), value(name + ":max", 0.0)
                limited = value(begin + "limited", "auto")
                if limited == "true" or (limited == "auto" and low < high):
                    words |= {begin + "limited": "true", name: numbers(low, high)}
            if max(rest := list(value("springlength", (-1.0, -1.0)))) >= 0:
                words["springlength"] = numbers(*rest)
            self.tendons[prim.GetPath()] = words["name"]
            inner = [element("joint", joint=axis.label, coef=numbers(factor)) for axis, factor in zip(axes, factors)]
            lines += [element("fixed", False, **words), *("  " + each for each in inner), "</fixed>"]
        return lines

    def actuators(self):
        scene, lines = self.scene, []
        self.controls = []
        driven = set()
        for prim in scene.prims():
            if prim.GetTypeName() != "MjcActuator":
                continue
            targets = scene.targets(prim, "mjc:target")
            axis = self.axis_by_path(targets[0]) if targets else None
            tendon = self.tendons.get(targets[0]) if targets else None
            if axis is None and tendon is None:
                target = f"<{targets[0]}>" if targets else "nothing"
                scene.unsupported(prim, f"acts on {target}, which is no joint of one coordinate", "name a joint", "leaves it out")
                continue
            driven.add(axis)
            value = lambda name, fallback: scene.value(prim, "mjc:" + name, fallback)
            words = {"name": self.name("actuator", prim)}
            words |= {"joint": axis.label} if axis else {"tendon": tendon}
            for key, name, fallback in (("gear", "gear", (1,)), ("gainprm", "gainPrm", (1,)), ("biasprm", "biasPrm", (0,)), ("dynprm", "dynPrm", (1,))):
                words[key] = numbers(value(name, fallback))
            for key, name, fallback in (("gaintype", "gainType", "fixed"), ("biastype", "biasType", "none"), ("dyntype", "dynType", "none")):
                words[key] = value(name, fallback)
            for key, name in (("ctrl", "ctrl"), ("force", "force"), ("act", "act")):
                low, high = value(f"{name}Range:min", 0.0), value(f"{name}Range:max", 0.0)
                limited = value(f"{name}Limited", "auto")
                if limited == "true" or (limited == "auto" and low < high):
                    words[f"{key}limited"], words[f"{key}range"] = "true", numbers(low, high)
            if value("actDim", -1) != -1:
                words["actdim"] = value("actDim", -1)
            lines.append(element("general", **words))
            self.controls.append(0.0)
        for joint in self.robot.joints:
            for axis in joint.axes if joint not in self.robot.loops else []:
                if axis.drive and axis in driven:
                    scene.note_each("drives of joints that an MjcActuator acts on are left out", joint.prim)
                elif axis.drive:
                    lines.append(self.drive(joint, axis))
        return lines

    def drive(self, joint, axis):
        """stiffness (target - position) + damping (target velocity - velocity), within maxForce."""
        drive = axis.drive
        stiffness, damping, most = drive["stiffness"], drive["damping"], drive["most"]
        words = {"name": self.name("actuator", joint.prim, axis.label[len(joint.prim.GetDisplayName() or joint.prim.GetName()) :] if len(joint.axes) > 1 else "")}
        words["joint"] = axis.label
        if stiffness > 0:
            words |= {"gainprm": numbers(stiffness), "biastype": "affine", "biasprm": numbers(damping * drive["velocity"], -stiffness, -damping)}
            self.controls.append(drive["position"])
        elif damping > 0:
            words |= {"gainprm": numbers(damping), "biastype": "affine", "biasprm": numbers(0, 0, -damping)}
            self.controls.append(drive["velocity"])
        else:
            self.controls.append(0.0)
        if math.isfinite(most):
            words |= {"forcelimited": "true", "forcerange": numbers(-most, most)}
        return element("general", **words)

    # ---- the start

    def keyframe(self):
        """MuJoCo's coordinates follow its bodies, depth first."""
        position, velocity, moved = [], [], any(self.controls)
        order = []

        def visit(i):
            order.append(i)
            for child in self.robot.bodies[i].children:
                visit(child)

        for i, body in enumerate(self.robot.bodies):
            if body.parent is None:
                visit(i)
        for i in order:
            body = self.robot.bodies[i]
            if body.is_root and not body.is_kinematic:
                position += parts(body.pose.translation) + parts(body.pose.rotation)
                velocity += self.free_velocity(body)
                moved = moved or any(velocity[-6:])
                continue
            for joint in body.joints:
                axes = joint.axes[::-1] if joint.reversed else joint.axes
                for axis in axes:
                    start = axis.reference if axis.start is None else axis.start
                    position.append(start)
                    velocity.append(axis.speed or 0.0)
                    moved = moved or start != axis.reference or velocity[-1] != 0
                if joint.is_ball:
                    own = getattr(joint, "ball_start", None) or Gf.Quatd(1)
                    frame = joint.frames[0 if joint.reversed else 1].rotation
                    own = own.GetInverse() if joint.reversed else own
                    position += parts((frame * own * frame.GetInverse()).GetNormalized())
                    velocity += [0.0] * 3
                    moved = moved or geometry.angle_of(own) > 1e-4
        lines = []
        if moved:
            words = {"qpos": numbers(position), "qvel": numbers(velocity)}
            if self.controls:
                words["ctrl"] = numbers(self.controls)
            lines.append(element("key", name="as-in-file", **words))
        for prim in self.scene.prims():
            if prim.GetTypeName() != "MjcKeyframe":
                continue
            words = {}
            for name, count in (("qpos", len(position)), ("qvel", len(velocity)), ("ctrl", len(self.controls))):
                given = self.scene.value(prim, "mjc:" + name)
                if given is None or len(given) == 0:
                    continue
                if len(given) != count:
                    self.scene.note_each(f"keyframes whose {name} is not of this model's {count} numbers are left out", prim)
                    break
                words[name] = numbers(given)
            else:
                lines.append(element("key", name=self.name("key", prim), **words))
        return lines

    def free_velocity(self, body):
        """Of the origin in the world, and the rate in the body's frame, which are MuJoCo's; the file has the centre's."""
        scene = self.scene
        linear = Gf.Vec3d(*scene.value(body.prim, "physics:velocity", (0, 0, 0))) * scene.metre
        angular = Gf.Vec3d(*scene.value(body.prim, "physics:angularVelocity", (0, 0, 0))) * (math.pi / 180)
        if linear == Gf.Vec3d(0) and angular == Gf.Vec3d(0):
            return [0.0] * 6
        above = body.prim.GetParent()
        turned = scene.turned.rotation if above.IsPseudoRoot() else scene.pose(above).rotation
        linear, angular = turned.Transform(linear), turned.Transform(angular)
        centre = body.pose.rotation.Transform(body.mass[1])
        linear = linear - Gf.Cross(angular, centre)
        return parts(linear) + parts(body.pose.rotation.GetInverse().Transform(angular))


def combined(a, b):
    """PhysX takes the mode of the two that comes later in this list."""
    if a.priority != b.priority:
        return max((a, b), key=lambda each: each.priority).friction[0]
    modes = ["average", "min", "multiply", "max"]
    mode = max((modes.index(each.combine) if each.combine in modes else 0) for each in (a, b))
    x, y = a.friction[0], b.friction[0]
    return ((x + y) / 2, min(x, y), x * y, max(x, y))[mode]

