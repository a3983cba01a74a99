"""Strangers' files, deadly plugins and damaged results: each ends in one sentence and a status, in a few seconds."""

import contextlib
import itertools
import json
import os
import pathlib
import random
import resource
import shutil
import sqlite3
import subprocess
import sys
import time
import zipfile

from harness import BALL, BALL_CAMPAIGN, DEADLY_PLUGINS, AssayTest, campaign, main, read_csv, reliability

# Longer than any of them may take, on a machine that does other things too.
PATIENCE = 60


def mjcf(inside, attributes=""):
    return f"<mujoco{attributes}>{inside}</mujoco>"


def in_world(inside):
    return mjcf(f"<worldbody>{inside}</worldbody>")


FREE_BALL = '<body><freejoint/><geom size=".1"/></body>'

HOSTILE = {
    "a class name that is a format": in_world('<body><freejoint/><geom class="%s%n" size=".1"/></body>'),
    "a class name that prints addresses": in_world('<body><freejoint/><geom class="%p%p" size=".1"/></body>'),
    "a model that contains itself": mjcf('<asset><model name="m" file="hostile.xml"/></asset>'
                                         '<worldbody><attach model="m" body="b" prefix="p"/></worldbody>'),
    "a file that includes itself": mjcf('<include file="hostile.xml"/>'),
    "2,000,000,000 numbers for each body": mjcf(f'<size nuser_body="2000000000"/><worldbody>{FREE_BALL}</worldbody>'),
    "2,000,000,000 keyframes": mjcf(f'<size nkey="2000000000"/><worldbody>{FREE_BALL}</worldbody>'),
    "a height field of 100,000 x 100,000": mjcf('<asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/>'
                                                '</asset><worldbody><geom type="hfield" hfield="h"/></worldbody>'),
    "50,000 free bodies": in_world(FREE_BALL * 50000),
    "an element with 200,000 attributes": in_world("<body " + " ".join(f'a{i}="1"' for i in range(200000)) + "/>"),
    "100,000 nested bodies": in_world("<body>" * 100000 + "</body>" * 100000),
}


class StrangersModels(AssayTest):
    """Crashes, hangs and floods of MuJoCo's parser, which stay in the process that parses."""

    def quickly_refused(self, *arguments, naming=()):
        start = time.monotonic()
        sentence = self.refused(*arguments, naming=naming)
        self.assertLess(time.monotonic() - start, PATIENCE, sentence)
        self.assertLess(len(sentence), 2000)
        return sentence

    def test_every_command_that_reads_a_model(self):
        for name, text in HOSTILE.items():
            with self.subTest(name):
                self.write("hostile.xml", text)
                self.quickly_refused("check", "hostile.xml", naming=["hostile.xml"])
        reliability("models that crash, hang or flood the parser: " + ", ".join(HOSTILE), len(HOSTILE),
                    "one sentence, exit status 2", "nothing")

    def test_simulate_and_run_are_as_safe(self):
        self.write("hostile.xml", HOSTILE["a class name that is a format"])
        self.quickly_refused("simulate", "hostile.xml", "--engine", "null", "--timestep", 1, "--duration", 1, "--out",
                             "-", naming=["hostile.xml", "class"])
        self.quickly_refused("run", "hostile.xml", naming=["hostile.xml"])
        self.write("ball.xml", HOSTILE["50,000 free bodies"])
        self.write("faults.toml", BALL_CAMPAIGN)
        self.quickly_refused("run", "faults.toml", "--out", "results", naming=["ball.xml"])

    def test_include_that_is_a_pipe(self):
        os.mkfifo(self.dir / "pipe.xml")
        self.write("hostile.xml", mjcf('<include file="pipe.xml"/>'))
        self.quickly_refused("check", "hostile.xml", naming=["pipe.xml", "regular file"])

    def test_long_chain_of_links(self):
        links = "".join(f'<link name="l{i}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
                        f'iyz="0"/></inertial></link>' for i in range(3000))
        joints = "".join(f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
                         f'<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>' for i in range(2999))
        self.write("long.urdf", f'<robot name="long">{links}{joints}</robot>')
        start = time.monotonic()
        done = self.run_assay("check", "long.urdf", "--json")
        self.assertLess(time.monotonic() - start, PATIENCE)
        if done.returncode != 0:
            self.check_sentence(done.stderr, ["long.urdf"])

    def test_campaign_with_a_key_of_many_dots(self):
        self.write("deep.toml", "a" + ".a" * 100000 + " = 1\n")
        self.quickly_refused("run", "deep.toml", "--out", "results", naming=["deep.toml"])
        self.write("deep.toml", "a = " + "[" * 100000 + "]" * 100000 + "\n")
        self.quickly_refused("run", "deep.toml", "--out", "results", naming=["deep.toml"])

    def test_family_names_its_limit(self):
        self.refused("check", "capsules-1000000", naming=["capsules-1000000", "10000"])


