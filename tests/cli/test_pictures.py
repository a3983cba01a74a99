"""export --trajectories, snapshot, movie: on a real campaign, made small."""

import csv
import ctypes
import io
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import time
import unittest
import zipfile

from harness import SOURCE, AssayTest, main, read_csv

sys.path[:0] = [str(SOURCE / "results"), str(SOURCE / "docs")]
import packed  # noqa: E402
from tables import movie  # noqa: E402

try:
    import numpy
except ImportError:
    numpy = None

CAMPAIGN = """
name = "small"
contenders = ["mujoco-euler", "mujoco-rk4"]
timesteps_ms = [1, 4]
reference_ms = 1
measures = ["raw_speed", "consistency"]
[timing]
rounds = 3
batch_ms = 1
processes = 1
[[system]]
name = "planar-chain"
duration_s = 0.512
sample_ms = 32
pieces = 2
piece_ms = 32
"""
BACKGROUND = 240  # src/report/render/renderer.h


def lacking():
    """What pictures need and is not here, "" for nothing."""
    if not shutil.which("ffmpeg"):
        return "ffmpeg is not installed"
    for library in ("libOSMesa.so.8", "libEGL.so.1"):
        try:
            ctypes.CDLL(library)
            return ""
        except OSError:
            pass
    return "neither OSMesa nor EGL is installed"


def read_npy(data):
    """(dtype, shape, bytes) of a .npy file."""
    assert data[:8] == b"\x93NUMPY\x01\x00", data[:8]
    length = struct.unpack("<H", data[8:10])[0]
    assert (10 + length) % 64 == 0
    header = eval(data[10:10 + length].decode("ascii"), {"__builtins__": {}})
    assert header["fortran_order"] is False
    return header["descr"], header["shape"], data[10 + length:]


class WithResults(AssayTest):
    def setUp(self):
        super().setUp()
        self.write("small.toml", CAMPAIGN)
        self.assay("run", "small.toml", "--out", "results")


