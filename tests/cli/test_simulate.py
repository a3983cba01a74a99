"""simulate: the CSV contract, physics that has a closed form, and runs that do not come to their end."""

import contextlib
import json
import math
import os
import pathlib
import signal
import sqlite3
import time

from harness import BALL, CSV_HEADER, AssayTest, main, read_csv

SPINNER = """<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="arm"><joint name="axle" type="hinge" axis="0 0 1"/>
      <inertial pos="0.5 0 0" mass="2" diaginertia="0.1 0.1 0.1"/></body>
  </worldbody>
  <actuator><motor name="drive" joint="axle" gear="2" ctrlrange="-1 1" ctrllimited="true"/></actuator>
  <keyframe><key qpos="0" qvel="0" ctrl="0.6"/></keyframe>
</mujoco>
"""
SERVO = SPINNER.replace('<motor name="drive" joint="axle" gear="2" ctrlrange="-1 1" ctrllimited="true"/>',
                        '<position name="drive" joint="axle" kp="20" kv="10"/>')
INERTIA = 0.1 + 2 * 0.5**2  # of the arm about its axle

AssayTest.with_verdicts = False  # folders have to stay empty


class Csv(AssayTest):
    def simulate(self, model, engine, timestep, duration, *more):
        """Rows of a run that has to succeed without a word but for what is approximated, and its text."""
        done = self.run_assay("simulate", model, "--engine", engine, "--timestep", timestep, "--duration", duration,
                              "--out", "run.csv", *more)
        self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)
        for line in done.stderr.splitlines():
            self.assertRegex(line, f"^assay: note: {engine} approximates ")
        self.assertEqual([path.name for path in self.dir.iterdir() if path.name.startswith("run.csv")], ["run.csv"])
        text = (self.dir / "run.csv").read_text()
        return read_csv(text), text

    def real_contenders(self):
        """Contender and its capabilities, all that move anything; those of engines set up on demand have tests of their own."""
        rows = self.assay_json("engines", "--json")["contenders"]
        return [(row["contender"], row["capabilities"]) for row in rows
                if row["contender"] != "null" and row["build"]["plugin"].endswith(".so")]

    @staticmethod
    def inexact(capabilities):
        """Whether the adapter declares that torques act otherwise than they should, which the gate bounds."""
        return any(deviation["test"] in ("torque-for-one-step", "torque-reaction")
                   for deviation in capabilities["deviations"])

    @staticmethod
    def without_contact(capabilities):
        """What an engine has to be told that does not do contact."""
        return [] if capabilities["contact"] else ["--contacts", "off"]


