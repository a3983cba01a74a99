"""Recommendations of the committed full run against a checker of its own.

The checker reads the database by itself and knows nothing of the program: what is sound, what a speed is where it was
not timed, and which contender is the fastest within a limit.
"""

import concurrent.futures
import contextlib
import json
import lzma
import math
import os
import re
import sqlite3
import sys

from harness import SOURCE, AssayTest, main

sys.path.insert(0, str(SOURCE / "results"))
import standing  # noqa: E402

FULL = SOURCE / "results/intel-xeon-2-cores"
# Errors: magnitudes of which less is better.
LIMITABLE = re.compile(r"truth_error(_max|_rms)?|consistency(_[\d.]+ms)?|\w+_drift(_relative)?|"
                       r"(joint_dislocation|joint_misalignment|limit_violation|penetration)_(max|rms)|grasp_slip|rebound")
LIMITS = 40
# Limits of each value that the program itself is asked for; ASSAY_ALL_LIMITS=1 asks it for all.
ASKED = LIMITS if os.environ.get("ASSAY_ALL_LIMITS") else 1


def same(a, b):
    return abs(a - b) <= 1e-9 * max(a, b)


class Checker:
    """Brute force over the cells of one system."""

    def __init__(self, db, system):
        self.found = {}  # candidates of each value
        self.cells = {}  # contender: timestep: [(measure, outcome, values)]
        for cell, contender, timestep, measure, outcome in db.execute(
                "SELECT id, contender, timestep_ms, measure, outcome FROM cells WHERE system = ? AND contender != 'null'",
                [system]):
            values = dict(db.execute('SELECT name, value FROM "values" WHERE cell_id = ? AND value IS NOT NULL', [cell]))
            self.cells.setdefault(contender, {}).setdefault(timestep, []).append((measure, outcome, values))

    def values(self):
        return sorted({name for steps in self.cells.values() for cells in steps.values()
                       for _, _, values in cells for name in values if LIMITABLE.fullmatch(name)})

    def range(self, name):
        found = [values[name] for steps in self.cells.values() for cells in steps.values()
                 for _, _, values in cells if values.get(name, 0) > 0]
        return (min(found), max(found)) if found else None

    def sound(self, contender, timestep):
        return all(outcome == "ok" and values.get("grasp_held", 1) == 1
                   for step, cells in self.cells[contender].items() if step <= timestep * (1 + 1e-9)
                   for _, outcome, values in cells)

    def speed(self, contender, timestep):
        """The realtime factor: timed, or between two that were timed; else None."""
        timed = {step: values["realtime_factor"] for step, cells in self.cells[contender].items()
                 for _, outcome, values in cells if outcome == "ok" and values.get("realtime_factor", 0) > 0}
        if timestep in timed:
            return timed[timestep]
        below = max((step for step in timed if step < timestep), default=None)
        above = min((step for step in timed if step > timestep), default=None)
        if below is None or above is None:
            return None
        weight = (math.log(timestep) - math.log(below)) / (math.log(above) - math.log(below))
        seconds = math.exp((1 - weight) * math.log(below / timed[below]) + weight * math.log(above / timed[above]))
        return timestep / seconds

    def error(self, contender, timestep, name):
        """The value at a timestep; None where it was not measured or says nothing."""
        for measure, _, values in self.cells[contender].get(timestep, []):
            if name in values and not (measure == "consistency" and "restart_floor" in values):
                bound = values.get("consistency_bound") if name == "consistency" else None
                return values[name] if bound is None else bound
        return None

    def worst(self, contender, timestep, name):
        if self.error(contender, timestep, name) is None:
            return None
        return max(error for step in self.cells[contender] if step <= timestep
                   if (error := self.error(contender, step, name)) is not None)

    def candidates(self, name):
        """{(contender, timestep): (speed, error)} of what an answer may be."""
        if name in self.found:
            return self.found[name]
        found = self.found[name] = {}
        for contender, steps in self.cells.items():
            for timestep in steps:
                speed, error = self.speed(contender, timestep), self.worst(contender, timestep, name)
                if speed is not None and error is not None and self.sound(contender, timestep):
                    found[contender, timestep] = speed, error
        return found


