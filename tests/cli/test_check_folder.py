"""`assay check DIR`: all robots of a folder, with a baseline, and with files for other programs."""

import ctypes
import json
import os
import re
import signal
import time
import xml.etree.ElementTree

from harness import BALL, AssayTest, main, obey_permissions
from test_check import ROBOT
from test_urdf import INERTIAL, arm

# One that is mended: swapped limits, and an inertia that no body has.
SWAPPED = arm(inertial=INERTIAL.replace('izz="0.1"', 'izz="0.5"'), joint='type="revolute"',
              inside='<limit lower="1" upper="-1" effort="1" velocity="1"/>')
# The explicit bound of so many joints on one free body takes minutes.
ENDLESS = """<mujoco><worldbody><body><freejoint/><geom size=".1" mass="1"/><replicate count="1500" offset=".3 0 0"><body>
<joint axis="0 1 0" damping="1" stiffness="1"/><geom size=".1" contype="0" conaffinity="0"/></body></replicate></body>
</worldbody></mujoco>"""
SCENE = '<mujoco>\n<include file="parts/figure.xml"/>\n</mujoco>'
FIGURE = '<mujoco model="figure">\n<worldbody><body name="thigh">\n<joint name="hip" axis="0 1 0"/>\n<geom size=".1"/></body></worldbody></mujoco>'


def read_as_others():
    """For subprocess's preexec_fn: root reads no more than others do."""
    PR_CAPBSET_DROP, CAP_DAC_READ_SEARCH = 24, 2
    obey_permissions()
    if os.geteuid() == 0 and ctypes.CDLL(None, use_errno=True).prctl(PR_CAPBSET_DROP, CAP_DAC_READ_SEARCH, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "root's right to read anything cannot be given up")


class FolderTest(AssayTest):
    with_verdicts = False

    def robots(self, files):
        """Writes files of the folder "robots": texts by name."""
        for name, text in files.items():
            self.write(f"robots/{name}", text)

    def report(self, *options, status=0, folder="robots"):
        done = self.run_assay("check", folder, "--json", *options)
        self.assertEqual(done.returncode, status, done.stderr)
        return json.loads(done.stdout)

    def found(self, report):
        """(level, kind, element, line) of each finding, by file."""
        return {each["file"]: sorted((f["level"], f["kind"], f["element"] or "", f["line"] or 0) for f in each["findings"])
                for each in report["files"]}

    def verdicts(self, report):
        return {each["file"]: each["verdict"] for each in report["files"]}


