"""What cannot be used is refused in one sentence that names it and says what to do; nothing is lost or overwritten."""

import resource
import subprocess

from harness import BALL, BALL_CAMPAIGN, SOURCE, AssayTest, data_folder, main, obey_permissions

ROBOT = """<mujoco>
  <worldbody>
    <body name="arm"><joint name="elbow" type="{joint}" axis="0 1 0"/>
      <geom name="skin" type="{geom}" size=".1 .1 .1" mass="1" {more}/></body>
  </worldbody>
  {rest}
</mujoco>
"""


def robot(joint="hinge", geom="sphere", more="", rest=""):
    return ROBOT.format(joint=joint, geom=geom, more=more, rest=rest)

AssayTest.with_verdicts = False  # folders have to stay empty


class Models(AssayTest):
    """The same refusal by every command that takes a model."""

    def refused_by_all(self, model, naming):
        sentence = self.refused("check", model, naming=naming)
        simulate = ["simulate", model, "--engine", "mujoco-euler", "--timestep", "1", "--duration", "1", "--out", "x.csv"]
        self.assertEqual(self.refused(*simulate), sentence)
        self.assertFalse((self.dir / "x.csv").exists())
        return sentence

    def test_missing_file(self):
        self.refused_by_all("nowhere.xml", ["'nowhere.xml'", "does not exist"])
        self.refused_by_all("no/such/folder.xml", ["'no/such/folder.xml'"])

    def test_unknown_system_gets_the_nearest_name(self):
        self.refused_by_all("planar-chian", ["'planar-chian'", "did you mean 'planar-chain'?"])
        self.refused_by_all("zzzzzzzz", ["'zzzzzzzz'", "planar-chain", "capsules-27"])
        for count in ["1000000", "0", "many"]:
            self.refused_by_all(f"capsules-{count}", [f"'capsules-{count}'", "N from 1 to 10000"])

    def test_directory_and_empty_name(self):
        (self.dir / "folder").mkdir()
        self.refused("check", "folder", naming=["'folder'", "no robot"])  # it takes folders of robots
        self.refused("parity", "folder", naming=["'folder'", "directory"])
        self.refused("simulate", "folder", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "1", "--out", "x.csv",
                     naming=["'folder'", "directory"])
        self.refused_by_all("", ["empty"])

    def test_malformed_xml(self):
        self.write("bad.xml", "<mujoco><worldbody><body></mujoco>")
        self.refused_by_all("bad.xml", ["bad.xml"])
        self.write("empty.xml", "")
        self.refused_by_all("empty.xml", ["empty.xml"])
        self.write("binary.xml", "\x00\x01\x02 no XML")
        self.refused_by_all("binary.xml", ["binary.xml"])
        self.write("unknown.xml", "<mujoco><worldbdy/></mujoco>")
        self.refused_by_all("unknown.xml", ["unknown.xml", "worldbdy"])
        self.write("attribute.xml", BALL.replace("mass=", "mas="))
        self.refused_by_all("attribute.xml", ["attribute.xml", "mas"])

    def test_what_no_engine_can_be_given_is_refused_by_name(self):
        two = '<worldbody><site name="p"/><body><joint name="a"/><geom size=".1"/><site name="q"/></body></worldbody>'
        for name, model in [
                ("couple", f'<mujoco>{two}<equality><joint name="couple" joint1="a" polycoef="0 0 1"/></equality></mujoco>'),
                ("rope", f'<mujoco>{two}<tendon><spatial name="rope"><site site="p"/><site site="q"/></spatial></tendon>'
                         "</mujoco>"),
                ("biceps", f'<mujoco>{two}<actuator><muscle name="biceps" joint="a" lengthrange="0 1"/></actuator></mujoco>'),
                ("skin", robot(more='surfacevel="1 0 0 0 0 0"', rest="").replace(
                    "<worldbody>", '<worldbody><geom type="plane" size="1 1 1"/>')),
                ("viscosity 2", robot().replace("<worldbody>", '<option viscosity="2"/><worldbody>'))]:
            with self.subTest(name):
                self.write("robot.xml", model)
                self.refused_by_all("robot.xml", [name, "--drop-unsupported"])

    def test_all_problems_are_counted(self):
        self.write("robot.xml", robot().replace("<worldbody>", '<option density="2"/><worldbody>').replace(
            'name="arm"', 'name="arm" gravcomp="1"'))
        common = ["--engine", "mujoco-euler", "--timestep", "1", "--duration", "1", "--out", "x.csv"]
        self.refused("simulate", "robot.xml", *common, naming=["1 more"])
        done = self.run_assay("check", "robot.xml")
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("2 problems", done.stderr)
        self.assertIn("density 2", done.stderr)
        self.assertIn("gravity compensation", done.stderr)

    def test_unreadable_file(self):
        # as root every file is readable; a file that fails when it is read is one that is no file
        self.refused("check", "/proc/self/mem", naming=["/proc/self/mem"])


