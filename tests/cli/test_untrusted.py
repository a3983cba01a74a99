"""What strangers' files and engines may not do: read and write elsewhere, take all memory, speak through names."""

import contextlib
import json
import os
import pathlib
import re
import shutil
import sqlite3
import struct
import subprocess
import time
import unittest

from harness import BALL, BALL_CAMPAIGN, SOURCE, AssayTest, main, reliability

ROBOT = ('<robot name="r"><link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
         '</inertial><collision><geometry><mesh filename="{}"/></geometry></collision></link></robot>')
CUBE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def landlock():
    """Version of the kernel's Landlock, 0 for none."""
    import ctypes  # pylint: disable=import-outside-toplevel
    version = ctypes.CDLL(None, use_errno=True).syscall(444, None, 0, 1)
    return max(version, 0)


class ModelsRoot(AssayTest):
    """What is unpacked together is one thing; what a file names elsewhere is not read."""

    def setUp(self):
        super().setUp()
        self.env["HOME"] = str(self.dir)
        self.env["TMPDIR"] = str(self.dir / "tmp")
        (self.dir / "tmp").mkdir()
        self.write("secret/cube.obj", CUBE)
        self.write(".ssh/id_rsa.obj", CUBE)

    def loads(self, file):
        self.assay("check", file, "--floating-base")

    def is_refused(self, file):
        self.refused("check", file, "--floating-base", naming=["outside the model's folder", "--allow-external-files"])
        self.assay("check", file, "--floating-base", "--allow-external-files")

    def test_a_description_without_manifest(self):
        self.write("arm_description/meshes/cube.obj", CUBE)
        self.write("arm_description/urdf/arm.urdf", ROBOT.format("../meshes/cube.obj"))
        self.loads("arm_description/urdf/arm.urdf")
        self.write("arm_description/urdf/arm.urdf", ROBOT.format("package://arm_description/meshes/cube.obj"))
        self.loads("arm_description/urdf/arm.urdf")
        self.write("arm_description/urdf/arm.urdf", ROBOT.format("../../secret/cube.obj"))
        self.is_refused("arm_description/urdf/arm.urdf")

    def test_an_archive_with_a_licence(self):
        self.write("download/LICENSE", "free")
        self.write("download/assets/meshes/cube.obj", CUBE)
        self.write("download/robots/arm/arm.urdf", ROBOT.format("../../assets/meshes/cube.obj"))
        self.loads("download/robots/arm/arm.urdf")
        self.write("download/robots/arm/arm.urdf", ROBOT.format("../../../secret/cube.obj"))
        self.is_refused("download/robots/arm/arm.urdf")

    def test_the_home_folder_is_no_package(self):
        self.write("README.md", "mine")
        self.write("package.xml", "<package><name>mine</name></package>")
        self.write("arm.urdf", ROBOT.format("secret/cube.obj"))
        self.loads("arm.urdf")  # its own folder
        self.write("urdf/arm.urdf", ROBOT.format("../secret/cube.obj"))
        self.is_refused("urdf/arm.urdf")
        self.write("arm/arm.urdf", ROBOT.format("../secret/cube.obj"))
        self.is_refused("arm/arm.urdf")

    def test_a_folder_that_a_file_calls_a_package(self):
        for uri in ("package://.ssh/id_rsa.obj", "package://secret/cube.obj", f"package://{self.dir.name}/secret/cube.obj"):
            with self.subTest(uri):
                self.write("arm/arm.urdf", ROBOT.format(uri))
                self.is_refused("arm/arm.urdf")
        self.write("secret/package.xml", "<package><name>secret</name></package>")
        self.write("arm/arm.urdf", ROBOT.format("package://secret/cube.obj"))
        self.loads("arm/arm.urdf")
        (self.dir / "secret/link.obj").symlink_to(self.dir / ".ssh/id_rsa.obj")
        self.write("arm/arm.urdf", ROBOT.format("package://secret/link.obj"))
        self.is_refused("arm/arm.urdf")

    def test_a_repair_takes_nothing_from_elsewhere(self):
        part = '<mujoco><worldbody><body><joint range="1 -1"/><geom size=".1"/></body></worldbody></mujoco>'
        self.write("secret/part.xml", part)
        self.write("arm/arm.xml", '<mujoco><include file="../secret/part.xml"/></mujoco>')
        self.refused("check", "arm/arm.xml", "--repair", "out.xml", naming=["outside the model's folder"])
        self.assertFalse((self.dir / "out.xml").exists())
        os.mkfifo(self.dir / "arm/pipe.xml")
        self.write("arm/arm.xml", '<mujoco><include file="pipe.xml"/></mujoco>')
        self.refused("check", "arm/arm.xml", "--repair", "out.xml", naming=["regular file"])

    def test_meshes_of_other_formats(self):
        # .ply: assimp's reader of it crashes
        for mesh in ("scene.blend", "scene.ply"):
            shutil.copy(SOURCE / "tests/fuzz/corpus/mesh/assimp-crash.ply", self.write(f"arm/{mesh}", ""))
            self.write("arm/arm.urdf", ROBOT.format(mesh))
            self.refused("check", "arm/arm.urdf", "--floating-base", naming=[mesh, mesh[5:], ".stl, .obj, .dae, .glb and .msh", "export it"])


