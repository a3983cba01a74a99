"""Adapters in Python: the example of docs/extending.md as it stands there, what goes wrong in bad ones, and what the
host costs."""

import contextlib
import csv
import importlib.util
import io
import json
import os
import pathlib
import random
import re
import shutil
import sqlite3
import subprocess
import sys
import types
import unittest

from harness import SOURCE, AssayTest, campaign, main

ENVIRONMENT = os.environ.get("ASSAY_TEST_PYTHON", "")

# The example's simulation with one fault, on the system of the campaign alone: the conformance suite passes.
BAD = """
import os, sys
import numpy


class Faulty(Simulation):
    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.steps = 0


class Raises(Faulty):
    def advance(self, count):
        self.fail()

    def fail(self):
        raise ValueError("the third link is loose")


class Gives(Faulty):
    answers = {}

    def advance(self, count):
        super().advance(count)
        self.steps += count

    def read_state(self):
        return {**super().read_state(), **(self.answers if self.steps else {})}


class Shape(Gives):
    answers = {"position": numpy.zeros(4)}


class Type(Gives):
    answers = {"velocity": numpy.zeros(5, dtype=numpy.float32)}


class Nothing(Faulty):
    def read_state(self):
        return None


class NotANumber(Gives):
    answers = {"position": numpy.full(5, numpy.nan)}


class Forks(Faulty):
    def advance(self, count):
        if os.fork() == 0:
            super().advance(count)


class Exits(Faulty):
    def advance(self, count):
        sys.exit(3)


class Ends(Faulty):
    def advance(self, count):
        os._exit(0)


class Fails(Faulty):
    def advance(self, count):
        raise assay.EngineFailure("no solution after 50 iterations")
"""
FAULTS = {  # class: what the stored outcome and reason say
    "Raises": ("crashed", r"ValueError: the third link is loose \[.*:\d+ in advance > .*:\d+ in fail\]"),
    "Shape": ("crashed", r"'position' of shape \(4,\): the model needs \(5,\)"),
    "Type": ("crashed", r"'velocity' with elements of type 'f': give float64"),
    "Nothing": ("crashed", r"read_state\(\) gave a NoneType"),
    "NotANumber": ("diverged", r"non-finite"),
    "Forks": ("crashed", r"must not fork.*in advance"),
    "Exits": ("crashed", r"SystemExit: 3 \[.*in advance\]"),
    "Ends": ("crashed", r"exit"),
    "Fails": ("diverged", r"no solution after 50 iterations"),
}

# Does nothing; `cost` compares a call from the host with none.
EMPTY = """
import assay_adapter as assay


class Engine(assay.Engine):
    environment = "my-environment"

    def contenders(self):
        return [assay.Contender(name="empty", summary="does nothing")]

    def capabilities(self, settings):
        return assay.Capabilities(integrator="none", order=1)

    def create(self, model, state, settings):
        return Simulation(state)


class Simulation:
    def __init__(self, state):
        self.state = {"position": state.position, "velocity": state.velocity, "bodies": state.bodies}

    def advance(self, count):
        pass

    def read_state(self):
        return self.state
"""


ON_DEMAND = {"drake": "drake-sap", "dartpy": "dartpy", "mujoco-warp": "mujoco-warp",
             "newton": "newton-steel", "mjx": "mjx", "genesis": "genesis", "sapien": "sapien-tgs",
             "superdex": "superdex"}  # engine: one of its contenders

# the same equations and integrator in C++, the largest difference of positions after 250 steps of the chain, m, and precision
SAME_AS = {"drake-sap": ("mujoco-euler", 1e-9, "double"), "dartpy": ("dart", 1e-12, "double"),
           "mujoco-warp": ("mujoco-euler", 2e-6, "single"), "newton-featherstone": ("mujoco-euler", 2e-6, "single"),
           "newton-steel": ("mujoco-euler", 2e-6, "single"), "newton-mujoco-rk4": ("mujoco-rk4", 2e-6, "single"),
           "mjx": ("mujoco-euler", 1e-12, "double"), "mjx-rk4": ("mujoco-rk4", 1e-12, "double"),
           "mjx-implicitfast": ("mujoco-implicitfast", 1e-12, "double"), "mjx-f32": ("mujoco-euler", 2e-6, "single"),
           "sapien-pgs": ("mujoco-euler", 2e-6, "single"), "sapien-tgs": ("mujoco-euler", 4e-6, "single")}