class Folder(FolderTest):
    def test_each_file_says_what_it_says_alone(self):
        files = {"ball.xml": BALL, "b/robot.xml": ROBOT, "b/arm.urdf": arm(), "c/swapped.urdf": SWAPPED, "broken.xml": "<mujoco><worldbody>",
                 "scene.xml": SCENE, "parts/figure.xml": FIGURE}
        self.robots(files)
        report = self.report(status=1)
        self.assertEqual([each["file"] for each in report["files"]],
                         sorted(set(files) - {"parts/figure.xml"}))
        found = self.found(report)
        for name in found:
            alone = json.loads(self.run_assay("check", f"robots/{name}", "--json").stdout)
            expected = [(finding["level"], finding["kind"], place["element"], place["line"] or 0)
                        for finding in alone.get("model_findings", []) for place in finding["places"]]
            expected += [("refused", "refused", problem["element"], problem["line"] or 0) for problem in alone["problems"]]
            self.assertEqual(found[name], sorted(expected), name)
        verdicts = self.verdicts(report)
        self.assertEqual(verdicts["ball.xml"], "ok")
        self.assertEqual(verdicts["b/robot.xml"], "mend")
        self.assertEqual({verdicts["c/swapped.urdf"], verdicts["broken.xml"]}, {"refused"})
        # lines of an included file are of that file
        (joint,) = [f for each in report["files"] if each["file"] == "scene.xml" for f in each["findings"] if f["kind"] == "joint-unlimited"]
        self.assertEqual((joint["file"], joint["line"]), ("parts/figure.xml", 3))
        self.assertEqual(report["not_checked"]["included"], [{"file": "parts/figure.xml", "by": "scene.xml"}])
        counted = {kind["kind"]: kind["findings"] for kind in report["kinds"]}
        self.assertEqual(sum(counted.values()), sum(map(len, found.values())))

    def test_what_is_no_robot_is_counted(self):
        self.robots({"ball.xml": BALL, "package.xml": "<package/>", "arm.urdf.xacro": "<robot/>", "world.usd": "#usda 1.0",
                       "piece.xml": "<mujocoinclude/>", ".hidden.xml": BALL, ".git/x.urdf": arm()})
        self.write("elsewhere.urdf", arm())
        (self.dir / "robots/link.urdf").symlink_to(self.dir / "elsewhere.urdf")
        (self.dir / "robots/same.xml").symlink_to("ball.xml")
        report = self.report()
        self.assertEqual(self.verdicts(report), {"ball.xml": "ok"})
        self.assertEqual(report["not_checked"], {"included": [{"file": "piece.xml", "by": None}], "other_xml": 1,
                                                 "not_read": {".usd": 1, ".xacro": 1}, "links_out": 1})
        text = self.assay("check", "robots")
        for words in ("1 robot, 1 ok", "1 file that others include", "1 .xml file of other programs", "1 .usd file", "1 link out of the folder"):
            self.assertIn(words, text)

    def test_two_that_include_each_other_are_checked(self):
        self.robots({"a.xml": '<mujoco><include file="b.xml"/></mujoco>', "b.xml": '<mujoco><include file="a.xml"/></mujoco>'})
        report = self.report(status=1)
        self.assertEqual(self.verdicts(report), {"a.xml": "refused", "b.xml": "refused"})
        for each in report["files"]:
            self.assertIn("contains itself", each["findings"][0]["message"])

    def test_the_table_has_a_line_for_each_file(self):
        self.robots({"ball.xml": BALL, "b/robot.xml": ROBOT, "broken.xml": "<mujoco><worldbody>"})
        done = self.run_assay("check", "robots")
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        lines = done.stdout.splitlines()
        self.assertRegex(lines[0], r"^b/robot\.xml +mend +.*start-overlap.*; \d+ to know$")
        self.assertRegex(lines[1], r"^ball\.xml +ok")
        self.assertRegex(lines[2], r"^broken\.xml +refused +.*not XML")
        self.assertIn("3 robots, 1 ok, 1 to mend, 1 refused", lines[4])
        self.assertIn("1 finding fails (--fail-on refused)", done.stdout)
        self.assertRegex(done.stdout, r"(?m)^start-overlap +mend +1 +1 ")

    def test_it_fits_the_terminal(self):
        self.robots({"b/robot.xml": ROBOT, "broken.xml": "<mujoco><worldbody>"})
        status, text = self.on_terminal("check", "robots", columns=60)
        self.assertEqual(status, 1)
        for line in re.sub(r"\x1b\[[0-9;]*[mK]|\r", "", text).splitlines():
            self.assertLessEqual(len(line), 60, line)

    def test_levels_that_fail(self):
        self.robots({"robot.xml": ROBOT})
        for level, status in (("refused", 0), ("mend", 1), ("know", 1), ("never", 0)):
            self.assertEqual(self.report("--fail-on", level, status=status)["fail_on"], None if level == "never" else level)
        self.robots({"robot.xml": "<mujoco><worldbody>"})
        self.report("--fail-on", "never")

    def test_the_order_does_not_depend_on_jobs(self):
        self.robots({f"{i % 3}/{i}.xml": ROBOT if i % 2 else BALL for i in range(12)})
        one, many = (self.assay("check", "robots", "--jobs", jobs) for jobs in (1, 5))
        self.assertEqual(one, many)

    def test_options_of_reading_hold_for_all(self):
        kite = BALL.replace('name="ball"', 'name="ball" gravcomp="0.5"')
        self.robots({"a.xml": kite, "b/b.xml": kite})
        self.assertEqual(set(self.verdicts(self.report(status=1)).values()), {"refused"})
        report = self.report("--drop-unsupported")
        self.assertEqual(self.verdicts(report), {"a.xml": "ok", "b/b.xml": "ok"})
        self.assertEqual([[f["kind"] for f in each["findings"]] for each in report["files"]], [["left-out"], ["left-out"]])

    def test_names_are_text(self):
        escape = "\x1b]0;owned\x07"
        (self.dir / "robots").mkdir()
        (self.dir / f"robots/a{escape}|`.xml").write_text(BALL)
        (self.dir / "robots/caf\udce9.xml").write_text(BALL)
        (self.dir / "robots/b.urdf").write_text('<robot name="r"><link name="a&#27;]0;owned&#7;"/><link name="a&#27;]0;owned&#7;"/></robot>')
        status, shown = self.on_terminal("check", "robots", NO_COLOR="1")
        self.assertEqual(status, 1)
        self.assertNotIn("\x1b]0", shown)
        self.assay("check", "robots", "--fail-on", "never", "--sarif", "r.sarif", "--junit", "r.xml", "--write-baseline", "known.json")
        for name in ("r.sarif", "r.xml", "known.json"):
            self.assertNotIn("\x1b", (self.dir / name).read_text(encoding="utf-8"))
        uris = {result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for result in
                json.loads((self.dir / "r.sarif").read_text(encoding="utf-8"))["runs"][0]["results"]}
        self.assertEqual(uris, {"b.urdf"})
        xml.etree.ElementTree.parse(self.dir / "r.xml")
        self.assay("check", "robots", "--baseline", "known.json", "--fail-on", "know")


