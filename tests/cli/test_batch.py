"""The measure 'batch': many worlds at once, together or in a process a core, and what goes wrong there."""

import contextlib
import json
import os
import sqlite3

from harness import SOURCE, AssayTest, main

ENVIRONMENT = os.environ.get("ASSAY_TEST_PYTHON", "")

CAMPAIGN = """
name = "worlds"
contenders = {contenders}
timesteps_ms = [1]
[timing]
rounds = 3
batch_ms = 2
[[system]]
name = "planar-chain"
measures = ["batch"]
worlds = {worlds}
duration_s = 0.256
"""

# The example's adapter steps many worlds, one after the other.
MANY = """
    def create_batch(self, model, worlds, settings, device):
        if device != "cpu":
            raise assay.Unsupported(f"no worlds on '{device}'")
        return KIND(model, settings.timestep)


class Batch:
    def __init__(self, model, timestep):
        self.model, self.timestep = model, timestep

    def restart(self, states):
        self.worlds = [Simulation(self.model, state, self.timestep) for state in states]

    def set_torques(self, torques):
        for world, own in zip(self.worlds, torques, strict=True):
            world.set_torques(own)

    def advance(self, count):
        for world in self.worlds:
            world.advance(count)

    def synchronize(self):
        pass

    def read_state(self, world):
        return self.worlds[world].read_state()

    def facts(self):
        return {"memory_bytes": 1000.0 * len(self.worlds), "compile_s": 0.25}


class Mixed(Batch):
    def read_state(self, world):
        return super().read_state(world - 1)


class Neighbours(Batch):
    def set_torques(self, torques):
        super().set_torques(torques[::-1])


class Full(Batch):
    def synchronize(self):
        if len(self.worlds) > 3:
            raise assay.EngineFailure("contact buffer too small for 4 worlds: raise max_contacts")


class Chatty(Batch):
    def facts(self):
        return {"memory": 1}
"""


class Worlds(AssayTest):
    def measured(self, contenders, worlds, *options):
        self.write("worlds.toml", CAMPAIGN.format(contenders=json.dumps(contenders), worlds=worlds))
        self.assay("run", "worlds.toml", "--out", "results", *options)
        with contextlib.closing(sqlite3.connect(self.dir / "results/assay.sqlite")) as db:
            cells = {(contender, measure): {"outcome": outcome, "reason": reason, "id": number} for
                     number, contender, measure, outcome, reason in
                     db.execute("SELECT id, contender, measure, outcome, reason FROM cells")}
            for cell in cells.values():
                cell["values"] = {name: (value, low, high) for name, value, low, high in db.execute(
                    'SELECT name, value, low, high FROM "values" WHERE cell_id = ?', (cell["id"],))}
        return cells