HINGES_ONLY = ("pendulum-period", "planar-chain", "spatial-chain", "restart", "torque-for-one-step", "constant-torque",
               "declared-features")


def short_example():
    page = (SOURCE / "docs/extending.md").read_text(encoding="utf-8")
    return re.search(r"## In Python\n.*?```python\n(.*?)```", page, re.DOTALL)[1]


def example():
    return (SOURCE / "examples/python-adapter/assay-engine-my-mujoco.py").read_text(encoding="utf-8")


class PythonTest(AssayTest):
    def setUp(self):
        super().setUp()
        if not os.path.isdir(ENVIRONMENT):
            self.skipTest(f"no environment '{ENVIRONMENT}': setup/setup.sh --tests makes it")
        self.engines = self.dir / "engines"
        self.engines.mkdir()
        (self.engines / "my-environment").symlink_to(ENVIRONMENT)
        self.env["ASSAY_ENGINE_PATH"] = str(self.engines)

    def adapter(self, name, text):
        (self.engines / f"assay-engine-{name}.py").write_text(text, encoding="utf-8")

    def absent(self):
        return {row["engine"]: row["reason"] for row in self.assay_json("engines", "--json")["absent"]}


class Example(PythonTest):
    def statuses(self, *arguments):
        done = self.run_assay("conformance", *arguments, "--json")
        return {each["test"]: each["status"] for each in json.loads(done.stdout)["contenders"][0]["results"]}

    def test_the_short_one_of_the_page(self):
        text = short_example()
        self.assertLess(len(text.splitlines()), 50)
        self.adapter("my-chains", text)
        tests = [part for test in HINGES_ONLY for part in ("--test", test)]
        self.assertEqual(self.statuses("my-chains", *tests), {test: "pass" for test in HINGES_ONLY})
        # what it has not, it refuses
        self.assertEqual(self.statuses("my-chains", "--test", "free-fall", "--test", "resting-height"),
                         {"free-fall": "fail", "resting-height": "not-applicable"})

    def test_it_passes_the_conformance_suite(self):
        printed = self.follow_example("python-adapter", {"my-environment": ENVIRONMENT})
        self.assertRegex(printed, r"my-mujoco\b.*\n")
        self.adapter("my-mujoco", example())
        listed = {row["contender"]: row for row in self.assay_json("engines", "--json")["contenders"]}
        self.assertEqual(listed["my-mujoco"]["version"], "4.0.1")
        status = self.statuses("my-mujoco")
        self.assertLessEqual(set(status.values()), {"pass", "not-applicable"}, status)
        for test in ("readback", "planar-chain", "oblique-trees", "torque-for-one-step", "batches", "restart"):
            self.assertEqual(status[test], "pass", test)

    def test_a_search_begins_with_engines_that_start_at_once(self):
        """An engine in Python takes seconds to start: the first answer must not wait for it, and it has its turn after that."""
        self.adapter("my-mujoco", example())
        done = self.run_assay("run", "planar-chain", "--minutes", "2", "--error", "50mm", "--contenders", "mujoco-euler,my-mujoco",
                              "--out", "found", "--progress", "text")
        self.assertEqual(done.returncode, 0, done.stderr)
        told = done.stderr
        first, answer, later = (told.find(text) for text in (
            "2 contenders take part; first 1 of them", ": mujoco-euler at ", "my-mujoco at 1 ms, which takes longer to start"))
        self.assertTrue(0 <= first < answer < later, told)
        with contextlib.closing(sqlite3.connect(self.dir / "found/assay.sqlite")) as db:
            measured = {name for name, in db.execute("SELECT DISTINCT contender FROM cells WHERE outcome = 'ok'")}
        self.assertEqual(measured, {"mujoco-euler", "my-mujoco"})

    def test_it_is_the_engine_itself(self):
        self.adapter("my-mujoco", example())

        def run(contender):
            text = self.assay("simulate", "planar-chain", "--engine", contender, "--contacts", "off", "--timestep", "1",
                              "--duration", "0.25", "--sample", "50", "--out", "-")
            return [[float(value) for key, value in row.items() if key != "body"]
                    for row in csv.DictReader(io.StringIO(text))]

        for mine, native in zip(run("my-mujoco"), run("mujoco-euler"), strict=True):
            for a, b in zip(mine, native, strict=True):
                self.assertAlmostEqual(a, b, delta=1e-12)

    def test_what_it_does_not_declare_is_refused(self):
        self.adapter("my-mujoco", example())
        verdicts = json.dumps([verdict for verdict in self.assay_json("check", "humanoid", "--json")["engines"]
                               if verdict["engine"] == "my-mujoco"])
        for said in ("has no joint limits", "has no contacts"):
            self.assertIn(said, verdicts)


