"""setup/checks/tidy.py: clang-tidy is asked about what changed since it passed, whoever compiled it."""

import json
import subprocess
import sys

from harness import SOURCE, AssayTest, main

# Instead of clang-tidy: notes what it is asked about, and finds something where the source says so.
CHECKER = r"""#!/bin/sh
[ "$1" = --version ] && exec echo "checker ${VERSION:-1}"
for source; do :; done
echo "${source##*/}" >>"$ASKED"
! grep -H finding "$source"
"""


class Tidy(AssayTest):
    def setUp(self):
        super().setUp()
        self.env["ASKED"] = str(self.dir / "asked")
        self.write("checker", CHECKER).chmod(0o755)
        self.tree = self.dir / "tree"
        subprocess.run(["git", "init", "--quiet", self.tree], check=True)
        self.write("tree/.clang-tidy", "Checks: all\n")
        self.write("tree/src/one.h", "// one\n")
        self.write("tree/src/two.h", '#include "one.h"\n')
        for name, header in (("a", "one.h"), ("b", "two.h"), ("c", "vector")):
            self.write(f"tree/src/{name}.cc", f'#include "{header}"\n')
        self.compile("-O3")

    def compile(self, *several):
        """As two sources in a unit, with a generated file before them, and one by itself, with each of several flags."""
        tree = self.tree
        unit = tree / "build/x/Unity/unity_0_cxx.cxx"
        unit.parent.mkdir(parents=True, exist_ok=True)
        unit.write_text("".join(f'#include "{tree}/src/{name}.cc"\n' for name in "ab"))
        commands = [{"directory": str(tree / "build"), "file": str(file),
                     "command": f"c++ -I{tree}/src {flags} -o {index}.o -c {file}"}
                    for flags in several for index, file in enumerate([unit, tree / "src/c.cc"])]
        (tree / "build/compile_commands.json").write_text(json.dumps(commands))

    def asked(self, status=0, cache="cache"):
        (self.dir / "asked").write_text("")
        tree = self.tree
        done = subprocess.run([sys.executable, SOURCE / "setup/checks/tidy.py", "--root", tree, "--build", tree / "build",
                               "--engines", self.dir / cache, "--clang-tidy", self.dir / "checker",
                               "--passed", tree / "passed.txt"], env=self.env, capture_output=True, text=True)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return sorted((self.dir / "asked").read_text().split())

    def test_only_what_changed_is_checked(self):
        self.assertEqual(self.asked(), ["a.cc", "b.cc", "c.cc"])
        self.assertEqual(self.asked(), [])
        self.write("tree/src/two.h", '#include "one.h"\n// changed\n')
        self.assertEqual(self.asked(), ["b.cc"])
        self.write("tree/src/one.h", "// changed\n")
        self.assertEqual(self.asked(), ["a.cc", "b.cc"])
        for change in (lambda: self.compile("-O2"), lambda: self.write("tree/.clang-tidy", "Checks: more\n"),
                       lambda: self.env.update(VERSION="2")):
            change()
            self.assertEqual(self.asked(), ["a.cc", "b.cc", "c.cc"])

    def test_a_finding_stays_until_it_is_mended(self):
        self.write("tree/src/c.cc", "// finding\n")
        self.assertEqual(self.asked(status=1), ["a.cc", "b.cc", "c.cc"])
        self.assertEqual(self.asked(status=1), ["c.cc"])
        self.write("tree/src/c.cc", "// mended\n")
        self.assertEqual(self.asked(), ["c.cc"])
        # what passed once and has a finding now is not taken for passed
        self.write("tree/src/c.cc", "// finding\n")
        self.assertEqual(self.asked(status=1), ["c.cc"])
        self.assertNotIn("c.cc", (self.dir / "tree/passed.txt").read_text())

    def test_another_place_of_the_clone_changes_nothing(self):
        self.asked()
        self.tree.rename(self.dir / "other")
        self.tree = self.dir / "other"
        self.compile("-O3")
        self.assertEqual(self.asked(), [])

    def test_a_cache_whose_name_begins_as_the_clone_s_is_another_place(self):
        for place in ("cache", "tree-cache"):
            (self.dir / place).mkdir()
            self.compile(f"-I{self.dir / place}/engine")
            asked = self.asked(cache=place)
        self.assertEqual(asked, [])

    def test_an_engine_that_is_not_installed_here_changes_nothing(self):
        """Its sources are those of another engine, compiled in another way."""
        self.compile("-O3", "-DOTHER")
        self.assertEqual(self.asked(), ["a.cc", "b.cc", "c.cc"])
        for several in (["-O3"], ["-O3", "-DOTHER"], ["-DOTHER"]):
            self.compile(*several)
            self.assertEqual(self.asked(), [], several)
        self.compile("-DOTHER")
        self.write("tree/src/c.cc", "// changed\n")
        self.assertEqual(self.asked(), ["c.cc"])
        self.compile("-O3", "-DOTHER")
        self.assertEqual(self.asked(), ["c.cc"])


if __name__ == "__main__":
    main()
