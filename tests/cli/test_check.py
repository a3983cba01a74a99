"""What `assay check` says of a model itself: findings with element, line and value, the explicit timestep, elements."""

import json
import math
import re

from harness import BALL, AssayTest, main

# Line by line: the floor is in line 4, the heavy arm in 5 and 6, the light tool in 7 to 9.
ROBOT = """<mujoco model="robot">
  <compiler angle="radian"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="arm" pos="0 0 .08"><joint name="shoulder" axis="0 1 0" range=".25 1" damping="2"/>
      <geom name="ball" size=".1" mass="1"/>
      <body name="tool" pos=".15 0 0">
        <joint name="wrist" axis="0 1 0" stiffness="8"/>
        <geom name="tip" size=".05" mass=".002"/></body></body>
    <body name="box" pos=".16 0 .5"><freejoint/><geom name="cube" type="box" size=".1 .1 .1" mass="1"/></body>
    <body name="other" pos=".33 0 .5"><freejoint/><geom name="die" type="box" size=".1 .1 .1" mass="1"/></body>
  </worldbody>
</mujoco>
"""


class Check(AssayTest):
    def report(self, text=ROBOT):
        self.write("robot.xml", text)
        return self.assay_json("check", "robot.xml", "--json")

    def places(self, report, kind):
        found = [finding for finding in report["model_findings"] if finding["kind"] == kind]
        self.assertEqual(len(found), 1, [finding["kind"] for finding in report["model_findings"]])
        return found[0], found[0]["places"]

    def test_findings_have_element_line_value_and_advice(self):
        report = self.report()
        for finding in report["model_findings"]:
            self.assertIn(finding["level"], ("mend", "know"))
            self.assertTrue(finding["kind"] and finding["title"] and finding["places"], finding)
            for place in finding["places"]:
                self.assertEqual(set(place), {"element", "line", "file", "value", "text"})
        limits, (shoulder,) = self.places(report, "start-beyond-limits")
        self.assertEqual((limits["level"], limits["unit"], shoulder["element"], shoulder["line"]),
                         ("mend", "rad", "joint 'shoulder'", 5))
        self.assertAlmostEqual(shoulder["value"], 0.25)
        _, (overlap,) = self.places(report, "start-overlap")
        self.assertEqual((overlap["element"], overlap["line"]), ("geoms 'cube' and 'die'", 10))
        self.assertAlmostEqual(overlap["value"], 0.03, places=6)
        _, (below,) = self.places(report, "start-below-ground")
        self.assertEqual((below["element"], below["line"]), ("geom 'ball'", 6))
        self.assertAlmostEqual(below["value"], 0.02, places=9)
        _, (ratio,) = self.places(report, "mass-ratio")
        self.assertEqual((ratio["element"], ratio["line"]), ("body 'tool'", 7))
        self.assertAlmostEqual(ratio["value"], 500)

    def test_what_is_to_mend_comes_first(self):
        levels = [finding["level"] for finding in self.report()["model_findings"]]
        self.assertEqual(levels, sorted(levels, key=["mend", "know"].index))
        text = self.assay("check", "robot.xml")
        order = [text.index(f"\n{heading}") for heading in ("to mend", "to know", "largest explicit timestep", "engine ", "elements ")]
        self.assertEqual(order, sorted(order))
        for words in ("'shoulder' (line 5) 250 mrad beyond 0.25", "'ball' (line 6) 20.0 mm below 'floor'",
                      "'cube' and 'die' (line 10) 30.0 mm", "2 g on 'arm' of 1 kg: 500"):
            self.assertIn(words, text)

    def test_explicit_timestep(self):
        timestep = self.report()["timestep"]
        self.assertEqual((timestep["pose"], timestep["singular"], timestep["with_feedback"]), ("start", False, None))
        springs = {spring["element"]: spring for spring in timestep["springs"]["springs"]}
        self.assertEqual(set(springs), {"joint 'shoulder'", "joint 'wrist'"})
        wrist = springs["joint 'wrist'"]
        inertia = 0.4 * 0.002 * 0.05**2
        self.assertEqual((wrist["line"], wrist["damper_ms"]), (8, None))
        self.assertAlmostEqual(wrist["inertia_held"], inertia)
        self.assertAlmostEqual(wrist["spring_ms"], 2000 * math.sqrt(wrist["inertia"] / 8))
        self.assertLessEqual(wrist["inertia"], inertia)
        self.assertEqual(timestep["springs"]["critical"], "joint 'wrist'")
        self.assertLessEqual(timestep["springs"]["largest_ms"], wrist["largest_ms"])

    def test_every_element_has_a_treatment_by_every_contender(self):
        report = self.report()
        sorts = {}
        for group in report["elements"]:
            sorts.setdefault(group["sort"], []).extend(element["line"] for element in group["elements"])
            judged = [name for engine in group["engines"] for name in engine["contenders"]]
            self.assertEqual(sorted(judged), sorted(self.contenders()))
            self.assertLessEqual({engine["fidelity"] for engine in group["engines"]}, {"exact", "approximated", "refused"})
        self.assertEqual(sorted(sorts["hinges"]), [5, 8])
        self.assertEqual(sorts["joint limits"], [5])
        self.assertEqual(sorted(sorts["boxes"]), [10, 11])
        self.assertEqual(len(sorts["contact pairs"]), report["model"]["contact_pairs"])
        for engine in report["engines"]:
            for finding in engine["findings"]:
                if finding["element"].startswith("joint 'wrist'"):
                    self.assertEqual(finding["line"], 8)

    def test_clean_robot_fits_one_screen(self):
        text = self.on_terminal("check", "planar-chain", columns=80)[1]
        self.assertLess(len(text.splitlines()), 40, text)

    def test_findings_fit_the_terminal(self):
        self.write("robot.xml", ROBOT)
        for columns in (80, 40):
            status, text = self.on_terminal("check", "robot.xml", columns=columns)
            self.assertEqual(status, 0)
            for line in re.sub(r"\x1b\[[0-9;]*m", "", text).splitlines():
                self.assertLessEqual(len(line), columns, line)

    def test_findings_do_not_change_the_status(self):
        self.write("robot.xml", ROBOT)
        self.assertEqual(self.run_assay("check", "robot.xml").returncode, 0)

    def test_hinges_and_slides_are_counted_apart(self):
        model = self.report(ROBOT.replace('name="wrist"', 'name="wrist" type="slide"'))["model"]
        self.assertEqual({key: model[key] for key in ("hinges", "slides", "balls", "limited_hinges", "limited_slides", "free_joints")},
                         {"hinges": 1, "slides": 1, "balls": 0, "limited_hinges": 1, "limited_slides": 0, "free_joints": 2})

    def test_what_was_left_out_comes_first(self):
        self.write("kite.xml", BALL.replace('name="ball"', 'name="ball" gravcomp="0.5"'))
        text = self.assay("check", "kite.xml", "--drop-unsupported")
        self.assertIn("gravity compensation", text.split("\nleft out\n", 1)[1].split("\n\n", 1)[0])
        self.assertEqual(text.count("gravity compensation"), 1)
        (problem,) = self.assay_json("check", "kite.xml", "--drop-unsupported", "--json")["problems"]
        self.assertEqual(problem["severity"], "left out")

    def test_paper_grasp(self):
        springs = self.assay_json("check", "grasp", "--json")["timestep"]["springs"]["springs"]
        distal = next(spring for spring in springs if spring["element"] == "joint 'FFJ1'")
        self.assertAlmostEqual(distal["damper_held_ms"], 1.34, places=2)