class Failures(FolderTest):
    def test_one_that_takes_too_long_leaves_the_others(self):
        self.robots({"a.xml": BALL, "endless.xml": ENDLESS, "z.xml": BALL})
        report = self.report("--time-limit", 5, "--junit", "r.xml", status=1)
        self.assertEqual(self.verdicts(report), {"a.xml": "ok", "endless.xml": "refused", "z.xml": "ok"})
        (finding,) = report["files"][1]["findings"]
        self.assertEqual(finding["kind"], "time-limit")
        self.assertIn("endless.xml' was stopped: it takes more than", finding["message"])
        suite = xml.etree.ElementTree.parse(self.dir / "r.xml").getroot()
        self.assertEqual((suite.get("errors"), suite.get("failures")), ("1", "0"))

    def test_what_cannot_be_read_is_a_finding(self):
        self.robots({"a.xml": BALL, "closed.urdf": arm(), "folder/b.xml": BALL})
        (self.dir / "robots/closed.urdf").chmod(0)
        (self.dir / "robots/folder").chmod(0)
        self.addCleanup((self.dir / "robots/folder").chmod, 0o700)
        done = self.run_assay("check", "robots", "--json", preexec_fn=read_as_others)
        self.assertEqual(done.returncode, 1, done.stderr)
        kinds = {each["file"]: [finding["kind"] for finding in each["findings"]] for each in json.loads(done.stdout)["files"]}
        self.assertEqual(kinds, {"a.xml": [], "closed.urdf": ["unreadable"], "folder/": ["unreadable"]})

    def test_an_interruption_leaves_no_file(self):
        self.robots({"endless.xml": ENDLESS})
        process = self.start_assay("check", "robots", "--sarif", "r.sarif", "--junit", "r.xml", "--write-baseline", "known.json")
        time.sleep(2)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        self.assertNotEqual(process.returncode, 0)
        self.assertEqual(self.files(), ["robots"])