class CampaignsThatAsk(AssayTest):
    def test_a_campaign_cannot_agree_for_its_user(self):
        self.write("secret/part.xml", "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>")
        self.write("mine/ball.xml", "<mujoco><include file='../secret/part.xml'/></mujoco>")
        self.write("mine/c.toml", BALL_CAMPAIGN + "allow_external_files = true\n")
        asks = ["mine/c.toml", "allow_external_files", "--allow-external-files"]
        self.refused("run", "mine/c.toml", "--out", "out", naming=asks)
        self.refused("submit", "--slurm", "mine/c.toml", "--out", "out", "--dry-run", naming=asks)
        self.assertFalse((self.dir / "out").exists())
        text = self.assay("submit", "--slurm", "mine/c.toml", "--out", "out", "--dry-run", "--allow-external-files")
        commands = [line for line in text.splitlines() if line.startswith("exec ")]
        self.assertTrue(commands and all(" --allow-external-files " in line for line in commands), text)
        self.assay("run", "mine/c.toml", "--out", "out", "--allow-external-files")
        self.env["ASSAY_ALLOW_EXTERNAL_FILES"] = "1"
        self.assay("run", "mine/c.toml", "--out", "out")
        # a robot's run agrees with its own option, for its programme too
        del self.env["ASSAY_ALLOW_EXTERNAL_FILES"]
        self.refused("run", "mine/ball.xml", "--out", "plan", "--plan", naming=["part.xml", "--allow-external-files"])
        self.assay("run", "mine/ball.xml", "--out", "plan", "--plan", "--allow-external-files")
        self.refused("run", "plan/campaign.toml", "--out", "again", naming=["allow_external_files"])


class Confined(AssayTest):
    """What runs engines and reads models cannot reach the rest of the machine."""

    def setUp(self):
        super().setUp()
        self.use_mishap_engine()
        self.write("ball.xml", BALL)
        self.home = self.dir / "home"
        self.home.mkdir()
        self.env["HOME"] = str(self.home)
        self.env["ASSAY_MISHAP_MARK"] = str(self.write("mark", "kkk"))
        if landlock() == 0:
            self.skipTest("this kernel has no Landlock")

    def simulate(self, fault):
        return self.run_assay("simulate", "ball.xml", "--engine", f"mishap-{fault}", "--timestep", 1, "--duration", 0.02, "--out",
                              "run.csv")

    def test_an_engine_of_simulate(self):
        faults = ["write-home", "read-file", "append-file", "remove-file", "open-socket", "change-mode", "limit-others", "slow-others",
                  "share-memory", "type-commands"]
        for fault in faults:
            with self.subTest(fault):
                done = self.simulate(fault)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertRegex(self.check_sentence(done.stderr, [fault]), "Permission denied|Operation not permitted")
        self.assertEqual(list(self.home.iterdir()), [])
        self.assertEqual((self.dir / "mark").read_text(), "kkk")
        done = self.simulate("limit-itself")  # which OpenMP's, Python's and others' libraries do
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_it_can_be_switched_off(self):
        self.env["ASSAY_SANDBOX"] = "off"
        done = self.simulate("write-home")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((self.home / "written-by-an-engine").exists())

    def test_results_say_what_is_in_force(self):
        self.write("c.toml", BALL_CAMPAIGN)
        for switched, manifest, said in (({}, "Landlock", ""), ({"ASSAY_SANDBOX": "off"}, "nothing", "note: ")):
            self.env.update(switched)
            done = self.run_assay("run", "c.toml", "--out", "results" + "".join(switched))
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("not confined" if said else "", done.stderr)
            if not said:
                self.assertNotIn("not confined", done.stderr)
            with sqlite3.connect(self.dir / ("results" + "".join(switched)) / "assay.sqlite") as db:
                (value,) = db.execute("SELECT value FROM manifest WHERE key = 'sandbox'").fetchone()
            self.assertIn(manifest, value)

    def test_nothing_is_left_of_workers(self):
        self.env["TMPDIR"] = str(self.dir / "tmp")
        (self.dir / "tmp").mkdir()
        self.test_results_say_what_is_in_force()
        self.assertEqual(list((self.dir / "tmp").iterdir()), [])

    def test_a_repair_is_written_where_it_is_to_be(self):
        self.write("arm.xml", '<mujoco><worldbody><body><joint range="1 -1"/><geom size=".1"/></body></worldbody></mujoco>')
        (self.dir / "sub").mkdir()
        for out in ("mended.xml", "sub/mended.xml"):
            self.assay("check", "arm.xml", "--repair", out)
            self.assertTrue((self.dir / out).exists())