class Faults(PythonTest):
    def test_each_is_an_outcome_with_its_reason(self):
        # on the campaign's system alone, so that the suite passes
        text = example().replace("return Simulation(model, state, settings.timestep)",
                                 "kind = FAULT() if model.name == 'planar-chain' else Simulation\n"
                                 "        return kind(model, state, settings.timestep)")
        self.assertIn("FAULT()", text)
        for fault in FAULTS:
            mine = text.replace("my-mujoco", f"bad-{fault.lower()}")
            mine += f"\n\ndef FAULT():\n    import bad_simulations\n    return bad_simulations.{fault}\n"
            self.adapter(f"bad-{fault.lower()}", mine)
        simulation = text[text.index("class Simulation"):]
        (self.engines / "bad_simulations.py").write_text("import assay_adapter as assay\n" + simulation + BAD)
        contenders = [f"bad-{fault.lower()}" for fault in FAULTS]
        self.write("bad.toml", campaign("bad", [1], ["truth"], contenders=contenders, duration_s=0.016))
        self.assay("run", "bad.toml", "--out", "results")
        with contextlib.closing(sqlite3.connect(self.dir / "results/assay.sqlite")) as db:
            stored = {row[0]: row[1:] for row in db.execute("SELECT contender, outcome, reason FROM cells")}
        for fault, (outcome, reason) in FAULTS.items():
            found = stored[f"bad-{fault.lower()}"]
            self.assertEqual(found[0], outcome, (fault, found))
            self.assertRegex(found[1], reason)

    def test_the_rest_is_named(self):
        self.adapter("importer", "import numpy\n" + EMPTY)
        self.adapter("broken", EMPTY.replace("order=1", "ordr=1"))
        self.adapter("unknown", EMPTY.replace("order=1", "order=1, features={'wheels': assay.exact()}"))
        self.adapter("syntax", "class Engine(:\n")
        absent = self.absent()
        self.assertRegex(absent["importer"], r"imports 'numpy' when it is loaded: import it inside create\(\)")
        self.assertIn("Capabilities has no 'ordr'", absent["broken"])
        self.assertIn("there is no feature 'wheels'", absent["unknown"])
        self.assertIn("SyntaxError", absent["syntax"])
        self.adapter("homeless", EMPTY.replace("my-environment", "nowhere").replace('"empty"', '"homeless"'))
        done = self.run_assay("simulate", "planar-chain", "--engine", "homeless", "--contacts", "off", "--timestep", 1,
                              "--duration", 0.01, "--out", "-")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"the Python environment '.*/nowhere' has no '.*site-packages': make it again")

    def test_an_engine_that_is_not_installed_is_named_with_its_command(self):
        absent = self.absent()
        for engine, contender in {**ON_DEMAND, "physx56": "physx56-d6-pgs"}.items():  # the last one is none of Python's
            if engine not in absent:
                continue  # installed here
            self.assertIn(f"./assay setup {engine}", absent[engine].replace("run ./", "./"))
            done = self.run_assay("simulate", "planar-chain", "--engine", contender, "--timestep", 1, "--duration", 1,
                                  "--out", "-")
            self.assertEqual(done.returncode, 2)
            self.assertIn(f"./assay setup {engine}", done.stderr)


