"""./assay: it builds what changed, starts at once when nothing did, and does not wait behind a build that is running.

A small clone stands for the real one: its set-up does nothing and its cmake writes a program of two lines.
"""

import fcntl
import os
import pathlib
import re
import shutil
import subprocess

from harness import SOURCE, AssayTest, main

CMAKE = r"""#!/bin/bash
if [[ $1 == --build ]]; then
  echo built >>"${CLONE}/builds"
  mkdir -p "${CLONE}/build/release/bin" "${CLONE}/build/release/engines"
  rm -f "${CLONE}/build/release/bin/assay"
  printf '#!/bin/bash\necho "program of $(cat "%s/src/source") with" "$@"\n' "${CLONE}" >"${CLONE}/build/release/bin/assay"
  sed -i "s|\$(cat .*)|$(cat "${CLONE}/src/source")|" "${CLONE}/build/release/bin/assay"
  chmod +x "${CLONE}/build/release/bin/assay"
fi
"""
SETUP = """#!/bin/bash
[[ $# -eq 0 ]] || echo "set-up of $*" >&2
echo "${ENGINE}" >"${CLONE}/build/engines.txt"
mkdir -p "${ENGINE}"
"""


class Launcher(AssayTest):
    def setUp(self):
        super().setUp()
        self.clone = self.dir / "clone"
        for name in ["assay", "setup/common.sh", "setup/build.sh"]:
            (self.clone / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(SOURCE / name, self.clone / name)
        for name, text in [("CMakeLists.txt", ""), ("CMakePresets.json", ""), ("cmake/x", ""), ("setup/setup.sh", SETUP),
                           ("bin/cmake", CMAKE)]:
            path = self.write(f"clone/{name}", text)
            path.chmod(0o755)
        self.engine = self.dir / "cache/assay/engines/toy-1"
        self.env.update(CLONE=str(self.clone), ENGINE=str(self.engine), PATH=f"{self.clone}/bin:{os.environ['PATH']}")
        self.source("one")

    def source(self, text):
        self.write("clone/src/source", text)

    def built(self):
        path = self.clone / "builds"
        return len(path.read_text().splitlines()) if path.exists() else 0

    def start(self, *arguments, **env):
        return subprocess.Popen([self.clone / "assay", *arguments], env={**self.env, **env}, cwd=self.dir, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def launch(self, *arguments, **env):
        """Standard output and the lines on standard error of an ./assay that succeeds."""
        run = self.start(*arguments, **env)
        out, err = run.communicate(timeout=60)
        self.assertEqual(run.returncode, 0, err)
        return out.strip(), err.splitlines()

    def another_build(self):
        """Takes the lock as another ./assay or ./test does; closing the file gives it back."""
        lock = open(self.clone / "build/lock", "a")
        self.addCleanup(lock.close)
        fcntl.flock(lock, fcntl.LOCK_EX)
        return lock

    def test_builds_what_changed_and_nothing_else(self):
        self.assertEqual(self.launch("a", "b c")[0], "program of one with a b c")
        self.assertEqual(self.built(), 1)
        self.assertEqual(self.launch("again"), ("program of one with again", []))
        self.assertEqual(self.built(), 1)
        self.source("two")
        self.assertEqual(self.launch()[0], "program of two with")
        self.assertEqual(self.built(), 2)
        shutil.rmtree(self.engine)
        self.launch()
        self.assertEqual(self.built(), 3, "an engine that went is set up again")

    def test_runs_what_is_built_while_another_build_runs(self):
        self.launch()
        self.source("two")
        # the other build has a program half written
        half = self.clone / "build/release/bin/assay"
        half.unlink()
        half.write_text("#!/bin/bash\necho half")
        with self.another_build():
            out, said = self.launch("x")
            self.assertEqual(out, "program of one with x")
            self.assertEqual(len(said), 1)
            self.assertRegex(said[0], "^assay: .*another build is running.*older than the sources.*ASSAY_WAIT=1")
            self.assertEqual(self.built(), 1)
        self.assertEqual(self.launch("x")[0], "program of two with x")

    def test_says_nothing_of_another_build_when_it_is_up_to_date(self):
        self.launch()
        with self.another_build():
            self.assertEqual(self.launch("x"), ("program of one with x", []))

    def test_waits_and_shows_progress_when_asked_to_or_nothing_is_built(self):
        for wait in ["", "1"]:
            with self.subTest(wait=wait):
                (self.clone / "build/logs").mkdir(parents=True, exist_ok=True)
                lock = self.another_build()
                self.write("clone/build/phase", "building the release build\n")
                self.write("clone/build/logs/build.log", "[1/20] Building x\n[9/20] Linking y [z]\n")
                run = self.start("x", ASSAY_WAIT=wait)
                self.assertEqual(run.stderr.readline(), "assay: waiting for another set-up or build of this clone\n")
                self.assertEqual(run.stderr.readline(), "assay: waiting: building the release build (40 %)\n")
                built = self.built()
                lock.close()
                out, _ = run.communicate(timeout=60)
                self.assertEqual((run.returncode, self.built()), (0, built + 1))
                self.source("two")
        self.assertEqual(out, "program of two with x\n")

    def test_program_that_runs_keeps_its_folder(self):
        self.launch()
        folder = (self.clone / "build/product").resolve()
        # what a campaign does: it starts workers from the folder of its own program
        shutil.copy(shutil.which("sleep"), folder / "bin/campaign")
        campaign = subprocess.Popen([folder / "bin/campaign", "60"])
        self.addCleanup(campaign.wait)
        self.addCleanup(campaign.kill)
        for text in ["two", "three"]:
            self.source(text)
            self.launch()
        self.assertTrue((folder / "bin/assay").exists())
        campaign.kill()
        campaign.wait()
        self.source("four")
        self.assertEqual(self.launch()[0], "program of four with")
        self.assertEqual([path.resolve() for path in (self.clone / "build").glob("product.*")],
                         [(self.clone / "build/product").resolve()])

    def test_engines_that_a_campaign_names_are_set_up_before_it_starts_again(self):
        self.launch()
        out, said = self.launch("run", "x.toml", ASSAY_SET_UP="toy joy")
        self.assertEqual(out, "program of one with run x.toml")
        self.assertIn("set-up of --engines toy joy", said)

    def test_without_a_build_it_says_so(self):
        run = self.start(ASSAY_NO_BUILD="1")
        self.assertIn("not built: run ./assay without ASSAY_NO_BUILD", run.communicate(timeout=60)[1])
        self.assertEqual(run.returncode, 1)


CAMPAIGN = """
name = "two"
contenders = ["null", "drake-sap", "genesis"]
timesteps_ms = [1]
reference_ms = 1
[[system]]
name = "planar-chain"
duration_s = 0.1
measures = ["raw_speed"]
timing_ms = [1]
"""


class Wanted(AssayTest):
    """What a program asks of the launcher that it was started by."""

    def run_campaign(self, *options, started_by_launcher=True, **env):
        launcher = self.write("launcher", '#!/bin/bash\necho "set up: ${ASSAY_SET_UP}; then: $*"\n')
        launcher.chmod(0o755)
        self.write("two.toml", CAMPAIGN)
        pid = "$$" if started_by_launcher else "1"
        command = f'ASSAY_LAUNCHER="{pid}:{launcher}" exec "{os.environ["ASSAY_PROGRAM"]}" "$@"'
        return subprocess.run(["bash", "-c", command, "-", "run", "two.toml", "--out", "results", "--references", "off", *options],
                              env={**self.env, **env}, cwd=self.dir, text=True, capture_output=True, timeout=120, check=False)

    def setUp(self):
        super().setUp()
        absent = {row["engine"] for row in self.assay_json("engines", "--json")["absent"]}
        if not {"drake", "genesis"} <= absent:
            self.skipTest("drake or genesis is set up here")

    def test_engines_that_are_absent_are_asked_for_with_what_they_take(self):
        run = self.run_campaign()
        self.assertEqual(run.stdout, "set up: drake genesis; then: run two.toml --out results --references off\n")
        self.assertRegex(run.stderr, r"'two' has contenders of engines that are not set up: drake \(\d+ MB\), genesis \([\d.]+ GB\); "
                         "they are set up first")
        self.assertFalse((self.dir / "results").exists())

    def test_it_goes_on_without_them(self):
        for options, how in [(["--no-set-up"], {}), ([], {"ASSAY_SET_UP_TRIED": "1"}), ([], {"started_by_launcher": False})]:
            with self.subTest(options=options, how=how):
                run = self.run_campaign(*options, **how)
                self.assertEqual(run.returncode, 0, run.stderr)
                self.assertIn("left out: contender 'genesis' is left out: engine 'genesis' is absent", " ".join(run.stdout.split()))


RECIPE = r"""
mkdir -p "${out}/toy-1"
echo "${flags}" >"${out}/toy-1/flags"
echo made >>"${COUNT}"
sleep 0.5
[[ ! -e ${COUNT}.slow ]] || sleep 10.5
[[ ! -e ${COUNT}.fail ]]
"""


class SetUp(AssayTest):
    """Clones with one engine, whose recipe is a shell script, and one cache."""

    def setUp(self):
        super().setUp()
        self.count = self.dir / "count"
        self.env.update(COUNT=str(self.count), ASSAY_SKIP_APT="1", ASSAY_CACHE=str(self.dir / "kept"))
        self.clones = [self.new_clone("one"), self.new_clone("two")]

    def new_clone(self, name):
        clone = self.dir / name
        shutil.copytree(SOURCE / "setup", clone / "setup")
        # hundreds of MB that say nothing about engines
        (clone / "setup/pip/libraries.txt").write_text("# none\n")
        self.write(f"{name}/src/engines/toy/apt-packages.txt", "")
        self.write(f"{name}/src/engines/toy/recipe/build.sh", RECIPE)
        return clone

    def start(self, clone, *arguments):
        return subprocess.Popen([clone / "setup/setup.sh", *arguments], env=self.env, cwd=self.dir, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def set_up(self, clone, *arguments):
        run = self.start(clone, *arguments)
        said = run.communicate(timeout=60)[1]
        self.assertEqual(run.returncode, 0, said)
        return said

    def made(self):
        return len(self.count.read_text().splitlines()) if self.count.exists() else 0

    def engines(self):
        return sorted(path.name for path in (self.dir / "kept/engines").iterdir() if path.is_dir())

    def folder(self, clone, **env):
        return subprocess.run(["bash", "-c", "root=$1; source $1/setup/common.sh; engine_folder toy ${BUILD:-}", "-", clone],
                              env={**self.env, **env}, text=True, capture_output=True, check=True).stdout.strip()

    def test_clones_at_once_make_an_engine_once(self):
        runs = [self.start(clone) for clone in self.clones]
        said = [run.communicate(timeout=60)[1] for run in runs]
        self.assertEqual([run.returncode for run in runs], [0, 0], said)
        self.assertEqual(self.made(), 1)
        self.assertEqual(self.set_up(self.clones[0]), "", "nothing is left to do or to say")
        lists = {(clone / "build/engines.txt").read_text().strip() for clone in self.clones}
        self.assertEqual(lists, {self.folder(self.clones[0])})
        self.assertTrue((pathlib.Path(lists.pop()) / "toy-1/flags").read_text().startswith("-O3"))

    def test_a_build_is_made_on_demand_and_with_its_flags(self):
        clone = self.clones[0]
        self.write("one/src/engines/toy/builds.txt", "v3\n")
        self.set_up(clone)
        self.assertEqual(self.made(), 1)
        self.set_up(clone, "--builds", "v3")
        self.assertEqual(self.made(), 2)
        both = (clone / "build/engines.txt").read_text().split()
        self.assertEqual(len(both), 2)
        flags = [(pathlib.Path(folder) / "toy-1/flags").read_text() for folder in both]
        self.assertNotIn("-march", flags[0])
        self.assertIn("-march=x86-64-v3", flags[1])
        self.assertTrue(flags[1].startswith(flags[0].strip()))
        self.assertEqual(self.set_up(clone, "--builds", "v3"), "", "nothing is left to do or to say")
        for arguments, said in [(["--builds", "v9"], "there is no build 'v9' to make: setup/builds.txt has v3"),
                                (["--builds"], "--builds needs the name of a build")]:
            run = self.start(clone, *arguments)
            self.assertIn(said, run.communicate(timeout=60)[1])
            self.assertEqual(run.returncode, 2)
        self.assertEqual(both[1], self.folder(clone, BUILD="v3"))

    def test_an_engine_on_request_is_made_when_it_is_named(self):
        clone = self.clones[0]
        self.write("one/src/engines/toy/about.toml", 'set_up = "request"\nminutes = 1\n')
        self.set_up(clone)
        self.assertEqual((self.made(), (clone / "build/engines.txt").read_text()), (0, ""))
        for arguments in (["toy"], ["all"]):
            self.assertIn("ready: toy", self.set_up(clone, "--engines", *arguments))
            self.assertEqual(self.made(), 1)
        self.assertEqual(self.set_up(clone), "", "nothing is left to do or to say")
        self.assertEqual((clone / "build/engines.txt").read_text().split(), [self.folder(clone)])
        for arguments, said in [([], "name the engines to set up, or all of them: toy all"),
                                (["toy", "joy"], "unknown engine 'joy': the engines that are set up on demand are toy, or all")]:
            run = self.start(clone, "--engines", *arguments)
            self.assertIn(said, run.communicate(timeout=60)[1])
            self.assertEqual(run.returncode, 2)

    def test_progress_that_ends_as_it_begins_says_nothing(self):
        script = (SOURCE / "setup/setup.sh").read_text(encoding="utf-8")
        functions = re.search(r"^start_progress\(\) \{\n.*?^trap end_progress EXIT\n", script, re.MULTILINE | re.DOTALL)[0]
        program = "set -euo pipefail\n" + functions + "for i in {1..20}; do start_progress work; end_progress; /bin/true; done"
        done = subprocess.run(["bash", "-c", program], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""))

    def test_other_recipe_is_another_piece(self):
        one, two = self.clones
        self.set_up(one)
        self.write("two/src/engines/toy/recipe/pins.txt", "other pins")
        self.set_up(two)
        self.assertEqual((self.made(), len(self.engines())), (2, 2))
        for clone in self.clones:
            self.assertEqual(self.set_up(clone), "")

    def test_key_is_that_of_recipe_flags_and_compiler(self):
        one, two = self.clones
        key = self.folder(one)
        self.assertEqual(key, self.folder(two))
        for clone, names in [(one, "Ab"), (two, "bA")]:
            for name in names:
                self.write(f"{clone.name}/src/engines/toy/recipe/{name}", name)
        self.assertEqual(self.folder(one), self.folder(two))
        self.assertNotEqual(self.folder(one), key)
        key = self.folder(one)
        compiler = self.write("other-c++", "#!/bin/sh\necho 'c++ (other) 1.0'\n")
        compiler.chmod(0o755)
        self.assertNotEqual(self.folder(one, CXX=str(compiler)), key)
        with open(one / "setup/engine_flags.txt", "a") as flags:
            flags.write("-march=native\n")
        self.assertNotEqual(self.folder(one), key)

    def test_recipe_that_fails_leaves_the_others_and_nothing_that_passes_for_done(self):
        clone = self.clones[0]
        self.write("count.fail", "")
        self.write("one/src/engines/other/recipe/build.sh", 'mkdir -p "${out}/other-1"\n')
        said = self.set_up(clone)
        self.assertIn("going on without the engine toy: ./assay setup toy tries it again", said)
        self.assertFalse(os.path.exists(self.folder(clone)))
        self.assertEqual([name.split("-")[0] for name in self.engines() if not name.endswith(".part")], ["other"])
        # who asks for it is told
        self.write("one/src/engines/toy/about.toml", 'set_up = "request"\nminutes = 1\n')
        run = self.start(clone, "--engines", "toy")
        self.assertIn("the engine toy could not be set up", run.communicate(timeout=60)[1])
        self.assertEqual(run.returncode, 1)
        (self.dir / "count.fail").unlink()
        self.set_up(clone, "--engines", "toy")
        self.assertEqual(self.made(), 3)

    def test_long_work_says_how_far_it_is(self):
        self.write("count.slow", "")
        self.assertRegex(self.set_up(self.clones[0]), r"assay: set-up \d of 3, about a minute left \(0:10\)")

    def test_prune_removes_what_was_not_used_for_long(self):
        self.set_up(self.clones[0])
        old = self.dir / "kept/engines/old-0"
        old.mkdir()
        os.utime(old, (0, 0))
        self.assertEqual(self.set_up(self.clones[0], "--prune").splitlines(), ["assay setup: removing engines/old-0"])
        self.assertEqual([self.folder(self.clones[0])], [str(self.dir / "kept/engines" / name) for name in self.engines()])

    def test_what_a_machine_lacks_is_one_sentence_before_any_work(self):
        clone = self.clones[0]
        for name, text in [("df", "#!/bin/sh\necho head; echo /dev/x 1 1 51200 99% /\n"), ("old-c++", "#!/bin/sh\nexit 1\n")]:
            self.write(f"bin/{name}", text).chmod(0o755)
        with_df = {"PATH": f"{self.dir}/bin:{self.env['PATH']}"}
        for env, said in [
                (with_df, f"the set-up and the build need some 2 GB in '{clone}', where 50 MB are left"),
                ({"CXX": "none-c++"}, "there is no compiler 'none-c++': install g++ 12 or newer"),
                ({"CXX": f"{self.dir}/bin/old-c++"}, "lacks parts of C++20: install g++ 12 or newer")]:
            run = subprocess.run([clone / "setup/setup.sh"], env={**self.env, **env}, cwd=self.dir, text=True, capture_output=True)
            self.assertEqual(run.returncode, 1, run.stderr)
            self.assertIn(said, run.stderr)
            self.assertEqual(len(run.stderr.splitlines()), 1, run.stderr)
        self.assertEqual(self.made(), 0)

    def test_no_place_for_the_cache_is_one_sentence(self):
        for home, expected in [("", "HOME, XDG_CACHE_HOME and ASSAY_CACHE are all unset"), ("/proc/none", "'/proc/none/.cache/assay'")]:
            with self.subTest(home=home):
                self.env.update(HOME=home, XDG_CACHE_HOME="", ASSAY_CACHE="")
                run = self.start(self.clones[0])
                said = run.communicate(timeout=60)[1]
                self.assertEqual((run.returncode, len(said.splitlines())), (1, 1), said)
                self.assertIn(expected, said)
                self.assertIn("set ASSAY_CACHE to", said)

    def test_caches_place(self):
        place = "root=$1; source $1/setup/common.sh; echo $cache"
        for env, expected in [({"ASSAY_CACHE": "/a", "XDG_CACHE_HOME": "/x", "HOME": "/h"}, "/a"),
                              ({"XDG_CACHE_HOME": "/x", "HOME": "/h"}, "/x/assay"), ({"HOME": "/h"}, "/h/.cache/assay")]:
            said = subprocess.run(["bash", "-c", place, "-", self.clones[0]], env={"PATH": os.environ["PATH"], **env},
                                  text=True, capture_output=True, check=True).stdout
            self.assertEqual(said, expected + "\n")


if __name__ == "__main__":
    main()
