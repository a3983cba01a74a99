"""Motions with contacts against certified solutions, and against a file of states."""

import contextlib
import math
import sqlite3

from harness import AssayTest, main

CAMPAIGN = """
name = "contacts"
contenders = {contenders}
timesteps_ms = {timesteps}
measures = {measures}
[[system]]
name = "{name}"
model = "{model}"
solution = "{solution}"
duration_s = {duration}
sample_ms = 4
"""


class Solutions(AssayTest):
    def campaign(self, model, solution, *, name="motion", contenders=("mujoco-euler",), measures=("truth",), duration=0.48, timesteps=(1,)):
        return self.write("contacts.toml", CAMPAIGN.format(
            name=name, model=model, solution=solution, duration=duration, timesteps=list(timesteps),
            contenders=str(list(contenders)).replace("'", '"'), measures=str(list(measures)).replace("'", '"')))

    def errors(self, out="results"):
        with contextlib.closing(sqlite3.connect(self.dir / out / "assay.sqlite")) as db:
            return {contender: (outcome, value) for contender, outcome, value in db.execute(
                "SELECT contender, outcome, (SELECT value FROM \"values\" v WHERE v.cell_id = c.id AND v.name = 'truth_error_max') "
                "FROM cells c WHERE measure = 'truth'")}

    def values(self, out="results"):
        """{(contender, timestep): {name: value}}"""
        found = {}
        with contextlib.closing(sqlite3.connect(self.dir / out / "assay.sqlite")) as db:
            for contender, timestep, name, value in db.execute(
                    "SELECT contender, timestep_ms, name, value FROM cells JOIN \"values\" ON cell_id = cells.id WHERE measure = 'truth'"):
                found.setdefault((contender, timestep), {})[name] = value
        return found

    def test_a_pyramid_lets_a_box_stop_late_and_has_too_little_friction(self):
        self.campaign("sliding-box", "slide-and-roll", contenders=("mujoco-euler", "bullet-si-f64"))
        self.assay("run", "contacts.toml", "--out", "results", "--no-set-up")
        soft, hard = self.values()["mujoco-euler", 1], self.values()["bullet-si-f64", 1]
        # It stops by itself along x until both velocities are equal, then along the diagonal; 2 % of its speed are left somewhat before.
        fast, slow, brake = 1.197953, 0.902723, 0.5 * 9.81
        speed = math.hypot(fast, slow)
        late = (fast - slow) / brake + (2 * slow - 0.02 * speed * math.sqrt(2)) / brake - 0.98 * speed / brake
        self.assertAlmostEqual(soft["event_time_error"], 1e3 * late, delta=4)
        self.assertAlmostEqual(soft["event_lag"], soft["event_time_error"], delta=1e-9)
        self.assertLess(hard["event_time_error"], 8)
        self.assertEqual((soft["missed_events"], hard["missed_events"]), (0, 0))
        self.assertGreater(soft["tangential_impulse_error"], 0.2)
        self.assertLess(hard["tangential_impulse_error"], 0.05)
        for values in (soft, hard):
            self.assertLess(values["normal_impulse_error"], 0.1)
        # before it has stopped
        self.campaign("sliding-box", "slide-and-roll", duration=0.36)
        self.assay("run", "contacts.toml", "--out", "short", "--no-set-up")
        values = self.values("short")["mujoco-euler", 1]
        self.assertEqual(values["missed_events"], 1)
        self.assertNotIn("event_time_error", values)

    def test_times_and_impulses_come_nearer_with_the_timestep(self):
        for model, duration, name, delta in (("rimless-wheel", 2, "event_time", 0.4), ("tipping-box", 0.32, "tangential_impulse", 0.1),
                                             ("tipping-box", 0.32, "normal_impulse", 0.1)):
            with self.subTest(model=model, name=name):
                self.campaign(model, model, contenders=("bullet-mb",), duration=duration, timesteps=(0.25, 1, 4))
                self.assay("run", "contacts.toml", "--out", model, "--no-set-up")
                values = self.values(model)
                errors = [values["bullet-mb", step][name + "_error"] for step in (0.25, 1, 4)]
                self.assertEqual(errors, sorted(errors))
                for step in (1, 4):
                    self.assertAlmostEqual(values["bullet-mb", step][name + "_order"], 1, delta=delta)

    def test_a_pyramid_of_friction_lets_a_box_slide_too_far(self):
        self.campaign("sliding-box", "slide-and-roll", contenders=("mujoco-euler", "mujoco-rk4"))
        self.assay("run", "contacts.toml", "--out", "results", "--no-set-up")
        for outcome, error in self.errors().values():
            self.assertEqual(outcome, "ok")
            # 40 % of the 0.229 m of Coulomb's law
            self.assertAlmostEqual(error, 0.0935, delta=0.005)

    def test_a_contender_is_exact_against_its_own_states(self):
        self.assay("simulate", "sliding-box", "--engine", "mujoco-euler", "--timestep", "1", "--duration", "0.48", "--sample", "4",
                   "--out", "own.csv")
        self.campaign("sliding-box", "own.csv", contenders=("mujoco-euler", "mujoco-rk4"))
        self.assay("run", "contacts.toml", "--out", "results", "--no-set-up")
        errors = self.errors()
        self.assertLess(errors["mujoco-euler"][1], 1e-12)
        self.assertGreater(errors["mujoco-rk4"][1], 1e-9)
        # another content is another solution
        lines = (self.dir / "own.csv").read_text(encoding="utf-8").splitlines()
        moved = [lines[0]] + [",".join(part if i != 2 else repr(float(part) + 0.001) for i, part in enumerate(line.split(",")))
                              for line in lines[1:]]
        self.write("own.csv", "\n".join(moved) + "\n")
        self.assay("run", "contacts.toml", "--out", "moved", "--no-set-up")
        self.assertAlmostEqual(self.errors("moved")["mujoco-euler"][1], 0.001, delta=1e-9)

    def test_what_is_no_solution_is_said_before_anything_runs(self):
        for model, solution, naming in (
                ("sliding-box", "slide-and-rol", ["slide-and-rol", "did you mean 'slide-and-roll'"]),
                ("humanoid", "slide-and-roll", ["humanoid", "no free joint"]),
                ("tipping-box", "tipping-box", ["slips at", "to stick there takes a friction of"]),
                ("sliding-box", "nowhere.csv", ["nowhere.csv"])):
            with self.subTest(solution=solution, model=model):
                self.campaign(model, solution)
                self.refused("run", "contacts.toml", "--out", "results", naming=naming)
                self.assertFalse((self.dir / "results").exists())
        self.campaign("sliding-box", "slide-and-roll", measures=("drift",))
        self.refused("run", "contacts.toml", "--out", "results", naming=["add 'truth' to its measures"])

    def test_files_of_states_are_read_with_care(self):
        header = "time,body,x,y,z\n"
        for text, naming in (
                ("", ["empty"]),
                ("time,body,x,y\n", ["own.csv:1", "no column 'z'"]),
                (header + "0.004,bax,0,0,0\n", ["own.csv:2", "no body 'bax'", "did you mean 'box'"]),
                (header + "0.004,box,0,0,nan\n", ["own.csv:2", "'z' is 'nan'"]),
                (header + "0.004,box,0,0\n", ["own.csv:2", "there are 4 columns"]),
                (header + "0.004,box,0,0,0\n", ["no line for body 'box' at 0.008 s"])):
            with self.subTest(text=text):
                self.write("own.csv", text)
                self.campaign("sliding-box", "own.csv")
                self.refused("run", "contacts.toml", "--out", "results", naming=naming)


if __name__ == "__main__":
    main()