class Declarations(PythonTest):
    """What adapters declare is kept, so that a process that only lists or names them has no interpreter."""

    def listed(self, **variables):
        env, self.env = self.env, {**self.env, "ASSAY_CACHE": str(self.dir / "cache"), **variables}
        try:
            done = self.run_assay("engines", "--json")
        finally:
            self.env = env
        self.assertEqual(done.returncode, 0, done.stderr)
        listed = json.loads(done.stdout)
        return {row["contender"]: row["summary"] for row in listed["contenders"]}, done.stderr

    def test_listing_starts_no_interpreter(self):
        self.adapter("empty", EMPTY)
        for _ in range(2):  # the first time in a process of its own, which ends
            listed, loaded = self.listed(LD_DEBUG="files")
            self.assertEqual(listed["empty"], "does nothing")
            self.assertIn("assay-engine-null.so", loaded)
            self.assertNotIn("libpython3", loaded)
        self.env["LD_DEBUG"] = "files"
        self.assertIn("libpython3", self.run_assay("simulate", "planar-chain", "--engine", "empty", "--contacts", "off", "--timestep", 1,
                                                   "--duration", 0.01, "--out", "-").stderr)

    def test_a_change_of_any_of_its_files_is_seen(self):
        helper = self.engines / "words.py"
        helper.write_text("SUMMARY = 'one'\n")
        self.adapter("empty", EMPTY.replace('"does nothing"', "words.SUMMARY").replace("import", "import words\nimport", 1))
        self.assertEqual([self.listed()[0]["empty"] for _ in range(2)], ["one", "one"])
        helper.write_text("SUMMARY = 'two'\n")
        self.assertEqual(self.listed()[0]["empty"], "two")
        self.adapter("empty", EMPTY.replace("does nothing", "three"))
        self.assertEqual(self.listed()[0]["empty"], "three")

    def test_without_a_cache_it_is_asked_each_time(self):
        self.adapter("empty", EMPTY)
        (self.dir / "none").write_text("no folder")
        listed, loaded = self.listed(ASSAY_CACHE=str(self.dir / "none"), LD_DEBUG="files")
        self.assertIn("empty", listed)
        self.assertNotIn("libpython3", loaded)

    def test_an_environment_of_another_python(self):
        self.adapter("empty", EMPTY.replace("my-environment", "other"))
        (self.engines / "other").mkdir()
        # a program that has the usual interpreter and no other
        alone = self.dir / "alone"
        (alone / "bin").mkdir(parents=True)
        shutil.copy(self.command()[0], alone / "bin/assay")
        built = pathlib.Path(self.program).parent.parent / "engines"
        (alone / "engines").mkdir()
        for name in ("assay-python-host.so", "python", "assay-engine-mujoco.so"):
            (alone / "engines" / name).symlink_to(built / name)
        self.command = lambda *arguments: [str(alone / "bin/assay"), *map(str, arguments)]
        for version, reason in (("3.12.4", r"of Python 3\.12, and assay has 3\.11: make it again, as with `python3\.11 -m venv --clear"),
                                ("3.13.5", r"needs Python 3\.13, .* which is not here: run \./assay setup cpython313")):
            (self.engines / "other/pyvenv.cfg").write_text(f"home = /usr/bin\nversion = {version}\n")
            self.assertRegex(self.absent()["empty"], reason)
            done = self.run_assay("simulate", "planar-chain", "--engine", "empty", "--contacts", "off", "--timestep", 1,
                                  "--duration", 0.01, "--out", "-")
            self.assertNotEqual(done.returncode, 0)
            self.assertRegex(done.stderr, rf"^assay: .*{reason}.*\n$")

    def test_an_interpreter_that_cannot_be_loaded(self):
        self.adapter("empty", EMPTY.replace("my-environment", "other"))
        (self.engines / "other").mkdir()
        (self.engines / "other/pyvenv.cfg").write_text("home = /usr/bin\nversion = 3.13.5\n")
        (self.engines / "assay-python-host-3.13.so").write_text("no library")
        done = self.run_assay("simulate", "planar-chain", "--engine", "empty", "--contacts", "off", "--timestep", 1,
                              "--duration", 0.01, "--out", "-")
        self.assertNotEqual(done.returncode, 0)
        self.assertRegex(done.stderr, r"engine 'empty' is in Python, and '.*-3\.13\.so' cannot be loaded \(.*\): "
                                      r"run \./assay setup cpython313")

    def test_two_interpreters_at_work(self):
        """Each contender has a process, and the one that compares them has at most one interpreter."""
        listed = self.assay_json("engines", "--json")
        contender = next((row["contender"] for row in listed["contenders"] if row["engine"] in ("drake", "dartpy") and
                          row["contender"] != row["engine"]), None)
        if contender is None:
            self.skipTest("no engine with another interpreter is set up")
        self.adapter("my-mujoco", example())
        for pair in ((contender, "my-mujoco"), ("my-mujoco", contender)):
            done = self.run_assay("conformance", *pair, "--test", "planar-chain", "--json")
            self.assertEqual({each["contender"]: [row["status"] for row in each["results"]]
                              for each in json.loads(done.stdout)["contenders"]}, dict.fromkeys(pair, ["pass"]), done.stderr)
        self.write("both.toml", campaign("both", [1], ["truth"], contenders=list(pair), duration_s=0.016))
        self.assay("run", "both.toml", "--out", "results")
        with contextlib.closing(sqlite3.connect(self.dir / "results/assay.sqlite")) as db:
            self.assertEqual(set(db.execute("SELECT contender, outcome FROM cells")), {(each, "ok") for each in pair})


