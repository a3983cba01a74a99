"""Templates: an engine, a system, measures, a claim and a section of the report are added to a copy of the repository as
docs/extending.md says, and the copy builds and runs. Objects that no addition touches come from the build under test."""

import csv
import filecmp
import io
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess

from harness import PROGRAM, SOURCE, AssayTest, main

BUILD = pathlib.Path(PROGRAM).parent.parent
LEFT_OUT = {".git", ".cache", "build", "results", "web/node_modules"}
CMAKE_CHOICES = ["CMAKE_BUILD_TYPE", "CMAKE_CXX_COMPILER", "CMAKE_CXX_FLAGS", "CMAKE_CXX_FLAGS_DEBUG",
                 "CMAKE_CXX_FLAGS_RELEASE", "CMAKE_UNITY_BUILD", "ASSAY_CACHE", "ASSAY_LTO"]

# What each row of docs/extending.md, "Adding something", asks for: files made of templates, and lines put behind others.
NEW = {
    "an engine": {"src/engines/myengine/engine.cc": "src/engines/skeleton/engine.cc",
                  "src/engines/myengine/README.md": "src/engines/skeleton/README.md",
                  "src/engines/myengine/CMakeLists.txt": "assay_add_engine(NAME myengine SOURCES engine.cc)\n"},
    "a system": {"models/template.xml": "docs/templates/system.xml",
                 "campaigns/template.toml": """name = "template"
contenders = ["mujoco-euler", "mujoco-rk4", "myengine"]
timesteps_ms = [1, 2]
measures = ["template", "template_pairs"]
[[system]]
name = "template"
duration_s = 1
"""},
    "a measure": {"src/measures/template.cc": "docs/templates/measure.cc"},
    "a measure of pairs": {"src/measures/template_pairs.cc": "docs/templates/measure_of_pairs.cc"},
    "a claim": {},
    "a section of the report": {"src/report/template.cc": "docs/templates/section.cc",
                                "web/src/tables/template.ts": "docs/templates/section.ts"},
}
LINES = {
    "an engine": [("src/engines/CMakeLists.txt", r"set\(folders python-host null", " myengine")],
    "a system": [],
    "a measure": [("src/measures/measures.cc", r"EACH\(batch\) *\\\n", "  EACH(template) \\\n"),
                  ("docs/methodology.md", r"(?s).*", "\n**Path** (`template_path`, m): mean distance that the bodies travel.\n")],
    "a measure of pairs": [("src/measures/measures.cc", r"EACH\(template\) *\\\n", "  EACH(template_pairs) \\\n"),
                           ("docs/methodology.md", r"(?s).*", "\n**Apart** (`template_apart`, m): largest distance of two fine-step runs.\n")],
    "a claim": [("campaigns/paper_claims.toml", r"(?s).*", "docs/templates/claim.toml")],
    "a section of the report": [
        ("src/report/CMakeLists.txt", r"add_library\(assay_report STATIC", " template.cc"),
        ("src/report/report.cc", r"namespace assay \{", "\nnlohmann::json template_data(const Store& store);"),
        ("src/report/report.cc", r"json data = \{\{\"format\", kReportFormat\},", '\n          {"template", template_data(store)},'),
        ("web/src/main.ts", r"import \{ gate \} from \"./tables/gate\";", '\nimport { template } from "./tables/template";'),
        ("web/src/main.ts", r"  add\(folded\(\"gate\".*", '\n  add(part("template", "Template", ""), "Template", () => [template(report)]);')],
}

ROWS = {"a measure of pairs": "a measure"}  # of docs/extending.md, where the name is another

# Before the compiler: an object of the list is taken from there, any other is compiled and noted.
LAUNCHER = r"""#!/bin/sh
for word; do
  case $last in -o) object=$word ;; -MF) dependencies=$word ;; esac
  last=$word
done
from=$(awk -F '\t' -v object="$object" '$1 == object {print $2; exit}' "$ASSAY_REUSE")
if [ -n "$from" ]; then
  ln -f "$from" "$object" 2>/dev/null || cp "$from" "$object"
  echo "$object:" >"$dependencies"
else
  echo "$object" >>"$ASSAY_REUSE.compiled"
  exec "$@"
fi
"""


def contents(text):
    """A template's text, or the text itself."""
    return (SOURCE / text).read_text(encoding="utf-8") if re.fullmatch(r"[\w./-]+\.\w+", text) else text


