"""engines, systems, check."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from harness import BALL, MISHAP_ENGINE, REFUSED_PLUGINS, SOURCE, AssayTest, data_folder, main

sys.path.insert(0, str(SOURCE / "docs"))
from tables import common, files  # noqa: E402


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
                self.assertEqual([part.split("=")[0] for part in row["differs"].split()], differs)
                self.assertTrue(pathlib.Path(row["build"]["plugin"]).exists())
                self.assertTrue(row["build"]["source"])

    def test_plugin_of_somebody_else(self):
        self.env["ASSAY_ENGINE_PATH"] = MISHAP_ENGINE
        self.assertIn("mishap-abort", self.contenders())

    def test_broken_plugin_is_absent_with_its_reason(self):
        self.write("plugins/assay-engine-broken.so", "this is no library")
        self.env["ASSAY_ENGINE_PATH"] = str(self.dir / "plugins")
        absent = {row["engine"]: row["reason"] for row in self.assay_json("engines", "--json")["absent"]}
        self.assertIn("assay-engine-broken.so", absent["broken"])
        self.assertRegex(self.assay("engines"), r"(?m)^  broken: .*assay-engine-broken\.so")

    def test_refused_plugins_are_absent_with_their_reasons(self):
        self.env["ASSAY_ENGINE_PATH"] = REFUSED_PLUGINS
        listed = self.assay_json("engines", "--json")
        absent = {row["engine"]: row["reason"] for row in listed["absent"]}
        said = {"noentry": r"no entry point: put ASSAY_ENGINE_PLUGIN",
                "outdated": r"was built for plugin version (\d+), this assay has (?!\1)\d+: build it again",
                "throwing": r"fails when it is loaded: no licence found", "hollow": r"makes no engine",
                "misnamed": r"calls itself 'somebody-else'"}
        for plugin, reason in said.items():
            self.assertRegex(absent[plugin], rf"assay-engine-{plugin}\.so' .*{reason}")
            self.assertRegex(self.assay("engines"), rf"(?m)^  {plugin}: .*{reason}")
        self.assertNotIn("intruder", {row["contender"] for row in listed["contenders"]})
        # of the others nothing is lost
        del self.env["ASSAY_ENGINE_PATH"]
        self.assertEqual(listed["contenders"], self.assay_json("engines", "--json")["contenders"])

    def test_refused_plugin_is_named_when_it_is_asked_for(self):
        self.env["ASSAY_ENGINE_PATH"] = REFUSED_PLUGINS
        self.write("ball.xml", BALL)
        for plugin, reason in [("outdated", "plugin version"), ("noentry", "no entry point")]:
            self.refused("simulate", "ball.xml", "--engine", f"{plugin}-fast", "--timestep", "1", "--duration", "1",
                         "--out", "run.csv", naming=[f"'{plugin}-fast'", f"assay-engine-{plugin}.so", reason])

    def test_engine_that_is_not_there_is_listed_with_how_to_get_it(self):
        # the program alone, as if none of its plugins had been built
        (self.dir / "alone/bin").mkdir(parents=True)
        shutil.copy(self.command()[0], self.dir / "alone/bin/assay")
        built = {row["engine"] for row in self.assay_json("engines", "--json")["contenders"]}
        absent = {row["engine"]: row["reason"] for row in self.assay_json("engines", "--json")["absent"]}
        self.assertFalse(built & set(absent))
        self.command = lambda *arguments: [str(self.dir / "alone/bin/assay"), *map(str, arguments)]
        missing = {row["engine"]: row["reason"] for row in self.assay_json("engines", "--json")["absent"]}
        self.assertEqual(set(missing), built | set(absent))
        for engine, reason in missing.items():
            self.assertRegex(reason, r"^not built: \S.*[^.]$")
            self.assertEqual(reason, absent.get(engine, f"not built: build the target assay-engine-{engine}"))

    def test_engine_that_was_not_found_is_listed_with_how_to_get_it(self):
        # what a program is given that is configured where set-up has fetched nothing but MuJoCo, which reads the models
        cache = pathlib.Path(os.environ["ASSAY_TEST_CACHE"])
        (self.dir / "cache/engines").mkdir(parents=True)
        for folder in (cache / "engines").glob("mujoco-*"):
            (self.dir / "cache/engines" / folder.name).symlink_to(folder)
        done = subprocess.run(["cmake", "-S", SOURCE, "-B", self.dir / "build", f"-DASSAY_CACHE={self.dir}/cache",
                               "-DASSAY_TESTS=OFF"], capture_output=True, text=True, env=self.env)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = re.findall(r'^\{R"\((.*)\)", R"(?:how)?\((.*?)\)(?:how)?", "(.*)", "(.*)"\},$',
                          (self.dir / "build/src/engines/known_engines.inc").read_text(), re.M)
        known = {name: how for name, how, _, _ in rows}
        set_up = {name: (what, takes) for name, _, what, takes in rows}
        self.assertEqual(set_up["bullet-f64"], ("", ""), "the core is no engine to ask for")
        self.assertEqual(set_up["ode"], ("", ""))
        self.assertEqual(set_up["bullet-f32"], ("bullet-f32", "5 minutes of compiling"))
        self.assertIn("setup/setup.sh", known["bullet-f64"])
        self.assertIn("./assay setup bullet-f32 (", known["bullet-f32"])
        self.assertIn("./assay setup jolt (", known["jolt-f64"])
        self.assertEqual(known["mujoco"], "build the target assay-engine-mujoco")
        self.assertEqual(known["null"], "build the target assay-engine-null")
        # every engine that has a folder of its own is either built or listed
        folders = {path.parent.name for path in (SOURCE / "src/engines").glob("*/engine.[cp]*")} - {"skeleton"}
        for folder in folders:
            self.assertTrue(any(name == folder or name.startswith(f"{folder}-") for name in known), folder)


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

    def test_the_page_of_campaign_keys_is_up_to_date(self):
        page = (SOURCE / "docs/files.md").read_text(encoding="utf-8")
        block = files.keys_block(self.assay("list", "campaign-keys"))
        self.assertEqual(common.updated(page, {"campaign-keys": block}), page, "write it with docs/update.py files")
        for text in ("| `duration_s` | `2` | required |", "| `no_ground` |", "| `iterations` |", "| `rounds` | `24` | 24 |"):
            self.assertIn(text, page)

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
            if model.is_dir():
                shutil.rmtree(model)
            elif model.name != "planar-chain.xml":
                model.unlink()
        program = [str(self.dir / "usr/bin/assay")]
        self.command = lambda *arguments: [*program, *map(str, arguments)]
        self.assertEqual([row["system"] for row in self.assay_json("systems", "--json")["systems"]], ["planar-chain"])


class Check(AssayTest):
    KITE = BALL.replace('name="ball"', 'name="ball" gravcomp="0.5"')

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
        self.use_mishap_engine()
        self.write("ball.xml", BALL)
        text = self.assay("check", "ball.xml")
        self.assertRegex(text, r"(?m)^mishap +refused +1 +mishap-refuse$")
        for fault, how in (("abort", r"SIGABRT"), ("exit", r"ended the\s+process early")):
            self.assertRegex(text, rf"(?m)^mishap +refused +1 +mishap-{fault}-in-check$")
            self.assertRegex(text, rf"(?s)  the model: asking mishap-{fault}-in-check what it does with 'ball'\s+.*?{how}")
        self.assertRegex(text, r"(?m)^mishap +approximated +1 +mishap-inexact$")
        self.assertRegex(text, r"(?m)^mishap +exact +mishap and \d+ more$")
        self.assertRegex(text, r"(?ms)^refused$.*^  body 'ball': give it to somebody else\n    mishap-refuse$.*^approximated$")
        self.assertRegex(text, r"(?m)^  body 'ball': rounded\n    mishap-inexact$")

    def test_items_that_are_alike_are_one(self):
        """One statement for all joints that an engine treats alike, and for all engines that say the same."""
        report = self.assay_json("check", "humanoid", "--json")
        text = self.assay("check", "humanoid")
        exact, table = text.split("exact in all contenders of ", 1)[1].split("\n\nengine ", 1)
        head, *statements = re.split(r"\n\n|\n(?=  \S)", table)
        exact = set(re.split(r",\s+", exact))
        for engine in report["engines"]:
            if engine["engine"] in exact:
                self.assertEqual(engine["verdict"], "exact")
                self.assertEqual([each["engine"] for each in report["engines"]].count(engine["engine"]), 1)
                continue
            counts = [sum(item["fidelity"] == kind for item in engine["findings"]) for kind in ("refused", "approximated")]
            row = rf"(?m)^{engine['engine']} +{engine['verdict']} +" + "".join(f"{n} +" for n in counts if n)
            self.assertRegex(head, row + rf"(all \d|all but|{engine['contenders'][0]}\b)")
        limits = [line for line in statements if re.search(r"\blimit\b.*\bof all \d+ joints|limit of all \d+ joints", line)]
        self.assertTrue(limits, text)
        self.assertIn(f"all {report['model']['hinges']} joints", text)
        self.assertLess(len(text.splitlines()), 120)

    def test_unsupported_element_is_refused_or_left_out_by_name(self):
        self.write("kite.xml", self.KITE)
        self.refused("check", "kite.xml", naming=["gravity compensation", "--drop-unsupported", "lets gravity act"])
        model = self.assay_json("check", "kite.xml", "--drop-unsupported", "--json")["model"]
        self.assertTrue(any("gravity compensation" in note for note in model["notes"]), model["notes"])

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
