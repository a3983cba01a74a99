"""engines, systems, check."""

import pathlib
import shutil

from harness import BALL, FAULTY_ENGINES, SOURCE, AssayTest, data_folder, main


class Engines(AssayTest):
    def test_table_and_json_list_the_same(self):
        contenders = self.assay_json("engines", "--json")["contenders"]
        lines = self.assay("engines").split("\n\n")[0].splitlines()[1:]
        self.assertEqual([line.split()[:3] for line in lines],
                         [[row["contender"], row["engine"], row["version"]] for row in contenders])
        self.assertEqual(contenders[0]["contender"], "null")
        self.assertIn("mujoco-rk4", [row["contender"] for row in contenders])

    def test_json_says_everything_of_a_contender(self):
        for row in self.assay_json("engines", "--json")["contenders"]:
            with self.subTest(row["contender"]):
                capabilities = row["capabilities"]
                self.assertIn(capabilities["precision"], ("single", "double"))
                self.assertIn(capabilities["coordinates"], ("joint", "maximal"))
                self.assertIn(capabilities["springs"], ("none", "explicit", "native"))
                for key in ["contact", "joint_limits", "torques", "armature", "gyroscopic"]:
                    self.assertIsInstance(capabilities[key], bool)
                for setting in row["settings"]:
                    self.assertTrue(setting["meaning"], setting)
                    self.assertEqual(type(setting["value"]), type(setting["default"]), setting)
                    if setting["choices"]:
                        self.assertIn(setting["value"], setting["choices"])
                differs = [s["name"] for s in row["settings"] if s["value"] != s["default"]]
                self.assertEqual([part.split("=")[0] for part in row["differs"].split()], sorted(differs))
                self.assertTrue(pathlib.Path(row["build"]["plugin"]).is_file())
                self.assertTrue(row["build"]["source"])

    def test_plugin_of_somebody_else(self):
        self.env["ASSAY_ENGINE_PATH"] = FAULTY_ENGINES
        self.assertIn("faulty-abort", self.contenders())

    def test_broken_plugin_is_absent_with_its_reason(self):
        self.write("plugins/assay-engine-broken.so", "this is no library")
        self.env["ASSAY_ENGINE_PATH"] = str(self.dir / "plugins")
        absent = {row["engine"]: row["reason"] for row in self.assay_json("engines", "--json")["absent"]}
        self.assertIn("assay-engine-broken.so", absent["broken"])
        self.assertRegex(self.assay("engines"), r"(?m)^  broken: .*assay-engine-broken\.so")