class Templates(AssayTest):
    def setUp(self):
        super().setUp()
        self.copy = self.dir / "assay"
        shutil.copytree(SOURCE, self.copy, symlinks=True, ignore=lambda folder, names: [
            name for name in names if os.path.relpath(os.path.join(folder, name), SOURCE) in LEFT_OUT or name == "__pycache__"])
        (self.copy / "results").mkdir()  # of which the program has this file
        shutil.copy(SOURCE / "results/withdrawn.toml", self.copy / "results")
        (self.copy / "web/node_modules").symlink_to((SOURCE / "web/node_modules").resolve())
        self.build = self.copy / "build"

    def do(self, *command):
        done = subprocess.run([str(part) for part in command], cwd=self.dir, env=self.env, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, f"{command}: {done.stdout[-4000:]}{done.stderr[-4000:]}")
        return done.stdout

    def add(self, thing):
        """The files that the addition made or changed, relative to the repository."""
        touched = set()
        for name, text in NEW[thing].items():
            path = self.copy / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(contents(text).replace('"skeleton"', '"myengine"'), encoding="utf-8")
            touched.add(name)
        for name, behind, text in LINES[thing]:
            before = (self.copy / name).read_text(encoding="utf-8")
            found = re.search(behind, before)
            self.assertIsNotNone(found, f"{name} has nothing like {behind}")
            (self.copy / name).write_text(before[:found.end()] + contents(text) + before[found.end():], encoding="utf-8")
            touched.add(name)
        return touched

    def changed(self):
        """Files of the copy that the repository does not have so."""
        found = set()
        for path in self.copy.rglob("*"):
            name = path.relative_to(self.copy)
            if path.is_file() and not path.is_symlink() and name.parts[0] != "build":
                original = SOURCE / name
                if not original.exists() or not filecmp.cmp(path, original, shallow=False):
                    found.add(str(name))
        return found

    def named(self, thing):
        """The places that docs/extending.md names for it; of a folder in `a/<name>/`, all that is in it."""
        text = (SOURCE / "docs/extending.md").read_text(encoding="utf-8")
        row = re.search(rf"^\| {re.escape(ROWS.get(thing, thing))} \| (.*) \|$", text, re.MULTILINE)
        self.assertIsNotNone(row, f"docs/extending.md does not say how to add {thing}")
        places = re.findall(r"`((?:src|web|models|campaigns|docs)/[^`]*)`", row.group(1))
        places += [f"docs/{link}" for link in re.findall(r"\]\((\w+\.md)\)", row.group(1))]
        return {place: re.escape(place).replace("<name>", r"[\w-]+") + (".*" if place.endswith("/") else "") for place in places}

    def as_original(self, text):
        """What names places in the copy, with those of the build under test."""
        return text.replace(str(self.build), str(BUILD)).replace(str(self.copy), str(SOURCE))

    def reusable(self, touched):
        """{object: object of the build under test} where neither the command nor any file that it reads is another."""
        entries = {}
        for folder in (self.build, BUILD):
            for entry in json.loads((folder / "compile_commands.json").read_text()):
                words = shlex.split(self.as_original(entry["command"]))
                while not re.search(r"(\+\+|g?cc|clang)(-\d+)?$", words[0]):
                    words.pop(0)  # a launcher
                entries.setdefault(words[words.index("-o") + 1], []).append((words, entry["file"]))
        reads = {}
        for line in self.do("ninja", "-C", BUILD, "-t", "deps").splitlines():
            if line.endswith("(VALID)"):
                reads[line.split(":")[0]] = files = []
            elif line.startswith("    "):
                files.append(os.path.normpath(BUILD / line.strip()))
        stale = {}

        def same(file, object_time):
            if file not in stale:
                name, generated = os.path.relpath(file, SOURCE), os.path.relpath(file, BUILD)
                other = self.build / generated
                if not generated.startswith(".."):
                    # The commit is another; what else is generated has to be equal.
                    fine = generated.endswith("build_info.h") or (
                        other.exists() and self.as_original(other.read_text(encoding="utf-8")) == pathlib.Path(file).read_text(encoding="utf-8"))
                    stale[file] = 0 if fine else float("inf")
                else:
                    stale[file] = float("inf") if name in touched else os.stat(file).st_mtime
            return stale[file] <= object_time

        result = {}
        for output, found in entries.items():
            original = BUILD / output
            if len(found) != 2 or found[0][0] != found[1][0] or output not in reads or not original.exists():
                continue
            words, _ = found[0]
            time = original.stat().st_mtime
            if any(str(SOURCE) in word for word in words if word.startswith("-D")):
                continue
            if all(same(file, time) for file in reads[output]):
                result[output] = original
        return result

    def make(self, touched):
        cache = (BUILD / "CMakeCache.txt").read_text()
        choices = [f"-D{name}={value}" for name, value in re.findall(r"^(\w+):\w+=(.*)$", cache, re.MULTILINE) if name in CMAKE_CHOICES]
        launcher = self.dir / "launcher.sh"
        launcher.write_text(LAUNCHER)
        launcher.chmod(0o755)
        reuse = self.dir / "reuse.tsv"
        self.env["ASSAY_REUSE"] = str(reuse)
        self.do("cmake", "-S", self.copy, "-B", self.build, *choices, "-DASSAY_TESTS=OFF", "-DASSAY_BENCHMARKS=OFF",
                f"-DCMAKE_CXX_COMPILER_LAUNCHER={launcher}")
        reuse.write_text("".join(f"{output}\t{original}\n" for output, original in self.reusable(touched).items()))
        self.do("cmake", "--build", self.build, "--target", "assay", "assay-engine-myengine")
        return (self.dir / "reuse.tsv.compiled").read_text().split()

    def test_one_of_each_builds_and_runs(self):
        touched = set()
        for thing in NEW:
            with self.subTest(thing):
                files = self.add(thing)
                touched |= files
                if "measure" in thing:
                    self.assertEqual(len(files), 3)
                places = self.named(thing)
                for file in files:
                    self.assertTrue(any(re.fullmatch(place, file) for place in places.values()),
                                    f"to add {thing} touches {file}, which docs/extending.md does not name")
                for name, place in places.items():
                    self.assertTrue(any(re.fullmatch(place, file) for file in files),
                                    f"docs/extending.md names {name} for {thing}, which needs no change of it")
        self.assertEqual(touched, self.changed())

        compiled = self.make(touched)
        self.assertLess(len(compiled), 25, "an addition touches a header that many files read")
        self.program = str(self.build / "bin/assay")
        self.env["ASSAY_ENGINE_PATH"] = str(BUILD / "engines")
        self.assertIn("myengine", self.contenders())
        self.assertIn("template", [row["system"] for row in self.assay_json("systems", "--json")["systems"]])
        text = self.assay("simulate", "template", "--engine", "myengine", "--timestep", "1", "--duration", "1", "--sample", "500",
                          "--out", "-")
        # without gravity it flies straight on: 3 m/s along x for one second
        self.assertAlmostEqual(float(list(csv.DictReader(io.StringIO(text)))[-1]["x"]), 3, places=9)

        self.assay("run", "template", "--out", "results")
        rows = list(csv.DictReader(io.StringIO(self.assay("export", "results", "--format", "csv"))))
        paths = {(row["contender"], float(row["timestep_ms"])): row for row in rows if row["measure"] == "template_path"}
        self.assertEqual(set(paths), {(name, step) for name in ("mujoco-euler", "mujoco-rk4") for step in (1, 2)})
        for row in paths.values():
            self.assertEqual((row["system"], row["unit"], row["outcome"]), ("template", "m", "ok"))
            self.assertAlmostEqual(float(row["value"]), 5, places=9)  # 3 and 4 m/s across each other

        # The skeleton refuses hinges, so it does not conform and is not scored.
        self.assertEqual({row["outcome"] for row in rows if row["contender"] == "myengine"}, {"unsupported"})
        apart = {row["contender"]: float(row["value"]) for row in rows if row["measure"] == "template_apart"}
        self.assertEqual(set(apart), {"mujoco-euler", "mujoco-rk4"})
        self.assertEqual(apart["mujoco-euler"], apart["mujoco-rk4"])
        self.assertAlmostEqual(apart["mujoco-euler"], 0, places=9)  # nothing acts on the bricks

        verdicts = {claim["number"]: claim["verdict"] for claim in self.assay_json("claims", "results", "--json")}
        self.assertEqual(verdicts[99], "holds")

        self.assay("report", "results")
        page = (self.dir / "results/report.html").read_text()
        self.assertIn('"template":{"mujoco-euler":4,"mujoco-rk4":4,"myengine":4}', page)
        self.assertIn('"label":"Path"', page)
        self.assertRegex(page, r"\$\{\w+\} cells`")


if __name__ == "__main__":
    main()