class Installed(AssayTest):
    """Engines that are set up on demand, beside the one that computes the same in C++."""

    def end(self, contender, model="planar-chain", bodies=5, columns=("x", "y", "z")):
        text = self.assay("simulate", model, "--engine", contender, "--contacts", "off", "--timestep", "1",
                          "--duration", "0.25", "--sample", "250", "--out", "-")
        rows = list(csv.DictReader(io.StringIO(text)))[-bodies:]
        return [float(row[column]) for row in rows for column in columns]

    def test_a_flat_body_is_no_reason_to_refuse(self):
        """Its moments are A + B = C, which rounding to single precision turns into A + B < C."""
        self.write("plates.xml", """<mujoco model="plates"><worldbody>""" + "".join(
            f"""<body name="plate{i}" pos="{i} 0 1" quat="0.9 0.1 0.{i} 0.3"><freejoint/>
            <inertial mass="0.3" pos="0 0 0" quat="0.7 0.{i} 0.3 0.5" diaginertia="{a} {b} {a + b:.17g}"/></body>"""
            for i, (a, b) in enumerate([(0.001, 0.002), (0.0037, 0.0021), (0.00013, 0.00029), (0.01, 0.01), (0.0007, 1e-9)])) +
            """</worldbody></mujoco>""")
        listed = {row["contender"] for row in self.assay_json("engines", "--json")["contenders"]}
        for contender in ("mujoco-euler", "newton-steel", "newton-mujoco", "mujoco-warp", "mjx"):
            if contender in listed:
                with self.subTest(contender):
                    turns = self.end(contender, "plates.xml", 5, ("qw", "qx", "qy", "qz"))
                    for i in range(5):
                        self.assertAlmostEqual(turns[4 * i] / turns[4 * i + 1], 9, delta=1e-4)

    def test_they_end_where_the_native_engine_does(self):
        listed = {row["contender"]: row for row in self.assay_json("engines", "--json")["contenders"]}
        for contender, (native, bound, precision) in SAME_AS.items():
            if contender not in listed:
                continue  # not installed here
            with self.subTest(contender):
                self.assertEqual(listed[contender]["capabilities"]["precision"], precision)
                self.assertRegex(listed[contender]["version"], r"^\d+\.\d+")
                for mine, its in zip(self.end(contender), self.end(native), strict=True):
                    self.assertAlmostEqual(mine, its, delta=bound)


