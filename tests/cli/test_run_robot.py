"""`assay run ROBOT`: from a model's file to a recommendation, with small robots and small budgets."""

import json
import re
import signal
import sqlite3
import time
import tomllib

from harness import AssayTest, main, reliability

ARM = """<mujoco model="arm">
  <worldbody>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" axis="0 1 0" damping="0.1" range="-150 150" limited="true"/>
      <geom type="capsule" size="0.05" fromto="0 0 0 0 0 -0.5" mass="2" contype="0" conaffinity="0"/>
      <body name="lower" pos="0 0 -0.5">
        <joint name="elbow" axis="0 1 0" damping="0.1"/>
        <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -0.4" mass="1" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
HOPPER = """<mujoco model="hopper">
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <body name="torso" pos="0 0 3">
      <freejoint/>
      <geom type="capsule" size="0.1" fromto="-0.2 0 0 0.2 0 0" mass="4"/>
      <body name="leg" pos="0 0 -0.2">
        <joint name="knee" axis="0 1 0" damping="0.2"/>
        <geom type="sphere" size="0.08" pos="0 0 -0.3" mass="1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
TWO = "mujoco-euler,mujoco-rk4"


def link(name, z, mass=1.0):
    return f"""<link name="{name}">
      <inertial><mass value="{mass}"/><origin xyz="0 0 {z}"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><origin xyz="0 0 {z}"/><geometry><box size="0.1 0.1 0.2"/></geometry></collision>
    </link>
    """


def urdf(base_z, limbs):
    """A base with a limb of one joint for each of `limbs`, the height of its box."""
    text = '<robot name="robot">' + link("base", base_z, 5)
    for i, z in enumerate(limbs):
        text += link(f"leg{i}", z) + f"""<joint name="joint{i}" type="revolute"><parent link="base"/><child link="leg{i}"/>
          <origin xyz="{0.3 * (i + 1)} 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="9"/></joint>"""
    return text + "</robot>"


