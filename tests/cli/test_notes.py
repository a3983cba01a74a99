"""What a model leaves out of its file is named wherever the model is used: on standard error, in results, reports and certificates."""

import json
import re
import sqlite3

from harness import BALL_CAMPAIGN, AssayTest, main

# Of this, --drop-unsupported leaves out the gravity compensation and the actuator.
KITE = """<mujoco model="kite">
  <worldbody>
    <body name="wing" pos="0 0 1" gravcomp="1">
      <joint name="hinge" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/>
    </body>
  </worldbody>
  <actuator><damper name="brake" joint="hinge" kv="1" ctrlrange="0 1"/></actuator>
</mujoco>
"""
# Another with more notes than a terminal is to be filled with.
MANY = KITE.replace("  <actuator>", "  <actuator>" + "".join(
    f'<damper name="brake{i}" joint="hinge" kv="1" ctrlrange="0 1"/>' for i in range(20)))
CAMPAIGN = BALL_CAMPAIGN.replace('["null"]', '["mujoco-euler"]').replace('model = "./ball.xml"',
                                                                         'model = "./kite.xml"\ndrop_unsupported = true')
NAMES = ("body 'wing'", "actuator 'brake'")


class Notes(AssayTest):
    def setUp(self):
        super().setUp()
        self.write("kite.xml", KITE)

    def told(self, done, prefix="assay: note: "):
        """Checks that each name stands in one note on standard error."""
        for name in NAMES:
            found = [line for line in done.stderr.splitlines() if line.startswith(prefix) and name in line]
            self.assertEqual(len(found), 1, (name, done.stderr))

    def test_parity_explain_and_snapshot(self):
        done = self.run_assay("parity", "kite.xml", "mujoco-euler", "--samples", "2", "--drop-unsupported", "--out", "c.json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.told(done)
        notes = json.loads((self.dir / "c.json").read_text())["notes"]
        for name in NAMES:
            self.assertEqual(len([note for note in notes if name in note]), 1, notes)
        done = self.run_assay("explain", "kite.xml", "mujoco-euler", "mujoco-euler", "--drop-unsupported", "--seconds", "0.1",
                              "--seeds", "1", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.told(done)
        self.assertEqual(json.loads(done.stdout)["notes"], notes)
        # which draws every model, also where there is no renderer to draw it with
        self.told(self.run_assay("snapshot", "kite.xml", "--size", "64x64", "--out", "kite.png"))

    def test_a_campaign_and_its_report(self):
        # two systems of one robot: each note once
        self.write("ball.toml", CAMPAIGN + CAMPAIGN[CAMPAIGN.index("[[system]]"):].replace('"ball"', '"other"'))
        done = self.run_assay("run", "ball.toml", "--out", "results")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.told(done, "note: ball, other: ")
        with sqlite3.connect(self.dir / "results/assay.sqlite") as db:
            stored = {name: json.loads(facts)["notes"] for name, facts in db.execute("SELECT name, json FROM systems")}
        self.assertEqual(set(stored), {"ball", "other"})
        for notes in stored.values():
            for name in NAMES:
                self.assertEqual(len([note for note in notes if name in note]), 1, notes)
        self.assay("report", "results")
        page = (self.dir / "results/report.html").read_text()
        data = json.loads(re.search(r'<script[^>]*id="assay-data"[^>]*>(.*?)</script>', page, re.S).group(1))
        self.assertEqual({system["name"]: system["facts"]["notes"] for system in data["systems"]}, stored)

        # programs get them as events
        done = self.run_assay("run", "ball.toml", "--out", "results", "--progress", "json")
        self.assertEqual(done.returncode, 0, done.stderr)
        said = [json.loads(line) for line in done.stderr.splitlines() if line.startswith("{")]
        self.assertTrue(any(event["event"] == "message" and NAMES[0] in event["text"] for event in said), said)

    def test_of_many_notes_the_results_keep_all(self):
        self.write("kite.xml", MANY)
        self.write("ball.toml", CAMPAIGN.replace("mujoco-euler", "null"))
        done = self.run_assay("run", "ball.toml", "--out", "results")
        self.assertEqual(done.returncode, 0, done.stderr)
        with sqlite3.connect(self.dir / "results/assay.sqlite") as db:
            (facts,), = db.execute("SELECT json FROM systems")
        notes = json.loads(facts)["notes"]
        self.assertGreater(len(notes), 20)
        told = [line for line in done.stderr.splitlines() if line.startswith("note: ball: ")]
        self.assertEqual(len(told), 11)
        self.assertIn(f"{len(notes) - 10} more notes", told[-1])

    def test_a_robots_programme(self):
        self.assay("run", "kite.xml", "--drop-unsupported", "--plan", "--minutes", "0.01", "--contenders", "mujoco-euler", "--out", "found")
        header = (self.dir / "found/campaign.toml").read_text().split("\nname = ")[0].splitlines()
        for name in NAMES:
            self.assertTrue(any(line.startswith("# ") and name in line for line in header), header)
        # and where that is run, which is a search
        done = self.run_assay("run", "found/campaign.toml", "--out", "again", "--jobs", "1")
        self.told(done, "assay: note: hold, random, swing: ")


if __name__ == "__main__":
    main()