class EndlessFiles(AssayTest):
    """Pipes, devices and files without end where a file of the user's is expected."""

    KINDS = {"a pipe": "regular file", "/dev/zero": "regular file", "100 GiB": "102400 MiB"}

    def make(self, kind, name):
        path = self.dir / name
        path.parent.mkdir(exist_ok=True)
        path.unlink(missing_ok=True)
        if kind == "a pipe":
            os.mkfifo(path)
        elif kind == "/dev/zero":
            path.symlink_to("/dev/zero")
        else:
            with open(path, "wb") as file:
                file.truncate(100 << 30)

    def quickly(self, work):
        start = time.monotonic()
        work()
        self.assertLess(time.monotonic() - start, PATIENCE)

    def test_campaigns(self):
        for kind, says in self.KINDS.items():
            with self.subTest(kind):
                self.make(kind, "c.toml")
                self.quickly(lambda: self.refused("run", "c.toml", "--out", "results", naming=["campaign", "c.toml", says]))
        (self.dir / "c.toml").unlink()
        self.write("c.toml", "# " + "x" * (5 << 20) + "\n" + BALL_CAMPAIGN)
        self.refused("run", "c.toml", "--out", "results", naming=["c.toml", "at most 4 MiB"])
        self.assertFalse((self.dir / "results").exists())
        reliability("a campaign, model or file of joint positions is a pipe, /dev/zero or 100 GiB of nothing",
                    3 * len(self.KINDS), "one sentence, exit status 2", "nothing")

    def test_models(self):
        for kind, says in self.KINDS.items():
            with self.subTest(kind):
                self.make(kind, "huge.xml")
                naming = ["huge.xml", says if kind == "100 GiB" else "not a file"]
                self.quickly(lambda: self.refused("check", "huge.xml", naming=naming))
                self.quickly(lambda: self.refused("check", "huge.xml", "--repair", "out.xml", naming=["huge.xml"]))

    def test_positions(self):
        self.write("ball.xml", BALL)
        for kind, says in self.KINDS.items():
            with self.subTest(kind):
                self.make(kind, "q.txt")
                self.quickly(lambda: self.refused("check", "ball.xml", "--qpos", "q.txt",
                                                  naming=["joint positions", "q.txt", says, "JOINT=VALUE"]))

    def test_a_programme_that_is_there_already(self):
        self.write("ball.xml", BALL)
        self.make("a pipe", "q/campaign.toml")
        self.quickly(lambda: self.refused("run", "ball.xml", "--out", "q", "--plan", naming=["q/campaign.toml", "regular file"]))

    def test_the_manifest_of_a_package(self):
        self.make("a pipe", "package.xml")
        self.write("arm.urdf", '<robot name="arm"><link name="base"/><link name="arm"><inertial><mass value="1"/><inertia ixx="1" '
                   'iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><mesh filename="package://arm/a.stl"/>'
                   '</geometry></collision></link><joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint>'
                   '</robot>')
        self.quickly(lambda: self.refused("check", "arm.urdf", naming=["arm.urdf", "a.stl"]))