class CollisionGroups(unittest.TestCase):
    """Which shapes touch as SAPIEN's four words of 32 bits (src/engines/sapien/collision_groups.py)."""

    def setUp(self):
        spec = importlib.util.spec_from_file_location("collision_groups", SOURCE / "src/engines/sapien/collision_groups.py")
        self.engine = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.engine)

    def masks(self, count, pairs):
        masks = [0] * count
        for a, b in pairs:
            masks[a] |= 1 << b
            masks[b] |= 1 << a
        return masks

    def touching(self, count, pairs, ignored=()):
        """Pairs that touch by the words, without those ignored; None where there are no words."""
        words = self.engine.groups(count, self.masks(count, pairs), self.masks(count, ignored))
        if words is None:
            return None
        self.assertTrue(all(0 <= word < 2**32 for each in words for word in each))
        return {(i, j) for j in range(count) for i in range(j) if (i, j) not in ignored and self.engine.touches(words[i], words[j])}

    def test_exactly_the_pairs_touch(self):
        draw = random.Random(5)
        everything = {(i, j) for j in range(40) for i in range(j)}
        cases = {"none but one": {(0, 2)}, "all": everything, "ground": {(0, j) for j in range(1, 40)},
                 "none of a few": everything - set(draw.sample(sorted(everything), 20)),
                 "pairs apart": {(2 * i, 2 * i + 1) for i in range(20)},
                 "every body of two": {(i, j) for i, j in everything if i // 2 != j // 2}}
        for name, pairs in cases.items():
            with self.subTest(name):
                self.assertEqual(self.touching(40, pairs), pairs)
        for share in (0.05, 0.2, 0.5, 0.8, 0.95):
            pairs = {(i, j) for j in range(16) for i in range(j) if draw.random() < share}
            with self.subTest(share):
                self.assertEqual(self.touching(16, pairs), pairs)

    def test_pairs_that_physx_leaves_out_may_come_out_either_way(self):
        beside = {(i, i + 1) for i in range(199)}
        pairs = {(i, j) for j in range(200) for i in range(j)} - beside
        self.assertEqual(self.touching(200, pairs, beside), pairs)

    def test_shapes_of_one_body_are_one_kind(self):
        """On 300 boxes of the ground, of which PhysX leaves out the pairs among themselves, five bodies that touch all and each other."""
        ground = {(i, j) for j in range(300) for i in range(j)}
        pairs = {(i, j) for j in range(300, 305) for i in range(j)}
        self.assertEqual(self.touching(305, pairs, ground), pairs)
        touch, everything = self.masks(305, pairs), (1 << 305) - 1
        kinds, _ = self.engine._merged(305, touch, [everything] * 305)
        self.assertEqual(kinds, 2)

    def test_too_many_kinds_are_said(self):
        draw = random.Random(5)
        self.assertIsNone(self.touching(120, {(i, j) for j in range(120) for i in range(j) if draw.random() < 0.5}))


class SuperDexMeshes(unittest.TestCase):
    """Surfaces and signed distances that SuperDex's adapter fills (src/engines/superdex/superdex_mesh.py)."""

    # prints, for each shape, the worst of each property
    PROGRAM = """
import json, sys, types
import numpy as np
sys.path.insert(0, sys.argv[1])
import superdex_mesh

shape = types.SimpleNamespace
corners = [(x, y, z) for x in (-0.1, 0.1) for y in (-0.2, 0.2) for z in (-0.3, 0.3)]
sides = [((0, 1, 3, 2), 1), ((4, 6, 7, 5), 1), ((0, 4, 5, 1), 1), ((2, 3, 7, 6), 1), ((0, 2, 6, 4), 1), ((1, 5, 7, 3), 1)]
faces = [face for (a, b, c, d), _ in sides for face in ((a, b, c), (a, c, d))]
field = shape(rows=4, columns=5, half_x=0.4, half_y=0.3, base=0.1, heights=[0.01 * ((3 * i) % 7) for i in range(20)])
model = shape(hulls=[shape(vertices=corners, faces=faces)], height_fields=[field])
pi, r = np.pi, 0.1
cell = 0.2 * 0.2  # of the field, of two triangles
columns = np.reshape(field.heights, (4, 5))
under = sum((h[0] + h[1] + h[3]) / 6 * cell + (h[1] + h[2] + h[3]) / 6 * cell
            for i in range(3) for j in range(4)
            for h in [(columns[i, j], columns[i, j + 1], columns[i + 1, j + 1], columns[i + 1, j])])
shapes = {  # with its volume
    "sphere": (shape(type="sphere", radius=r), 4 / 3 * pi * r**3),
    "ellipsoid": (shape(type="ellipsoid", half_size=(0.1, 0.2, 0.3)), 4 / 3 * pi * 0.006),
    "capsule": (shape(type="capsule", radius=r, half_length=0.2), pi * r**2 * 0.4 + 4 / 3 * pi * r**3),
    "cylinder": (shape(type="cylinder", radius=r, half_length=0.2), pi * r**2 * 0.4),
    "box": (shape(type="box", half_size=(0.1, 0.2, 0.3)), 8 * 0.006),
    "hull": (shape(type="hull", data=0), 8 * 0.006),
    "height-field": (shape(type="height-field", data=0), under + 0.8 * 0.6 * 0.1),
}
found = {}
for name, (each, volume) in shapes.items():
    vertices, faces = superdex_mesh.of(model, each, 12)
    corner = vertices[faces]
    six = np.sum(np.cross(corner[:, 0], corner[:, 1]) * corner[:, 2], axis=1)
    areas = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    values = {"volume": abs(six.sum() / 6 / volume - 1), "open": float(np.abs(areas.sum(axis=0)).max() / np.linalg.norm(areas, axis=1).sum())}
    if name != "hull":  # its neighbours are divided apart from each other
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).tolist()
        once = {tuple(edge) for edge in edges}
        values["edges"] = len(edges) - len(once) + sum((b, a) not in once for a, b in once)
    if name not in ("sphere", "box"):  # SuperDex finds these by formula
        normals = areas / np.linalg.norm(areas, axis=1)[:, None]
        middle = corner.mean(axis=1)
        away = 0.004
        at = [superdex_mesh.distance(model, each, middle + step * normals) for step in (-away, 0, away)]
        values["surface"] = float(np.abs(at[1]).max())
        values["inside"], values["outside"] = float(at[0].max()), float(at[2].min())
    found[name] = values
print(json.dumps(found))
"""

    def test_they_are_closed_and_as_large_as_the_shapes(self):
        if not os.path.isdir(ENVIRONMENT):
            self.skipTest(f"no environment '{ENVIRONMENT}': setup/setup.sh --tests makes it")
        done = subprocess.run([pathlib.Path(ENVIRONMENT) / "bin/python", "-B", "-c", self.PROGRAM, SOURCE / "src/engines/superdex"],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = json.loads(done.stdout)
        self.assertEqual(len(found), 7)
        for name, values in found.items():
            with self.subTest(name, **values):
                self.assertLess(values["volume"], 1.5e-3 if name == "capsule" else 1e-12)  # its profile has corners
                self.assertLess(values["open"], 1e-12)
                self.assertEqual(values.get("edges", 0), 0)
                if "surface" in values:  # middles of triangles lie below a round surface
                    self.assertLess(values["surface"], 3e-4)
                    self.assertLess(values["inside"], 0)
                    self.assertGreater(values["outside"], 3e-3)


class Friction(unittest.TestCase):
    """Coefficients of shapes for an engine that takes the mean of two (src/engines/newton/shape_friction.py)."""

    def coefficients(self, **pairs):
        made = types.SimpleNamespace
        return self.engine.friction_of_shapes(made(contacts=[
            made(shape_a=name[0], shape_b=name[1], friction=mu) for name, mu in pairs.items()]))

    def setUp(self):
        spec = importlib.util.spec_from_file_location("shape_friction", SOURCE / "src/engines/newton/shape_friction.py")
        self.engine = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.engine)

    def test_each_pair_has_its_own(self):
        for pairs in ({"ab": 0.5}, {"ag": 0.3, "bg": 0.9, "cg": 0.1}, {"ab": 0.7, "ag": 1, "bg": 1}, {"ab": 0, "bc": 1},
                      {"ab": 0.4, "bc": 0.5, "cd": 0.6, "da": 0.5}, {"ab": 0.2, "cd": 0.8}, {}):
            with self.subTest(pairs):
                found = self.coefficients(**pairs)
                self.assertTrue(all(mu >= 0 for mu in found.values()), found)
                for (a, b), mu in pairs.items():
                    self.assertAlmostEqual((found[a] + found[b]) / 2, mu)

    def test_where_none_fit(self):
        for pairs in ({"ab": 0.4, "bc": 0.5, "cd": 0.6, "da": 0.9},  # a loop that does not close
                      {"ab": 0.1, "bc": 0.1, "ca": 1},  # a negative one
                      {"ab": 0, "bc": 1, "cd": 0}):
            self.assertIsNone(self.coefficients(**pairs), pairs)


class PairElements(unittest.TestCase):
    """Names of contact pairs in what an adapter's check() says, as class PairGroups gives them to those in C++."""

    def setUp(self):
        spec = importlib.util.spec_from_file_location("adapter", SOURCE / "src/engines/python-host/assay_adapter.py")
        self.adapter = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.adapter)

    def model(self, bodies):
        made = types.SimpleNamespace
        shapes = [made(name=f"s{i}", type="box" if i % 2 else "hull") for i in range(bodies)]
        return made(shapes=shapes, contacts=[made(shape_a=a, shape_b=b) for b in range(bodies) for a in range(b)])

    def test_a_few_have_their_own_names(self):
        model = self.model(3)
        self.assertEqual(self.adapter.pair_elements(model, model.contacts[1:]), ["contact of 's0' and 's2'", "contact of 's1' and 's2'"])

    def test_many_are_a_few_groups(self):
        model = self.model(250)
        self.assertEqual(len(model.contacts), 31125)
        self.assertEqual(self.adapter.pair_elements(model, model.contacts), [
            "contacts of 's0' and 's1' and 15624 more pairs of meshes and boxes",
            "contacts of 's0' and 's2' and 7749 more pairs of meshes", "contacts of 's1' and 's3' and 7749 more pairs of boxes"])
        detailed = ((pair, ", friction 0.001" if pair.shape_a == 0 else "") for pair in model.contacts)
        elements = self.adapter.pair_elements(model, detailed)
        self.assertEqual(len(elements), 5)
        self.assertIn("contacts of 's0' and 's1' and 124 more pairs of meshes and boxes, friction 0.001", elements)
        self.assertEqual(self.adapter.pair_elements(model, model.contacts[:1]), ["contact of 's0' and 's1'"])


class SetUp(AssayTest):
    """What is looked at before anything is downloaded."""

    with_verdicts = False  # its cache stays empty

    def set_up(self, *arguments, **programs):
        tools = self.dir / "tools"
        tools.mkdir(exist_ok=True)
        for name, script in programs.items():
            (tools / name.replace("_", "-")).write_text(f"#!/bin/sh\n{script}\n")
            (tools / name.replace("_", "-")).chmod(0o755)
        done = subprocess.run([SOURCE / "assay", "setup", *arguments], capture_output=True, text=True, env={
            **self.env, "PATH": f"{tools}:{self.env['PATH']}", "ASSAY_CACHE": str(self.dir / "cache"),
            "ASSAY_LOCK_HELD": "1"})  # the clone's lock may be that of whoever runs this test
        self.assertEqual(list((self.dir / "cache").glob("*")) if (self.dir / "cache").exists() else [], [])
        return done.returncode, done.stderr

    def test_unknown_names(self):
        for arguments in ([], ["newtonian"], ["drake", "newtonian"]):
            status, said = self.set_up(*arguments)
            self.assertEqual(status, 2)
            self.assertIn("drake", said)
        self.assertIn("'newtonian'", said)

    def test_an_old_libc(self):
        status, said = self.set_up("drake", getconf="echo glibc 2.31")
        self.assertEqual(status, 1)
        self.assertRegex(said, r"drake are for x86-64 Linux with glibc 2\.34 or newer, and this is .*glibc 2\.31")

    def test_another_python(self):
        status, said = self.set_up("drake", "mjx", pkg_config="exit 1")
        self.assertEqual(status, 1)
        self.assertRegex(said, "need CPython 3.11 as a library.*\n.*install libpython3.11-dev .* without: mjx\n")

    def common(self, command):
        return subprocess.run(["bash", "-c", f'root={SOURCE}; source "{SOURCE}/setup/common.sh"; {command}'], capture_output=True,
                              text=True, check=True, env={**self.env, "ASSAY_CACHE": "/nowhere"}).stdout.split()

    def test_each_adapter_names_its_interpreter(self):
        for engine in sorted(path.parent.name for path in SOURCE.glob("src/engines/*/requirements.txt")):
            about = SOURCE / "src/engines" / engine / "about.toml"
            named = re.search(r'^python = "(.*)"$', about.read_text() if about.exists() else "", re.MULTILINE)
            python, = self.common(f"engine_python {engine}")
            version = named[1] if named else "3.11"
            self.assertEqual(os.path.basename(python), f"python{version}")
            self.assertEqual(python.startswith("/nowhere/engines/cpython"), bool(named), python)
            pins = (about.parent / "requirements.txt").read_text(encoding="utf-8")
            self.assertIn(f"inaries for CPython {version} on", pins)

    def test_nobody_builds_an_interpreter_that_was_not_asked_for(self):
        self.assertIn("cpython313", self.common("recipes_of rare"))
        self.assertNotIn("cpython313", self.common("recipes_of core request"))

    def test_a_wheel_for_another_python(self):
        script = (SOURCE / "setup/setup.sh").read_text(encoding="utf-8")
        function = re.search(r"^install_wheels\(\) \{\n.*?^\}\n", script, re.MULTILINE | re.DOTALL)[0]
        python = self.dir / "python"
        python.write_text('#!/bin/sh\n[ "$1" = -c ] && { echo 3.11; exit; }\n'
                          'echo "ERROR: No matching distribution found for drake==1.58.0" >&2; exit 1\n')
        python.chmod(0o755)
        done = subprocess.run(["bash", "-c", f'set -e; log="{self.dir}/log"; touch "$log"; root="{SOURCE}"; '
                               'die() { echo "$*"; exit 1; }\n' + function + f'install_wheels "{python}" "{SOURCE}/x/requirements.txt"'],
                              capture_output=True, text=True, env=self.env)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"^drake==1\.58\.0 of x/requirements\.txt has no binary for Python 3\.11: pin one that has, or name "
                                      r"another Python in about\.toml beside it \(.*\)\n$")


if __name__ == "__main__":
    main()
