"""URDF files as their users have them: packages, meshes, mistakes and their repair."""

import struct

from harness import AssayTest, main

BOX = [(0.1 * x, 0.2 * y, 0.3 * z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
         (1, 5, 7), (1, 7, 3)]
INERTIAL = ('<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>')


def stl():
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *[x for k in face for x in BOX[k]], 0) for face in FACES)
    return bytes(80) + struct.pack("<I", len(FACES)) + body


def obj():
    return "".join(f"v {x} {y} {z}\n" for x, y, z in BOX) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES)


def dae(unit, up):
    numbers = " ".join(f"{x / unit:.9g}" for p in BOX for x in p)
    indices = " ".join(str(k) for face in FACES for k in face)
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="u" meter="{unit}"/><up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="24">{numbers}</float_array><technique_common>
<accessor source="#a" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def arm(tip="", joint='type="continuous"', inside="", inertial=INERTIAL):
    """One link that turns; `tip` is what else it has, `inside` what else its joint has."""
    return f"""<robot name="arm">
<link name="base"/>
<link name="tip">{inertial}
{tip}</link>
<joint name="turn" {joint}><parent link="base"/><child link="tip"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
{inside}</joint>
</robot>
"""


def mesh(uri, scale=""):
    return f'<collision><geometry><mesh filename="{uri}"{scale}/></geometry></collision>'


class Meshes(AssayTest):
    def ground_height(self, text, *options):
        """Where --ground puts the plane: the lowest point of the hull."""
        self.write("ws/my_robot/urdf/arm.urdf", text)
        model = self.assay_json("check", "ws/my_robot/urdf/arm.urdf", "--ground", "--json", *options)["model"]
        self.assertEqual(model["planes"], 1)
        return model["contact_pairs"], model["hash"]

    def test_formats_give_one_hull(self):
        self.write("ws/my_robot/meshes/box.obj", obj())
        (self.dir / "ws/my_robot/meshes/box.stl").write_bytes(stl())
        self.write("ws/my_robot/meshes/box_mm.dae", dae(0.001, "Z_UP"))
        self.write("ws/my_robot/meshes/box_y.dae", dae(1, "Y_UP"))
        pairs, first = self.ground_height(arm(mesh("package://my_robot/meshes/box.stl")))
        self.assertEqual(pairs, 1)
        self.assertNotEqual(self.ground_height(arm(mesh("package://my_robot/meshes/box.stl", ' scale="1 1 2"')))[1], first)
        beside = arm(mesh("../meshes/box.stl"))
        self.assertEqual(self.ground_height(beside, "--allow-external-files")[1], first)
        self.write("ws/my_robot/package.xml", "<package><name>my_robot</name></package>")
        self.assertEqual(self.ground_height(beside)[1], first, "the file's package is its folder")

    def test_missing_mesh_names_where_it_was_looked_for(self):
        self.write("arm.urdf", arm(mesh("package://elsewhere/box.stl")))
        self.refused("check", "arm.urdf", naming=["elsewhere/box.stl", "line 4", "--package elsewhere=DIR"])
        (self.dir / "there").mkdir()
        self.refused("check", "arm.urdf", "--package", "elsewhere=there", naming=["there/box.stl"])
        (self.dir / "there/box.stl").write_bytes(stl())
        self.assay("check", "arm.urdf", "--package", "elsewhere=there")

    def test_broken_meshes(self):
        for content, words in [(b"", "empty file"), (b"solid nothing\nendsolid\n", "box.stl"),
                               (bytes(80) + struct.pack("<I", 0), "box.stl"), (b"garbage" * 40, "box.stl")]:
            (self.dir / "box.stl").write_bytes(content)
            self.write("arm.urdf", arm(mesh("box.stl")))
            self.refused("check", "arm.urdf", naming=[words, "line 4"])
            self.assay("check", "arm.urdf", "--drop-unsupported")

    def test_visual_meshes_are_not_needed(self):
        self.write("arm.urdf", arm('<visual><geometry><mesh filename="package://no/where.dae"/></geometry></visual>'))
        self.assay("check", "arm.urdf")


