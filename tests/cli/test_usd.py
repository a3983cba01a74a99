"""USD files: what the reader makes of UsdPhysics and the schemas of engines, by closed forms and the same robot in MJCF."""

import math
import os
import pathlib
import subprocess
import xml.etree.ElementTree as ElementTree

from harness import AssayTest, main, read_csv

CACHE = os.environ.get("ASSAY_TEST_CACHE", "")
DEGREE = math.pi / 180


def stage(text, metre=1.0, kilogram=1.0, up="Z", layers=""):
    return f"""#usda 1.0
(
    defaultPrim = "robot"
    metersPerUnit = {metre!r}
    kilogramsPerUnit = {kilogram!r}
    upAxis = "{up}"
    {layers}
)
{text}
"""


def prim(kind, name, inside="", apis=(), more=""):
    """`inside`: properties and prims, a line each."""
    schemas = f"prepend apiSchemas = [{', '.join(f'{chr(34)}{each}{chr(34)}' for each in apis)}]" if apis else ""
    head = f"(\n{schemas}\n{more}\n)" if schemas or more else ""
    return f'def {kind} "{name}" {head}\n{{\n{inside}\n}}\n'


def vector(values):
    return f"({', '.join(repr(float(each)) for each in values)})"


def place(position, quaternion=None, scale=None):
    lines, order = [f"double3 xformOp:translate = {vector(position)}"], ["translate"]
    if quaternion is not None:
        lines.append(f"quatd xformOp:orient = {vector(quaternion)}")
        order.append("orient")
    if scale is not None:
        lines.append(f"double3 xformOp:scale = {vector(scale)}")
        order.append("scale")
    lines.append(f"uniform token[] xformOpOrder = [{', '.join(f'{chr(34)}xformOp:{each}{chr(34)}' for each in order)}]")
    return "\n".join(lines)


def body(name, inside="", apis=(), at=(0, 0, 0), **where):
    return prim("Xform", name, place(at, **where) + "\n" + inside, ["PhysicsRigidBodyAPI", *apis])


def mass(kilograms=1.0, moments=(0.1, 0.1, 0.1), centre=(0, 0, 0)):
    return (f"float physics:mass = {kilograms!r}\nfloat3 physics:diagonalInertia = {vector(moments)}\n"
            f"point3f physics:centerOfMass = {vector(centre)}")


def joint(kind, name, first, second, inside="", apis=(), at=(0, 0, 0), at_second=(0, 0, 0)):
    ends = "".join(f"rel physics:body{i} = </robot/{each}>\n" for i, each in enumerate((first, second)) if each)
    frames = f"point3f physics:localPos0 = {vector(at)}\npoint3f physics:localPos1 = {vector(at_second)}\n"
    return prim(f"Physics{kind}Joint", name, ends + frames + inside, apis)


def robot(*parts, apis=(), inside=""):
    return prim("Xform", "robot", inside + "\n" + "\n".join(parts), apis)


DOWN = (math.sqrt(0.5), -math.sqrt(0.5), 0, 0)  # what turns z to y