class PluginFolders(AssayTest):
    """Plugins come from the program's own folders and from ASSAY_ENGINE_PATH, and from nowhere else."""

    def test_no_plugin_of_the_current_or_the_models_folder(self):
        plugin = next(pathlib.Path(os.environ["ASSAY_MISHAP_ENGINE"]).glob("assay-engine-mishap.so"))
        for folder in (".", "engines", "robot", "robot/engines", "lib/assay/engines"):
            (self.dir / folder).mkdir(parents=True, exist_ok=True)
            shutil.copy(plugin, self.dir / folder)
        self.write("robot/ball.xml", BALL)
        for path in (None, "", ":", "::nowhere:"):
            if path is not None:
                self.env["ASSAY_ENGINE_PATH"] = path
            self.assertEqual([name for name in self.contenders() if name.startswith("mishap")], [], path)
            listed = self.assay_json("check", "robot/ball.xml", "--json")
            self.assertNotIn("mishap", json.dumps(listed))
        self.env["ASSAY_ENGINE_PATH"] = "engines"
        self.assertIn("mishap", self.contenders())


class HostileNames(AssayTest):
    """Text of strangers' files is text, wherever it is shown."""

    SCRIPT, ESCAPE = "</script><script>alert(1)</script>", "\x1b]0;owned\x07\x1b[31m"

    def has_no_escapes(self, shown):
        plain = re.sub(r"\x1b\[[0-9;]*[mK]|\x1b\[\?25[lh]|\r", "", shown)
        self.assertNotRegex(plain, "[\x00-\x08\x0b-\x1f\x7f]")
        self.assertNotIn("\x1b]0", shown)

    def test_of_models(self):
        self.write("ball.xml", BALL.replace('name="ball"', 'name="b&#27;]0;owned&#7;&#27;[31m&#155;31m"'))
        for arguments in (["check", "ball.xml"], ["simulate", "ball.xml", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "0.01",
                                                  "--out", "-"]):
            status, shown = self.on_terminal(*arguments, NO_COLOR="1")
            self.assertEqual(status, 0, shown)
            if arguments[0] == "check":
                self.has_no_escapes(shown)
        self.write("arm.urdf", '<robot name="r&#27;[31m"><link name="a&#27;]0;owned&#7;"/><link name="a&#27;]0;owned&#7;"/></robot>')
        status, shown = self.on_terminal("check", "arm.urdf", NO_COLOR="1")
        self.assertEqual(status, 2)
        self.has_no_escapes(shown)

    def write_bytes(self, name, file):
        """A pendulum whose names are not UTF-8, in a file called `file`."""
        text = BALL.replace("<freejoint/>", '<joint name="j\udcfe" axis="0 1 0"/>')
        text = text.replace('qpos="0 0 10 1 0 0 0" qvel="1 2 3 0 0 0"', 'qvel="1"')
        text = text.replace("</mujoco>", '<actuator><motor name="t\udcfc" joint="j\udcfe"/></actuator></mujoco>')
        (self.dir / file).write_bytes(text.replace('name="ball"', f'name="{name}"').encode("utf-8", "surrogateescape"))

    def test_that_are_not_utf8(self):
        self.write_bytes("b\udcff", "ball.xml")
        self.write("c.toml", BALL_CAMPAIGN)
        self.assay("run", "c.toml", "--out", "results", "--references", "off")
        self.assay("report", "results")
        with sqlite3.connect(self.dir / "results/assay.sqlite") as db:
            scene = json.loads(db.execute("SELECT json FROM scenes").fetchone()[0])
        db.close()
        self.assertEqual([body["name"] for body in scene["bodies"]], ["b\ufffd"])
        self.assertEqual(scene["hinges"], ["j\ufffd"])
        self.assay("parity", "ball.xml", "mujoco-euler", "--out", "certificate.json")
        self.assertIn("\ufffd", (self.dir / "certificate.json").read_text(encoding="utf-8"))

    def test_of_files_that_are_not_utf8(self):
        self.write_bytes("ball", "caf\udce9.xml")
        self.assay_json("check", "caf\udce9.xml", "--json")
        # its campaign names the file
        self.refused("run", "caf\udce9.xml", "--minutes", "0.1", "--out", "found", naming=["caf\\xe9.xml", "not UTF-8", "rename it"])

    def test_of_campaigns(self):
        self.write("ball.xml", BALL)
        self.write("c.toml", 'name = "../../\\u001b]0;owned\\u0007"\ncontenders = ["\\u001b[31mx"]\n')
        status, shown = self.on_terminal("run", "c.toml", "--out", "results", NO_COLOR="1")
        self.assertEqual(status, 2)
        self.has_no_escapes(shown)

    def hostile_results(self):
        seed = SOURCE / "tests/fuzz/corpus/store/ball-1.sqlite"
        (self.dir / "results").mkdir()
        shutil.copy(seed, self.dir / "results/assay.sqlite")
        evil = f"../../../{self.SCRIPT}{self.ESCAPE}"
        with sqlite3.connect(self.dir / "results/assay.sqlite") as db:
            for table, column in (("cells", "system"), ("systems", "name"), ("scenes", "system"), ("runs", "system"),
                                  ("manifest", "value")):
                db.execute(f"UPDATE {table} SET {column} = ?" + (" WHERE key = 'campaign_title'" if table == "manifest" else ""),
                           (evil,))
            db.execute("UPDATE cells SET contender = contender || ?", (self.SCRIPT + self.ESCAPE,))
            db.execute("UPDATE contenders SET name = name || ?, settings = ?", (self.SCRIPT + self.ESCAPE, self.SCRIPT))
            db.execute("UPDATE cells SET reason = ?", (self.SCRIPT,))
        db.close()

    def test_of_results_in_pages_paths_and_terminals(self):
        self.hostile_results()
        self.assay("report", "results")
        page = (self.dir / "results/report.html").read_text(encoding="utf-8")
        self.assertNotIn("<script>alert(1)", page)
        self.assertIn("alert(1)", page)
        self.write("1/2/3/here", "")
        for arguments in (["export", "results", "--trajectories", "csv", "--out", "1/2/3/states"], ["status", "results"],
                          ["recommend", "results"], ["claims", "results"], ["compare", "results", "results"]):
            status, shown = self.on_terminal(*arguments, NO_COLOR="1")
            self.assertIn(status, (0, 1, 2), shown)
            self.has_no_escapes(shown)
        self.assertEqual({path.name for path in self.dir.iterdir()} - {"cache"}, {"1", "results"})
        self.assertEqual([path.name for folder in ("1", "1/2") for path in (self.dir / folder).iterdir()], ["2", "3"])