class Baseline(FolderTest):
    def test_only_new_findings_fail(self):
        self.robots({"robot.xml": ROBOT, "broken.xml": "<mujoco><worldbody>"})
        self.report("--write-baseline", "known.json", "--fail-on", "know", status=1)
        report = self.report("--baseline", "known.json", "--fail-on", "know")
        self.assertEqual((report["failing"], report["baseline"]["new"], report["baseline"]["gone"]), (0, 0, []))
        self.assertTrue(all(finding["known"] for each in report["files"] for finding in each["findings"]))
        # an edit elsewhere moves the lines
        self.robots({"robot.xml": ROBOT.replace("<worldbody>", "<worldbody>\n\n\n<!-- an edit -->")})
        self.report("--baseline", "known.json", "--fail-on", "know")
        # a new one
        self.robots({"robot.xml": ROBOT.replace('name="other" pos=".33', 'name="other" pos=".34').replace(
            "</worldbody>", '<body name="more" pos=".16 .5 .5"><freejoint/><geom name="dice" type="box" size=".1 .1 .1" mass="1"/></body>'
            '<body pos=".16 .6 .5"><freejoint/><geom name="dice2" type="box" size=".1 .1 .1" mass="1"/></body></worldbody>')})
        report = self.report("--baseline", "known.json", "--fail-on", "mend", status=1)
        fresh = [(f["kind"], f["element"]) for each in report["files"] for f in each["findings"] if not f["known"] and f["level"] == "mend"]
        self.assertEqual(fresh, [("start-overlap", "geoms 'dice' and 'dice2'")])
        text = self.run_assay("check", "robots", "--baseline", "known.json", "--fail-on", "mend").stdout
        self.assertIn("1 finding fails (--fail-on mend)", text)

    def test_what_is_gone_is_said(self):
        self.robots({"robot.xml": ROBOT, "gone.xml": "<mujoco><worldbody>"})
        self.report("--write-baseline", "known.json", status=1)
        (self.dir / "robots/gone.xml").unlink()
        self.robots({"robot.xml": ROBOT.replace('range=".25 1"', 'range="-.25 1"')})
        report = self.report("--baseline", "known.json", "--fail-on", "know")
        gone = {(each["file"], each["kind"], each["subject"]) for each in report["baseline"]["gone"]}
        self.assertIn(("robot.xml", "start-beyond-limits", "joint 'shoulder'"), gone)
        self.assertIn("gone.xml", {file for file, *_ in gone})
        text = self.assay("check", "robots", "--baseline", "known.json")
        self.assertIn("of the baseline are gone: write it again with --write-baseline", text)
        self.assertIn("gone: gone.xml: refused", text)

    def test_it_is_the_same_wherever_the_folder_is(self):
        broken = '<mujoco><include file="../elsewhere.xml"/></mujoco>'
        for folder in ("here/robots", "there/deep/robots"):
            self.write(f"{folder}/broken.xml", broken)
            self.write(f"{folder}/robot.xml", ROBOT)
        self.report("--write-baseline", "known.json", folder="here/robots", status=1)
        report = self.report("--baseline", "known.json", "--fail-on", "know", folder=self.dir / "there/deep/robots")
        self.assertEqual(report["baseline"]["gone"], [])

    def test_one_of_another_folder_is_noticed(self):
        self.robots({"a.xml": BALL})
        self.write("others/b.xml", "<mujoco><worldbody>")
        self.report("--write-baseline", "known.json", folder="others", status=1)
        done = self.run_assay("check", "robots", "--baseline", "known.json")
        self.assertEqual(done.returncode, 0)
        self.check_sentence(done.stderr, ["no robot of the baseline 'known.json' is in 'robots'"])


