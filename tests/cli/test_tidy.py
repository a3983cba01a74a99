"""setup/tidy.py: clang-tidy is asked about what changed lately, however it is compiled."""

import json
import subprocess
import sys

from harness import SOURCE, AssayTest, main

# Instead of clang-tidy: notes what it is asked about, and finds something where the source says so.
CHECKER = r"""#!/bin/sh
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
        self.write("tree/.gitignore", "/build/\n")
        self.write("tree/src/a.h", "// a\n")
        for name in "abc":
            self.write(f"tree/src/{name}.cc", '#include "a.h"\n')
        # two sources in a unit, one of them by itself, too, with another flag
        unit = self.tree / "build/x/Unity/unity_0_cxx.cxx"
        unit.parent.mkdir(parents=True, exist_ok=True)
        unit.write_text("".join(f'#include "{self.tree}/src/{name}.cc"\n' for name in "ab"))
        commands = [{"directory": str(self.tree / "build"), "file": str(file), "command": f"c++ -I{self.tree}/src {flags} -c {file}"}
                    for file, flags in [(unit, "-O3"), (self.tree / "src/c.cc", "-O3"), (self.tree / "src/c.cc", "-O1")]]
        (self.tree / "build/compile_commands.json").write_text(json.dumps(commands))
        self.commit("2026-01-01T00:00:00")

    def git(self, *arguments, **environment):
        subprocess.run(["git", "-C", self.tree, "-c", "user.name=a", "-c", "user.email=a@b", *arguments], check=True,
                       capture_output=True, env={**self.env, **environment})

    def commit(self, when):
        self.git("add", "-A")
        self.git("commit", "--allow-empty", "-m", "a change", GIT_COMMITTER_DATE=when, GIT_AUTHOR_DATE=when)

    def asked(self, *more, status=0):
        (self.dir / "asked").write_text("")
        done = subprocess.run([sys.executable, SOURCE / "setup/tidy.py", "--root", self.tree, "--build", self.tree / "build",
                               "--clang-tidy", self.dir / "checker", *more], env=self.env, capture_output=True, text=True)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return sorted((self.dir / "asked").read_text().split())

    def test_what_changed_in_the_day_before_the_newest_commit(self):
        self.assertEqual(self.asked(), ["a.cc", "b.cc", "c.cc"])  # nothing is older
        self.write("tree/src/b.cc", "// b\n")
        self.commit("2026-01-03T00:00:00")
        self.assertEqual(self.asked(), ["b.cc"])
        self.commit("2026-01-03T20:00:00")
        self.assertEqual(self.asked(), ["b.cc"])
        self.write("tree/src/a.h", "// changed, not committed\n")
        self.commit("2026-01-05T00:00:00")
        self.write("tree/src/c.cc", "// changed, not committed\n")
        self.assertEqual(self.asked(), ["a.cc", "c.cc"])
        self.assertEqual(self.asked("--all"), ["a.cc", "b.cc", "c.cc"])

    def test_what_changed_since_the_last_release(self):
        self.git("tag", "v1.0")
        self.write("tree/src/b.cc", "// b\n")
        self.commit("2026-01-03T00:00:00")
        self.commit("2026-02-03T00:00:00")
        self.assertEqual(self.asked(), ["b.cc"])

    def test_a_limit_of_time_leaves_the_oldest_changes(self):
        for name, day in [("c", "03T00"), ("a", "03T10"), ("b", "03T20")]:
            self.write(f"tree/src/{name}.cc", "// changed\n")
            self.commit(f"2026-01-{day}:00:00")
        self.assertEqual(self.asked("--seconds", "-1"), [])
        (self.dir / "asked").write_text("")
        self.assertEqual(self.asked("--jobs", "1"), ["a.cc", "b.cc", "c.cc"])
        self.assertEqual((self.dir / "asked").read_text().split(), ["b.cc", "a.cc", "c.cc"])

    def test_a_finding_fails(self):
        self.write("tree/src/c.cc", "// finding\n")
        self.commit("2026-01-03T00:00:00")
        self.assertEqual(self.asked(status=1), ["c.cc"])


if __name__ == "__main__":
    main()