class Trajectories(WithResults):
    def array(self, path, name):
        with zipfile.ZipFile(self.dir / path) as archive:
            dtype, shape, data = read_npy(archive.read(f"{name}.npy"))
        if dtype == "<f8":
            return shape, list(struct.unpack(f"<{len(data) // 8}d", data))
        width = 4 * int(dtype[2:])
        self.assertTrue(dtype.startswith("<U"))
        return shape, [data[i:i + width].decode("utf-32-le").rstrip("\0") for i in range(0, len(data), width)]

    def simulated(self, contender):
        return read_csv(self.assay("simulate", "planar-chain", "--engine", contender, "--timestep", "1", "--duration",
                                   "0.512", "--sample", "32", "--out", "-"))

    def test_npz_holds_what_was_simulated(self):
        self.assay("export", "results", "--trajectories", "npz", "--out", "states")
        with open(self.dir / "states/index.csv", newline="") as file:
            index = list(csv.DictReader(file))
        self.assertEqual([(row["file"], row["system"], row["contender"], row["timestep_ms"], row["samples"], row["bodies"])
                          for row in index],
                         [(f"planar-chain/{name}.npz", "planar-chain", name, "1", "17", "5")
                          for name in ("mujoco-euler", "mujoco-rk4")])
        for row in index:
            path = f"states/{row['file']}"
            expected = self.simulated(row["contender"])
            for name, columns in (("position", "xyz"), ("orientation", ("qw", "qx", "qy", "qz")),
                                  ("velocity", ("vx", "vy", "vz")), ("angular_velocity", ("wx", "wy", "wz"))):
                shape, values = self.array(path, name)
                self.assertEqual(shape, (17, 5, len(columns)))
                for found, wanted in zip(values, [line[column] for line in expected for column in columns], strict=True):
                    self.assertAlmostEqual(found, wanted, places=12)
            self.assertEqual(self.array(path, "bodies")[1], [line["body"] for line in expected[:5]])
            shape, time = self.array(path, "time")
            self.assertEqual(shape, (17,))
            for i, found in enumerate(time):
                self.assertAlmostEqual(found, 0.032 * i, places=12)
            self.assertEqual(self.array(path, "angle")[0], (17, 5))
            self.assertEqual(self.array(path, "rate")[0], (17, 5))
            self.assertEqual(self.array(path, "timestep_ms"), ((), [1.0]))
            self.assertEqual(self.array(path, "run")[1], ["planar-chain", row["contender"]])
        before = (self.dir / "states/planar-chain/mujoco-rk4.npz").read_bytes()
        self.assay("export", "results", "--trajectories", "npz", "--out", "states")
        self.assertEqual((self.dir / "states/planar-chain/mujoco-rk4.npz").read_bytes(), before)

    @unittest.skipUnless(numpy, "this Python has no NumPy")
    def test_numpy_reads_it(self):
        self.assay("export", "results", "--trajectories", "npz", "--out", "states")
        run = numpy.load(self.dir / "states/planar-chain/mujoco-euler.npz")
        self.assertEqual(run["position"].shape, (17, 5, 3))
        self.assertLess(numpy.abs(numpy.linalg.norm(run["orientation"], axis=2) - 1).max(), 1e-12)
        self.assertEqual(list(run["run"]), ["planar-chain", "mujoco-euler"])
        self.assertEqual(len(run["hinges"]), 5)

    def test_csv_is_that_of_simulate(self):
        self.assay("export", "results", "--trajectories", "csv", "--out", "states")
        found = read_csv((self.dir / "states/planar-chain/mujoco-euler.csv").read_text())
        expected = self.simulated("mujoco-euler")
        self.assertEqual(len(found), len(expected))
        for row, wanted in zip(found, expected):
            self.assertEqual(row["body"], wanted["body"])
            for key in row.keys() - {"body"}:
                self.assertAlmostEqual(row[key], wanted[key], places=12)

    def test_a_run_that_is_gone_is_left_out_and_told(self):
        # the whole runs are the largest files; the others are the pieces that start from them
        max((self.dir / "results/trajectories").glob("*.bin"), key=lambda file: file.stat().st_size).unlink()
        done = self.run_assay("export", "results", "--trajectories", "npz", "--out", "states")
        self.assertEqual(done.returncode, 0)
        self.assertIn("1 run written to 'states'; 1 run failed or not measured yet", done.stderr)
        self.assertEqual(len(list((self.dir / "states").rglob("*.npz"))), 1)

    # Files of another program, with the right address and checksum.
    def test_forged_runs_are_no_runs(self):
        movie = ("movie", "results", "planar-chain", "--size", "64x64", "--out", "movie.mp4")
        snapshot = ("snapshot", "results", "planar-chain", "--size", "64x64", "--out", "picture.png")
        for what, bodies, times in (("states of no bodies", 0, (0, 1, 2)), ("another system's", 4, (0, 1, 2)),
                                    ("another system's", 6, (0, 1, 2)), ("times that do not increase", 5, (1, 1, 1)),
                                    ("times that do not increase", 5, (0, 1, 1 + 1e-12)),
                                    ("times that no run reaches", 5, (0, 1, 1e300))):
            with self.subTest(what, bodies=bodies):
                for file in (self.dir / "results/trajectories").glob("*.bin"):
                    address = file.stem.encode()
                    content = (b"assay-trajectory-2\n" + struct.pack("<Q", len(address)) + address +
                               struct.pack("<3Q", len(times), bodies, 5))
                    for moment in times:
                        content += struct.pack("<d", moment)
                        content += bodies * struct.pack("<13d", 0, 0, 1, 1, *(9 * [0])) + struct.pack("<10d", *(10 * [0]))
                    file.write_bytes(content + packed.content_hash(content).encode())
                done = self.run_assay("export", "results", "--trajectories", "csv", "--out", "states")
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertIn(what, done.stderr)
                self.refused(*snapshot, naming=["keeps no run of 'planar-chain'"])
                self.refused(*movie, naming=["planar-chain", "no kept run"])
        self.assertFalse((self.dir / "movie.mp4").exists())
        self.assay("report", "results")

    def test_refusals(self):
        self.refused("export", "results", "--trajectories", "mat", "--out", "states", naming=["'mat'", "npz or csv"])
        self.refused("export", "results", "--trajectories", "npz", naming=["--out"])
        self.refused("export", "results", "--trajectories", "npz", "--format", "csv", naming=["--format"])
        self.refused("export", "results", naming=["--format", "--trajectories"])
        self.write("file", "")
        self.refused("export", "results", "--trajectories", "npz", "--out", "file/states", status=1, naming=["file/states"])