class Numbers(AssayTest):
    def simulate(self, naming, timestep="1", duration="1", **options):
        arguments = ["simulate", "planar-chain", "--engine", "mujoco-euler", f"--timestep={timestep}",
                     f"--duration={duration}", "--out", "x.csv"]
        for key, value in options.items():
            arguments += [f"--{key}", value]
        self.refused(*arguments, naming=naming)
        self.assertEqual(list(self.dir.iterdir()), [])

    def test_timestep_must_be_positive(self):
        for text in ["-1", "0", "-1/64"]:
            self.simulate(["--timestep", f"is {text}", "positive", "milliseconds"], timestep=text)
        # an option's value may begin with a dash without an equals sign too
        for control, naming in [("sinus", "did you mean 'sine'?"), ("sine,amplitude", "'amplitude'"),
                                ("passive,amplitude=2", "'amplitude=2'"), ("sine,frequency=fast", "'frequency=fast'")]:
            self.refused("simulate", "planar-chain", "--engine", "null", "--timestep", "1", "--duration", "1", "--out",
                         "x.csv", "--control", control, naming=[naming])
        self.refused("simulate", "planar-chain", "--engine", "null", "--timestep", "-1", "--duration", "1", "--out", "x.csv",
                     naming=["--timestep", "-1", "positive"])

    def test_numbers_must_be_numbers(self):
        for text in ["abc", "1ms", "nan", "inf", "1/0", "1,5", "0x10"]:
            self.simulate(["--timestep", f"'{text}'", "not a number"], timestep=text)
            self.simulate(["--duration", f"'{text}'", "not a number"], duration=text)

    def test_empty_values(self):
        for option in ["--timestep", "--duration", "--sample"]:
            arguments = ["simulate", "planar-chain", "--engine", "null", "--timestep", "1", "--duration", "1", "--sample",
                         "1", "--out", "x.csv"]
            arguments[arguments.index(option) + 1] = ""
            self.refused(*arguments, naming=[option, "''"])

    def test_duration_must_be_positive(self):
        self.simulate(["--duration", "-3", "positive", "seconds"], duration="-3")
        self.simulate(["--duration", "0", "positive"], duration="0")

    def test_timestep_must_divide_the_duration(self):
        self.simulate(["--duration", "1 s", "3 ms", "0.999 or 1.002"], timestep="3")
        self.simulate(["--duration", "0.5 s", "2000 ms", "use 2"], timestep="2000", duration="0.5")

    def test_timestep_must_divide_the_sample(self):
        self.simulate(["--sample", "2.5 ms", "1 ms", "2 or 3"], sample="2.5")
        self.simulate(["--sample", "0.5 ms", "1 ms", "use 1"], sample="0.5")
        self.simulate(["--sample", "-4", "positive"], sample="-4")

    def test_sample_must_divide_the_duration(self):
        self.simulate(["--duration", "1 s", "300 ms", "0.9 or 1.2"], sample="300")

    def test_runs_without_end(self):
        self.simulate(["--duration", "1e300 s", "at most"], duration="1e300")
        self.simulate(["--timestep", "1e-320 ms", "at least"], timestep="1e-320")

    def test_switches(self):
        self.simulate(["--contacts", "'maybe'", "on or off"], contacts="maybe")
        self.simulate(["--gravity", "'0'", "on or off"], gravity="0")