class Refused(AssayTest):
    """Files that cannot be used end in one sentence with the element, the line and a mend."""

    LINK = ('<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
            "</link>\n")
    JOINT = '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/></joint>\n'

    def urdf(self, *parts):
        self.write("robot.urdf", '<robot name="r">\n' + "".join(parts) + "</robot>\n")

    def test_trees(self):
        link, joint = self.LINK.format, self.JOINT.format
        for parts, naming in [
                ((link("a"), link("b"), link("c"), joint("i", "b", "c"), joint("j", "c", "b")), ["line 5", "cycle"]),
                ((link("a"), link("b"), link("a"), joint("j", "a", "b")), ["'a'", "line 4", "line 2", "rename"]),
                ((link("a"), link("b"), link("c"), joint("j", "a", "b")), ["'a'", "'c'", "line 4", "one root"])]:
            self.urdf(*parts)
            self.refused("check", "robot.urdf", naming=naming)

    def test_mjcf_messages_end_in_a_mend(self):
        for text, naming in [
                ('<mujoco>\n<include file="gone.xml"/></mujoco>', ["gone.xml", "line 2", "correct its name"]),
                ('<mujoco><worldbody>\n<body name="a"><freejoint/><geom size="1"/></body>\n<body name="a"/></worldbody></mujoco>',
                 ["'a'", "line 3", "rename"]),
                ('<mujoco><worldbody>\n<body><freejoint/><geom size="big"/></body></worldbody></mujoco>',
                 ["size", "line 2", "numbers"]),
                ("<mujoco><worldbody>\n<body></worldbody></mujoco>", ["line 2", "not XML", "</body>"])]:
            self.write("robot.xml", text)
            self.refused("check", "robot.xml", naming=["robot.xml", *naming])

    def test_an_include_from_another_folder_is_read_on_request(self):
        self.write("part.xml", BALL)
        (self.dir / "arm").mkdir()
        self.write("arm/arm.xml", '<mujoco><include file="../part.xml"/></mujoco>')
        self.refused("check", "arm/arm.xml", naming=["part.xml", "--allow-external-files"])
        self.assertEqual(
            self.assay_json("check", "arm/arm.xml", "--json", "--allow-external-files")["model"]["bodies"], 1)

    def test_meshes_beside_an_included_file(self):
        self.write("arm/scene.xml", '<mujoco><include file="parts/arm.xml"/></mujoco>')
        self.write("arm/parts/arm.xml", '<mujoco><asset><mesh name="arm" file="arm.obj"/></asset><worldbody><body><freejoint/>'
                                        '<geom type="mesh" mesh="arm"/></body></worldbody></mujoco>')
        self.refused("check", "arm/scene.xml", naming=["mesh 'arm'", "parts/arm.xml", "line 1", "arm/parts/arm.obj"])
        self.write("arm/parts/arm.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        for model in ("arm/scene.xml", self.dir / "arm/scene.xml"):
            self.assertIn("scene: 1 body, 6 DOF", self.assay("check", model))

    def test_included_elements_have_their_file_and_line(self):
        (self.dir / "parts").mkdir()
        self.write("robot.xml", '<mujoco>\n<worldbody><geom name="floor" type="plane" size="1 1 1"/>'
                   '<include file="parts/leg.xml"/></worldbody>\n'
                   '<actuator>\n<include file="parts/drive.xml"/></actuator></mujoco>')
        self.write("parts/leg.xml", '<mujocoinclude>\n<body name="thigh">\n<joint name="hip" axis="0 1 0" armature="0.1"/>\n'
                   '<geom size="0.1" fromto="0 0 0 0 0 1" type="capsule"/>\n</body></mujocoinclude>')
        self.write("parts/drive.xml", '<mujocoinclude>\n<muscle name="flexor" joint="hip" lengthrange="0 1"/></mujocoinclude>')
        self.refused("check", "robot.xml", naming=["actuator 'flexor' (parts/drive.xml, line 2)"])
        refused = self.run_assay("check", "robot.xml", "--json")
        problem = json.loads(refused.stdout)["problems"][0]
        self.assertEqual([problem[key] for key in ["element", "line", "file"]], ["actuator 'flexor'", 2, "parts/drive.xml"])
        self.write("parts/drive.xml", '<mujocoinclude>\n<motor name="flexor" joint="hip"/></mujocoinclude>')
        report = self.assay_json("check", "robot.xml", "--json")
        places = {each["element"]: (each["line"], each["file"]) for group in report["elements"] for each in group["elements"]}
        self.assertEqual(places["joint 'hip'"], (3, "parts/leg.xml"))
        self.assertEqual(places.pop("geom 'floor'"), (2, None))
        self.assertEqual({place for element, place in places.items() if element.startswith("geom")}, {(2, "parts/leg.xml")})
        armature = [finding for engine in report["engines"] for finding in engine["findings"]
                    if finding["element"] == "joint 'hip' armature"]
        self.assertTrue(armature)
        self.assertEqual({(finding["line"], finding["file"]) for finding in armature}, {(3, "parts/leg.xml")})

    def report(self, text):
        self.write("scene.xml", text)
        return self.assay_json("check", "scene.xml", "--json")

    def findings_of(self, report, beginning):
        """Findings whose element begins so, by contender."""
        return {name: finding["how"] for engine in report["engines"] for finding in engine["findings"]
                if finding["element"].startswith(beginning) for name in engine["contenders"]}

    def test_single_precision_far_from_the_origin_is_said(self):
        single = {row["contender"] for row in self.assay_json("engines", "--json")["contenders"]
                  if row["capabilities"]["precision"] == "single" and "positions are double" not in row["capabilities"]["other"]}
        self.assertFalse({"jolt-f64", "box3d", "box3d-native-pd"} & single)
        box = '<body pos="{0} {0} .05"><freejoint/><geom type="box" size=".1 .1 .05" mass="1" friction=".5 0 0"/></body>'
        for far in (10, 100, 2000, 10000):
            report = self.report(f'<mujoco><worldbody><geom type="plane" size="10 10 .1"/>{box.format(far)}</worldbody></mujoco>')
            found = self.findings_of(report, "positions")
            if far <= 10:  # fifty substeps round fifty times
                self.assertEqual({name for name in found if "-tgs" not in name}, set())
            if far >= 2000:
                self.assertEqual(set(found), single)
                for how in found.values():
                    self.assertRegex(how, r"single precision: coordinates are multiples of [\d.e-]+ m .* off by [\d.]+ m/s")
            self.assertLessEqual(set(found), single)

    def test_friction_that_depends_on_its_direction_is_said(self):
        box = '<mujoco><worldbody><geom type="plane" size="9 9 1" friction="{0} 0 0"/><body pos="0 0 1"><freejoint/>' \
              '<geom type="box" size=".1 .1 .1" friction="{0} 0 0"/></body></worldbody></mujoco>'
        found = self.findings_of(self.report(box.format(0.5)), "friction")
        rows = self.assay_json("engines", "--json")["contenders"]
        # Drake's lagged contacts brake too strongly in every direction
        fixed = {row["contender"] for row in rows
                 if any(each["test"] == "friction-directions" and "of the step before" not in each["reason"]
                        for each in row["capabilities"]["deviations"])}
        self.assertEqual(set(found), fixed)
        for how in found.values():
            self.assertRegex(how, r"1\.41 times|29 %|14 %")
        without = self.findings_of(self.report(box.format(0)), "friction of contact")
        self.assertFalse({name for name, how in without.items() if "lower bound" not in how}, without)

    def test_many_pairs_and_joints_are_grouped(self):
        def field(count):
            return f"""<mujoco><default><geom condim="6"/></default><worldbody>
  <replicate count="{count}" offset="0 .3 0"><geom type="box" size=".1 .1 .05" pos="0 0 .05"/></replicate>
  <replicate count="20" offset=".3 0 0"><body pos="0 0 .5"><freejoint/><geom type="box" size=".1 .1 .1"/>
    <body><joint axis="0 1 0" range="-1 1" armature=".1"/><geom type="capsule" size=".03 .1" pos=".3 0 0"/></body></body></replicate>
</worldbody></mujoco>"""

        self.write("field.xml", field(100))
        many = self.assay("check", "field.xml", "--json")
        report = json.loads(many)
        pairs = report["model"]["contact_pairs"]
        self.assertGreater(pairs, 4000)
        self.assertEqual(sum(group["count"] for group in report["elements"] if group["sort"] == "contact pairs"), pairs)
        rolling = [group for group in report["elements"] if group["sort"].startswith("rolling friction")]
        self.assertEqual(sum(group["count"] for group in rolling), pairs)
        self.assertRegex(rolling[0]["elements"][0]["element"],
                         r"^contacts of '.*' and '.*' and \d+ more pairs of (boxes|capsules)( and capsules)?$")
        refused = [finding for engine in report["engines"] for finding in engine["findings"]
                   if finding["element"].startswith("contacts of ")]
        self.assertTrue(refused)
        self.assertTrue(all(finding["count"] > 100 for finding in refused))
        # ten times the pairs: nothing more to say
        self.write("field.xml", field(1000))
        self.assertLess(abs(len(self.assay("check", "field.xml", "--json")) - len(many)), 0.1 * len(many))
        text = self.assay("check", "field.xml")
        self.assertIn("more pairs of boxes", text)

    def test_expanded_xacro_is_another_file(self):
        self.write("robot.urdf", '<robot name="r" xmlns:xacro="x"><xacro:macro name="m"/></robot>')
        self.refused("check", "robot.urdf", naming=["xacro robot.urdf > robot-expanded.urdf"])


if __name__ == "__main__":
    main()