class OtherPrograms(FolderTest):
    def test_sarif(self):
        self.robots({"robot.xml": ROBOT, "my arm.urdf": SWAPPED})
        self.report("--sarif", "r.sarif", "--write-baseline", "known.json", status=1)
        sarif = json.loads((self.dir / "r.sarif").read_text(encoding="utf-8"))
        self.assertEqual(sarif["version"], "2.1.0")
        (run,) = sarif["runs"]
        rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
        self.assertEqual(len(rules), len(set(rules)))
        lines = set()
        for result in run["results"]:
            self.assertEqual(rules[result["ruleIndex"]], result["ruleId"])
            self.assertIn(result["level"], ("error", "warning", "note"))
            self.assertTrue(result["message"]["text"])
            (location,) = result["locations"]
            physical = location["physicalLocation"]
            self.assertIn(physical["artifactLocation"]["uri"], ("robot.xml", "my%20arm.urdf"))
            if "region" in physical:
                self.assertGreater(physical["region"]["startLine"], 0)
                lines.add((physical["artifactLocation"]["uri"], result["ruleId"], physical["region"]["startLine"]))
        self.assertIn(("robot.xml", "start-beyond-limits", 5), lines)
        self.assertEqual(len({result["partialFingerprints"]["assayFinding/v1"] for result in run["results"]}), len(run["results"]))
        self.report("--sarif", "again.sarif", "--baseline", "known.json")
        again = json.loads((self.dir / "again.sarif").read_text(encoding="utf-8"))["runs"][0]["results"]
        self.assertEqual({result["baselineState"] for result in again}, {"unchanged"})

    def test_junit(self):
        self.robots({"ball.xml": BALL, "b/robot.xml": ROBOT, "broken.xml": "<mujoco><worldbody>"})
        self.report("--junit", "r.xml", "--fail-on", "mend", status=1)
        suite = xml.etree.ElementTree.parse(self.dir / "r.xml").getroot()
        self.assertEqual([suite.get(key) for key in ("tests", "failures", "errors")], ["3", "2", "0"])
        cases = {(case.get("classname"), case.get("name")): case for case in suite.iter("testcase")}
        self.assertEqual(set(cases), {(".", "ball.xml"), ("b", "robot.xml"), (".", "broken.xml")})
        self.assertEqual(len(cases[".", "ball.xml"]), 0)
        self.assertIn("b/robot.xml:5: mend (start-beyond-limits)", cases["b", "robot.xml"].find("failure").text)

    def test_markdown(self):
        self.robots({"ball.xml": BALL, "robot.xml": ROBOT})
        done = self.run_assay("check", "robots", "--markdown", "--fail-on", "mend")
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        self.assertIn("### `robots`: 2 robots, 1 ok, 1 to mend, 0 refused", done.stdout)
        self.assertIn("| `robot.xml:5` | mend | start-beyond-limits | `", done.stdout)
        self.assertIn("### findings by kind", done.stdout)


class RepairAll(FolderTest):
    def test_repaired_files_keep_their_paths(self):
        self.robots({"ball.xml": BALL, "c/swapped.urdf": SWAPPED})
        before = {path: path.read_bytes() for path in (self.dir / "robots").rglob("*.*")}
        self.report(status=1)
        report = self.report("--repair", "mended/all")
        self.assertEqual(self.verdicts(report)["c/swapped.urdf"], "ok")
        (swapped,) = [each for each in report["files"] if each["file"] == "c/swapped.urdf"]
        self.assertEqual(swapped["repaired"], "mended/all/c/swapped.urdf")
        self.assertEqual(len(swapped["repairs"]), 2)
        written = [str(path.relative_to(self.dir)) for path in (self.dir / "mended").rglob("*") if path.is_file()]
        self.assertEqual(written, ["mended/all/c/swapped.urdf"])
        self.assertEqual({path: path.read_bytes() for path in before}, before)
        self.assay("check", "mended/all/c/swapped.urdf")
        self.assay("check", "robots", "--repair", "mended/all")  # again
        self.assertIn("1 file repaired", self.assay("check", "robots", "--repair", "mended/all"))
        # in memory
        self.assertEqual(self.verdicts(self.report("--repair"))["c/swapped.urdf"], "ok")

    def test_inputs_are_never_replaced(self):
        self.robots({"c/swapped.urdf": SWAPPED})
        for into in ("robots", "robots/mended", ".", "robots/../robots"):
            self.refused("check", "robots", "--repair", into, naming=[f"--repair '{into}'", "'robots'", "elsewhere"])
        self.refused("check", "robots", "--repair", "robots/c/swapped.urdf", naming=["swapped.urdf"])
        # a link that leads back
        (self.dir / "mended").mkdir()
        (self.dir / "mended/c").symlink_to(self.dir / "robots/c")
        report = self.report("--repair", "mended", status=1)
        self.assertIn("repair", [finding["kind"] for finding in report["files"][0]["findings"]])
        self.assertEqual((self.dir / "robots/c/swapped.urdf").read_text(), SWAPPED)


