"""The command line itself: help, version, wrong usage, output that nobody reads."""

import re
import subprocess

from harness import COMMANDS, OLD_COMMANDS, AssayTest, main


class Help(AssayTest):
    def test_program_lists_every_command(self):
        text = self.assay("--help")
        for command in COMMANDS:
            self.assertRegex(text, rf"(?m)^  {command} +\S")
        for hidden in ["worker", "completion", *OLD_COMMANDS]:
            self.assertNotRegex(text, rf"(?m)^  {hidden} ")
        self.assertLessEqual(len(text.splitlines()), 50)

    def test_every_command_has_help_with_examples(self):
        for command in COMMANDS + OLD_COMMANDS:
            with self.subTest(command):
                text = self.assay(command, "--help")
                self.assertIn("Examples:\n", text)
                self.assertEqual(text, self.assay(command, "-h"))
                self.assertEqual(text, self.assay("help", command))
        self.assertEqual(self.assay("help"), self.assay("--help"))
        self.refused("help", "simlate", naming=["unknown command 'simlate'", "did you mean 'simulate'?"])

    def test_examples_use_options_that_exist(self):
        for command in COMMANDS + OLD_COMMANDS:
            text = self.assay(command, "--help")
            options, examples = text.split("Examples:\n")
            lines = [line for line in examples.splitlines() if re.match(r"  \S", line)]
            self.assertTrue(lines, command)
            known = set(re.findall(r"--[a-z-]+", options))
            for line in lines:
                with self.subTest(line):
                    self.assertRegex(line, rf"^  (\S+=\S+ )?assay {command}\b")
                    self.assertLessEqual(set(re.findall(r"--[a-z-]+", line)), known)

    def test_old_names_do_the_same(self):
        for old, new in [(["engines"], ["list"]), (["engines", "--json"], ["list", "engines", "--json"]),
                         (["engines", "--features", "--markdown"], ["list", "engines", "--features", "--markdown"]),
                         (["systems"], ["list", "systems"]), (["systems", "--json"], ["list", "systems", "--json"])]:
            self.assertEqual(self.assay(*old), self.assay(*new), new)
        self.refused("list", "enginse", naming=["'enginse'", "did you mean 'engines'?"])
        self.refused("list", "systems", "--features", naming=["--features is of engines"])

    def test_version_names_the_commit(self):
        self.assertRegex(self.assay("--version"), r"^assay \d+\.\d+\.\d+ \(([0-9a-f]{12}(-dirty)?|unknown)\)\n$")

    def test_no_arguments_show_the_help(self):
        done = self.run_assay()
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertEqual(done.stderr, self.assay("--help"))

    def test_simulate_names_every_control_that_it_takes(self):
        text = " ".join(self.assay("simulate", "--help").split())
        for control in ["passive", "actuators", "hold,natural_frequency=HZ", "0, which is 10 Hz", "random,motion=RAD,seed=N",
                        "sine,amplitude=NM,frequency=HZ,phase_step=RAD", "CSV file of torques"]:
            self.assertIn(control, text)
        common = ["simulate", "planar-chain", "--engine", "null", "--timestep", "1", "--duration", "0.01", "--out", "x.csv"]
        for control in ["hold,natural_frequency=0", "random,motion=0.1,seed=2"]:
            self.assay(*common, "--control", control)
        self.refused(*common, "--control", "quadratic", naming=["'quadratic'", "file,path=torques.csv", "policy,config=policy.toml"])


class WrongUsage(AssayTest):
    def test_unknown_command_gets_the_nearest_name(self):
        self.refused("simlate", naming=["unknown command 'simlate'", "did you mean 'simulate'?"])
        self.refused("zzzzzz", naming=["'zzzzzz'", *COMMANDS])

    def test_unknown_option_gets_the_nearest_name(self):
        for option in ["--timstep", "--timstep=1"]:
            self.refused("simulate", "planar-chain", option, "1", naming=["'--timstep'", "'--timestep'"])
        self.refused("--jason", naming=["'--jason'", "assay --help"])

    def test_missing_and_superfluous_arguments(self):
        self.refused("simulate", naming=["is required", "assay simulate --help"])
        self.refused("simulate", "planar-chain", "--timestep", naming=["--timestep needs a value"])
        self.refused("engines", "--json=yes", naming=["--json takes no value"])
        self.refused("check", "planar-chain", "capsules-27", naming=["'capsules-27'", "assay check --help"])
        self.refused("run", "quick", naming=["--out is required"])
        self.refused("report", naming=["DIR is required"])


class Output(AssayTest):
    def shell(self, line):
        return subprocess.run(["bash", "-c", f"set -o pipefail; {line}"], cwd=self.dir, capture_output=True, text=True,
                              env={**self.env, "A": self.command()[0]}, timeout=100)

    def test_closed_pipe_ends_quietly(self):
        for line in ['"$A" engines --json | head -0', '"$A" systems --json | true', '"$A" --help | true',
                     '"$A" simulate planar-chain --engine mujoco-euler --timestep 1 --duration 100 --out - | head -1']:
            with self.subTest(line):
                done = self.shell(line)
                self.assertEqual(done.stderr, "")
                # killed by SIGPIPE, or done before the pipe was closed
                self.assertIn(done.returncode, (0, 141))

    def test_full_disk_is_a_failure(self):
        for arguments in ["engines --json", "systems", "--help", "--version",
                          "simulate planar-chain --engine mujoco-euler --timestep 1 --duration 1 --out -"]:
            with self.subTest(arguments):
                done = self.shell(f'"$A" {arguments} > /dev/full')
                self.assertEqual(done.returncode, 1)
                self.check_sentence(done.stderr, ["standard output", "No space left"])


if __name__ == "__main__":
    main()
