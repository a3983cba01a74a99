"""What the tests of the program share: running it, and what every refusal has to look like."""

import csv
import ctypes
import fcntl
import hashlib
import io
import json
import os
import pathlib
import pty
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import termios
import unittest

PROGRAM = os.environ.get("ASSAY_PROGRAM", "")
MISHAP_ENGINE = os.environ.get("ASSAY_MISHAP_ENGINE", "")
REFUSED_PLUGINS = os.environ.get("ASSAY_REFUSED_PLUGINS", "")
DEADLY_PLUGINS = os.environ.get("ASSAY_DEADLY_PLUGINS", "")
VERDICTS = os.environ.get("ASSAY_TEST_VERDICTS", "")  # folder of verdicts.py
RELIABILITY = os.environ.get("ASSAY_RELIABILITY", "")  # folder for lines of docs/lab/reliability.md
SOURCE = pathlib.Path(__file__).resolve().parents[2]
COMMANDS = ["list", "check", "parity", "conformance", "convert", "import", "simulate", "run", "match", "paper", "submit", "status", "merge", "recommend",
            "explain", "bisect", "report", "compare", "history", "export", "draw"]
OLD_COMMANDS = ["engines", "systems", "snapshot", "movie", "transfer", "claims"]  # until 1.0; the help does not show them
CSV_HEADER = "time,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz"

# A ball that was thrown, far above the ground.
BALL = """<mujoco model="ball">
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="ball" pos="0 0 10">
      <freejoint/>
      <geom name="skin" type="sphere" size="0.1" mass="2"/>
    </body>
  </worldbody>
  <keyframe><key qpos="0 0 10 1 0 0 0" qvel="1 2 3 0 0 0"/></keyframe>
</mujoco>
"""