class Contract(Csv):
    def test_header_rows_and_digits(self):
        rows, text = self.simulate("planar-chain", "mujoco-euler", "1", "0.05", "--sample", "10")
        lines = text.splitlines()
        self.assertEqual(lines[0], CSV_HEADER)
        self.assertTrue(text.endswith("\n"))
        self.assertEqual([row["body"] for row in rows], [f"link{i}" for i in range(1, 6)] * 6)
        self.assertEqual([row["time"] for row in rows[::5]], [0, 0.01, 0.02, 0.03, 0.04, 0.05])
        for line in lines[1:]:
            for field in line.split(",")[:1] + line.split(",")[2:]:
                self.assertEqual(field, f"{float(field):.17g}")
        for row in rows:
            self.assertAlmostEqual(row["qw"] ** 2 + row["qx"] ** 2 + row["qy"] ** 2 + row["qz"] ** 2, 1, delta=1e-12)

    def test_every_step_is_sampled_when_nothing_is_said(self):
        rows, _ = self.simulate("planar-chain", "mujoco-euler", "1/64", "0.01")
        times = [row["time"] for row in rows[::5]]
        self.assertEqual(times, [i / 64000 for i in range(641)])
        self.assertEqual(times[-1], 0.01)

    def test_last_sample_is_at_the_duration_and_times_do_not_drift(self):
        for timestep, duration, count in [("0.1", "0.7", 7000), ("0.3", "0.9", 3000), ("7", "0.7", 100), ("1/3", "1", 3000)]:
            with self.subTest(timestep):
                rows, _ = self.simulate("planar-chain", "null", timestep, duration)
                times = [row["time"] for row in rows[::5]]
                self.assertEqual((len(times), times[0], times[-1]), (count + 1, 0, float(duration)))
                step = eval(timestep) / 1000
                self.assertLess(max(abs(t - i * step) for i, t in enumerate(times)), 1e-15)

    def test_samples_are_rows_of_the_full_run(self):
        for engine, _ in self.real_contenders():
            with self.subTest(engine):
                full, _ = self.simulate("planar-chain", engine, "1", "0.1")
                some, _ = self.simulate("planar-chain", engine, "1", "0.1", "--sample", "20")
                at = {(row["time"], row["body"]): row for row in full}
                self.assertEqual(len(some), 6 * 5)
                for row in some:
                    self.assertEqual(row, at[row["time"], row["body"]])

    def test_same_command_gives_the_same_bytes(self):
        for engine, can in self.real_contenders():
            options = ["--sample", "50", *self.without_contact(can)]
            with self.subTest(engine):
                texts = {self.simulate("capsules-27", engine, "2", "0.3", *options)[1] for _ in range(2)}
                self.assertEqual(len(texts), 1)

    def test_first_sample_is_the_keyframe_and_all_engines_agree_on_it(self):
        self.write("ball.xml", BALL)
        for engine, can in self.real_contenders():
            with self.subTest(engine):
                rows, _ = self.simulate("ball.xml", engine, "1", "0.01", *self.without_contact(can))
                first = [rows[0][key] for key in CSV_HEADER.split(",") if key != "body"]
                self.assertEqual(first, [0, 0, 0, 10, 1, 0, 0, 0, 1, 2, 3, 0, 0, 0])

    def test_body_names_are_quoted_where_they_must_be(self):
        self.write("names.xml", BALL.replace('body name="ball"', 'body name="a &quot;b&quot;, c"'))
        rows, _ = self.simulate("names.xml", "null", "1", "0.01")
        self.assertEqual({row["body"] for row in rows}, {'a "b", c'})

    def test_standard_output(self):
        text = self.assay("simulate", "planar-chain", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "0.1",
                          "--out", "-")
        self.assertEqual(text, self.simulate("planar-chain", "mujoco-euler", "1", "0.1")[1])

    def test_earlier_file_is_replaced_through_a_link(self):
        self.write("real.csv", "old")
        (self.dir / "link.csv").symlink_to("real.csv")
        self.assay("simulate", "planar-chain", "--engine", "null", "--timestep", "1", "--duration", "0.1", "--out",
                   "link.csv")
        self.assertTrue((self.dir / "link.csv").is_symlink())
        self.assertTrue((self.dir / "real.csv").read_text().startswith(CSV_HEADER))