class Overwriting(AssayTest):
    """What a command is given to read stays as it is, under whatever name it is to be written."""

    def kept(self, option, out, *arguments):
        before = (self.dir / out).read_bytes()
        self.refused(*arguments, option, out, naming=[option, f"'{out}'", "the command reads", "give another"])
        self.assertEqual((self.dir / out).read_bytes(), before)
        self.assertEqual(list(self.dir.glob("*.partial")), [])

    def test_a_model_by_its_run_its_picture_or_its_repair(self):
        self.write("ball.xml", BALL)
        (self.dir / "link.xml").symlink_to("ball.xml")
        self.write("torques.csv", "time\n0\n")
        self.write("start.txt", "0 0 10 1 0 0 0")
        simulate = ["simulate", "ball.xml", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "0.01"]
        self.kept("--out", "ball.xml", *simulate)
        self.kept("--out", "link.xml", *simulate)
        self.kept("--out", "torques.csv", *simulate, "--control", "torques.csv")
        self.kept("--out", "start.txt", *simulate, "--qpos", "start.txt")
        self.kept("--out", "ball.xml", "snapshot", "ball.xml")
        self.kept("--out", "ball.xml", "parity", "./ball.xml", "mujoco-euler")
        self.kept("--repair", "ball.xml", "check", "ball.xml")
        # a file of before that is only called like another option's value is written anew
        self.write("1", "of before")
        self.assay(*simulate, "--out", "1")

    def test_results_by_their_export(self):
        self.write("ball.xml", BALL)
        self.write("ball.toml", BALL_CAMPAIGN)
        self.assay("run", "ball.toml", "--out", "results")
        self.kept("--out", "results/assay.sqlite", "export", "results", "--format", "csv")
        self.kept("--out", "results/assay.sqlite", "compare", "results", "results")


class Names(AssayTest):
    def simulate(self, naming, engine="mujoco-euler", *more):
        self.refused("simulate", "planar-chain", "--engine", engine, "--timestep", "1", "--duration", "1", "--out", "x.csv",
                     *more, naming=naming)
        self.assertEqual(list(self.dir.iterdir()), [])

    def test_unknown_contender(self):
        self.simulate(["'mujoco-rk5'", "did you mean 'mujoco-rk4'?"], "mujoco-rk5")
        self.simulate(["'havoc'"], "havoc")

    def test_unknown_setting(self):
        self.simulate(["'iteratons'", "did you mean 'iterations'?"], "mujoco-euler", "--set", "iteratons=3")

    def test_value_of_a_setting(self):
        self.simulate(["iterations", "many"], "mujoco-euler", "--set", "iterations=many")
        self.simulate(["iterations", "-3"], "mujoco-euler", "--set", "iterations=-3")
        self.simulate(["integrator", "rk5", "rk4"], "mujoco-euler", "--set", "integrator=rk5")

    def test_form_of_a_setting(self):
        self.simulate(["--set", "'iterations'", "key=value"], "mujoco-euler", "--set", "iterations")
        self.simulate(["--set", "'=3'", "key=value"], "mujoco-euler", "--set", "=3")
        self.simulate(["'iterations'", "twice"], "mujoco-euler", "--set", "iterations=3", "--set", "iterations=4")

    def test_unknown_conformance_test_and_contender(self):
        self.refused("conformance", "mujoco-rk4", "--test", "free-fal", naming=["'free-fal'", "did you mean 'free-fall'?"])
        self.refused("conformance", "mujoco-rk5", naming=["'mujoco-rk5'", "did you mean 'mujoco-rk4'?"])


class Places(AssayTest):
    def simulate(self, out, status, naming, **options):
        done = self.run_assay("simulate", "planar-chain", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "2",
                              "--out", out, **options)
        self.assertEqual(done.returncode, status, done.stderr)
        self.check_sentence(done.stderr, naming)

    def test_place_that_cannot_be(self):
        self.write("file", "")
        self.simulate("nowhere/x.csv", 2, ["'nowhere/x.csv'", "directory that exists"])
        self.simulate("file/x.csv", 2, ["'file/x.csv'", "directory"])
        self.simulate(".", 2, ["'.'", "directory"])
        self.simulate("", 2, ["--out", "empty"])
        self.assertEqual(self.files(), ["file"])

    def test_device_without_space(self):
        self.simulate("/dev/full", 1, ["'/dev/full'", "No space left"])

    def test_directory_without_permission(self):
        folder = self.dir / "locked"
        folder.mkdir(mode=0o555)
        folder.chmod(0o555)
        self.simulate("locked/x.csv", 1, ["'locked/x.csv'", "Permission denied"], preexec_fn=obey_permissions)

    def test_file_that_outgrows_the_disk(self):
        # a limit on the size of files fails the write as a full disk does; rows of 2 s take more than 1 MB
        limit = 200_000
        self.write("x.csv", "an earlier run")
        self.simulate("x.csv", 1, ["'x.csv'", "free some space", "'x.csv.partial'"],
                      preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        self.assertEqual((self.dir / "x.csv").read_text(), "an earlier run")
        rows = (self.dir / "x.csv.partial").read_text()
        self.assertTrue(limit * 0.9 < len(rows) <= limit and rows.endswith("\n"), len(rows))
        self.assertTrue(all(line.count(",") == 14 for line in rows.splitlines()))


if __name__ == "__main__":
    main()
