"""`assay completion`: what a shell offers."""

import re
import subprocess

from harness import COMMANDS, PROGRAM, AssayTest, main


class Completion(AssayTest):
    def offers(self, *words):
        """The candidates for the last of `words`."""
        script = ('source <("$1" completion bash); COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _assay; '
                  '[[ ${#COMPREPLY[@]} -eq 0 ]] || printf "%s\\n" "${COMPREPLY[@]}"; '
                  '[[ -z ${ASSAY_NO_BUILD+set} ]]')
        done = subprocess.run(["bash", "-c", script, "bash", PROGRAM, *words], cwd=self.dir, env=self.env, capture_output=True, text=True, timeout=60)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout.split()

    def test_commands(self):
        self.assertEqual(sorted(self.offers("")), sorted([*COMMANDS, "--help", "--version"]))
        self.assertEqual(self.offers("sim"), ["simulate"])

    def test_options_are_those_of_the_help(self):
        options = re.findall(r"(?m)^  (?:-h,)?(--[\w-]+)", self.assay("simulate", "--help"))
        self.assertLess({"--help", "--engine", "--drop-unsupported"}, set(options))
        self.assertEqual(sorted(self.offers("simulate", "--")), sorted(options))
        self.assertEqual(self.offers("run", "x.toml", "--sh"), ["--shard"])

    def test_names(self):
        self.assertEqual(self.offers("check", "planar"), ["planar-chain"])
        self.assertEqual(self.offers("simulate", "planar-chain", "--engine", ""), self.contenders())
        self.assertIn("free-fall", self.offers("conformance", "--test", "free"))
        self.assertEqual(self.offers("export", "results", "--format", ""), ["csv", "json"])
        self.assertEqual(self.offers("compare", "a", "b", "--format", ""), ["markdown", "json", "csv"])
        self.assertEqual(self.offers("list", ""), ["engines", "systems", "campaign-keys"])
        self.assertIn("hold", self.offers("simulate", "planar-chain", "--control", ""))
        self.assertEqual(self.offers("simulate", "planar-chain", "--timestep", ""), [])

    def test_every_option_is_offered(self):
        for command in COMMANDS:
            shown = set(re.findall(r"(?m)^  (?:-\w,)?(--[a-z-]+)", self.assay(command, "--help").split("Examples:")[0]))
            self.assertEqual(set(self.offers(command, "--")), shown, command)

    def test_files(self):
        self.write("my robot.xml", "")
        self.write("mine.toml", "")
        self.assertEqual(self.offers("run", "mi"), ["mine.toml"])
        self.assertEqual(" ".join(self.offers("check", "my")), "my robot.xml")


if __name__ == "__main__":
    main()