class Replays(WithResults):
    def replay(self):
        html = (self.dir / "results/report.html").read_text()
        [replay] = json.loads(re.search(r'id="assay-replays">(.*?)</script>', html, re.S)[1])
        return replay

    def test_runs_of_other_timesteps(self):
        self.assay("report", "results")
        self.assertEqual([(run["contender"], run["timestep_ms"]) for run in self.replay()["runs"]],
                         [("mujoco-euler", 1), ("mujoco-rk4", 1)])
        done = self.run_assay("report", "results", "--replays", "4,5")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("planar-chain: 2 runs at 4 ms", done.stderr)
        self.assertIn("planar-chain has no replay at 5 ms", done.stderr)
        replay = self.replay()
        self.assertEqual([(run["contender"], run["timestep_ms"]) for run in replay["runs"]],
                         [(name, step) for step in (1, 4) for name in ("mujoco-euler", "mujoco-rk4")])
        # Euler at 4 ms is not Euler at 1 ms, and RK4 nearly is RK4
        away = {(run["contender"], run["timestep_ms"]): run["distance_m"][-1] for run in replay["runs"]}
        self.assertGreater(away["mujoco-euler", 4], 1e-4)
        self.assertLess(abs(away["mujoco-rk4", 4] - away["mujoco-rk4", 1]), 0.1 * away["mujoco-euler", 4])
        # what is kept is not run again, and a campaign that goes on leaves it there
        again = self.run_assay("report", "results", "--replays", "4")
        self.assertNotIn("runs at", again.stderr)
        self.assay("run", "small.toml", "--out", "results")
        self.assay("report", "results")
        self.assertEqual(self.replay(), replay)
        self.assay("export", "results", "--trajectories", "npz", "--out", "states")
        self.assertEqual(sorted(path.name for path in (self.dir / "states").rglob("*.npz")),
                         ["mujoco-euler-4ms.npz", "mujoco-euler.npz", "mujoco-rk4-4ms.npz", "mujoco-rk4.npz"])
        self.refused("report", "results", "--replays", "x", naming=["--replays", "'x'"])


class Links(WithResults):
    def test_a_movie_is_not_written_through_one(self):
        victim = self.write("victim", "mine")
        (self.dir / "movie.mp4.partial").symlink_to(victim)
        self.refused("movie", "results", "planar-chain", "--out", "movie.mp4",
                     naming=["'movie.mp4.partial'", "a symbolic link", "remove it"])
        self.assertEqual(victim.read_text(), "mine")
        self.assertTrue((self.dir / "movie.mp4.partial").is_symlink())