class Physics(Csv):
    def test_thrown_ball(self):
        self.write("ball.xml", BALL)
        g, h = 9.81, 1e-3
        for engine, can in self.real_contenders():
            with self.subTest(engine):
                # single precision keeps about 7 digits of a height of 10 m
                rounding = 2e-4 if can["precision"] == "single" else 1e-10
                options = ["--sample", "100", *self.without_contact(can)]
                for row in self.simulate("ball.xml", engine, "1", "1", *options)[0]:
                    t = row["time"]
                    # at most a first-order method's error, which is half a step's fall each step
                    self.assertAlmostEqual(row["z"], 10 + 3 * t - g * t**2 / 2, delta=g * t * h / 2 * 1.001 + rounding)
                    self.assertAlmostEqual(row["x"], t, delta=rounding)
                    self.assertAlmostEqual(row["y"], 2 * t, delta=rounding)
                    self.assertAlmostEqual(row["vz"], 3 - g * t, delta=rounding)

    def test_falling_chain_ends_where_three_other_solvers_do(self):
        # the last link after 1 s by an integration of the Lagrangian, by MuJoCo's RK4 and by Simbody's RK-Merson, which
        # agree to 2e-13; and the errors at 1 ms and 1/64 ms that these methods were seen to have outside of assay
        truth = [-1.1380581024156, 0, 0.5467778217001]
        expected = {"mujoco-euler": (4.34e-3, 6.78e-5), "mujoco-implicit": (1.77e-3, 2.84e-5),
                    "mujoco-rk4": (2.1e-9, None), "bullet-mb": (4.34e-3, 6.78e-5), "bullet-mb-rk4": (2.1e-9, None),
                    "bullet-si-f64": (1.447e-3, 2.29e-5), "bullet-mlcp-f64": (1.447e-3, 2.29e-5),
                    "ode-quick": (1.449e-3, 2.29e-5), "ode-step": (1.447e-3, 2.29e-5)}
        present = set(self.contenders())
        self.assertTrue(present & set(expected))
        for engine in sorted(present & set(expected)):
            for timestep, error in zip(["1", "1/64"], expected[engine]):
                with self.subTest(f"{engine} at {timestep} ms"):
                    last = self.simulate("falling-chain", engine, timestep, "1", "--sample", "1000")[0][-1]
                    found = math.dist([last["x"], last["y"], last["z"]], truth)
                    if error is None:  # rounding is all that is left
                        self.assertLess(found, 1e-12)
                    else:
                        self.assertAlmostEqual(found / error, 1, delta=0.01)

    def test_gravity_off(self):
        self.write("ball.xml", BALL)
        for engine, can in self.real_contenders():
            with self.subTest(engine):
                options = ["--gravity", "off", *self.without_contact(can)]
                last = self.simulate("ball.xml", engine, "1", "1", *options)[0][-1]
                self.assertAlmostEqual(last["z"], 13, delta=2e-3 if can["precision"] == "single" else 1e-9)
                self.assertEqual(last["vz"], 3)

    def test_contacts_off(self):
        self.write("drop.xml", BALL.replace('qpos="0 0 10 ', 'qpos="0 0 0.3 ').replace('qvel="1 2 3', 'qvel="0 0 0'))
        for engine, can in self.real_contenders():
            if not can["contact"]:
                continue
            with self.subTest(engine):
                resting = self.simulate("drop.xml", engine, "1", "2", "--sample", "2000")[0][-1]
                self.assertAlmostEqual(resting["z"], 0.1, delta=0.01)
                falling = self.simulate("drop.xml", engine, "1", "2", "--sample", "2000", "--contacts", "off")[0][-1]
                self.assertAlmostEqual(falling["z"], 0.3 - 9.81 * 2, delta=0.02)

    def test_motor_holds_its_control(self):
        self.write("spinner.xml", SPINNER)
        rate = 2 * 0.6 / INERTIA  # after 1 s
        for engine, can in self.real_contenders():
            with self.subTest(engine):
                last = self.simulate("spinner.xml", engine, "1", "1", "--sample", "1000")[0][-1]
                self.assertAlmostEqual(last["wz"], rate, delta=rate * (5e-2 if self.inexact(can) else 2e-3))

    def test_servo_reaches_its_set_point(self):
        self.write("servo.xml", SERVO)
        for engine, can in self.real_contenders():
            delta = 1e-2 if self.inexact(can) else 1e-3
            with self.subTest(engine):
                last = self.simulate("servo.xml", engine, "1", "5", "--sample", "5000")[0][-1]
                self.assertAlmostEqual(last["x"], 0.5 * math.cos(0.6), delta=delta)
                self.assertAlmostEqual(last["y"], 0.5 * math.sin(0.6), delta=delta)

    def test_servo_beyond_an_explicit_step(self):
        """MuJoCo's implicit integrators take a velocity gain as its users know it; to others it is a torque of the step's start."""
        kp, kv = 500, 10000  # an explicit step is stable below 2 I / kv = 0.12 ms
        self.write("stiff.xml", SERVO.replace('kp="20" kv="10"', f'kp="{kp}" kv="{kv}"'))
        contenders = {name: capabilities for name, capabilities in self.real_contenders()}
        right = 0.6 * (1 - math.exp(-kp / kv * 0.2))  # after a moment the arm creeps at the rate kp / kv
        for contender in ("mujoco-implicitfast", "mujoco-implicit"):
            if contender not in contenders:
                continue
            self.assertTrue(contenders[contender]["actuators"])
            rows, _ = self.simulate("stiff.xml", contender, "2", "0.2", "--sample", "100")
            body = rows[-1]
            angle = 2 * math.atan2(body["qz"], body["qw"])
            self.assertAlmostEqual(angle, right, delta=0.01 * right)
        done = self.run_assay("simulate", "stiff.xml", "--engine", "bullet-mb", "--timestep", "0.05", "--duration", "0.01",
                              "--out", "run.csv")
        if "bullet-mb" in contenders:
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("actuator 'drive'", done.stderr)
            self.assertIn("explicit", done.stderr)

    def test_a_control_can_be_left_out(self):
        self.write("spinner.xml", SPINNER)
        last = self.simulate("spinner.xml", "mujoco-euler", "1", "1", "--sample", "1000", "--control", "passive")[0][-1]
        self.assertEqual(last["wz"], 0)

    def test_a_sine_turns_as_it_has_to(self):
        self.write("spinner.xml", SPINNER)
        # from rest, 3 Nm sin(2 pi t / 2 s): at its half the rate is the integral over a half wave
        last = self.simulate("spinner.xml", "mujoco-euler", "0.25", "1", "--sample", "1000", "--control",
                             "sine,amplitude=3,frequency=0.5")[0][-1]
        rate = 3 / INERTIA * 2 / math.pi
        self.assertAlmostEqual(last["wz"], rate, delta=1e-3 * rate)

    # What the report and the findings print as the command that shows a cell.
    def test_a_campaigns_control_can_be_repeated(self):
        self.write("spinner.xml", SPINNER)
        systems = [("planar-chain", "planar-chain", '{kind = "sine", amplitude = 0.3, frequency = 1.5, phase_step = 0.7}'),
                   ("driven", "./spinner.xml", '"actuators"'), ("left", "./spinner.xml", '"passive"')]
        self.write("controls.toml", 'name = "controls"\ncontenders = ["mujoco-euler", "ode-step"]\ntimesteps_ms = [2]\n'
                   'reference_ms = 2\nmeasures = ["consistency"]\n' + "".join(
                       f'[[system]]\nname = "{name}"\nmodel = "{model}"\nduration_s = 0.256\nsample_ms = 32\npieces = 2\n'
                       f"piece_ms = 32\ncontrol = {control}\n" for name, model, control in systems))
        self.assay("run", "controls.toml", "--out", "results")
        self.assay("export", "results", "--trajectories", "csv", "--out", "states")
        with contextlib.closing(sqlite3.connect(self.dir / "results/assay.sqlite")) as db:
            facts = {name: json.loads(text) for name, text in db.execute("SELECT name, json FROM systems")}
        self.assertEqual([facts[name].get("control_option") for name, _, _ in systems],
                         ["sine,amplitude=0.3,frequency=1.5,phase_step=0.7", None, "passive"])
        for name, model, _ in systems:
            for contender in ("mujoco-euler", "ode-step"):
                option = facts[name].get("control_option")
                rows, _ = self.simulate(model, contender, "2", "0.256", "--sample", "32",
                                        *(["--control", option] if option else []))
                stored = read_csv((self.dir / f"states/{name}/{contender}.csv").read_text())
                self.assertEqual(len(rows), len(stored))
                for row, kept in zip(rows, stored):
                    for key in row:
                        if key != "body":
                            self.assertAlmostEqual(row[key], kept[key], places=9, msg=f"{name} {contender} {key}")
                if option:
                    unasked, _ = self.simulate(model, contender, "2", "0.256", "--sample", "32")
                    self.assertNotAlmostEqual(unasked[-1]["x"], rows[-1]["x"], places=3)

    def test_setting_makes_one_contender_another(self):
        rk4 = self.simulate("planar-chain", "mujoco-rk4", "1", "0.2")[1]
        euler = self.simulate("planar-chain", "mujoco-euler", "1", "0.2")[1]
        self.assertNotEqual(euler, rk4)
        self.assertEqual(self.simulate("planar-chain", "mujoco-euler", "1", "0.2", "--set", "integrator=rk4")[1], rk4)
        both = ["--set", "integrator=rk4", "--set", "solver=cg"]
        self.assertEqual(self.simulate("planar-chain", "mujoco-euler", "1", "0.2", *both)[1], rk4)

    def test_unsupported_element_is_left_out_with_a_word(self):
        self.write("kite.xml", BALL.replace("<worldbody>", '<option density="1000"/><worldbody>'))
        common = ["simulate", "kite.xml", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "0.1", "--out", "x.csv"]
        self.refused(*common, naming=["density 1000", "--drop-unsupported"])
        self.assertFalse((self.dir / "x.csv").exists())
        done = self.run_assay(*common, "--drop-unsupported")
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stderr, r"(?m)^assay: note: .*drag")


