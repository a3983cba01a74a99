"""Motions with contacts against certified solutions, and against a file of states."""

import contextlib
import sqlite3

from harness import AssayTest, main

CAMPAIGN = """
name = "contacts"
contenders = {contenders}
timesteps_ms = [1]
measures = {measures}
[[system]]
name = "{name}"
model = "{model}"
solution = "{solution}"
duration_s = {duration}
sample_ms = 4
"""


class Solutions(AssayTest):
    def campaign(self, model, solution, *, name="motion", contenders=("mujoco-euler",), measures=("truth",), duration=0.48):
        return self.write("contacts.toml", CAMPAIGN.format(
            name=name, model=model, solution=solution, duration=duration,
            contenders=str(list(contenders)).replace("'", '"'), measures=str(list(measures)).replace("'", '"')))

    def errors(self, out="results"):
        with contextlib.closing(sqlite3.connect(self.dir / out / "assay.sqlite")) as db:
            return {contender: (outcome, value) for contender, outcome, value in db.execute(
                "SELECT contender, outcome, (SELECT value FROM \"values\" v WHERE v.cell_id = c.id AND v.name = 'truth_error_max') "
                "FROM cells c WHERE measure = 'truth'")}

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