class OutsideFiles(AssayTest):
    """A model's files lie below its folder, unless the user says otherwise."""

    def setUp(self):
        super().setUp()
        self.write("secret/part.xml", in_world(FREE_BALL))
        self.write("secret/cube.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")

    def test_includes_and_meshes(self):
        models = {
            "include": mjcf('<include file="../secret/part.xml"/>'),
            "absolute": mjcf(f'<include file="{self.dir}/secret/part.xml"/>'),
            "mesh": mjcf('<asset><mesh name="m" file="../secret/cube.obj"/></asset><worldbody><body><freejoint/>'
                         '<geom type="mesh" mesh="m"/></body></worldbody>'),
            "folder": mjcf('<compiler meshdir="../secret"/><asset><mesh name="m" file="cube.obj"/></asset><worldbody>'
                           '<body><freejoint/><geom type="mesh" mesh="m"/></body></worldbody>'),
        }
        for name, text in models.items():
            with self.subTest(name):
                self.write("mine/robot.xml", text)
                self.refused("check", "mine/robot.xml",
                             naming=["secret", "outside the model's folder", "--allow-external-files"])
                self.assay("check", "mine/robot.xml", "--allow-external-files")
        (self.dir / "mine/link.xml").symlink_to(self.dir / "secret/part.xml")
        self.write("mine/robot.xml", mjcf('<include file="link.xml"/>'))
        self.refused("check", "mine/robot.xml", naming=["link.xml", "outside the model's folder"])

    MESH = ('<asset><mesh name="m" file="{}"/></asset><worldbody><body><freejoint/><geom type="mesh" mesh="m"/></body>'
            '</worldbody>')

    def is_outside(self, *naming):
        self.refused("check", "mine/robot.xml", naming=[*naming, "outside the model's folder", "--allow-external-files"])

    # MuJoCo looks for what a file includes in the model's folder, then in that file's own.
    def test_what_included_files_name(self):
        self.write("mine/robot.xml", mjcf('<include file="sub/a.xml"/>'))
        (self.dir / "mine/sub").mkdir()
        (self.dir / "mine/sub/link.xml").symlink_to("../../secret/part.xml")
        parts = {
            "include": mjcf('<include file="../../secret/part.xml"/>'),
            "link": mjcf('<include file="link.xml"/>'),
            "third level": mjcf('<include file="deep/b.xml"/>'),
            "mesh": mjcf(self.MESH.format("../../secret/cube.obj")),
            "model": mjcf('<asset><model name="m" file="../../secret/part.xml"/></asset>'),
            "folder": mjcf('<compiler meshdir="../secret"/>' + self.MESH.format("cube.obj")),
            "name alone": mjcf('<compiler meshdir="../secret" strippath="true"/>' + self.MESH.format("x/cube.obj")),
            "backslashes": mjcf('<include file="..\\..\\secret\\part.xml"/>'),
        }
        self.write("mine/sub/deep/b.xml", mjcf('<include file="../../../secret/part.xml"/>'))
        for name, text in parts.items():
            with self.subTest(name):
                self.write("mine/sub/a.xml", text)
                self.is_outside("sub/a.xml" if name != "third level" else "deep/b.xml", "line 1")
        for name in ("include", "link", "mesh"):
            self.write("mine/sub/a.xml", parts[name])
            self.assay("check", "mine/robot.xml", "--allow-external-files")
        reliability("an included file names files, links, meshes, models or folders of meshes outside the model's folder",
                    len(parts), "one sentence, exit status 2; nothing of them is opened", "nothing")

    # What is said in one file holds for all of them.
    def test_folders_that_included_files_choose(self):
        self.write("mine/c.xml", mjcf('<compiler meshdir="../secret"/>'))
        include = '<include file="c.xml"/>'
        for inside in (include + self.MESH.format("cube.obj"), self.MESH.format("cube.obj") + include):
            self.write("mine/robot.xml", mjcf(inside))
            self.is_outside("cube.obj")
            self.assay("check", "mine/robot.xml", "--allow-external-files")

    def test_a_name_says_nothing_about_what_exists(self):
        (self.dir / "mine").mkdir()
        (self.dir / "mine/link.xml").symlink_to("../secret/none.xml")
        for name in ("../secret/none.xml", "/nowhere/none.xml", "link.xml"):
            self.write("mine/robot.xml", mjcf(f'<include file="{name}"/>'))
            self.is_outside(name.rsplit("/", maxsplit=1)[-1])
        self.write("mine/robot.xml", mjcf('<include file="none.xml"/>'))
        self.refused("check", "mine/robot.xml", naming=["none.xml", "correct its name"])

    # MuJoCo takes a name and ".." after it away, whatever link the name is.
    def test_a_folder_that_is_a_link(self):
        self.write("secret/deep/x.xml", mjcf(""))
        (self.dir / "mine").mkdir()
        (self.dir / "mine/link").symlink_to("../secret/deep")
        self.write("mine/part.xml", in_world(FREE_BALL))
        self.write("mine/robot.xml", mjcf('<include file="link/../part.xml"/>'))
        self.assay("check", "mine/robot.xml")
        self.write("mine/robot.xml", mjcf('<include file="link/../../secret/part.xml"/>'))
        self.is_outside("part.xml")

    def test_what_included_files_hold(self):
        self.write("mine/robot.xml", mjcf('<include file="sub/a.xml"/>'))
        self.write("mine/sub/a.xml", mjcf('<include file="b.xml"/>'))
        parts = {
            "class": (in_world('<body><freejoint/><geom class="%s%n" size=".1"/></body>'), ["%s%n", "rename the class"]),
            "keyframes": (mjcf(f'<size nkey="2000000000"/><worldbody>{FREE_BALL}</worldbody>'), ["nkey", "at most"]),
            "itself": (mjcf('<include file="b.xml"/>'), ["contains itself"]),
            "capitals": (mjcf('<INCLUDE file="../../secret/part.xml"/>'), ["write 'include'"]),
            "no XML": ("<mujoco><worldbody></mujoco>", ["is not XML", "write </worldbody>"]),
        }
        for name, (text, naming) in parts.items():
            with self.subTest(name):
                self.write("mine/sub/b.xml", text)
                self.refused("check", "mine/robot.xml", naming=["b.xml", *naming])
        (self.dir / "mine/sub/b.xml").unlink()
        os.mkfifo(self.dir / "mine/sub/b.xml")
        start = time.monotonic()
        self.refused("check", "mine/robot.xml", naming=["'b.xml'", "sub/a.xml, line 1", "regular file"])
        self.assertLess(time.monotonic() - start, 20)  # the parser's own limit is 30 s

    # MuJoCo unpacks one wherever it finds it, and reads the model in it with all that that names.
    def test_archives(self):
        with zipfile.ZipFile(self.write("mine/cube.mjz", ""), "w") as archive:
            archive.writestr("model.xml", mjcf(f'<include file="{self.dir}/secret/part.xml"/>'))
        for inside in (self.MESH.format("cube.mjz"), '<asset><model name="m" file="cube.mjz"/></asset>'):
            self.write("mine/robot.xml", mjcf(inside))
            self.refused("check", "mine/robot.xml", naming=["the archive 'cube.mjz'", "unpack it"])

    def test_a_robot_in_parts(self):
        cube = (self.dir / "secret/cube.obj").read_text()
        self.write("mine/robot.xml", mjcf('<compiler meshdir="meshes"/><include file="sub/a.xml"/><include file="floor.xml"/>'))
        self.write("mine/floor.xml", in_world('<geom type="plane" size="1 1 1"/>'))
        self.write("mine/sub/a.xml", mjcf('<include file="arm.xml"/><include file="deep/../hand.xml"/><include file="../more.xml"/>'))
        self.write("mine/sub/arm.xml", mjcf(self.MESH.format("cube.obj")))
        self.write("mine/sub/hand.xml", mjcf(self.MESH.format("../tips/tip.obj").replace('"m"', '"tip"')))
        self.write("mine/more.xml", in_world(FREE_BALL))
        self.write("mine/meshes/cube.obj", cube)
        self.write("mine/tips/tip.obj", cube)
        self.assertIn("3 bodies", self.assay("check", "mine/robot.xml"))

    def test_a_repair_of_a_robot_in_parts(self):
        self.write("mine/robot.xml", mjcf('<include file="sub/a.xml"/>'))
        self.write("mine/sub/a.xml", mjcf('<include file="b.xml"/>'))
        self.write("mine/sub/b.xml", in_world('<body><joint name="j" limited="true" range="1 -1"/><geom size=".1"/></body>'))
        self.refused("check", "mine/robot.xml", naming=["joint 'j'", "b.xml, line 1", "swapped"])
        self.assay("check", "mine/robot.xml", "--repair", "mine/mended.xml")
        self.assertNotIn("include", (self.dir / "mine/mended.xml").read_text())
        self.assay("check", "mine/mended.xml")

    # What one unpacks is the package, and nothing beside it.
    def test_python_packages(self):
        self.write("lib/bots-1.0.dist-info/METADATA", "Name: bots")
        self.write("lib/bots/shared/deep/part.xml", in_world(FREE_BALL))
        self.write("lib/bots/a/b/c/d/robot.xml", mjcf('<include file="../../../../shared/deep/part.xml"/>'))
        self.assay("check", "lib/bots/a/b/c/d/robot.xml")
        self.write("lib/bots/a/b/c/d/robot.xml", mjcf('<include file="../../../../../../secret/part.xml"/>'))
        self.refused("check", "lib/bots/a/b/c/d/robot.xml", naming=["secret", "outside the model's folder", "lib/bots'"])

    def test_urdf(self):
        body = ('<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
                '<collision><geometry><mesh filename="{}"/></geometry></collision>')
        robot = '<robot name="r"><link name="base">' + body + "</link></robot>"
        self.write("mine/robot.urdf", robot.format("../secret/cube.obj"))
        self.refused("check", "mine/robot.urdf", "--floating-base",
                     naming=["cube.obj", "outside the model's folder", "--allow-external-files"])
        self.assay("check", "mine/robot.urdf", "--floating-base", "--allow-external-files")
        self.write("mine/robot.urdf", robot.format("package://parts/cube.obj"))
        self.assay("check", "mine/robot.urdf", "--floating-base", "--package", f"parts={self.dir}/secret")
        self.write("mine/robot.urdf", robot.format("package://parts/../secret/cube.obj"))
        self.refused("check", "mine/robot.urdf", "--floating-base", "--package", f"parts={self.dir}/secret",
                     naming=["outside the model's folder"])