class Pictures(WithResults):
    WIDTH, HEIGHT = 320, 240

    def setUp(self):
        super().setUp()
        if reason := lacking():
            self.skipTest(reason)

    def frames(self, path, width=WIDTH, height=HEIGHT):
        """Raw frames of a picture or movie."""
        done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(self.dir / path), "-f", "rawvideo", "-pix_fmt", "rgb24",
                               "-"], stdout=subprocess.PIPE, check=True)
        size = 3 * width * height
        self.assertEqual(len(done.stdout) % size, 0)
        return [done.stdout[i:i + size] for i in range(0, len(done.stdout), size)]

    def shown(self, frame):
        """Number of pixels that are no background."""
        return sum(abs(green - BACKGROUND) > 15 for green in frame[1::3])

    def difference(self, a, b, left, right, top, bottom, width=WIDTH):
        """Mean absolute difference of a part of two frames."""
        total = 0
        for y in range(top, bottom):
            part = slice(3 * (y * width + left), 3 * (y * width + right))
            total += sum(abs(x - y) for x, y in zip(a[part], b[part]))
        return total / (3 * (right - left) * (bottom - top))

    def snapshot(self, *arguments):
        self.assay("snapshot", *arguments, "--size", f"{self.WIDTH}x{self.HEIGHT}", "--out", "picture.png")
        [frame] = self.frames("picture.png")
        return frame

    def test_snapshots_of_a_model_and_of_results(self):
        model = self.snapshot("planar-chain")
        # five capsules in space: some of the picture, not most of it
        self.assertGreater(self.shown(model), 0.005 * self.WIDTH * self.HEIGHT)
        self.assertLess(self.shown(model), 0.3 * self.WIDTH * self.HEIGHT)
        start, end = (self.snapshot("results", "planar-chain", "--time", time) for time in ("0", "0.512"))
        self.assertGreater(self.shown(start), 0.005 * self.WIDTH * self.HEIGHT)
        self.assertNotEqual(start, end)
        self.assertEqual(self.snapshot("results", "planar-chain", "--contender", "mujoco-euler", "--time", "0.51"), end)
        # both integrators start from the same state, in views that differ by as little as their runs do
        other = self.snapshot("results", "planar-chain", "--contender", "mujoco-rk4")
        self.assertLess(self.difference(start, other, 0, self.WIDTH, 0, self.HEIGHT), 2)

    def movie(self, *arguments):
        self.assay("movie", "results", "planar-chain", "--size", f"{2 * self.WIDTH}x{self.HEIGHT}", "--out", "movie.mp4",
                   *arguments)
        return self.frames("movie.mp4", width=2 * self.WIDTH)

    def test_frames_differ_where_states_do(self):
        frames = self.movie()
        self.assertEqual(len(frames), 17, "a frame a kept state")
        panels = [(0, self.WIDTH - 4), (self.WIDTH, 2 * self.WIDTH)]
        for left, right in panels:
            for a, b in zip(frames, frames[1:]):
                self.assertGreater(self.difference(a, b, left, right, 70, self.HEIGHT - 40, 2 * self.WIDTH), 0.1)

    def test_frames_are_equal_where_states_are(self):
        # the engine that does nothing stays where it is
        frames = self.movie("--contenders", "mujoco-euler,null", "--timestep", "4")
        self.assertEqual(len(frames), 17, "as far apart as the kept states")
        moving = still = 0
        for frame in frames[1:]:
            moving = max(moving, self.difference(frames[0], frame, 0, self.WIDTH - 4, 70, self.HEIGHT - 40, 2 * self.WIDTH))
            still = max(still, self.difference(frames[0], frame, self.WIDTH, 2 * self.WIDTH, 70, self.HEIGHT - 40,
                                               2 * self.WIDTH))
        self.assertLess(still, 0.5, "but for the encoder's losses")
        self.assertGreater(moving, 4 * still + 1)

    def test_a_gif_has_the_movie_s_pictures(self):
        self.assay("draw", "results", "planar-chain", "--size", f"{2 * self.WIDTH}x{self.HEIGHT}", "--out", "movie.gif")
        self.assertEqual((self.dir / "movie.gif").read_bytes()[:6], b"GIF89a")
        frames = self.frames("movie.gif", width=2 * self.WIDTH)
        shown = self.movie()
        self.assertGreater(len(frames), 1)
        self.assertLessEqual(len(frames), len(shown))
        self.assertLess(self.difference(frames[0], shown[0], 0, 2 * self.WIDTH, 0, self.HEIGHT, 2 * self.WIDTH), 4,
                        "but for a palette and the encoder's losses")
        self.assertNotEqual(frames[0], frames[-1])

    def test_an_interrupted_movie_leaves_nothing(self):
        started = self.start_assay("movie", "results", "planar-chain", "--size", "1920x1080", "--out", "movie.mp4")
        deadline = time.monotonic() + 60
        while not list(self.dir.glob("movie.mp4*")) and time.monotonic() < deadline:
            time.sleep(0.01)
        started.send_signal(signal.SIGINT)
        _, text = started.communicate(timeout=120)
        self.assertEqual(started.returncode, 1, text)
        self.assertIn("interrupted at frame", text)
        self.assertEqual(list(self.dir.glob("movie.mp4*")), [])

    def test_a_movie_that_cannot_be_written(self):
        self.refused("movie", "results", "planar-chain", "--out", "nowhere/movie.mp4", status=1,
                     naming=["nowhere/movie.mp4"])

    def test_what_is_missing_is_said(self):
        bin_folder = self.dir / "bin"
        bin_folder.mkdir()
        self.env["PATH"] = str(bin_folder)
        self.refused("movie", "results", "planar-chain", "--out", "movie.mp4", status=1, naming=["ffmpeg", "install"])
        self.assertEqual(list(self.dir.glob("movie.mp4*")), [])
        for library in ("libOSMesa.so.8", "libEGL.so.1"):
            self.write(f"lib/{library}", "no library")
        self.env["LD_LIBRARY_PATH"] = f"{self.dir / 'lib'}:{os.environ.get('LD_LIBRARY_PATH', '')}"
        self.refused("snapshot", "planar-chain", "--out", "picture.png", status=1, naming=["OSMesa", "libosmesa6"])
        self.assertEqual(list(self.dir.glob("picture.png*")), [])

    def test_refusals(self):
        for command, arguments, naming in [
            ("movie", ["results", "planar-chian"], ["planar-chian", "did you mean 'planar-chain'?"]),
            ("movie", ["results", "planar-chain", "--contenders", "mujoco-eular"], ["did you mean 'mujoco-euler'?"]),
            ("movie", ["results", "planar-chain", "--timestep", "5"], ["5 ms", "32 ms"]),
            ("movie", ["results", "planar-chain", "--size", "3x3"], ["'3x3'", "even"]),
            ("movie", ["nowhere", "planar-chain"], ["nowhere"]),
            ("snapshot", ["results", "planar-chain", "--time", "9"], ["'9'", "0.512"]),
            ("snapshot", ["planar-chain", "--time", "0"], ["--time"]),
            ("snapshot", ["results", "planar-chain", "--contender", "ode"], ["'ode'"]),
            ("snapshot", ["planar-chian"], ["did you mean 'planar-chain'?"]),
        ]:
            self.refused(command, *arguments, "--out", "file", naming=naming)
            self.assertEqual(list(self.dir.glob("file*")), [])


class OfTheReadme(AssayTest):
    """The committed moving picture shows what the committed results are of."""

    def test_it_is_current(self):
        gif = movie.PAGE.read_bytes()
        self.assertEqual(gif[:6], b"GIF89a")
        self.assertLessEqual(len(gif), movie.MOST_BYTES)
        self.assertEqual(json.loads(movie.comment_of(gif)), movie.recipe(movie.RESULTS), "make it again with docs/update.py movie ./assay")
        shown = re.search(rf"!\[([^\]]*)\]\(docs/{movie.PAGE.name}\)", (SOURCE / "README.md").read_text(encoding="utf-8")).group(1)
        self.assertIn(f"{movie.TIMESTEP_MS} ms", shown)
        self.assertIn(movie.SYSTEM, shown)

    def test_a_comment_is_read_as_it_was_written(self):
        for text in ("{}", "x" * 255, "y" * 700):
            self.assertEqual(movie.comment_of(movie.with_comment(b"GIF89a;", text)), text)


if __name__ == "__main__":
    main()