# An arm whose numbers are those of ARM_MJCF: m, kg, s. Lengths and masses are in the file's units.
def arm(metre=1.0, kilogram=1.0, up="Z"):
    force, torque = kilogram * metre, kilogram * metre**2
    place_of = lambda *values: tuple(each / metre for each in values)
    moments = lambda *values: tuple(each / torque for each in values)
    parts = [
        prim("PhysicsScene", "scene"),
        body("base", mass(5 / kilogram, moments(0.1, 0.1, 0.1)), ["PhysicsMassAPI"]),
        joint("Fixed", "hold", "", "base", f"quatf physics:localRot0 = {vector(DOWN if up == 'Y' else (1, 0, 0, 0))}"),
        body("upper", mass(2 / kilogram, moments(0.02, 0.03, 0.01), place_of(0.05, 0, 0.1))
             + "\nquatf physics:principalAxes = (0.9238795, 0.3826834, 0, 0)", ["PhysicsMassAPI"], at=place_of(0, 0, 0.3)),
        joint("Revolute", "shoulder", "base", "upper", f"""uniform token physics:axis = "Y"
            float physics:lowerLimit = -90
            float physics:upperLimit = 45
            float drive:angular:physics:stiffness = {50 * DEGREE / torque!r}
            float drive:angular:physics:damping = {2 * DEGREE / torque!r}
            float drive:angular:physics:maxForce = {30 / torque!r}
            float physxJoint:armature = {0.04 / torque!r}
            float newton:damping = {0.3 * DEGREE / torque!r}
            float newton:friction = {0.2 / torque!r}""", ["PhysicsDriveAPI:angular", "PhysxJointAPI"], at=place_of(0, 0, 0.3)),
        body("fore", mass(1 / kilogram, moments(0.01, 0.01, 0.005)), ["PhysicsMassAPI"], at=place_of(0, 0, 0.7)),
        joint("Prismatic", "slide", "upper", "fore", f"""uniform token physics:axis = "Z"
            float physics:lowerLimit = {-0.1 / metre!r}
            float physics:upperLimit = {0.2 / metre!r}
            float drive:linear:physics:damping = {20 / kilogram!r}
            float drive:linear:physics:maxForce = {80 / force!r}""", ["PhysicsDriveAPI:linear"], at=place_of(0, 0, 0.4)),
        body("hand", mass(0.5 / kilogram, moments(0.002, 0.002, 0.001)), ["PhysicsMassAPI"], at=place_of(0.1, 0, 0.9)),
        joint("Spherical", "wrist", "fore", "hand", at=place_of(0.1, 0, 0.2)),
    ]
    # the same robot in a world whose y points up
    turned = place((0, 0, 0), DOWN) if up == "Y" else ""
    return stage(robot(*parts, inside=turned), metre, kilogram, up)


ARM_MJCF = """<mujoco model="robot">
  <compiler angle="degree"/>
  <worldbody>
    <body name="base">
      <inertial mass="5" pos="0 0 0" diaginertia="0.1 0.1 0.1"/>
      <body name="upper" pos="0 0 0.3">
        <joint name="shoulder" axis="0 1 0" range="-90 45" armature="0.04" damping="0.3" frictionloss="0.2"/>
        <inertial mass="2" pos="0.05 0 0.1" diaginertia="0.02 0.03 0.01" quat="0.9238795 0.3826834 0 0"/>
        <body name="fore" pos="0 0 0.4">
          <joint name="slide" type="slide" axis="0 0 1" range="-0.1 0.2"/>
          <inertial mass="1" pos="0 0 0" diaginertia="0.01 0.01 0.005"/>
          <body name="hand" pos="0.1 0 0.2">
            <joint name="wrist" type="ball"/>
            <inertial mass="0.5" pos="0 0 0" diaginertia="0.002 0.002 0.001"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder" joint="shoulder" kp="50" kv="2" forcerange="-30 30"/>
    <velocity name="slide" joint="slide" kv="20" forcerange="-80 80"/>
  </actuator>
</mujoco>
"""

BOX_POINTS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
BOX_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]  # outwards


def box_mesh(name, size, approximation="convexHull", left_handed=False, inside=""):
    faces = [face[::-1] if left_handed else face for face in BOX_FACES]
    points = ", ".join(vector(each * size[i] for i, each in enumerate(point)) for point in BOX_POINTS)
    orientation = 'uniform token orientation = "leftHanded"\n' if left_handed else ""
    return prim("Mesh", name, f"""point3f[] points = [{points}]
        int[] faceVertexCounts = [{', '.join('4' for _ in faces)}]
        int[] faceVertexIndices = [{', '.join(str(i) for face in faces for i in face)}]
        uniform token physics:approximation = "{approximation}"
        {orientation}{inside}""", ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])