class Mistakes(AssayTest):
    def refused_with(self, text, *naming):
        self.write("arm.urdf", text)
        return self.refused("check", "arm.urdf", naming=naming)

    def test_tree(self):
        extra = '<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/></joint></robot>'
        self.refused_with(arm().replace("</robot>", extra.format("turn", "tip", "base")), "joint 'turn'", "line 5")
        self.refused_with(arm().replace("</robot>", extra.format("back", "tip", "base")), "cycle")
        self.refused_with(arm().replace("</robot>", extra.format("twice", "base", "tip")), "two joints")
        self.refused_with(arm().replace("</robot>", extra.format("x", "bse", "tip")), "'bse'", "did you mean 'base'?")
        self.refused_with(arm().replace("</robot>", '<link name="tip"/></robot>'), "line 3", "rename")
        self.refused_with(arm().replace("</robot>", '<link name="alone"/></robot>'), "'base'", "'alone'", "root")
        self.refused_with('<robot name="empty"/>', "no link")

    def test_numbers(self):
        self.refused_with(arm().replace('xyz="0 0 1"', 'xyz="0 nan 1"'), "joint 'turn'", "line 5", "0 nan 1")
        self.refused_with(arm().replace('<axis xyz="0 1 0"', '<axis xyz="0 0 0"'), "axis", "line 5")

    def test_other_formats(self):
        self.refused_with('<sdf version="1.6"><model name="x"/></sdf>', "give its model a <link>")
        self.refused_with(arm().replace("</robot>", "<xacro:include filename='x'/></robot>"), "xacro arm.urdf >")

    def test_massless_leaf(self):
        text = arm(inertial="") + ""
        self.refused_with(text, "joint 'turn'", "moves no mass", "line 5")

    def test_inertia_and_limits_are_repaired(self):
        wrong = INERTIAL.replace('izz="0.1"', 'izz="0.5"')
        text = arm(inertial=wrong, joint='type="revolute"', inside='<limit lower="1" upper="-1" effort="1" velocity="1"/>')
        self.write("arm.urdf", text)
        done = self.run_assay("check", "arm.urdf")
        self.assertEqual(done.returncode, 2)
        self.assertIn("link 'tip' (line 3) has an inertia that breaks the triangle inequality", done.stderr)
        self.assertIn("line 6", done.stderr)
        done = self.run_assay("check", "arm.urdf", "--repair", "mended.urdf")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("inertia of link 'tip'", done.stderr)
        self.assay("check", "mended.urdf")
        mended = (self.dir / "mended.urdf").read_text()
        self.assertEqual(mended.replace('lower="-1" upper="1"', 'lower="1" upper="-1"').count("\n"), text.count("\n"))
        self.assertIn('<mass value="1"/>', mended)


    def test_nothing_to_repair(self):
        self.write("arm.urdf", arm())
        done = self.run_assay("check", "arm.urdf", "--repair", "mended.urdf")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("finds nothing in 'arm.urdf' that it can mend, and it loads", done.stderr)
        self.assertFalse((self.dir / "mended.urdf").exists())
        self.write("arm.urdf", arm(inertial=INERTIAL.replace('value="1"', 'value="-1"')))
        done = self.run_assay("check", "arm.urdf", "--repair", "mended.urdf")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("has the mass -1 kg; give a positive mass", done.stderr)
        self.assertFalse((self.dir / "mended.urdf").exists())


class MjcfRepair(AssayTest):
    def test_inertia_is_repaired(self):
        self.write("arm.xml", '<mujoco>\n<worldbody><body name="b"><joint/>\n<inertial pos="0 0 0" mass="1" '
                              'diaginertia="1 1 3"/></body></worldbody></mujoco>')
        self.refused("check", "arm.xml", naming=["body 'b' (line 3)", "triangle inequality", "--repair"])
        done = self.run_assay("check", "arm.xml", "--repair", "mended.xml")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("mended.xml: changes 1, and it loads", done.stderr)
        self.assay("check", "mended.xml")


class RepairInMemory(AssayTest):
    COMMANDS = (("check",), ("simulate", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "0.004", "--out", "a.csv"),
                ("snapshot", "--out", "a.png"), ("run", "--plan", "--out", "planned"), ("explain", "mujoco-euler", "bullet-mb"),
                ("parity",))

    def every_command_takes(self, file):
        written = (self.dir / file).read_text()
        for command, *options in self.COMMANDS:
            with self.subTest(command):
                refused = self.run_assay(command, file, *options)
                self.assertEqual(refused.returncode, 2, refused.stderr)
                self.assertIn("give --repair", refused.stderr)
                done = self.run_assay(command, file, *options, "--repair")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertIn("repaired: ", done.stdout + done.stderr)
        self.assertEqual((self.dir / file).read_text(), written)

    def test_of_a_urdf_file(self):
        self.write("arm.urdf", arm(inertial=INERTIAL.replace('izz="0.1"', 'izz="0.5"')))
        self.every_command_takes("arm.urdf")

    def test_of_an_mjcf_file(self):
        self.write("arm.xml", '<mujoco>\n<worldbody><body name="b"><joint/>\n<inertial pos="0 0 -0.2" mass="1" '
                              'diaginertia="0.01 0.01 0.05"/></body></worldbody></mujoco>')
        self.every_command_takes("arm.xml")