class DeadlyPlugins(AssayTest):
    """A plugin that ends the process which loads it is left out by name, and nothing else is."""

    def test_each_is_named_and_the_others_work(self):
        expected = {"aborter": "signal 6", "exiter": "exit status 0", "nameaborter": "signal 6",
                    "exitlister": "exit status 0", "unable": "nothing is known"}
        folder = self.dir / "plugins"
        shutil.copytree(DEADLY_PLUGINS, folder)
        # a file that ends in the middle: a page that is not there
        whole = pathlib.Path(DEADLY_PLUGINS) / "assay-engine-unable.so"
        (folder / "assay-engine-cut.so").write_bytes(whole.read_bytes()[:6000])
        self.env["ASSAY_ENGINE_PATH"] = str(folder)
        listed = self.assay_json("engines", "--json")
        absent = {row["engine"]: row["reason"] for row in listed["absent"]}
        for name, reason in expected.items():
            self.assertIn(reason, absent[name], name)
        self.assertIn("cut", absent)
        self.assertIn("null", [row["contender"] for row in listed["contenders"]])
        self.write("ball.xml", BALL)
        self.write("faults.toml", BALL_CAMPAIGN)
        self.assay("check", "ball.xml")
        self.assay("simulate", "ball.xml", "--engine", "null", "--timestep", 1, "--duration", 0.01, "--out", "-")
        self.assay("run", "faults.toml", "--out", "results")
        self.refused("simulate", "ball.xml", "--engine", "exiter", "--timestep", 1, "--duration", 1, "--out", "-",
                     naming=["exiter", "absent"])
        reliability("plugins that abort, exit(0), throw or are cut off: when loaded, in name(), contenders(), capabilities()",
                    len(expected) + 1, "left out, by name and reason", "that engine")

    def test_those_that_do_not_come_to_an_end(self):
        self.env["ASSAY_ENGINE_PATH"] = str(pathlib.Path(DEADLY_PLUGINS).parent / "hanging")
        start = time.monotonic()
        listed = self.assay_json("engines", "--json")
        self.assertLess(time.monotonic() - start, PATIENCE)
        absent = {row["engine"]: row["reason"] for row in listed["absent"]}
        self.assertIn("is not loaded after 10 s", absent["hanger"])
        self.assertIn("leaves a process behind", absent["forker"])
        self.assertIn("null", [row["contender"] for row in listed["contenders"]])
        reliability("plugins that hang with signals ignored, or leave a process that holds all descriptors: when loaded", 2,
                    "left out after 10 s, by name and reason, with what they started", "that engine")

    def test_one_whose_trial_somebody_else_ends(self):
        self.env["ASSAY_ENGINE_PATH"] = str(pathlib.Path(DEADLY_PLUGINS).parent / "killed")
        self.env["ASSAY_MISHAP_MARK"] = str(self.dir / "mark")
        self.env["ASSAY_SANDBOX"] = "off"  # the trial may not write there
        self.env["ASSAY_MISHAP_KILLS"] = "2"
        absent = {row["engine"]: row["reason"] for row in self.assay_json("engines", "--json")["absent"]}
        self.assertEqual((self.dir / "mark").stat().st_size, 2)
        self.assertIn("calls itself 'somebody-else'", absent["victim"])
        self.env["ASSAY_MISHAP_KILLS"] = "1000"
        self.refused("engines", status=1, naming=["assay-engine-victim.so", "ended from outside (SIGKILL)", "start the same"])
        reliability("SIGKILL of the trial of a plugin", 5, "tried again; after the third time one sentence, exit status 1",
                    "nothing")

    def test_an_engine_whose_answer_somebody_else_ends(self):
        self.use_mishap_engine()
        self.write("ball.xml", BALL)
        self.env["ASSAY_MISHAP_MARK"] = str(self.dir / "mark")
        self.env["ASSAY_SANDBOX"] = "off"
        simulate = ["simulate", "ball.xml", "--engine", "mishap-killed-in-check", "--timestep", 1, "--duration", 0.01,
                    "--out", "-", "--set"]
        self.assay(*simulate, "times=2")
        self.assertEqual((self.dir / "mark").stat().st_size, 2)
        self.refused(*simulate, "times=1000", status=1, naming=["asking mishap-killed-in-check", "ended from outside (SIGKILL)"])
        reliability("SIGKILL of the process that tries a file or asks an engine", 5,
                    "tried again; after the third time one sentence, exit status 1", "nothing")

    def test_an_engine_that_ends_the_process_when_it_is_asked_about_a_model(self):
        self.use_mishap_engine()
        self.write("ball.xml", BALL)
        for fault in ("abort", "exit"):
            with self.subTest(fault):
                contender = f"mishap-{fault}-in-check"
                self.refused("simulate", "ball.xml", "--engine", contender, "--timestep", 1, "--duration", 1, "--out", "-",
                             naming=["asking", contender])
        # these ask every contender
        self.refused("run", "ball.xml", naming=["asking mishap-"])
        for contender in ("mishap-abort-in-check", "mishap-exit-in-check"):
            self.assertRegex(self.assay("check", "ball.xml"), rf"(?m)^mishap +refused +1 +{contender}$")
        reliability("an engine aborts or calls exit(0) in check()", 2,
                    "one sentence and exit status 2; `check` says that it refuses the model", "nothing")