class Systems(AssayTest):
    def test_figures_of_the_papers_systems(self):
        systems = {row["system"]: row for row in self.assay_json("systems", "--json")["systems"]}
        chain, capsules = systems["planar-chain"], systems["capsules-27"]
        self.assertEqual((chain["bodies"], chain["dof"], chain["hinges"], chain["free_joints"]), (5, 5, 5, 0))
        self.assertEqual((chain["contact_pairs"], chain["gravity"]), (0, [0, 0, 0]))
        self.assertEqual((capsules["bodies"], capsules["dof"], capsules["free_joints"], capsules["capsules"]),
                         (27, 162, 27, 27))
        # every capsule against every other and the floor
        self.assertEqual(capsules["contact_pairs"], 27 * 26 // 2 + 27)
        self.assertEqual(len({row["hash"] for row in systems.values()}), len(systems))

    def test_table_shows_what_the_json_says(self):
        rows = self.assay_json("systems", "--json")["systems"]
        lines = self.assay("systems").splitlines()
        self.assertEqual(len(lines), 1 + len(rows))
        for line, row in zip(lines[1:], rows):
            self.assertEqual(line.split()[:3], [row["system"], str(row["bodies"]), str(row["dof"])])

    def test_data_folder_of_the_user(self):
        self.write("lab/models/ball.xml", BALL)
        self.env["ASSAY_DATA"] = str(self.dir / "lab")
        self.assertEqual([row["system"] for row in self.assay_json("systems", "--json")["systems"]], ["ball"])
        self.env["ASSAY_DATA"] = str(self.dir / "nowhere")
        self.refused("systems", naming=["ASSAY_DATA", "nowhere"])

    def test_broken_file_does_not_hide_the_others(self):
        folder = data_folder(self.dir / "lab")
        self.write("lab/models/broken.xml", "<mujoco><worldbody>")
        self.env["ASSAY_DATA"] = str(folder)
        done = self.run_assay("systems")
        self.assertEqual(done.returncode, 2)
        self.check_sentence(done.stderr, ["broken.xml"])
        self.assertIn("planar-chain", done.stdout)

    def test_installed_program_finds_its_data(self):
        # the layout of an installation, made of links and copies
        (self.dir / "usr/bin").mkdir(parents=True)
        shutil.copy(self.command()[0], self.dir / "usr/bin/assay")
        data_folder(self.dir / "usr/share/assay")
        for model in (self.dir / "usr/share/assay/models").iterdir():
            if model.name != "planar-chain.xml":
                model.unlink()
        program = [str(self.dir / "usr/bin/assay")]
        self.command = lambda *arguments: [*program, *map(str, arguments)]
        self.assertEqual([row["system"] for row in self.assay_json("systems", "--json")["systems"]], ["planar-chain"])


class Check(AssayTest):
    BOX = BALL.replace("</body>", '<geom name="crate" type="box" size=".1 .2 .3" mass="1"/></body>')

    def test_every_contender_has_a_verdict(self):
        for model in ["planar-chain", SOURCE / "models/capsules-27.xml"]:
            report = self.assay_json("check", model, "--json")
            judged = [name for engine in report["engines"] for name in engine["contenders"]]
            self.assertEqual(sorted(judged), sorted(self.contenders()))
            for engine in report["engines"]:
                kinds = {finding["fidelity"] for finding in engine["findings"]}
                self.assertLessEqual(kinds, {"approximated", "refused"})
                self.assertEqual(engine["verdict"] == "exact", not kinds)
                for finding in engine["findings"]:
                    self.assertTrue(finding["element"] and finding["how"])

    def test_chain_is_exact_for_real_engines(self):
        for engine in self.assay_json("check", "planar-chain", "--json")["engines"]:
            self.assertEqual(engine["verdict"], "approximated" if engine["engine"] == "null" else "exact")

    def test_refused_and_approximated_say_what_and_how(self):
        self.use_faulty_engine()
        self.write("ball.xml", BALL)
        text = self.assay("check", "ball.xml")
        self.assertRegex(text, r"(?m)^faulty \(faulty-refuse\): refused\n  refused +body 'ball': give it to somebody else$")
        self.assertRegex(text, r"(?m)^faulty \(faulty-inexact\): approximated\n  approximated +body 'ball': rounded$")
        self.assertRegex(text, r"(?m)^faulty \(faulty-slow, .*faulty-fly\): exact$")

    def test_unsupported_shape_is_refused_or_left_out_by_name(self):
        self.write("box.xml", self.BOX)
        self.refused("check", "box.xml", naming=["crate", "box", "--drop-unsupported"])
        self.assertIn("crate", self.assay("check", "box.xml", "--drop-unsupported"))
        model = self.assay_json("check", "box.xml", "--drop-unsupported", "--json")["model"]
        self.assertTrue(any("crate" in note for note in model["notes"]), model["notes"])
        # the mass that the box stands for stays
        self.assertEqual((model["spheres"], model["mass"]), (1, 3))

    def test_urdf_file(self):
        self.write("arm.urdf", """<robot name="arm">
          <link name="base"/>
          <link name="upper"><inertial><origin xyz="0 0 .1"/><mass value="2"/>
            <inertia ixx=".02" iyy=".02" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial></link>
          <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
            <limit lower="-1" upper="1" effort="10" velocity="10"/></joint></robot>""")
        model = self.assay_json("check", "arm.urdf", "--json")["model"]
        self.assertEqual((model["bodies"], model["dof"], model["limited_hinges"], model["mass"]), (1, 1, 1, 2))


if __name__ == "__main__":
    main()