def toml(value):
    """A value as TOML, which JSON's are but for tables."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(each)}" for key, each in value.items()) + "}"
    return json.dumps(value)


def campaign(name, timesteps_ms, measures, *, contenders=("mujoco-euler",), reference_ms=None, timing=None, system="planar-chain",
             **of_system):
    """The text of a campaign of one system: `timing` are the keys of its [timing], `of_system` those of its [[system]]."""
    top = {"name": name, "contenders": contenders, "timesteps_ms": timesteps_ms,
           "reference_ms": timesteps_ms[0] if reference_ms is None else reference_ms, "measures": measures}
    parts = [("", top), ("[timing]", timing or {}), ("[[system]]", {"name": system, **of_system})]
    return "\n".join(line for heading, keys in parts if keys
                     for line in [*([heading] if heading else []), *(f"{key} = {toml(value)}" for key, value in keys.items())]) + "\n"


# Of a file ball.xml with BALL in it.
BALL_CAMPAIGN = campaign("ball", [1], ["drift"], contenders=["null"], system="ball", model="./ball.xml", duration_s=0.01, contacts=False)


def obey_permissions():
    """For subprocess's preexec_fn: what is started obeys permissions of folders even when it is root's."""
    PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1
    if os.geteuid() == 0 and ctypes.CDLL(None, use_errno=True).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "root's right to write anywhere cannot be given up")


class AssayTest(unittest.TestCase):
    """Each test has an empty folder of its own as current directory of the program."""

    maxDiff = 4000
    running = None  # the test that reliability() asks
    with_verdicts = True  # of usual contenders in the conformance suite: no other campaign has to ask it again

    def setUp(self):
        AssayTest.running = self
        if not PROGRAM:
            self.fail("ASSAY_PROGRAM names no program: run the tests with ctest")
        folder = tempfile.TemporaryDirectory(prefix="assay-cli-")
        self.addCleanup(folder.cleanup)
        self.dir = pathlib.Path(folder.name)
        self.program = PROGRAM
        self.env = {k: v for k, v in os.environ.items() if not k.startswith("ASSAY_")}
        self.env["CMAKE_GENERATOR"] = "Ninja"  # a machine that assay's set-up has made need not have make
        self.env["XDG_CACHE_HOME"] = str(self.dir / "cache")  # references of one test are not another's
        if VERDICTS and self.with_verdicts:
            shutil.copytree(VERDICTS, self.dir / "cache/assay/conformance")

    def files(self):
        """Names in the folder, without what the program keeps for later."""
        return sorted(path.name for path in self.dir.iterdir() if path.name != "cache")

    def forget_verdicts(self):
        """For a test that is about the suite itself."""
        shutil.rmtree(self.dir / "cache/assay/conformance", ignore_errors=True)

    def use_mishap_engine(self):
        self.env["ASSAY_ENGINE_PATH"] = MISHAP_ENGINE

    def write(self, name, text):
        path = self.dir / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def command(self, *arguments):
        return [self.program, *map(str, arguments)]

    def run_assay(self, *arguments, **options):
        """The finished process, whatever its status is."""
        return subprocess.run(self.command(*arguments), cwd=self.dir, env=self.env, capture_output=True, text=True,
                              stdin=subprocess.DEVNULL, timeout=500, **options)

    def on_terminal(self, *arguments, columns=80, **environment):
        """Status and text of a run on a terminal of its own, where standard output and error are one."""
        master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        unset = ("NO_COLOR", "CLICOLOR_FORCE", "COLUMNS")
        env = {key: value for key, value in self.env.items() if key not in unset}
        process = subprocess.Popen(self.command(*arguments), cwd=self.dir, env={**env, "TERM": "xterm", **environment},
                                   stdout=slave, stderr=slave, stdin=subprocess.DEVNULL)
        os.close(slave)
        shown = b""
        while True:
            try:
                part = os.read(master, 65536)
            except OSError:  # the last process has closed it
                break
            if not part:
                break
            shown += part
        os.close(master)
        return process.wait(timeout=500), shown.decode().replace("\r\n", "\n")

    def start_assay(self, *arguments, **options):
        return subprocess.Popen(self.command(*arguments), cwd=self.dir, env=self.env, text=True,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)

    def assay(self, *arguments):
        """Standard output of a run that has to succeed."""
        done = self.run_assay(*arguments)
        self.assertEqual(done.returncode, 0, f"{arguments}: {done.stderr}")
        return done.stdout

    def assay_json(self, *arguments):
        """The JSON that is alone on standard output."""

        def no_constant(name):
            raise ValueError(f"{name} is no JSON")

        return json.loads(self.assay(*arguments), parse_constant=no_constant)

    def python_with_numpy(self):
        for python in (sys.executable, "/usr/bin/python3"):
            if os.path.exists(python) and subprocess.run([python, "-c", "import numpy"], capture_output=True).returncode == 0:
                return python
        return self.fail("no Python here has NumPy: install python3-numpy")

    def follow_example(self, example, links=None):
        """Runs the commands of an example's README, beside nothing but the program, its build, the examples and `links`
        (in the example's folder: name to what it stands for)."""
        shutil.copytree(SOURCE / "examples", self.dir / "examples")
        for name, target in (links or {}).items():
            (self.dir / "examples" / example / name).symlink_to(target)
        (self.dir / "assay").symlink_to(PROGRAM)
        (self.dir / "build").mkdir()
        (self.dir / "build/release").symlink_to(pathlib.Path(PROGRAM).parent.parent)
        text = (self.dir / "examples" / example / "README.md").read_text(encoding="utf-8")
        commands = [line[2:] for block in re.findall(r"```console\n(.*?)```", text, re.DOTALL)
                    for line in block.splitlines() if line.startswith("$ ")]
        self.assertTrue(commands)
        # The reader's python3 has NumPy; the one that comes first on this machine need not.
        (self.dir / "bin").mkdir()
        (self.dir / "bin/python3").write_text(f'#!/bin/sh\nexec "{self.python_with_numpy()}" "$@"\n', encoding="utf-8")
        (self.dir / "bin/python3").chmod(0o755)
        environment = {**self.env, "PATH": f"{self.dir / 'bin'}{os.pathsep}{self.env['PATH']}"}
        done = subprocess.run(["bash", "-ec", "\n".join(commands)], cwd=self.dir, env=environment, capture_output=True,
                              text=True, stdin=subprocess.DEVNULL, timeout=500)
        self.assertEqual(done.returncode, 0, done.stdout[-3000:] + done.stderr[-3000:])
        return done.stdout

    def refused(self, *arguments, naming=(), status=2):
        """Has to fail with `status` and one sentence that holds all of `naming`; returns the sentence."""
        done = self.run_assay(*arguments)
        self.assertEqual(done.returncode, status, f"{arguments}: {done.stdout}{done.stderr}")
        self.assertEqual(done.stdout, "")
        return self.check_sentence(done.stderr, naming)

    def check_sentence(self, text, naming=()):
        lines = text.splitlines()
        self.assertEqual(len(lines), 1, text)
        self.assertRegex(lines[0], r"^assay: \S")
        self.assertFalse(lines[0].endswith("."), text)
        for part in naming:
            self.assertIn(str(part), lines[0])
        return lines[0]

    def contenders(self):
        return [row["contender"] for row in self.assay_json("engines", "--json")["contenders"]]


def reliability(fault, tries, outcome, lost):
    """A line of docs/lab/reliability.md (docs/update.py reliability): call it at the end of a test. A test in which a part has
    failed (subTest) goes on to its end, and leaves none."""
    if AssayTest.running._outcome.success:  # pylint: disable=protected-access
        leave({"fault": fault, "tries": tries, "outcome": outcome, "lost": lost}, fault)


def leave(line, name):
    if RELIABILITY:
        folder = pathlib.Path(RELIABILITY)
        folder.mkdir(parents=True, exist_ok=True)
        name = hashlib.sha256(name.encode()).hexdigest()[:16]
        (folder / f"{name}.json").write_text(json.dumps(line) + "\n", encoding="utf-8")


def read_csv(text):
    """Rows of `assay simulate` as dictionaries with numbers."""
    rows = []
    for row in csv.DictReader(io.StringIO(text)):
        rows.append({key: value if key == "body" else float(value) for key, value in row.items()})
    return rows


def data_folder(folder, campaigns=()):
    """Makes `folder` a place for ASSAY_DATA with the real models and the given campaigns (name, text)."""
    shutil.copytree(SOURCE / "models", folder / "models")
    (folder / "campaigns").mkdir()
    for name, text in campaigns:
        (folder / "campaigns" / f"{name}.toml").write_text(text)
    return folder


def main():
    result = unittest.main(module="__main__", argv=sys.argv, verbosity=2, exit=False).result
    for test, reason in result.skipped:
        name = f"{pathlib.Path(sys.argv[0]).stem}.{test.id().removeprefix('__main__.')}"
        leave({"skipped": name, "reason": reason}, name)
    sys.exit(not result.wasSuccessful())