class EnginesOutput(AssayTest):
    def test_what_an_engine_prints_is_not_in_the_table(self):
        self.use_mishap_engine()
        self.write("ball.xml", BALL)
        done = self.run_assay("simulate", "ball.xml", "--engine", "mishap-chatter", "--timestep", 1, "--duration", 0.02,
                              "--out", "-")
        self.assertEqual(done.returncode, 0, done.stderr[-1000:])
        self.assertEqual(len(read_csv(done.stdout)), 21)
        self.assertEqual(done.stdout.count("\n"), 22)
        self.assertIn("very many lines", done.stderr)

    def test_states_that_cannot_be_are_no_rows(self):
        self.use_mishap_engine()
        self.write("ball.xml", BALL)
        for fault, says in {"wrong-size": "0 bodies where the model has 1", "zero-orientation": "length 0",
                            "nan-time": "non-finite", "backward": "the time -0.01 s where 0.01 s was asked for"}.items():
            done = self.run_assay("simulate", "ball.xml", "--engine", f"mishap-{fault}", "--timestep", 1, "--duration",
                                  0.02, "--out", "run.csv")
            self.assertEqual(done.returncode, 1, fault)
            self.check_sentence(done.stderr, [" gave ", says])

    def test_states_that_cannot_be_are_no_forces_and_no_figures(self):
        self.use_mishap_engine()
        faults = {"wrong-size": "4 bodies where the model has 5", "zero-orientation": "length 0", "nan-time": "non-finite",
                  "backward": "the time -"}
        for fault, says in faults.items():
            with self.subTest(fault):
                certificate, = self.assay_json("parity", "planar-chain", f"mishap-{fault}", "--samples", 2, "--json")["certificates"]
                self.assertEqual((certificate["verdict"], certificate["causes"]), ("not examined", []))
                self.assertIn("the engine gave", certificate["failure"])
                self.assertIn(says, certificate["failure"])
                done = self.run_assay("conformance", f"mishap-{fault}", "--test", "planar-chain")
                self.assertEqual(done.returncode, 1)
                self.assertRegex(done.stdout, rf"(?m)^  fail +planar-chain .*the engine gave .*{says}")
        reliability("an engine's states of another size, of a time that goes back, or with numbers that cannot be, in parity and conformance",
                    2 * len(faults), "not examined, or a test that fails, with the reason", "nothing")


class Escapes(AssayTest):
    def test_names_do_not_reach_the_terminal_raw(self):
        self.write("ball.xml", BALL.replace('name="ball"', 'name="b&#27;[31m&#7;"'))
        status, shown = self.on_terminal("check", "ball.xml", NO_COLOR="1")
        self.assertEqual(status, 0, shown)
        self.assertNotIn("\x1b[31m", shown)
        self.assertNotIn("\x07", shown)
        status, shown = self.on_terminal("check", "no\x1b[31mfile.xml", NO_COLOR="1")
        self.assertEqual(status, 2)
        self.assertNotIn("\x1b[31m", shown)

    TITLE = "b\x1b]0;owned\x07"  # would set the window's title

    def test_states_on_a_terminal(self):
        self.write("ball.xml", BALL.replace('body name="ball"', 'body name="b&#27;]0;owned&#7;"'))
        arguments = ["simulate", "ball.xml", "--engine", "null", "--timestep", 1, "--duration", 0.002, "--out"]
        status, shown = self.on_terminal(*arguments, "-", NO_COLOR="1")
        self.assertEqual(status, 0, shown)
        self.assertNotRegex(shown, r"[\x07\x1b]")
        self.assertIn(r"b\x1b]0;owned\x07", shown)
        for text in (self.assay(*arguments, "-"), (self.assay(*arguments, "x.csv"), (self.dir / "x.csv").read_text())[1]):
            self.assertEqual({row["body"] for row in read_csv(text)}, {self.TITLE})

    def test_values_on_a_terminal(self):
        turned = "b\u009b\u0085\u202e\u2066"
        self.write("ball.xml", BALL)
        self.write("faults.toml", BALL_CAMPAIGN + BALL_CAMPAIGN[BALL_CAMPAIGN.index("[[system]]"):].replace(
            'name = "ball"', 'name = "b\\u009b\\u0085\\u202e\\u2066"'))
        text = self.dir / "faults.toml"
        text.write_text(text.read_text().replace('[[system]]\nname = "ball"', r'[[system]]' '\n' r'name = "b\u001b]0;owned\u0007"'))
        self.assay("run", "faults.toml", "--out", "results")
        for how in ("csv", "json"):
            status, shown = self.on_terminal("export", "results", "--format", how, NO_COLOR="1")
            self.assertEqual(status, 0, shown)
            self.assertNotRegex(shown, "[\x07\x1b\u0080-\u009f\u202e\u2066]")
        self.assertIn(self.TITLE, self.assay("export", "results", "--format", "csv"))
        written = self.assay("export", "results", "--format", "json")
        self.assertNotRegex(written, "[\u0080-\u009f\u202e\u2066]")
        self.assertLessEqual({self.TITLE, turned}, {row["system"] for row in json.loads(written)})

    def test_a_name_begins_no_line_of_its_own(self):
        self.write("ball.xml", BALL)
        self.write("faults.toml", BALL_CAMPAIGN.replace("null", "mujoco-euler").replace(
            '[[system]]\nname = "ball"', '[[system]]\nname = "b\\nassay: all verified"'))
        done = self.run_assay("run", "faults.toml", "--out", "results", "--jobs", 1)
        shown = self.on_terminal("run", "faults.toml", "--out", "others")[1]
        for text in (done.stdout, done.stderr, shown, self.on_terminal("report", "results")[1]):
            self.assertNotRegex(text, "(?m)^assay: all verified")


