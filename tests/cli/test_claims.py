"""claims: verdicts on the paper's claims, on a real campaign, made small."""

import contextlib
import re
import sqlite3

from harness import SOURCE, AssayTest, main

# A little of all that the claims ask for, at timesteps that are too large for any of them to mean much.
CAMPAIGN = """
name = "small"
contenders = ["mujoco-euler", "mujoco-rk4"]
timesteps_ms = [1, 2, 4]
reference_ms = "1/2"
[timing]
rounds = 2
batch_ms = 1
[[system]]
name = "planar-chain"
measures = ["raw_speed", "consistency", "drift"]
duration_s = 0.16
pieces = 2
piece_ms = 32
[[system]]
name = "astronaut"
measures = ["drift"]
control = "actuators"
duration_s = 0.064
[[system]]
name = "grasp"
measures = ["grasp"]
control = "actuators"
grasp = {object = "object", hand = "palm"}
duration_s = 0.032
"""
SCALING = """
[[system]]
name = "capsules-%d"
family = "capsules"
contenders = ["mujoco-euler"]
timesteps_ms = [10]
measures = ["scaling"]
duration_s = 0.2
"""
VERDICTS = {"holds", "changed", "not-settled", "not-measurable"}
FIGURE = {"label", "contender", "system", "timestep_ms", "measure", "value", "unit", "low", "high"}


class ClaimsTest(AssayTest):
    def measure(self):
        self.write("small.toml", CAMPAIGN + "".join(SCALING % n for n in (2, 4, 8)))
        self.assay("run", "small.toml", "--out", "results")

    def values(self):
        with contextlib.closing(sqlite3.connect(self.dir / "results/assay.sqlite")) as db:
            return {row[:4]: row[4] for row in db.execute(
                'SELECT system, contender, timestep_ms, name, value FROM "values" JOIN cells ON cells.id = cell_id')}

    def test_verdicts_come_from_the_stored_values(self):
        self.measure()
        values = self.values()
        told = self.assay_json("claims", "results", "--json")
        self.assertEqual([claim["number"] for claim in told], list(range(1, 18)))
        for claim in told:
            self.assertIn(claim["verdict"], VERDICTS)
            self.assertEqual(bool(claim["reason"]), claim["verdict"] == "not-measurable", claim)
            self.assertTrue(claim["verdict"] == "not-measurable" or claim["now"].startswith("Now: "), claim)
            self.assertEqual(bool(claim["now"]), bool(claim["threshold"]), claim)
            for figure in claim["figures"]:
                self.assertEqual(set(figure), FIGURE)
                key = (figure["system"], figure["contender"], figure["timestep_ms"], figure["measure"])
                if "/" not in figure["label"] and key in values:
                    self.assertEqual(figure["value"], values[key])
        by_number = {claim["number"]: claim for claim in told}
        # The other engines are missing, so that nothing about the whole line-up can hold.
        self.assertEqual(by_number[1]["verdict"], "not-measurable")
        self.assertIn("no contender 'bullet-mb'", by_number[3]["reason"])
        self.assertEqual(by_number[7]["verdict"], "not-measurable")
        # Runge-Kutta against Euler is there.
        ratio = next(figure for figure in by_number[9]["figures"] if figure["label"] == "MuJoCo Euler / MuJoCo RK4")
        self.assertGreater(ratio["value"], 1)
        self.assertIsNone(ratio["timestep_ms"])
        held = {figure["label"]: figure["value"] for figure in by_number[13]["figures"]}
        self.assertEqual(held, {"MuJoCo Euler": values["grasp", "mujoco-euler", 1, "grasp_held"],
                                "MuJoCo RK4": values["grasp", "mujoco-rk4", 1, "grasp_held"]})
        exponent = next(figure for figure in by_number[12]["figures"] if figure["label"] == "MuJoCo sparse")
        self.assertEqual(exponent["value"], values["capsules-8", "mujoco-euler", 10, "scaling_exponent"])

    # A name that no measurement stores would make a claim unmeasurable for ever.
    def test_every_value_that_a_claim_names_is_one_that_is_stored(self):
        self.measure()
        stored = {key[3] for key in self.values()}
        claims = (SOURCE / "campaigns/paper_claims.toml").read_text()
        named = re.findall(r'^value = "(\w+)"', claims, re.M)
        self.assertGreater(len(named), 13)
        self.assertLessEqual(set(named), stored)
        self.assertEqual(set(re.findall(r'^measure = "(\w+)"', claims, re.M)), {"grasp", "consistency"})

    def test_texts(self):
        self.measure()
        text = self.assay("claims", "results")
        self.assertEqual(re.findall(r"^(\d+)\. ", text, re.M), [str(n) for n in range(1, 18)])
        self.assertRegex(text.splitlines()[-1], r"^\d+ holds, \d+ changed, \d+ not settled, \d+ not measurable$")
        markdown = self.assay("claims", "results", "--markdown")
        self.assertEqual(len(re.findall(r"^\| \d+ \| ", markdown, re.M)), 17)
        self.assertEqual(len(re.findall(r"^### \d+\. ", markdown, re.M)), 17)

    def test_claims_of_ones_own(self):
        self.measure()
        claim = """
            [engines]
            "Euler" = ["mujoco-euler"]
            "RK4" = ["mujoco-rk4"]
            [[claim]]
            number = 1
            title = "Four orders are better than one"
            statement = "Runge-Kutta 4 loses less energy than Euler's method"
            paper = "arithmetic"
            [[claim.test]]
            kind = "at-timestep"
            value = "energy_drift"
            timestep_ms = 4
            systems = ["planar-chain"]
            who = ["{}"]
            against = ["{}"]
            above = 1
            """
        for who, against, verdict in (("RK4", "Euler", "holds"), ("Euler", "RK4", "changed")):
            self.write("mine.toml", claim.format(who, against))
            told = self.assay_json("claims", "results", "--claims", "mine.toml", "--json")
            self.assertEqual([each["verdict"] for each in told], [verdict])

    def test_refusals(self):
        self.refused("claims", "elsewhere", naming=["elsewhere"])
        self.write("bad.toml", "[engines]\nA = ['a']\n[[claim]]\nnumbr = 1\n")
        self.refused("claims", "elsewhere", "--claims", "bad.toml", naming=["bad.toml:4", "did you mean 'number'?"])
        self.refused("claims", "elsewhere", "--json", "--markdown", naming=["--json", "--markdown"])


if __name__ == "__main__":
    main()