class ForgedResults(AssayTest):
    """Results that another program has written so: a sentence, never a crash, all memory or another file."""

    def setUp(self):
        super().setUp()
        (self.dir / "results").mkdir()
        shutil.copy(SOURCE / "tests/fuzz/corpus/store/ball-1.sqlite", self.dir / "results/assay.sqlite")

    def forge(self, *statements):
        db = sqlite3.connect(self.dir / "results/assay.sqlite")
        for statement in statements:
            db.execute(statement)
        db.commit()
        db.close()

    def test_addresses_that_are_paths(self):
        self.write("victim.bin", "mine")
        self.forge("UPDATE runs SET address = '../../victim'")
        self.refused("export", "results", "--trajectories", "csv", "--out", "states", naming=["address", "victim"])
        self.assertEqual((self.dir / "victim.bin").read_text(), "mine")

    def test_facts_of_other_types(self):
        self.forge("UPDATE contenders SET capabilities_json = '{\"changes\": [{\"setting\": 1}], \"coordinates\": [], \"varies\": {}}'",
                   "UPDATE systems SET json = '{\"model_hash\": 3, \"family\": [], \"dof\": \"x\"}'")
        self.assay("report", "results")
        self.assay("compare", "results", "results")
        self.assay("merge", "results", "--out", "union")

    def test_ratios_that_are_no_pairs(self):
        for text in ("{", '[{"of":3}]', '{"a": 3}', '"a"', "3"):
            with self.subTest(text):
                self.forge(f"INSERT OR REPLACE INTO manifest VALUES('ratios', '{text}')")
                self.refused("merge", "results", "--out", "union", naming=["'results'", f"'{text}'", "'ratios'"])
                self.assertFalse((self.dir / "union").exists())

    def test_parts_without_number(self):
        self.forge("CREATE TABLE nodes(id TEXT PRIMARY KEY, json TEXT NOT NULL) WITHOUT ROWID",
                   "INSERT INTO nodes VALUES('n', '{\"shard\": \"1/2000000000\", \"jobs\": \"x\", \"name\": {}}')")
        done = self.run_assay("status", "results")
        self.assertLess(len(done.stdout), 5000)
        self.assertIn(done.returncode, (0, 1, 2))