class BadInput(FolderTest):
    def test_folders_without_robots(self):
        (self.dir / "empty").mkdir()
        self.refused("check", "empty", naming=["'empty'", "no robot", "check the path"])
        self.write("ros/package.xml", "<package/>")
        self.write("ros/arm.urdf.xacro", "<robot/>")
        self.refused("check", "ros", naming=["'ros'", "1 .xml file of other programs", "1 .xacro", "URDF or MJCF first"])

    def test_options(self):
        self.robots({"ball.xml": BALL})
        self.write("file.txt", "")

        def refused(*options, naming):
            self.refused("check", "robots", *options, naming=naming)

        refused("--fail-on", "error", naming=["--fail-on is 'error'", "refused, mend, know or never"])
        refused("--jobs", "0", naming=["--jobs is '0'"])
        refused("--time-limit", "soon", naming=["--time-limit", "'soon'"])
        refused("--qpos", "file.txt", naming=["--qpos is of one robot", "'robots'"])
        refused("--sarif", "no/such/r.sarif", naming=["--sarif 'no/such/r.sarif'", "no folder", "no/such"])
        refused("--junit", "robots", naming=["--junit 'robots' is a folder"])
        refused("--junit", "-", naming=["--junit is '-'", "--json"])
        refused("--junit", "r", "--sarif", "./r", naming=["--sarif and --junit name the same file"])
        refused("--sarif", "robots/ball.xml", naming=["--sarif 'robots/ball.xml'", "a file that the command reads"])
        refused("--repair", "file.txt", naming=["'file.txt' is a file", "give a folder"])
        refused("--repair", "--write-baseline", "b", naming=["--repair and --write-baseline contradict each other"])
        refused("--json", "--markdown", naming=["assay check --help"])
        self.refused("check", "robots/ball.xml", "--sarif", "r", naming=["--sarif is for a folder", "'robots/ball.xml' is none"])
        self.assertEqual((self.dir / "robots/ball.xml").read_text(), BALL)
        self.assertEqual(self.files(), ["file.txt", "robots"])

    def test_baselines(self):
        self.robots({"ball.xml": BALL})

        def refused(text, naming):
            self.write("b.json", text)
            self.refused("check", "robots", "--baseline", "b.json", naming=["--baseline 'b.json'", *naming])

        refused("no JSON", ["is not JSON", "--write-baseline"])
        refused("{}", ["is no baseline", "--write-baseline"])
        refused('{"format": "assay check baseline", "version": 99, "findings": []}', ["version 99", "reads version 1", "newer assay"])
        refused('{"format": "assay check baseline", "version": 1, "findings": [{"file": "a"}]}', ["'kind'"])
        self.refused("check", "robots", "--baseline", "none.json", naming=["none.json"])
        self.refused("check", "robots", "--baseline", "robots", naming=["robots"])


if __name__ == "__main__":
    main()