class Numbers(AssayTest):
    def campaign(self, **changes):
        text = BALL_CAMPAIGN
        for old, new in changes.values():
            self.assertIn(old, text)
            text = text.replace(old, new)
        self.write("ball.xml", BALL)
        self.write("faults.toml", text)

    def test_limits_that_overflow(self):
        self.campaign(limit=("timesteps_ms", "time_limit_s = 1e10\ntimesteps_ms"))
        self.refused("run", "faults.toml", "--out", "results", naming=["time_limit_s", "10000000000", "at most"])
        self.campaign(limit=("timesteps_ms", "time_limit_s = 1e-320\ntimesteps_ms"))
        self.refused("run", "faults.toml", "--out", "results", naming=["time_limit_s", "e-320", "at least 0.01"])
        self.campaign(limit=("timesteps_ms", "time_limit_s = inf\ntimesteps_ms"))
        self.refused("run", "faults.toml", "--out", "results", naming=["time_limit_s", "inf"])
        reliability("time limits that overflow the clock, or that nothing keeps", 3, "one sentence, exit status 2", "nothing")

    def test_durations_that_nobody_can_wait_for(self):
        self.campaign(long=("duration_s = 0.01", "duration_s = 1e12"))
        self.refused("run", "faults.toml", "--out", "results", naming=["duration_s", "at most"])
        self.campaign(long=("duration_s = 0.01", "duration_s = 1e12\nsample_ms = 1e12\ntiming_ms = [1]"))
        self.refused("run", "faults.toml", "--out", "results", naming=["duration_s", "at most"])
        self.campaign(long=("duration_s = 0.01", "duration_s = 1e308"))
        self.refused("run", "faults.toml", "--out", "results", naming=["duration_s", "at most 1e+09 s"])
        self.campaign(fine=("reference_ms = 1", "reference_ms = 1e-320"))
        self.refused("run", "faults.toml", "--out", "results", naming=["reference_ms", "e-32", "at least 1e-06 ms"])

    def test_one_run_has_a_campaigns_limits(self):
        self.write("ball.xml", BALL)
        for timestep, duration, naming in [("1e-320", "1", ["--timestep", "at least 1e-06 ms"]),
                                           ("1e308", "1", ["--timestep", "at most 1e+12 ms"]),
                                           ("1", "1e12", ["--duration", "1e12", "at most 1e+09 s"]),
                                           ("1e-6", "1e6", ["--duration", "1e6", "at most 1e+03 s"])]:
            self.refused("simulate", "ball.xml", "--engine", "null", "--timestep", timestep, "--duration", duration, "--out",
                         "x.csv", naming=naming)


class Descriptors(AssayTest):
    """What a program is started with: streams that are closed or full, a small limit of open files."""

    def setUp(self):
        super().setUp()
        self.write("ball.xml", BALL)
        self.write("faults.toml", BALL_CAMPAIGN.replace('["null"]', '["mujoco-euler", "ode-quick"]'))

    def started(self, *arguments, prepare):
        return self.run_assay(*arguments, preexec_fn=prepare)

    def test_closed_streams(self):
        self.assay("run", "faults.toml", "--out", "clean")
        values = self.assay("export", "clean", "--format", "csv")
        tries = 0
        for closed in itertools.chain.from_iterable(itertools.combinations(range(3), count) for count in (1, 2, 3)):
            with self.subTest(closed):
                close = lambda: [os.close(number) for number in closed]  # noqa: E731
                done = self.started("run", "faults.toml", "--out", f"results{tries}", prepare=close)
                # what it has measured is stored; only the word about it is lost
                self.assertEqual(done.returncode, 1 if 1 in closed else 0, done.stderr)
                self.assertEqual((self.dir / f"results{tries}/.lock").read_bytes(), (self.dir / "clean/.lock").read_bytes())
                self.assertEqual(self.assay("export", f"results{tries}", "--format", "csv"), values)
                done = self.started("simulate", "ball.xml", "--engine", "mujoco-euler", "--timestep", 1, "--duration", 0.01, "--out",
                                    "x.csv", prepare=close)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(len(read_csv((self.dir / "x.csv").read_text())), 11)
                (self.dir / "x.csv").unlink()
                tries += 1
        done = self.started("engines", prepare=lambda: os.close(1))
        self.assertEqual(done.returncode, 1)
        self.check_sentence(done.stderr, ["standard output cannot be written"])
        reliability("standard input, output or error is closed at the start", 2 * tries + 1,
                    "results are whole; what cannot be shown ends with status 1", "the words that nobody could read")

    def test_progress_that_cannot_be_written(self):
        with open("/dev/full", "wb") as full:
            for form in ("text", "json"):
                done = subprocess.run(self.command("run", "faults.toml", "--out", form, "--progress", form), cwd=self.dir,
                                      env=self.env, stdout=subprocess.PIPE, stderr=full, timeout=500)
                self.assertEqual(done.returncode, 0)
                self.assertIn(b"2 ok", done.stdout)

    def test_few_open_files(self):
        self.assay("run", "faults.toml", "--out", "clean")
        values = self.assay("export", "clean", "--format", "csv")
        limits = (4, 6, 8, 10, 11, 12, 14, 16, 20, 24, 32, 48, 64, 100)
        for most in limits:
            with self.subTest(most):
                done = self.started("run", "faults.toml", "--out", f"results{most}",
                                    prepare=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (most, most)))
                if most >= 48:
                    self.assertEqual(done.returncode, 0, done.stderr)
                if done.returncode == 0:
                    self.assertEqual(self.assay("export", f"results{most}", "--format", "csv"), values)
                    continue
                self.assertIn(done.returncode, (1, 2))
                self.assertRegex(done.stderr.splitlines()[-1] if done.stderr else "", "^assay: ")
                # an engine is not to blame, and the same command goes on
                self.assay("run", "faults.toml", "--out", f"results{most}")
                self.assertEqual(self.assay("export", f"results{most}", "--format", "csv"), values)
        done = self.started("run", "faults.toml", "--out", "none",
                            prepare=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3)))
        self.assertNotEqual(done.returncode, 0)
        reliability("a small limit of open files (4 to 100)", len(limits),
                    "one sentence, exit status 1 or 2, or all is measured; with more files it goes on", "nothing")