class Options(AssayTest):
    def test_floating_base(self):
        self.write("arm.urdf", arm().replace('<link name="base"/>', f'<link name="base">{INERTIAL}</link>'))
        self.assertEqual(self.assay_json("check", "arm.urdf", "--json")["model"]["dof"], 1)
        self.assertEqual(self.assay_json("check", "arm.urdf", "--floating-base", "--json")["model"]["dof"], 7)

    # What floats on the root floats in the world, whatever the root is called.
    def test_floating_joint(self):
        free = arm(joint='type="floating"')
        for text in (free, free.replace('"base"', '"world"')):
            self.write("arm.urdf", text)
            for option in ((), ("--floating-base",)):
                self.assertEqual(self.assay_json("check", "arm.urdf", *option, "--json")["model"]["dof"], 6, option)
            self.refused("check", "arm.urdf", "--fixed-base", naming=["nothing in it can move"])
        self.write("arm.urdf", free.replace('"tip"', '"world"'))
        self.refused("check", "arm.urdf", naming=["link 'world'", "line 3", "not the root"])

    # Each refusal's mend is one that mends.
    def test_nothing_moves(self):
        self.write("cube.urdf", '<robot name="cube"><link name="cube"><collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>')
        self.refused("check", "cube.urdf", naming=["nothing in it can move", "<inertial>", 'inertiafromgeom="auto"'])
        weighed = (self.dir / "cube.urdf").read_text().replace("<link", '<mujoco><compiler inertiafromgeom="auto"/></mujoco><link', 1)
        self.write("weighed.urdf", weighed)
        self.assertEqual(self.assay_json("check", "weighed.urdf", "--json")["model"]["dof"], 6)
        self.refused("check", "cube.urdf", "--floating-base", "--drop-unsupported", naming=["nothing in it can move", "<inertial>"])
        body = '<body><geom size="1"/></body>'
        self.write("one.xml", f"<mujoco><worldbody>{body}</worldbody></mujoco>")
        self.refused("check", "one.xml", naming=["nothing in it can move", "--floating-base"])
        self.assay("check", "one.xml", "--floating-base")
        self.write("two.xml", f"<mujoco><worldbody>{body}{body}</worldbody></mujoco>")
        self.assertNotIn("--floating-base", self.refused("check", "two.xml", naming=["nothing in it can move", "<freejoint/>"]))
        self.refused("check", "two.xml", "--floating-base", naming=["<freejoint/>"])

    def test_within_limits(self):
        self.write("arm.urdf", arm(joint='type="revolute"', inside='<limit lower="0.5" upper="2" effort="1" velocity="1"/>'))
        kinds = [[finding["kind"] for finding in self.assay_json("check", "arm.urdf", *options, "--json")["model_findings"]]
                 for options in ([], ["--within-limits"])]
        self.assertIn("start-beyond-limits", kinds[0])
        self.assertNotIn("start-beyond-limits", kinds[1])

    def test_qpos(self):
        self.write("arm.urdf", arm())
        self.write("q.txt", "turn = 0.5  # rad\n")
        self.assay("check", "arm.urdf", "--qpos", "q.txt")
        self.write("q.txt", "trn = 0.5\n")
        self.refused("check", "arm.urdf", "--qpos", "q.txt", naming=["q.txt:1", "did you mean 'turn'?"])
        self.write("q.txt", "1 2\n")
        self.refused("check", "arm.urdf", "--qpos", "q.txt", naming=["2 numbers", "has 1"])
        self.write("q.txt", "turn = 0.5\nturn = 0.6\n")
        self.refused("check", "arm.urdf", "--qpos", "q.txt", naming=["q.txt:2", "joint 'turn' has a position already"])


if __name__ == "__main__":
    main()