class FullRunTest(AssayTest):
    def setUp(self):
        super().setUp()
        (self.dir / "full").mkdir()
        (self.dir / "full/assay.sqlite").write_bytes(lzma.decompress((FULL / "assay.sqlite.xz").read_bytes()))

    def checkers(self):
        with contextlib.closing(sqlite3.connect(self.dir / "full/assay.sqlite")) as db:
            standing.standing(db)  # without what is withdrawn
            return {system: Checker(db, system) for system, in db.execute(
                "SELECT DISTINCT system FROM cells WHERE measure NOT IN ('scaling', 'raw_speed', 'reference')")}

    def views(self):
        """What the report's page is told."""
        self.assay("report", "full")
        page = (self.dir / "full/report.html").read_text(encoding="utf-8")
        data = re.search(r'<script[^>]*id="assay-data"[^>]*>(.*?)</script>', page, re.DOTALL).group(1)
        return {view["system"]: view for view in json.loads(data)["views"]}

    def unit(self, name):
        """The stored unit, as an option takes it."""
        with contextlib.closing(sqlite3.connect(self.dir / "full/assay.sqlite")) as db:
            unit, = db.execute('SELECT unit FROM "values" WHERE name = ? LIMIT 1', [name]).fetchone()
        return "" if unit == "1" else unit

    def check(self, checker, name, limit, answer):
        """That (contender, timestep), or None, is the fastest sound answer."""
        good = {place: speed for place, (speed, error) in checker.candidates(name).items() if error <= limit}
        if not good:
            self.assertIsNone(answer)
            return
        self.assertIn(answer, good, "unsound, not timed, or beyond the limit")
        self.assertGreaterEqual(good[answer], max(good.values()) * (1 - 1e-12))

    def test_no_answer_is_unsound(self):
        views, asked, answers = self.views(), [], 0
        for system, checker in self.checkers().items():
            view = views[system]

            def worst_of(candidate, points=view["points"]):
                return points[candidate["point"]].get("worst", {})

            self.assertEqual(sorted(view["errors"]), checker.values(), system)
            for name in checker.values():
                bounds = checker.range(name)
                if bounds is None:
                    continue
                for i in range(LIMITS):
                    limit = bounds[0] / 2 * (4 * bounds[1] / bounds[0]) ** (i / (LIMITS - 1))
                    # The picker's rule: the first candidate within the limit.
                    first = next((candidate for candidate in view["candidates"]
                                  if worst_of(candidate).get(name, {"value": math.inf})["value"] <= limit), None)
                    point = view["points"][first["point"]] if first else None
                    answer = (point["contender"], point["timestep_ms"]) if point else None
                    with self.subTest(system=system, value=name, limit=limit):
                        self.check(checker, name, limit, answer)
                    answers += 1
                    if i % math.ceil(LIMITS / ASKED) == LIMITS // 2 % math.ceil(LIMITS / ASKED):
                        asked.append((system, name, self.unit(name), limit, answer))
        self.assertGreater(answers, 1000)

        def ask(question):
            system, name, unit, limit, _ = question
            free = [f"--{option}=any" for option, value in (("penetration", "penetration"), ("slip", "grasp_slip")) if not name.startswith(value)]
            return self.run_assay("recommend", "full", system, "--limit", f"{name}={limit!r}{unit}", *free, "--json")

        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            for (system, name, _, limit, answer), done in zip(asked, pool.map(ask, asked)):
                with self.subTest(system=system, value=name, limit=limit):
                    self.assertEqual(done.returncode, 0 if answer else 1, done.stderr)
                    told = json.loads(done.stdout)["recommended"]
                    self.assertEqual(told and (told["contender"], told["timestep_ms"]), answer)

    # What 0.1 answered: a run that had diverged, one that was never timed, one that was lucky in its phase.
    def test_answers_that_were_wrong(self):
        checkers = self.checkers()
        for system, error in (("grasp", 10e-3), ("astronaut", 10e-3), ("planar-chain", 100e-3)):
            answer = self.assay_json("recommend", "full", system, "--error", f"{error}m", "--penetration", "any", "--slip", "any", "--json")
            told = answer["recommended"]
            self.assertIn(answer["measure"], ("truth_error", "truth_error_max") if system == "planar-chain" else ("consistency",))
            self.check(checkers[system], answer["measure"], error, (told["contender"], told["timestep_ms"]))
        told = self.assay_json("recommend", "full", "planar-chain", "--error", "100mm", "--json")
        euler = [row for row in told["contenders"] if row["contender"] == "mujoco-euler"]
        self.assertLess(euler[0]["timestep_ms"], 16, "16 ms is off by 1.35 m")


if __name__ == "__main__":
    main()