class ShortOfMemory(AssayTest):
    """What the machine lacks is no verdict on a contender, and nothing of it is kept."""

    RUN = ["run", "short.toml", "--out", "results", "--references", "kept"]

    def under(self, limits, *arguments):
        """The finished process under limits of memory, or None where the program itself does not start under them, as
        sanitizers'."""

        def prepare():
            for kind, most in limits.items():
                resource.setrlimit(kind, (most, most))

        if self.run_assay("--version", preexec_fn=prepare).returncode != 0:
            return None
        return self.run_assay(*arguments, preexec_fn=prepare)

    def test_a_limit_of_the_shell(self):
        self.write("short.toml", campaign("short", [1], ["drift"], duration_s=0.064))
        tried = 0
        limits = [{resource.RLIMIT_AS: size << 20} for size in (90, 120, 140)] + [{resource.RLIMIT_DATA: size << 20} for size in (20, 40)]
        for limit in limits:
            done = self.under(limit, *self.RUN)
            if done is None:
                continue
            tried += 1
            if done.returncode != 0:
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertNotIn("not scored", done.stdout)
                self.assertRegex(done.stderr, "ulimit -|not enough memory")
                self.assertNotIn("there already", done.stdout + done.stderr)  # none was measured before
                self.assertNotRegex(done.stdout, r"[1-9] before")
            # the same command without the limit has every cell, as has a fresh directory
            for out in ["results", "fresh"]:
                self.assertIn("1 ok", self.assay(*self.RUN[:3], out, *self.RUN[4:]))
            for folder in ["results", "fresh", "kept", "conformance", "cache"]:
                shutil.rmtree(self.dir / folder, ignore_errors=True)
        if tried == 0:
            self.skipTest("the program does not start under a limit of memory")

    def test_the_suite_by_hand(self):
        done = self.under({resource.RLIMIT_AS: 150000 << 10}, "conformance", "mujoco-euler")
        if done is None:
            self.skipTest("the program does not start under a limit of memory")
        self.assertNotRegex(done.stdout, "(?m)^  fail ")
        if "not-run" in done.stdout:
            self.assertEqual(done.returncode, 1)
            self.assertIn("ulimit -v", done.stderr)


class LostDatabase(AssayTest):
    def test_a_database_that_is_removed_during_a_run(self):
        self.use_mishap_engine()
        campaign = BALL_CAMPAIGN.replace('["null"]', '["null", "mishap"]')
        self.write("ball.xml", BALL)
        self.write("faults.toml", campaign.replace("timesteps_ms = [1]", "timesteps_ms = [1, 2]"))
        for replaced in [False, True]:
            with self.subTest(replaced=replaced):
                run = self.start_assay("run", "faults.toml", "--out", "results", "--progress", "json")
                database = self.dir / "results/assay.sqlite"
                while run.poll() is None and not database.exists():
                    time.sleep(0.001)
                database.unlink()
                if replaced:
                    database.write_bytes(b"another")
                told = run.communicate(timeout=PATIENCE)[1].splitlines()[-1]
                self.assertEqual(run.returncode, 1, told)
                self.assertIn("results/assay.sqlite", told)
                self.assertRegex(told, "removed, moved or replaced")
                shutil.rmtree(self.dir / "results")


class Clock(AssayTest):
    SHIM = """
        #define _GNU_SOURCE
        #include <errno.h>
        #include <fcntl.h>
        #include <stdlib.h>
        #include <string.h>
        #include <sys/syscall.h>
        #include <sys/time.h>
        #include <time.h>
        #include <unistd.h>
        // Each program in which the clock has jumped leaves its name, where it may write.
        static void leave_name(void) {
          const char* mark = getenv("SHIM_MARK");
          const int file = mark ? open(mark, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644) : -1;
          if (file < 0) return;
          if (write(file, program_invocation_short_name, strlen(program_invocation_short_name)) > 0) (void)!write(file, "\\n", 1);
          close(file);
        }
        static long jump(void) {
          static long calls, left;
          if (!__atomic_exchange_n(&left, 1, __ATOMIC_RELAXED)) leave_name();
          return (__atomic_fetch_add(&calls, 1, __ATOMIC_RELAXED) % 2 ? 5 : -5) * 3600L;
        }
        int clock_gettime(clockid_t clock, struct timespec* now) {
          const int result = syscall(SYS_clock_gettime, clock, now);
          if (clock == CLOCK_REALTIME) now->tv_sec += jump();
          return result;
        }
        int gettimeofday(struct timeval* restrict now, void* restrict zone) {
          (void)zone;
          struct timespec exact;
          syscall(SYS_clock_gettime, CLOCK_REALTIME, &exact);
          now->tv_sec = exact.tv_sec + jump();
          now->tv_usec = exact.tv_nsec / 1000;
          return 0;
        }
        time_t time(time_t* out) {
          struct timespec exact;
          syscall(SYS_clock_gettime, CLOCK_REALTIME, &exact);
          const time_t now = exact.tv_sec + jump();
          if (out) *out = now;
          return now;
        }
    """

    def test_it_jumps_by_hours(self):
        self.write("shim.c", self.SHIM)
        subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", "shim.so", "shim.c"], cwd=self.dir, check=True)
        self.write("ball.xml", BALL)
        self.write("faults.toml", BALL_CAMPAIGN.replace('["null"]', '["mujoco-euler", "ode-quick"]').replace(
            '["drift"]', '["drift", "consistency", "raw_speed"]').replace("0.01", "0.128\npiece_ms = 64").replace(
            "timesteps_ms = [1]", "timesteps_ms = [1, 2]").replace("[[system]]", "[timing]\nrounds = 2\nbatch_ms = 1\n[[system]]"))

        def rows(out, query):
            with contextlib.closing(sqlite3.connect(self.dir / out / "assay.sqlite")) as db:
                return db.execute(query).fetchall()

        def untimed(out):
            return rows(out, """SELECT system, contender, timestep_ms, outcome, name, value FROM "values"
                JOIN cells ON cells.id = cell_id WHERE measure IN ('drift', 'consistency') ORDER BY 1, 2, 3, 4, 5""")

        self.assay("run", "faults.toml", "--out", "clean")
        values = untimed("clean")
        self.assertTrue(values)
        self.env |= {"LD_PRELOAD": str(self.dir / "shim.so"), "SHIM_MARK": str(self.dir / "mark")}
        times = subprocess.run([sys.executable, "-c", "import time; print(time.time(), time.time())"], env=self.env,
                               capture_output=True, text=True, check=True).stdout.split()
        self.assertGreater(abs(float(times[1]) - float(times[0])), 9 * 3600, "the clock does not jump")
        (self.dir / "mark").unlink()
        self.assay("run", "faults.toml", "--out", "results")
        for name in ("LD_PRELOAD", "SHIM_MARK"):
            del self.env[name]
        self.assertIn(pathlib.Path(self.program).name, (self.dir / "mark").read_text().split())
        self.assertEqual(untimed("results"), values)
        cells = rows("results", "SELECT started, finished, wall_s FROM cells")
        self.assertTrue(cells)
        for started, finished, wall_s in cells:
            self.assertGreaterEqual(wall_s, 0)
            self.assertLess(wall_s, 3600)
            self.assertTrue(0 <= finished - started < 3600, (started, finished))
        reliability("the system's clock jumps back and forth by hours", len(cells), "the same values, no negative duration", "nothing")