class Unfinished(Csv):
    """An engine that fails, a user who stops it: what was computed is kept, and one sentence says where."""

    def setUp(self):
        super().setUp()
        self.use_mishap_engine()
        self.write("ball.xml", BALL)

    def common(self, engine, duration="1"):
        return ["simulate", "ball.xml", "--engine", engine, "--timestep", "10", "--duration", duration, "--out", "run.csv"]

    def kept(self, name, count):
        """The file holds exactly the first `count` samples, all of finite numbers."""
        rows = read_csv((self.dir / name).read_text())
        self.assertEqual([row["time"] for row in rows], [i / 100 for i in range(count)])
        for row in rows:
            self.assertAlmostEqual(row["x"], row["time"], delta=1e-12)
            self.assertTrue(all(math.isfinite(value) for key, value in row.items() if key != "body"))

    def test_divergence(self):
        for fault in ["nan", "far"]:
            with self.subTest(fault):
                self.refused(*self.common(f"mishap-{fault}"), status=1,
                             naming=[f"mishap-{fault} diverged at 0.1 s", "'run.csv'", "--timestep"])
                self.kept("run.csv", 10)

    def test_engine_failure(self):
        self.refused(*self.common("mishap-throw"), status=1, naming=["mishap-throw", "the solver gave up", "'run.csv'"])
        self.kept("run.csv", 10)

    def test_exception_of_any_type(self):
        self.refused(*self.common("mishap-throw-number"), status=1,
                     naming=["mishap-throw-number failed at 0.09", "not a std::exception", "'run.csv'"])

    def test_crash(self):
        self.refused(*self.common("mishap-abort"), status=1, naming=["mishap-abort", "SIGABRT", "'run.csv.partial'"])
        self.kept("run.csv.partial", 10)
        self.assertFalse((self.dir / "run.csv").exists())

    def test_exit(self):
        for fault in ["exit-at-once", "exit-as-if-done"]:
            with self.subTest(fault):
                self.refused(*self.common(f"mishap-{fault}"), status=1,
                             naming=[f"mishap-{fault} ended its process early", "'run.csv.partial'"])
        self.kept("run.csv.partial", 10)

    def test_failures_in_other_calls_than_a_step(self):
        for fault, naming in {"throw-in-create": ["failed before its first step: no more in create"],
                              "exit-in-create": ["ended its process early", "did not take a step"]}.items():
            self.refused(*self.common(f"mishap-{fault}"), status=1, naming=[f"mishap-{fault} {naming[0]}", *naming[1:]])
            self.assertEqual(self.files(), ["ball.xml"], fault)
        for call, samples in {"torques": 11, "read": 10}.items():
            self.refused(*self.common(f"mishap-throw-in-{call}"), status=1,
                         naming=[f"mishap-throw-in-{call} failed at 0.1 s: no more in {call}", "'run.csv'"])
            self.kept("run.csv", samples)
            self.refused(*self.common(f"mishap-exit-in-{call}"), status=1,
                         naming=[f"mishap-exit-in-{call} ended its process early", "'run.csv.partial'"])
            self.kept("run.csv.partial", samples)

    def test_somebody_else_ends_it(self):
        self.refused(*self.common("mishap-killed"), status=1,
                     naming=["mishap-killed", "'run.csv.partial'", "ended from outside (SIGKILL)", "start the same command"])
        self.kept("run.csv.partial", 10)

    def test_memory_has_a_limit(self):
        self.refused(*self.common("mishap-hoard"), status=1, naming=["mishap-hoard failed at 0.09", "bad_alloc", "'run.csv'"])

    def left(self):
        """Processes that the engine has started, as it wrote them down."""
        mark = self.dir / "mark"
        return [int(line) for line in mark.read_text().split()] if mark.exists() else []

    def are_gone(self, processes):
        for process in processes:
            with self.assertRaises(ProcessLookupError, msg=f"{process} outlives the command"):
                for _ in range(500):
                    os.kill(process, 0)
                    time.sleep(0.01)

    def test_what_the_engine_starts_ends_with_it(self):
        self.env |= {"ASSAY_MISHAP_MARK": str(self.dir / "mark"), "ASSAY_SANDBOX": "off"}  # it may not write there
        start = time.monotonic()
        self.assay(*self.common("mishap-leave"))
        self.assertLess(time.monotonic() - start, 60)  # the process that was left sleeps for 300 s
        self.assertEqual(len(self.left()), 1)
        self.are_gone(self.left())

    def test_what_the_engine_starts_ends_with_a_killed_guard(self):
        self.env |= {"ASSAY_MISHAP_MARK": str(self.dir / "mark"), "ASSAY_SANDBOX": "off"}
        process = self.start_assay(*self.common("mishap-leave-and-hang"))
        for _ in range(2000):
            if self.left():
                break
            time.sleep(0.01)
        left = self.left()
        self.assertEqual(len(left), 1)
        guard = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        self.assertEqual(len(guard), 1)
        os.kill(int(guard[0]), signal.SIGKILL)
        _, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1)
        self.check_sentence(err, ["mishap-leave-and-hang", "ended from outside (SIGKILL)"])
        self.are_gone(left)

    def test_crash_leaves_an_earlier_file_alone(self):
        self.write("run.csv", "an earlier run")
        self.refused(*self.common("mishap-abort"), status=1)
        self.assertEqual((self.dir / "run.csv").read_text(), "an earlier run")

    def test_refusal_of_the_engine(self):
        self.refused(*self.common("mishap-refuse"), naming=["mishap-refuse", "body 'ball'", "give it to somebody else"])
        self.assertEqual(self.files(), ["ball.xml"])

    def test_approximation_is_said(self):
        done = self.run_assay(*self.common("mishap-inexact"))
        self.assertEqual(done.returncode, 0)
        self.check_sentence(done.stderr, ["mishap-inexact", "body 'ball'", "rounded"])

    def wait_for_rows(self, process):
        partial = self.dir / "run.csv.partial"
        for _ in range(2000):
            if partial.exists() and partial.read_text().count("\n") > 3:
                return
            self.assertIsNone(process.poll(), "ended before it was to be interrupted")
            time.sleep(0.01)
        self.fail("no rows after 20 s")

    def test_interruption(self):
        # as a shell's kill does (the program alone) and as a terminal does (all of its processes)
        for number in [signal.SIGINT, signal.SIGTERM]:
            for send in [os.kill, os.killpg]:
                with self.subTest(f"{number} by {send.__name__}"):
                    (self.dir / "run.csv.partial").unlink(missing_ok=True)
                    process = self.start_assay(*self.common("mishap-slow", "1000"), start_new_session=True)
                    self.wait_for_rows(process)
                    send(process.pid, number)
                    out, err = process.communicate(timeout=60)
                    self.assertEqual((process.returncode, out), (1, ""))
                    self.check_sentence(err, ["interrupted at", "of 1000 s", "'run.csv.partial'"])
                    rows = read_csv((self.dir / "run.csv.partial").read_text())
                    self.kept("run.csv.partial", len(rows))
                    self.assertFalse((self.dir / "run.csv").exists())

    def test_second_interruption_ends_a_hanging_engine(self):
        process = self.start_assay(*self.common("mishap-hang"), start_new_session=True)
        self.wait_for_rows(process)
        time.sleep(0.3)
        os.killpg(process.pid, signal.SIGINT)
        time.sleep(0.3)
        self.assertIsNone(process.poll())
        os.killpg(process.pid, signal.SIGINT)
        self.assertEqual(process.wait(timeout=60), -signal.SIGINT)
        process.communicate()
        # the engine's process went with it
        with self.assertRaises(ProcessLookupError):
            for _ in range(500):
                os.killpg(process.pid, 0)
                time.sleep(0.01)

    def test_progress_shows_on_a_terminal_only(self):
        status, shown = self.on_terminal(*self.common("mishap-slow", "2"))
        self.assertEqual(status, 0)
        self.assertRegex(shown, r"mishap-slow on ball: \d+ % \([\d.]+ of 2 s\), \d+ s left")
        self.assertTrue(shown.endswith("\r\x1b[K"), shown[-80:])
        self.simulate("ball.xml", "mishap-slow", "10", "2")  # says nothing


if __name__ == "__main__":
    main()