class UsdTest(AssayTest):
    def setUp(self):
        super().setUp()
        environments = pathlib.Path(CACHE, "python")
        found = sorted(environments.glob("usd-*/bin/python"))
        if not found:
            self.skipTest("the library that reads USD is not set up: ./assay setup usd")
        self.python = found[0]
        (self.dir / "cache/assay").mkdir(parents=True, exist_ok=True)
        (self.dir / "cache/assay/python").symlink_to(environments)

    def model(self, text, *options, name="robot.usda"):
        """The model as MJCF, and what was noted."""
        self.write(name, text)
        done = self.run_assay("convert", name, "--to", "mjcf", "--out", "-", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return ElementTree.fromstring(done.stdout), done.stderr

    def only(self, model, path):
        found = model.findall(path)
        self.assertEqual(len(found), 1, path)
        return found[0]

    def assert_numbers(self, text, expected, within=1e-6):
        values = [float(each) for each in text.split()]
        self.assertEqual(len(values), len(expected), text)
        for value, each in zip(values, expected):
            self.assertAlmostEqual(value, each, delta=within * max(1, abs(each)))

    def refusal(self, text, *naming, options=()):
        self.write("robot.usda", text)
        return self.refused("check", "robot.usda", *options, naming=naming)


class SameRobot(UsdTest):
    def test_units_and_axes_change_nothing(self):
        self.write("arm.xml", ARM_MJCF)
        for metre, kilogram, up in ((1.0, 1.0, "Z"), (0.01, 1.0, "Z"), (1.0, 0.001, "Z"), (0.01, 0.5, "Y")):
            with self.subTest(metre=metre, kilogram=kilogram, up=up):
                self.write("arm.usda", arm(metre, kilogram, up))
                # single precision of the file
                done = self.run_assay("parity", "arm.usda", "arm.xml", "--fail-above", "0.001%")
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_a_gain_that_is_1_percent_off_is_named(self):
        self.write("arm.xml", ARM_MJCF.replace('kp="50"', 'kp="50.5"'))
        self.write("arm.usda", arm())
        done = self.run_assay("parity", "arm.usda", "arm.xml")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("shoulder", done.stdout)
        self.assertIn("USD", done.stdout)

    def test_binary_and_packed_files_are_the_same(self):
        text, _ = self.model(arm())
        expected = ElementTree.tostring(text)
        for ending in ("usdc", "usd", "usdz"):
            script = "import sys; from pxr import Sdf, UsdUtils\n"
            if ending == "usdz":
                script += "assert UsdUtils.CreateNewUsdzPackage(sys.argv[1], sys.argv[2])"
            else:
                script += "Sdf.Layer.FindOrOpen(sys.argv[1]).Export(sys.argv[2])"
            subprocess.run([self.python, "-c", script, "robot.usda", f"robot.{ending}"], cwd=self.dir, check=True, capture_output=True)
            with self.subTest(ending=ending):
                done = self.run_assay("convert", f"robot.{ending}", "--to", "mjcf", "--out", "-")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(ElementTree.tostring(ElementTree.fromstring(done.stdout)), expected)

    def test_it_is_simulated_in_an_engine(self):
        ball = body("ball", mass() + '\nvector3f physics:velocity = (1, 0, 0)', ["PhysicsMassAPI"], at=(0, 0, 10))
        self.write("ball.usda", stage(robot(ball)))
        last = read_csv(self.assay("simulate", "ball.usda", "--engine", "ode-step", "--timestep", "1", "--duration", "1", "--out", "-"))[-1]
        self.assertAlmostEqual(last["x"], 1, delta=1e-6)
        self.assertAlmostEqual(last["z"], 10 - 9.81 / 2, delta=0.02)


class Masses(UsdTest):
    def inertial(self, *parts, apis=(), inside="", outside=""):
        model, _ = self.model(stage(robot(body("box", inside + "\n" + "\n".join(parts), apis), outside)))
        return self.only(model, ".//inertial")

    CUBE = "double size = 0.2"

    def test_the_weakest_density_is_the_material_s(self):
        material = prim("Material", "rubber", "float physics:density = 3000\nfloat physics:dynamicFriction = 0.5\nfloat physics:staticFriction = 0.5",
                        ["PhysicsMaterialAPI"])
        bound = "rel material:binding:physics = </robot/rubber>\n" + self.CUBE
        dense, heavy = "float physics:density = 500\n", "float physics:mass = 7\n"
        collision, massive = ["PhysicsCollisionAPI", "MaterialBindingAPI"], ["PhysicsMassAPI"]
        for cube, apis, of_body, expected in (
            (self.CUBE, [], "", 8), (bound, [], "", 24), (bound, [], "float physics:density = 2000\n", 16),
            (bound + "\n" + dense, massive, "float physics:density = 2000\n", 4), (bound + "\n" + heavy, massive, "", 7),
            (bound + "\n" + heavy, massive, "float physics:mass = 3\n", 3),
        ):
            with self.subTest(expected=expected):
                inertial = self.inertial(prim("Cube", "cube", cube, collision + apis), apis=massive, inside=of_body, outside=material)
                self.assert_numbers(inertial.get("mass"), [expected])
                moment = expected * 0.2**2 / 6
                self.assert_numbers(inertial.get("fullinertia"), [moment] * 3 + [0] * 3)

    def test_shapes_have_their_volumes_and_moments(self):
        # volume and principal moments of density 1, x y z
        r, h = 0.1, 0.4
        cylinder = math.pi * r**2 * h
        ball = 4 / 3 * math.pi * r**3
        side = cylinder * (r**2 / 4 + h**2 / 12) + ball * (0.4 * r**2 + h**2 / 4 + 3 / 8 * h * r)
        cone = math.pi * r**2 * h / 3
        box = (0.2, 0.4, 0.6)
        brick = [0.048 / 12 * (a * a + b * b) for a, b in ((0.4, 0.6), (0.2, 0.6), (0.2, 0.4))]
        round_ = f"double radius = {r}\ndouble height = {h}\n"
        shapes = [
            (prim("Sphere", "s", f"double radius = {r}", ["PhysicsCollisionAPI"]), ball, [0.4 * ball * r * r] * 3, 1e-6),
            (prim("Cylinder", "s", round_ + 'uniform token axis = "Y"', ["PhysicsCollisionAPI"]), cylinder,
             [cylinder * (r**2 / 4 + h**2 / 12), cylinder * r**2 / 2, cylinder * (r**2 / 4 + h**2 / 12)], 1e-6),
            (prim("Capsule", "s", round_ + 'uniform token axis = "X"', ["PhysicsCollisionAPI"]), cylinder + ball,
             [cylinder * r**2 / 2 + 0.4 * ball * r**2, side, side], 1e-6),
            (prim("Cone", "s", round_, ["PhysicsCollisionAPI"]), cone,
             [cone * (3 / 20 * r**2 + 3 / 80 * h**2)] * 2 + [cone * 0.3 * r**2], 0.02),
            (box_mesh("s", [each / 2 for each in box]), 0.048, brick, 1e-6),
            (box_mesh("s", [each / 2 for each in box], "none", left_handed=True), 0.048, brick, 1e-6),
            (box_mesh("s", [0.5] * 3, inside=place((0, 0, 0), scale=(-0.2, 0.4, 0.6))), 0.048, brick, 1e-6),
            (box_mesh("s", [each / 2 for each in box], "boundingCube"), 0.048, brick, 1e-6),
            (prim("Cube", "s", "double size = 1\n" + place((0, 0, 0), scale=box), ["PhysicsCollisionAPI"]), 0.048, brick, 1e-6),
        ]
        for text, volume, moments, within in shapes:
            with self.subTest(text.split("{")[0] + text[-200:]):
                inertial = self.inertial(text)
                self.assertAlmostEqual(float(inertial.get("mass")) / (1000 * volume), 1, delta=within)
                for value, moment in zip(inertial.get("fullinertia").split(), moments):
                    self.assertAlmostEqual(float(value) / (1000 * moment), 1, delta=within)

    def test_a_mass_without_inertia_is_spread_over_the_shapes(self):
        cubes = [prim("Cube", name, self.CUBE + "\n" + place((x, 0, 0)), ["PhysicsCollisionAPI"]) for name, x in (("a", 0), ("b", 0.4))]
        inertial = self.inertial(*cubes, apis=["PhysicsMassAPI"], inside="float physics:mass = 2")
        self.assert_numbers(inertial.get("pos"), [0.2, 0, 0])
        own = 2 * 0.2**2 / 6
        self.assert_numbers(inertial.get("fullinertia"), [own, own + 2 * 0.2**2, own + 2 * 0.2**2, 0, 0, 0])


PAIR = [body("a", mass(), ["PhysicsMassAPI"]), body("b", mass(), ["PhysicsMassAPI"], at=(1, 0, 0))]


class Joints(UsdTest):
    def test_a_joint_hangs_the_first_body_on_the_second_where_that_is_the_root(self):
        turn = joint("Revolute", "turn", "a", "b", 'uniform token physics:axis = "Z"\nfloat physics:lowerLimit = -10\nfloat physics:upperLimit = 20', at=(1, 0, 0))
        model, _ = self.model(stage(robot(*PAIR, turn, joint("Fixed", "hold", "", "b", at=(1, 0, 0)))))
        hinge = self.only(model, ".//body[@name='a']/joint")
        # b's coordinate against a: seen from b the axis is the other way round, with the same limits
        self.assert_numbers(hinge.get("axis"), [0, 0, -1])
        self.assert_numbers(hinge.get("range"), [-10 * DEGREE, 20 * DEGREE])
        self.assert_numbers(hinge.get("pos"), [1, 0, 0])

    def start_angle(self, text):
        """About z, of the only body that moves."""
        self.write("start.usda", stage(text))
        row = read_csv(self.assay("simulate", "start.usda", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "0.001", "--out", "-"))[0]
        self.assertEqual(row["time"], 0)
        return 2 * math.atan2(row["qz"], row["qw"])

    def test_bodies_that_are_turned_start_there(self):
        half = math.radians(15)
        second = body("b", mass(), ["PhysicsMassAPI"], at=(1, 0, 0), quaternion=(math.cos(half), 0, 0, math.sin(half)))
        turn = joint("Revolute", "turn", "a", "b", 'uniform token physics:axis = "Z"', at=(1, 0, 0))
        hold = joint("Fixed", "hold", "", "a")
        self.assertAlmostEqual(self.start_angle(robot(PAIR[0], second, turn, hold)), math.radians(30), delta=1e-6)
        state = turn.replace('uniform token physics:axis = "Z"', 'uniform token physics:axis = "Z"\nfloat state:angular:physics:position = 40')
        self.assertAlmostEqual(self.start_angle(robot(*PAIR, state, hold)), math.radians(40), delta=1e-6)

    def test_limits_of_a_generic_joint_lock_what_they_leave_nothing_of(self):
        locked = "".join(f"float limit:{each}:physics:low = 1\nfloat limit:{each}:physics:high = -1\n" for each in ("transX", "transY", "transZ", "rotZ"))
        apis = [f"PhysicsLimitAPI:{each}" for each in ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")]
        limits = "float limit:rotX:physics:low = -20\nfloat limit:rotX:physics:high = 30\nfloat limit:rotY:physics:low = -5\nfloat limit:rotY:physics:high = 6\n"
        model, _ = self.model(stage(robot(*PAIR, prim("PhysicsJoint", "both", "rel physics:body0 = </robot/a>\nrel physics:body1 = </robot/b>\npoint3f physics:localPos0 = (1, 0, 0)\n" + locked + limits, apis))))
        found = model.findall(".//joint")
        self.assertEqual([each.get("name") for each in found], ["both_rotY", "both_rotX"])
        self.assert_numbers(found[0].get("range"), [-5 * DEGREE, 6 * DEGREE])
        self.assert_numbers(found[1].get("axis"), [1, 0, 0])

    def test_a_four_bar_is_closed_by_points_of_its_hinge(self):
        bars = [body(name, mass(), ["PhysicsMassAPI"], at=at) for name, at in (("left", (0, 0, 0)), ("top", (0, 0, 1)), ("right", (1, 0, 0)))]
        axis = 'uniform token physics:axis = "Y"'
        hinges = [joint("Revolute", "foot", "", "left", axis), joint("Revolute", "knee", "left", "top", axis, at=(0, 0, 1)),
                  joint("Revolute", "heel", "", "right", axis, at=(1, 0, 0)),
                  joint("Revolute", "lid", "top", "right", axis + "\nbool physics:excludeFromArticulation = 1", at=(1, 0, 0), at_second=(0, 0, 1))]
        model, stderr = self.model(stage(robot(*bars, *hinges)))
        self.assertEqual(len(model.findall(".//joint[@name]")), 3)
        self.assertEqual(len(model.findall(".//connect")), 2)
        self.assertIn("</robot/lid>", stderr)

    def test_mimics_of_physx_and_newton(self):
        turns = [body("c", mass(), ["PhysicsMassAPI"], at=(2, 0, 0)), joint("Fixed", "hold", "", "a"), joint("Revolute", "lead", "a", "b", 'uniform token physics:axis = "Z"', at=(1, 0, 0))]
        axis = 'uniform token physics:axis = "Z"\n'
        physx = axis + "float physxMimicJoint:rotZ:gearing = -2\nfloat physxMimicJoint:rotZ:offset = 30\nrel physxMimicJoint:rotZ:referenceJoint = </robot/lead>\nuniform token physxMimicJoint:rotZ:referenceJointAxis = \"rotZ\""
        newton = axis + "float newton:mimicCoef0 = -30\nfloat newton:mimicCoef1 = 2\nrel newton:mimicJoint = </robot/lead>"
        for text, api in ((physx, "PhysxMimicJointAPI:rotZ"), (newton, "NewtonMimicAPI")):
            with self.subTest(api):
                model, _ = self.model(stage(robot(*PAIR, *turns, joint("Revolute", "follow", "b", "c", text, [api], at=(1, 0, 0)))))
                coupling = self.only(model, ".//equality/joint")
                offset, factor, *others = (float(each) for each in coupling.get("polycoef").split())
                if coupling.get("joint1") == "lead":
                    offset, factor = -offset / factor, 1 / factor
                self.assertEqual({coupling.get("joint1"), coupling.get("joint2")}, {"follow", "lead"})
                self.assertAlmostEqual(offset, -30 * DEGREE)
                self.assertAlmostEqual(factor, 2)
                self.assertEqual(others, [0, 0, 0])


class Contacts(UsdTest):
    """Three balls in a row on hinges, and a floor."""

    BALL = prim("Sphere", "skin", "double radius = 0.1", ["PhysicsCollisionAPI"])

    def pairs(self, *more, first="", apis=(), of_joint="", root=(), inside="", floor=""):
        bodies = [body("a", first + "\n" + self.BALL, apis), body("b", self.BALL, at=(1, 0, 0)), body("c", self.BALL, at=(2, 0, 0))]
        hinges = [joint("Revolute", f"{x}{y}", x, y, of_joint, at=(1, 0, 0)) for x, y in ("ab", "bc")]
        ground = prim("Plane", "floor", 'uniform token axis = "Z"\n' + floor + place((0, 0, -2)), ["PhysicsCollisionAPI", "MaterialBindingAPI"])
        model, self.noted = self.model(stage(robot(*bodies, *hinges, *more, apis=root, inside=inside) + ground))
        return {frozenset((each.get("geom1"), each.get("geom2"))): each for each in model.findall(".//contact/pair")}

    def bodies(self, pairs):
        names = {"skin": "a", "b_skin": "b", "c_skin": "c", "floor": "floor"}
        return {"".join(sorted(names[each] for each in pair)) for pair in pairs}

    def test_who_touches_whom(self):
        floors = {"afloor", "bfloor", "cfloor"}
        self.assertEqual(self.bodies(self.pairs()), floors | {"ac"})
        self.assertEqual(self.bodies(self.pairs(of_joint="bool physics:collisionEnabled = 1")), floors | {"ab", "bc", "ac"})
        self.assertEqual(self.bodies(self.pairs(root=["PhysicsArticulationRootAPI"], inside="bool physxArticulation:enabledSelfCollisions = 0")), floors)
        self.assertEqual(self.bodies(self.pairs(first="rel physics:filteredPairs = </robot/c>", apis=["PhysicsFilteredPairsAPI"])), floors)
        group = prim("PhysicsCollisionGroup", "balls", "rel collection:colliders:includes = [</robot/a>, </robot/c>]\nrel physics:filteredGroups = </robot/balls>", ["CollectionAPI:colliders"])
        self.assertEqual(self.bodies(self.pairs(group)), floors)

    def test_friction_is_combined_as_the_materials_say(self):
        ice = lambda mode: prim("Material", "ice", f'float physics:dynamicFriction = 0.1\nfloat physics:staticFriction = 0.1\nuniform token physxMaterial:frictionCombineMode = "{mode}"', ["PhysicsMaterialAPI", "PhysxMaterialAPI"])
        for mode, expected in (("average", 0.3), ("min", 0.1), ("multiply", 0.05), ("max", 0.5)):
            with self.subTest(mode):
                pairs = self.pairs(ice(mode), floor="rel material:binding:physics = </robot/ice>\n")
                self.assert_numbers(pairs[frozenset(("skin", "floor"))].get("friction").split()[0], [expected])
                self.assert_numbers(pairs[frozenset(("skin", "c_skin"))].get("friction").split()[0], [0.5])
                self.assertIn("PhysX's default", self.noted)


class Account(UsdTest):
    def test_what_is_not_carried_over_is_named(self):
        damped = body("a", mass() + "\nfloat physxRigidBody:linearDamping = 0.2\nfloat physics:unheardOf = 3", ["PhysicsMassAPI"])
        _, noted = self.model(stage(robot(damped, apis=["PhysicsArticulationRootAPI"], inside="int physxArticulation:solverPositionIterationCount = 8")))
        for word in ("physxRigidBody:linearDamping", "physics:unheardOf", "</robot/a>", "the contender decides them"):
            self.assertIn(word, noted)

    def test_units_axes_and_disabled_parts_are_named(self):
        off = joint("Revolute", "off", "a", "b", "bool physics:jointEnabled = 0")
        _, noted = self.model(stage(robot(*PAIR, off), metre=0.01, up="Y"))
        for word in ("metersPerUnit is 0.01", "y is up", "</robot/off>"):
            self.assertIn(word, noted)
        _, noted = self.model(stage(robot(*PAIR)).replace("metersPerUnit = 1.0", ""))
        self.assertIn("USD's default", noted)

    def test_findings_name_prims(self):
        turn = joint("Revolute", "turn", "a", "b", at=(1, 0, 0))
        weak = body("b", "", at=(1, 0, 0))
        sentence = self.refusal(stage(robot(PAIR[0], weak, turn)), "</robot/b>")
        self.assertNotIn("line", sentence)


class Composition(UsdTest):
    PART = stage(robot(*PAIR, joint("Revolute", "turn", "a", "b", at=(1, 0, 0))))

    def over(self, arc, **options):
        return stage(prim("Xform", "robot", more=f"prepend {arc}"), **options)

    def test_files_within_the_folder_are_read(self):
        self.write("parts/part.usda", self.PART)
        expected, _ = self.model(self.PART)
        for arc in ("references = @parts/part.usda@", "payload = @parts/part.usda@"):
            with self.subTest(arc):
                model, _ = self.model(self.over(arc))
                self.assertEqual(ElementTree.tostring(model), ElementTree.tostring(expected))
        model, _ = self.model(stage("", layers="subLayers = [@parts/part.usda@]"))
        self.assertEqual(ElementTree.tostring(model), ElementTree.tostring(expected))

    def test_instances_are_bodies_of_their_own(self):
        self.write("parts/ball.usda", stage(prim("Xform", "robot", prim("Sphere", "skin", "double radius = 0.1", ["PhysicsCollisionAPI"]))))
        shell = prim("Xform", "shell", more="instanceable = true\nprepend references = @parts/ball.usda@")
        bodies = [body(name, shell, at=(i, 0, 0)) for i, name in enumerate("abc")]
        model, _ = self.model(stage(robot(*bodies)))
        self.assertEqual(len(model.findall(".//geom")), 3)
        for inertial in model.findall(".//inertial"):
            self.assert_numbers(inertial.get("mass"), [4 / 3 * math.pi])

    def test_files_outside_are_refused_by_name(self):
        self.write("other/part.usda", self.PART)
        for arc in ("references = @../other/part.usda@", "payload = @../other/part.usda@", f"references = @{self.dir}/other/part.usda@"):
            with self.subTest(arc):
                self.write("mine/robot.usda", self.over(arc))
                self.refused("check", "mine/robot.usda", naming=("other/part.usda", "outside the model's folder", "--allow-external-files"))
        self.assertIn("2 bodies", self.assay("check", "mine/robot.usda", "--allow-external-files"))
        os.symlink("../other/part.usda", self.dir / "mine/link.usda")
        self.write("mine/robot.usda", self.over("references = @link.usda@"))
        self.refused("check", "mine/robot.usda", naming=("link.usda", "outside the model's folder"))

    def test_cycles_and_missing_files_are_refused_by_name(self):
        self.write("b.usda", self.over("references = @robot.usda@"))
        self.refusal(self.over("references = @b.usda@"), "cycle", "b.usda", "robot.usda")
        self.refusal(self.over("payload = @gone.usda@"), "gone.usda", "not there")
        self.refusal(self.over("payload = @https://example.org/arm.usd@"), "https://example.org/arm.usd", "network")


class BadFiles(UsdTest):
    def test_refusals_name_the_value_and_the_fix(self):
        turn = lambda inside, kind="Revolute", **more: joint(kind, "turn", "a", "b", inside, at=(1, 0, 0), **more)
        cases = [
            (stage(prim("Xform", "robot", prim("Cube", "box"))), "has no UsdPhysics joint or rigid body", "Cube"),
            (stage(robot(joint("Revolute", "turn", "", ""))), "PhysicsRigidBodyAPI"),
            (stage(robot(*PAIR, turn("float physics:lowerLimit = 2\nfloat physics:upperLimit = 1"))), "</robot/turn>", "lower limit of 2", "swap"),
            (stage(robot(*PAIR, turn("rel physics:body0 = </robot/nobody>").replace("rel physics:body0 = </robot/a>\n", ""))), "</robot/nobody>", "not there"),
            (stage(robot(*PAIR, turn("", "Distance"))), "PhysicsDistanceJoint", "--drop-unsupported"),
            (stage(robot(*PAIR, turn('uniform token drive:angular:physics:type = "acceleration"\nfloat drive:angular:physics:stiffness = 3', apis=["PhysicsDriveAPI:angular"]))), "acceleration"),
            (stage(robot(*PAIR, turn("float physxJoint:armature = -1"))), "negative armature of -1"),
            (stage(robot(body("a", "float physics:mass = -2", ["PhysicsMassAPI"]))), "mass -2", "positive"),
            (stage(robot(body("a", prim("Sphere", "s", "double radius = 0", ["PhysicsCollisionAPI"])))), "</robot/a/s>", "size 0"),
            (stage(robot(body("a", prim("BasisCurves", "s", "", ["PhysicsCollisionAPI"])))), "BasisCurves"),
            (stage(robot(*PAIR), metre=-1.0), "metersPerUnit is -1"),
            ("#usda 1.0\ndef Xform {", "is no USD"),
            ("PXR-USDC", "robot.usda"),
            ("", "robot.usda"),
        ]
        for text, *naming in cases:
            with self.subTest(naming):
                self.refusal(text, *naming)

    def test_without_the_library_it_says_how_to_get_it(self):
        (self.dir / "cache/assay/python").unlink()
        self.refusal(arm(), "usd-core", "./assay setup usd")

    def test_what_is_left_out_is_named(self):
        self.write("robot.usda", stage(robot(*PAIR, joint("Distance", "far", "a", "b"), joint("Revolute", "turn", "a", "b", at=(1, 0, 0)))))
        self.assertIn("</robot/far>", self.assay("check", "robot.usda", "--drop-unsupported"))


if __name__ == "__main__":
    main()