class EndlessFiles(AssayTest):
    def test_torques_from_a_device(self):
        self.write("ball.xml", BALL)
        os.mkfifo(self.dir / "pipe.csv")
        (self.dir / "zero.csv").symlink_to("/dev/zero")
        for path in ("zero.csv", "pipe.csv"):
            self.refused("run", "ball.xml", "--control", path, "--plan", naming=[path])
        reliability("torques from a pipe or an endless device", 2, "one sentence, exit status 2", "nothing")


class StrangersResults(AssayTest):
    """What may lie in a results folder that somebody else has made: it is refused by name, soon, and nothing of it is run."""

    PATIENCE = 60  # s; none of it takes one, on a machine that does nothing else

    def setUp(self):
        super().setUp()
        self.write("ball.xml", BALL)
        self.write("c.toml", BALL_CAMPAIGN.replace('["null"]', '["mujoco-euler"]').replace('["drift"]', '["drift", "consistency"]').replace(
            "0.01", "0.128\npiece_ms = 64"))
        self.assay("run", "c.toml", "--out", "whole", "--references", "off")
        self.values = self.assay("export", "whole", "--format", "csv")
        self.readers = (["export", "r", "--format", "csv"], ["report", "r"], ["claims", "r"], ["status", "r"],
                        ["merge", "r", "whole", "--out", "union"])
        self.writer = ["run", "c.toml", "--out", "r", "--references", "off"]

    def copy(self):
        for folder in ("r", "union"):
            shutil.rmtree(self.dir / folder, ignore_errors=True)
        shutil.copytree(self.dir / "whole", self.dir / "r")

    def forge(self, statements):
        with contextlib.closing(sqlite3.connect(self.dir / "r/assay.sqlite")) as db:
            db.executescript(statements)

    def all_refuse(self, naming, commands=None):
        """Returns how many commands did."""
        commands = commands or (*self.readers, self.writer)
        for arguments in commands:
            with self.subTest(" ".join(arguments)):
                start = time.monotonic()
                self.refused(*arguments, naming=naming)
                self.assertLess(time.monotonic() - start, self.PATIENCE)
        return len(commands)

    def test_code_of_a_database(self):
        count = "WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c) SELECT max(n) FROM c"
        tries = 0
        for statements, naming in {
                f"CREATE TABLE z(a); CREATE TRIGGER x AFTER INSERT ON cells BEGIN INSERT INTO z {count}; END":
                    ["'z'", "DROP TABLE"],
                f"CREATE TRIGGER x AFTER INSERT ON cells BEGIN DELETE FROM plan WHERE cost_s = ({count}); END":
                    ["the trigger 'x'", "DROP TRIGGER"],
                f"DROP TABLE scenes; CREATE VIEW scenes AS SELECT name AS system, ({count}) AS json FROM systems":
                    ["the view 'scenes'", "DROP VIEW"],
                "ALTER TABLE cells ADD COLUMN x AS (length(zeroblob(1000000000)))": ["'cells'", "a column 'x'"]}.items():
            self.copy()
            self.forge("DELETE FROM cells WHERE measure = 'drift';" + statements)
            tries += self.all_refuse(["assay.sqlite", *naming])
        reliability("a stranger's results with triggers, views, generated columns or further tables that never end", tries,
                    "one sentence that names them, exit status 2; nothing of it is run", "nothing")

    def test_values_that_take_all_memory(self):
        tries = 0
        for statement, table, readers in (("UPDATE systems SET json = zeroblob(90000000)", "'systems'", "report claims merge"),
                                          ("UPDATE cells SET reason = hex(zeroblob(45000000))", "'cells'", "export report claims merge run")):
            self.copy()
            self.forge(statement)
            commands = [each for each in (*self.readers, self.writer) if each[0] in readers.split()]
            tries += self.all_refuse(["r/assay.sqlite", "damaged", table, "more than 64 MiB"], commands)
        reliability("a stranger's results with values of 90 MB", tries, "one sentence that names the table, exit status 2", "nothing")

    def test_files_that_are_no_files(self):
        tries = 0
        for name in ("assay.sqlite-journal", "assay.sqlite-wal", "assay.sqlite-shm", ".lock"):
            for what, make in (("a named pipe", os.mkfifo), ("a symbolic link", lambda path: path.symlink_to("/dev/zero")),
                               ("a symbolic link", lambda path: path.symlink_to(self.dir / "made")), ("a directory", os.mkdir)):
                self.copy()
                file = self.dir / "r" / name
                file.unlink(missing_ok=True)
                make(file)
                some = [self.readers[0], self.readers[3], self.writer]
                tries += self.all_refuse([f"r/{name}'", what, "remove it"], some)
                self.assertFalse((self.dir / "made").exists())
        reliability("a stranger's results with a pipe, a device, a link or a folder for the log, journal, index or lock", tries,
                    "one sentence that names it, exit status 2", "nothing")

    def test_a_journal_that_removes_a_file(self):
        self.copy()
        self.forge("PRAGMA journal_mode = DELETE")
        victim = self.write("victim", "mine")
        magic, name = bytes.fromhex("d9d505f920a163d7"), bytes(victim)
        header = magic + struct.pack(">5I", 0, 1, (self.dir / "r/assay.sqlite").stat().st_size // 4096, 512, 4096)
        (self.dir / "r/assay.sqlite-journal").write_bytes(
            header.ljust(512, b"\0") + struct.pack(">I", 0x40000000 // 4096 + 1) + name + struct.pack(">II", len(name), sum(name)) + magic)
        tries = self.all_refuse(["r/assay.sqlite-journal", "remove it"])
        self.assertEqual(victim.read_text(), "mine")
        reliability("a stranger's results with a journal that has SQLite remove another file", tries, "one sentence, exit status 2", "nothing")

    def test_runs_that_are_no_runs(self):
        def sparse(begin, size):
            def make(path):
                path.write_bytes(begin)
                os.truncate(path, size)
            return make

        with contextlib.closing(sqlite3.connect(self.dir / "whole/assay.sqlite")) as db:
            first = self.dir / "whole/trajectories" / (db.execute("SELECT address FROM runs").fetchone()[0] + ".bin")
        makers = [os.mkfifo, lambda path: path.symlink_to("/dev/zero"), os.mkdir, sparse(first.read_bytes(), 100 << 30),
                  sparse(first.read_bytes(), 3 << 30), sparse(b"", 3 << 30)]
        for make in makers:
            self.copy()
            shutil.rmtree(self.dir / "states", ignore_errors=True)
            file = self.dir / "r/trajectories" / first.name
            file.unlink()
            make(file)
            start = time.monotonic()
            done = self.run_assay("export", "r", "--trajectories", "csv", "--out", "states")
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(f"{first.name}' is damaged", done.stderr)
            self.assertTrue((self.dir / "states/index.csv").exists(), "it has gone on")
            self.assay("report", "r")
            self.assertLess(time.monotonic() - start, self.PATIENCE)
        reliability("a stranger's run is a pipe, a device, a folder, or a sparse file of 3 or 100 GiB", 2 * len(makers),
                    "damaged: named by the export, left out by the report", "that run")

    def test_links_are_not_written_through(self):
        self.write("victim", "mine")
        for name in (".lock", "assay.sqlite", "trajectories"):
            self.copy()
            path = self.dir / "r" / name
            if path.exists():
                path.rename(self.dir / f"moved-{name}")
            path.symlink_to(self.dir / ("victim" if name == ".lock" else f"moved-{name}"))
            self.refused(*self.writer, naming=[f"r/{name}'", "a symbolic link"])
        self.copy()
        for arguments in (["export", "r", "--format", "csv", "--out", "x.csv"],
                          ["simulate", "ball.xml", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "0.01", "--out", "x.csv"]):
            (self.dir / "x.csv.partial").symlink_to(self.dir / "victim")
            done = self.run_assay(*arguments)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.check_sentence(done.stderr.splitlines()[-1], ["'x.csv.partial'", "a symbolic link", "remove it"])  # after notes
            (self.dir / "x.csv.partial").unlink()
            (self.dir / "x.csv.partial").write_text("of an earlier command")
            os.link(self.dir / "x.csv.partial", self.dir / "second-name")
            self.assay(*arguments)
            self.assertFalse((self.dir / "x.csv.partial").exists())
            self.assertEqual((self.dir / "second-name").read_text(), "of an earlier command")
            (self.dir / "second-name").unlink()
        self.assertEqual((self.dir / "victim").read_text(), "mine")

    def test_claims_from_a_pipe(self):
        os.mkfifo(self.dir / "pipe.toml")
        (self.dir / "zero.toml").symlink_to("/dev/zero")
        for name, what in (("pipe.toml", "a named pipe"), ("zero.toml", "a device")):
            self.refused("claims", "whole", "--claims", name, naming=[name, what, "give a TOML file"])
        self.refused("claims", "whole", "--claims", "none.toml", naming=["none.toml", "check the path"])

    def test_a_certificate_from_a_pipe(self):
        self.copy()
        (self.dir / "r/parity").mkdir(exist_ok=True)
        os.mkfifo(self.dir / "r/parity/ball.json")
        (self.dir / "r/parity/zero.json").symlink_to("/dev/zero")
        self.assay("report", "r")

    # Each of them is small; together, as JSON, they would take some 40 times as much memory.
    def test_many_certificates(self):
        self.copy()
        (self.dir / "r/parity").mkdir(exist_ok=True)
        for i in range(5):
            self.write(f"r/parity/{i}.json", '{"certificates": [' + "[]," * (4 << 18) + "[]]}")  # 3 MiB
        self.assay("report", "r")
        self.write("r/parity/5.json", " " * (1 << 20) + "{}")
        self.refused("report", "r", naming=["r/parity/5.json", "16 MiB", "remove"])


class FuzzedMeshes(AssayTest):
    """Files that fuzzing found to end the library that reads them."""

    def test_every_mesh_that_ends_the_library(self):
        files = sorted((SOURCE / "tests/fuzz/corpus/mesh-library").glob("*"))
        self.assertTrue(files)
        for file in files:
            with self.subTest(file.name):
                shutil.copy(file, self.dir)
                self.write("arm.urdf", '<robot name="arm"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" '
                           f'ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><mesh filename="{file.name}"/></geometry>'
                           '</collision></link></robot>')
                self.refused("check", "arm.urdf", "--floating-base", naming=[file.name, "an index that is no whole number"])
        reliability("a mesh on which the library that reads meshes takes all memory, as fuzzing found it", len(files),
                    "one sentence, exit status 2", "nothing")


if __name__ == "__main__":
    main()