class DamagedResults(AssayTest):
    def setUp(self):
        super().setUp()
        self.write("ball.xml", BALL)
        self.write("faults.toml", BALL_CAMPAIGN.replace('["null"]', '["mujoco-euler"]').replace(
            '["drift"]', '["consistency"]').replace("0.01", "0.128\npiece_ms = 64"))
        self.assay("run", "faults.toml", "--out", "results")

    def test_damaged_runs_are_named_by_the_export(self):
        files = list((self.dir / "results/trajectories").glob("*.bin"))
        self.assertTrue(files)
        for file in files:
            file.write_bytes(file.read_bytes()[:-1])
        done = self.run_assay("export", "results", "--trajectories", "csv", "--out", "states")
        self.assertEqual(done.returncode, 1, done.stderr)
        named = [file for file in files if file.name in done.stderr]  # others hold the ends of pieces, which are no runs
        self.assertEqual(len(named), 1)
        self.assertIn(f"{named[0].name}' is damaged", done.stderr)
        self.assertIn("0 runs written to 'states'; 1 run damaged", done.stderr)

    def test_damaged_cells_are_named_and_measured_again(self):
        values = self.assay("export", "results", "--format", "csv")
        with contextlib.closing(sqlite3.connect(self.dir / "results/assay.sqlite")) as db:
            db.execute("UPDATE \"values\" SET value = value + 1 WHERE name = 'consistency'")
            db.commit()
        self.refused("export", "results", "--format", "csv", naming=["damaged", "consistency of ball", "--retry"])
        self.refused("report", "results", naming=["damaged"])
        self.refused("run", "faults.toml", "--out", "results", naming=["damaged", "--retry"])
        self.assay("run", "faults.toml", "--out", "results", "--retry")
        self.assertEqual(self.assay("export", "results", "--format", "csv"), values)
        reliability("a stored value changes on the disk", 1, "named when it is read; --retry measures the cell again",
                    "that cell")


    def test_damaged_samples_are_measured_again(self):
        database = self.dir / "results/assay.sqlite"

        def samples():
            with contextlib.closing(sqlite3.connect(database)) as db:
                return db.execute("SELECT c.key, s.name, s.idx, s.value FROM samples s JOIN cells c ON c.id = s.cell_id "
                                  "ORDER BY 1, 2, 3").fetchall()

        before = samples()
        self.assertTrue(before)
        with contextlib.closing(sqlite3.connect(database)) as db:
            db.execute("UPDATE samples SET value = value + 1")
            db.commit()
        self.assertNotEqual(samples(), before)
        self.assay("run", "faults.toml", "--out", "results", "--retry")
        self.assertEqual(samples(), before)
        self.assay("report", "results")


class DamagedLog(AssayTest):
    """The write-ahead log of a run that was killed, with bits changed or cut off."""

    def test_nothing_wrong_is_read_and_the_same_command_goes_on(self):
        self.write("ball.xml", BALL)
        self.write("c.toml", BALL_CAMPAIGN.replace('["null"]', '["mujoco-euler", "mujoco-rk4"]').replace(
            "timesteps_ms = [1]", "timesteps_ms = [1, 2, 4, 8]").replace('["drift"]', '["consistency", "drift"]').replace(
                "0.01", "0.128\npiece_ms = 64"))
        self.assay("run", "c.toml", "--out", "whole", "--references", "off")
        values = self.assay("export", "whole", "--format", "csv")
        log, process = self.dir / "r/assay.sqlite-wal", None
        for _ in range(20):
            shutil.rmtree(self.dir / "r", ignore_errors=True)
            process = self.start_assay("run", "c.toml", "--out", "r", "--references", "off", "--jobs", "1")
            while process.poll() is None and (not log.exists() or log.stat().st_size < 200_000):
                time.sleep(0.002)
            process.kill()
            process.communicate()
            if process.returncode == -9 and log.exists() and log.stat().st_size > 100_000:
                break
        self.assertEqual(process.returncode, -9, "it was never killed in time")
        whole = log.read_bytes()
        seed = random.randrange(1 << 32)
        draw, tries, sentences, fewer = random.Random(seed), 24, 0, 0
        before = self.assay("export", "r", "--format", "csv").splitlines()
        shutil.copytree(self.dir / "r", self.dir / "copy", ignore=shutil.ignore_patterns("*-shm"))
        # reading may have put the log into the database
        self.assertEqual((self.dir / "copy/assay.sqlite-wal").read_bytes(), whole)
        shutil.move(self.dir / "copy", self.dir / "killed")
        for number in range(tries):
            shutil.rmtree(self.dir / "copy", ignore_errors=True)
            shutil.copytree(self.dir / "killed", self.dir / "copy")
            damaged, at = bytearray(whole), draw.randrange(len(whole))
            if number % 4 == 0:
                damaged = damaged[:at]
            else:
                damaged[at] ^= 1 << draw.randrange(8)
            (self.dir / "copy/assay.sqlite-wal").write_bytes(damaged)
            with self.subTest(seed=seed, at=at, number=number):
                done = self.run_assay("export", "copy", "--format", "csv")
                self.assertIn(done.returncode, (0, 2), done.stderr)
                if done.returncode == 2:
                    sentences += 1
                    self.check_sentence(done.stderr, ["copy"])
                else:
                    rows = done.stdout.splitlines()
                    self.assertLessEqual(set(rows), set(before))
                    fewer += len(rows) < len(before)
                if number % 8 == 0:
                    self.assay("run", "c.toml", "--out", "copy", "--references", "off")
                    self.assertEqual(self.assay("export", "copy", "--format", "csv"), values)
        self.assertGreater(sentences + fewer, 0, f"seed {seed}")
        reliability("the write-ahead log of a run that was killed is cut off, or a bit of it changes", tries,
                    "a sentence, or fewer cells and no other value; the same command measures the rest",
                    "cells that were only in the damaged part of the log")


if __name__ == "__main__":
    main()