class RunRobot(AssayTest):
    def cells(self, folder):
        with sqlite3.connect(self.dir / folder / "assay.sqlite") as db:
            return db.execute("SELECT system, contender, timestep_ms, measure, outcome FROM cells").fetchall()

    def search(self, robot, *more, minutes="3"):
        return self.assay("run", robot, "--minutes", minutes, "--contenders", TWO, *more)

    def test_ends_with_a_recommendation(self):
        self.write("robots/arm.xml", ARM)
        text = self.search("robots/arm.xml", "--out", "found", "--error", "5mm", "--realtime", "2")
        answer = self.assay_json("recommend", "found", "all", "--error", "5mm", "--realtime", "2", "--json")
        best = answer["recommended"]
        self.assertIn(f"{best['contender']} at {best['timestep_ms']:g} ms", text)
        self.assertLessEqual(best["worst"]["truth_error_max"]["value"], 0.005)
        self.assertLessEqual(best["worst"]["consistency"]["value"], 0.005)
        self.assertGreaterEqual(best["realtime_factor"]["value"], 2)
        for part in ["margin:", "What did not qualify, and why" if len(answer["contenders"]) < 2 else "real time", "To run next",
                     "approximates in this robot", "How sure this is"]:
            self.assertIn(part, text)
        for absent in self.assay_json("engines", "--json")["absent"]:
            self.assertRegex(text, f"Engines that were not asked:\\n.*{re.escape(absent['engine'])}")
        report = (self.dir / "found/report.html").read_text()
        self.assertIn("How sure this is", report)
        with sqlite3.connect(self.dir / "found/assay.sqlite") as db:
            kept = db.execute("SELECT value FROM manifest WHERE key = 'answer'").fetchone()[0]
            replayed = db.execute("SELECT count(*) FROM runs WHERE system = 'hold' AND timestep_ms = 1").fetchone()[0]
        parts = json.loads(kept)
        self.assertIn(f"{best['contender']} at {best['timestep_ms']:g} ms", parts[0]["heading"])
        for part in parts:
            self.assertIn(part["heading"], text)
            for row in part["rows"]:
                self.assertEqual(len(row), len(part["columns"]))
        self.assertGreaterEqual(replayed, 1)
        # Some cells were not worth their time.
        programme = tomllib.loads((self.dir / "found/campaign.toml").read_text())
        self.assertEqual(programme["contenders"], TWO.split(","))
        self.assertEqual([system["name"] for system in programme["system"]], ["hold", "random", "swing"])
        self.assertEqual({system["model"] for system in programme["system"]}, {"../robots/arm.xml"})
        self.assertEqual(programme["search"], {"minutes": 3, "error": "5mm", "realtime": "2"})
        # The programme can be run again, from another folder.
        again = self.assay("run", "found/campaign.toml", "--out", "again")
        self.assertIn("real time", again)
        # The same command finds everything there.
        before = self.cells("found")
        self.search("robots/arm.xml", "--out", "found", "--error", "5mm", "--realtime", "2")
        self.assertGreaterEqual(len(self.cells("found")), len(before))

    def test_limits_on_what_is_not_measured_come_before_the_budget(self):
        self.write("arm.xml", ARM)
        for more in (["--plan"], []):
            run = ["run", "arm.xml", "--minutes", "9", "--contenders", "mujoco-euler", "--out", "found", *more]
            self.refused(*run, "--limit", "truth_eror=1mm", naming=["--limit", "'truth_eror'", "did you mean 'truth_error'?"])
            self.refused(*run, "--limit", "energy_drift=1J", naming=["--limit", "'energy_drift'", "not measured", "of 'arm'"])
            self.refused(*run, "--limit", "step_time=1us", naming=["--limit", "'step_time'", "no error"])
            self.refused(*run, "--slip", "1mm", naming=["--slip", "no slip is measured", "of 'arm'"])
            self.refused(*run, "--error", "1mm", "--limit", "truth_error_max=1mm", naming=["'truth_error_max'", "limited twice"])
            self.assertFalse((self.dir / "found/assay.sqlite").exists())
        # a right one mends what the wrong ones have left
        self.assay("run", "arm.xml", "--plan", "--contenders", "mujoco-euler", "--out", "found", "--limit", "truth_error=1mm")
        campaign = tomllib.loads((self.dir / "found/campaign.toml").read_text())
        self.assertEqual(campaign["search"]["limits"], ["truth_error=1mm"])

    def test_a_plan_says_how_it_was_written_and_which_torques_drive_it(self):
        self.write("arm.xml", ARM)
        self.write("push.csv", "time,shoulder\n0,0\n1,2\n")
        text = self.assay("run", "arm.xml", "--plan", "--contenders", "mujoco-euler", "--control", "push.csv", "--out", "plan")
        self.assertIn("with the torques of '../push.csv'", text)
        first = (self.dir / "plan/campaign.toml").read_text().splitlines()[0]
        self.assertTrue(first.startswith("# Written by: assay run arm.xml"), first)
        self.assertIn("--control push.csv", first)
        self.assertTrue(first.endswith(" --plan"), first)

    def test_what_a_robot_is_decides_what_is_measured(self):
        self.write("hopper.xml", HOPPER)
        done = self.run_assay("run", "hopper.xml", "--minutes", "0.001", "--contenders", TWO)
        self.assertIn("falls 5 cm onto the ground", done.stdout)
        programme = tomllib.loads((self.dir / "hopper-results/campaign.toml").read_text())
        drop, random, swing = programme["system"]
        self.assertEqual((drop["name"], drop["above_ground_m"], drop["control"]), ("drop", 0.05, "hold"))
        self.assertEqual((random["contacts"], random["gravity"], random["control"]), (False, False, "random"))
        self.assertEqual((swing["smooth"], swing["measures"]), (True, ["truth"]))
        self.assertEqual(drop["model"], "../hopper.xml")

    def programme(self, file, *more):
        """The output and the first system of the programme for a file."""
        out = file.replace(".", "-")
        done = self.run_assay("run", file, "--plan", "--contenders", "mujoco-euler", "--out", out, *more)
        self.assertIn("programme: ", done.stdout, done.stderr)
        systems = tomllib.loads((self.dir / out / "campaign.toml").read_text())["system"]
        for key in ["floating_base", "fixed_base", "ground", "no_ground"]:
            self.assertEqual(len({system.get(key) for system in systems}), 1)
        return done.stdout, systems[0]

    def test_where_a_file_does_not_say_how_the_robot_stands(self):
        self.write("legs.urdf", urdf(0.5, [0, 0]))
        text, first = self.programme("legs.urdf")
        self.assertIn("its base is free, because it stands on 2 of its limbs", text)
        self.assertIn("a ground plane lies under its lowest point", text)
        self.assertEqual((first["name"], first["floating_base"], first["ground"]), ("drop", True, True))
        self.write("held.urdf", urdf(0.5, [0, 0]))
        text, first = self.programme("held.urdf", "--fixed-base")
        self.assertEqual((first["name"], first["fixed_base"], "ground" in first), ("hold", True, False))

        # An arm, and a torso whose limbs do not reach the ground, stay on their base.
        for name, robot in [("arm.urdf", urdf(0, [0.5])), ("torso.urdf", urdf(0, [0.5, 0.5]))]:
            self.write(name, robot)
            text, first = self.programme(name)
            self.assertIn("its base is fixed to the world", text)
            self.assertEqual((first["name"], "ground" in first, "floating_base" in first), ("hold", False, False))

        self.write("drone.urdf", urdf(0, []))
        text, first = self.programme("drone.urdf")
        self.assertIn("nothing else could move", text)
        self.assertEqual((first["name"], first["floating_base"], first["ground"]), ("drop", True, True))

    def test_a_free_base_gets_a_ground(self):
        self.write("free.xml", HOPPER.replace('<geom type="plane" size="0 0 1"/>', ""))
        text, first = self.programme("free.xml")
        self.assertIn("a ground plane lies under its lowest point", text)
        self.assertEqual((first["name"], first["ground"], first["above_ground_m"]), ("drop", True, 0.05))
        done = self.run_assay("run", "free.xml", "--no-ground", "--plan", "--contenders", "mujoco-euler", "--out", "none")
        self.assertIn("free in space, without gravity", done.stdout)
        first = tomllib.loads((self.dir / "none/campaign.toml").read_text())["system"][0]
        self.assertEqual((first["no_ground"], first["gravity"]), (True, False))
        # Without gravity nothing falls.
        self.write("space.xml", HOPPER.replace('<geom type="plane" size="0 0 1"/>', "").replace(
            "<worldbody>", '<option gravity="0 0 0"/><worldbody>'))
        text, first = self.programme("space.xml")
        self.assertIn("free in space", text)
        self.assertNotIn("ground", first)

    def test_a_free_object_does_not_make_the_robot_fall(self):
        ball = '<body name="ball" pos="0.3 0 0.5"><freejoint/><geom type="sphere" size="0.05" mass="0.1"/></body>'
        self.write("juggler.xml", ARM.replace("<worldbody>", '<worldbody><geom type="plane" size="0 0 1"/>' + ball))
        text, first = self.programme("juggler.xml")
        self.assertIn("stands on its fixed base", text)
        self.assertEqual((first["name"], "above_ground_m" in first), ("hold", False))

    def test_a_budget_that_is_too_small_says_so_and_goes_on(self):
        self.write("arm.xml", ARM)
        done = self.run_assay("run", "arm.xml", "--minutes", "0.0005", "--contenders", TWO, "--out", "found")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("no recommendation", done.stdout)
        self.assertNotIn("joint position error", done.stdout)  # the error that is asked for does not depend on what is there
        self.assertIn("the budget ended before these were decided", done.stdout)
        self.assertIn("real time", self.search("arm.xml", "--out", "found"))

    def test_a_few_contenders_give_an_answer_before_the_others_are_begun(self):
        self.write("arm.xml", ARM)
        process = self.start_assay("run", "arm.xml", "--minutes", "5", "--error", "20mm", "--contenders", "mujoco-*", "--out", "found")
        first = None  # when the first timing was complete
        until = time.monotonic() + 300
        while first is None and time.monotonic() < until and process.poll() is None:
            time.sleep(0.1)
            try:
                with sqlite3.connect(f"file:{self.dir}/found/assay.sqlite?mode=ro", uri=True) as db:
                    first = db.execute("SELECT min(finished) FROM cells WHERE measure = 'raw_speed' AND outcome = 'ok'").fetchone()[0]
            except sqlite3.OperationalError:  # not there, or locked
                pass
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=100)
        self.assertIsNotNone(first, "no contender was timed")
        with sqlite3.connect(self.dir / "found/assay.sqlite") as db:
            begun = db.execute("SELECT count(DISTINCT contender) FROM cells WHERE started < ? AND contender LIKE 'mujoco-%'",
                               (first,)).fetchone()[0]
        self.assertLessEqual(begun, 3)
        self.assertGreater(len(tomllib.loads((self.dir / "found/campaign.toml").read_text())["contenders"]), 10)
        # What was measured until then is an answer.
        answer = self.assay_json("recommend", "found", "all", "--error", "20mm", "--json")
        self.assertIsNotNone(answer["recommended"])

    def test_an_interrupted_run_goes_on(self):
        self.write("hopper.xml", HOPPER)
        arguments = ["run", "hopper.xml", "--minutes", "1", "--contenders", TWO, "--out", "found"]
        process = self.start_assay(*arguments)
        database = self.dir / "found/assay.sqlite"
        until = time.monotonic() + 60
        while time.monotonic() < until and process.poll() is None:
            if database.exists() and database.stat().st_size > 60000:
                break
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=100)
        if process.returncode != 0:  # it may have ended before
            self.assertNotIn("Traceback", errors)
        done = self.run_assay(*arguments)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        self.assertIn("How sure this is", done.stdout)
        self.assertEqual(len(self.cells("found")), len(set(self.cells("found"))))

    def test_own_torques(self):
        self.write("arm.xml", ARM)
        self.write("data/push.csv", "time,elbow\n0,0\n0.5,1\n2,-1\n")
        self.run_assay("run", "arm.xml", "--control", "data/push.csv", "--minutes", "0.02", "--contenders", TWO, "--out", "found")
        programme = tomllib.loads((self.dir / "found/campaign.toml").read_text())
        self.assertEqual(programme["system"][0]["control"], {"kind": "file", "path": "../data/push.csv"})
        self.assertTrue(any(system == "file" for system, *_ in self.cells("found")))
        for text, naming in [("time,elbow\n0,0\n1,2,3\n", ["push.csv:3", "3 columns", "has 2"]),
                             ("time,elbow\n0,nan\n", ["push.csv:2", "'nan'"]),
                             ("time,elbow\n1,0\n0.5,0\n", ["push.csv:3", "0.5", "sort the lines"]),
                             ("time,elbov\n0,0\n", ["push.csv:1", "'elbov'", "did you mean 'elbow'?"])]:
            self.write("data/push.csv", text)
            self.refused("run", "arm.xml", "--control", "data/push.csv", "--contenders", TWO, "--out", "other", naming=naming)

    def test_refusals_are_reported_for_each_engine(self):
        self.write("arm.xml", ARM)
        engines = self.assay_json("check", "arm.xml", "--json")["engines"]
        refusing = [engine for engine in engines if engine["verdict"] == "refused"]
        done = self.run_assay("run", "arm.xml", "--plan", "--out", "found")
        self.assertIn("assay run found/campaign.toml --out found", done.stdout)
        self.assertFalse((self.dir / "found/assay.sqlite").exists())
        programme = tomllib.loads((self.dir / "found/campaign.toml").read_text())
        for engine in refusing:
            self.assertFalse(set(engine["contenders"]) & set(programme["contenders"]))
            self.assertIn(f"{engine['engine']}: refuses", done.stdout)

    def test_a_refused_element_with_two_names_is_counted(self):
        bodies = "".join(f'<body pos="0 0 {i}"><freejoint/><geom name="egg{i}" type="ellipsoid" size="0.1 0.1 0.2" mass="1"/></body>'
                         for i in range(3))
        self.write("eggs.xml", f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
        done = self.run_assay("run", "eggs.xml", "--plan", "--out", "eggs")
        self.assertIn("dart: refuses contact (3 times, first egg0 and egg1):", done.stdout)

    def test_a_programme_that_was_cut_is_written_anew(self):
        self.write("arm.xml", ARM)
        command = ["run", "arm.xml", "--plan", "--contenders", "mujoco-euler", "--out", "found"]
        self.assay(*command)
        file = self.dir / "found/campaign.toml"
        whole = file.read_bytes()
        sizes = (0, 10, 200, 900)
        for size in sizes:
            self.assertLess(size, len(whole))
            file.write_bytes(whole[:size])
            done = self.run_assay(*command)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("'found/campaign.toml' is only the beginning", done.stderr)
            self.assertEqual(file.read_bytes(), whole)
        self.assertEqual([path.name for path in file.parent.iterdir()], ["campaign.toml"])
        # what somebody has written stays
        file.write_text("name = ")
        self.refused(*command, naming=["found/campaign.toml", "remove the file"])
        self.assertEqual(file.read_text(), "name = ")
        # a link is replaced
        file.unlink()
        file.symlink_to(self.dir / "made")
        self.assay(*command)
        self.assertFalse((self.dir / "made").exists())
        self.assertFalse(file.is_symlink())
        self.assertEqual(file.read_bytes(), whole)
        reliability("the programme of a robot's run is cut after 0 to 900 bytes", len(sizes), "it is written anew, and the command goes on",
                    "nothing")

    def test_wrong_use(self):
        self.write("arm.xml", ARM)
        self.refused("run", "arm.xml", "--minutes", "0", naming=["--minutes is 0"])
        self.refused("run", "arm.xml", "--control", "hodl", naming=["'hodl'", "did you mean 'hold'?"])
        self.refused("run", "arm.xml", "--contenders", "mujoko-*", naming=["'mujoko-*'"])
        self.refused("run", "arm.xml", "--error", "1s", naming=["--error", "1s"])
        self.refused("run", "arm.xml", "--shard", "1/2", naming=["--shard"])
        self.refused("run", "quick", "--out", "x", "--minutes", "1", naming=["--minutes", "[search]"])
        self.refused("run", "quick", "--out", "x", "--plan", naming=["--plan"])
        self.refused("run", "missing.urdf", naming=["'missing.urdf'", "does not exist"])
        self.run_assay("run", "arm.xml", "--minutes", "0.001", "--contenders", "mujoco-euler", "--out", "found")
        self.refused("run", "arm.xml", "--contenders", "mujoco-rk4", "--out", "found",
                     naming=["found/campaign.toml", "another programme", "--out"])


if __name__ == "__main__":
    main()