class Apart(Worlds):
    def test_engines_of_one_world_share_the_cores(self):
        cells = self.measured(["mujoco-euler", "ode-quick"], [1, 5])
        self.assertEqual(set(cells), {(c, f"batch-{n}") for c in ("mujoco-euler", "ode-quick") for n in (1, 5)})
        for (_, measure), cell in cells.items():
            self.assertEqual(cell["outcome"], "ok", cell)
            values = cell["values"]
            worlds = int(measure.removeprefix("batch-"))
            self.assertEqual(values["batch_worlds"][0], worlds)
            self.assertEqual(values["batch_compared"][0], worlds)
            self.assertEqual(values["batch_equivalence"][0], 0)  # the same code in another process
            self.assertEqual(values["batch_processes"][0], min(worlds, len(os.sched_getaffinity(0))))
            rate, low, high = values["batch_rate"]
            self.assertTrue(0 < low <= rate <= high, values)
            self.assertAlmostEqual(rate * values["batch_step_time"][0], 1e6 * worlds, delta=1e-6 * 1e6 * worlds)
            self.assertGreater(values["batch_latency"][0], 0)

    def test_they_stand_apart_from_the_speed_of_one_world(self):
        self.measured(["mujoco-euler"], [1, 2])
        page = json.loads(self.assay("report", "results", "--json"))
        rows = page["batches"][0]["rows"]
        self.assertEqual([row["worlds"] for row in rows], [1, 2])
        self.assertIn("cpu", page["batches"][0]["devices"])
        exported = json.loads(self.assay("export", "results", "--format", "json"))
        self.assertTrue(any("batch_rate" in json.dumps(row) for row in exported))
        done = self.run_assay("recommend", "results", "planar-chain", "--error", "1mm")
        self.assertNotIn("times real time", done.stdout)

    def test_bad_campaigns_are_named(self):
        for worlds, said in (("[]", "'worlds' is empty"), ("[0]", "'worlds' has 0"), ("[2, 2]", "'worlds' has 2 twice"),
                             ('["all"]', "'worlds' has 'all'"), ("[1000000]", "whole numbers from 1 to 65536")):
            self.write("bad.toml", CAMPAIGN.format(contenders='["mujoco-euler"]', worlds=worlds))
            done = self.run_assay("run", "bad.toml", "--out", "bad")
            self.assertEqual(done.returncode, 2, worlds)
            self.assertIn(said, done.stderr.replace('"', "'"))
        text = CAMPAIGN.format(contenders='["mujoco-euler"]', worlds="[2]")
        for old, new, said in (("worlds = [2]\n", "", "does not say how many worlds"),
                               ('measures = ["batch"]', 'measures = ["raw_speed"]', "'worlds' is for the measure 'batch'"),
                               ("duration_s = 0.256", "duration_s = 0.1", "has fewer than 128 steps of 1 ms"),
                               ("[[system]]", '[[system]]\ncontrol = "sine"', "has a control")):
            self.write("bad.toml", text.replace(old, new, 1))
            done = self.run_assay("run", "bad.toml", "--out", "bad")
            self.assertEqual(done.returncode, 2, new)
            self.assertIn(said, done.stderr)

    def test_a_device_that_is_not_there_is_named_before_anything_runs(self):
        self.write("worlds.toml", CAMPAIGN.format(contenders='["mujoco-euler"]', worlds="[2]"))
        for device, said in (("gpu", "'gpu' is no device: give cpu, or cuda:0"), ("cuda:63", "'cuda:63' is not there")):
            done = self.run_assay("run", "worlds.toml", "--out", "results", "--device", device)
            self.assertEqual(done.returncode, 2, device)
            self.assertIn(said, done.stderr)
            self.assertFalse((self.dir / "results").exists())
        self.write("one.toml", CAMPAIGN.format(contenders='["mujoco-euler"]', worlds="[2]").replace("worlds = [2]\n", "").replace(
            '"batch"', '"raw_speed"'))
        done = self.run_assay("run", "one.toml", "--out", "results", "--device", "cpu")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--device is for the measure 'batch'", done.stderr)


class Together(Worlds):
    """Worlds of one adapter in Python, stepped by one call."""

    def setUp(self):
        super().setUp()
        if not os.path.isdir(ENVIRONMENT):
            self.skipTest(f"no environment '{ENVIRONMENT}': setup/setup.sh --tests makes it")
        engines = self.dir / "engines"
        engines.mkdir()
        (engines / "my-environment").symlink_to(ENVIRONMENT)
        self.env["ASSAY_ENGINE_PATH"] = str(engines)
        example = (SOURCE / "examples/python-adapter/assay-engine-my-mujoco.py").read_text(encoding="utf-8")
        head, simulation = example.split("\n\nclass Simulation", 1)
        for kind in ("Batch", "Mixed", "Neighbours", "Full", "Chatty"):
            text = head.rstrip() + "\n" + MANY.replace("KIND", kind) + "\n\nclass Simulation" + simulation
            (engines / f"assay-engine-{kind.lower()}.py").write_text(text.replace("my-mujoco", f"my-{kind.lower()}"))

    def test_each_world_is_that_of_one(self):
        cells = self.measured(["my-batch"], [1, 40])
        for worlds, compared in ((1, 1), (40, 16)):
            cell = cells["my-batch", f"batch-{worlds}"]
            self.assertEqual(cell["outcome"], "ok", cell)
            self.assertEqual(cell["values"]["batch_equivalence"][0], 0)
            self.assertEqual(cell["values"]["batch_compared"][0], compared)
            self.assertEqual(cell["values"]["batch_memory"][0], 1000 * worlds)
            self.assertEqual(cell["values"]["batch_compile_time"][0], 0.25)
            self.assertNotIn("batch_processes", cell["values"])

    def test_what_goes_wrong_is_an_outcome_without_a_rate(self):
        cells = self.measured(["my-mixed", "my-neighbours", "my-full", "my-chatty"], [4])
        for contender, outcome, said in (("my-mixed", "diverged", "from its run of one world after 32 steps"),
                                         ("my-neighbours", "diverged", "from its run of one world after 32 steps"),
                                         ("my-full", "diverged", "contact buffer too small for 4 worlds: raise max_contacts"),
                                         ("my-chatty", "crashed", "facts() gave 'memory'")):
            cell = cells[contender, "batch-4"]
            self.assertEqual(cell["outcome"], outcome, cell)
            self.assertIn(said, cell["reason"])
            self.assertNotIn("batch_rate", cell["values"])


if __name__ == "__main__":
    main()
