"""recommend, and references that later campaigns reuse: on a real campaign, made small."""

import contextlib
import json
import shutil
import sqlite3

from harness import AssayTest, campaign, main

def small(name="small", timing=(1, 4)):
    return campaign(name, ["1/4", 1, 4], ["raw_speed", "consistency", "truth", "drift"], contenders=["mujoco-euler", "mujoco-rk4"],
                    reference_ms="1/8", timing={"rounds": 3, "batch_ms": 1}, timing_ms=timing, duration_s=0.16, pieces=2, piece_ms=32)


class RecommendTest(AssayTest):
    def measure(self, name="small", timing=(1, 4), out="results", *more):
        self.write(f"{name}.toml", small(name, timing))
        return self.assay("run", f"{name}.toml", "--out", out, *more)

    def values(self, name, out="results"):
        with contextlib.closing(sqlite3.connect(self.dir / out / "assay.sqlite")) as db:
            return {(contender, timestep): value for contender, timestep, value in db.execute(
                """SELECT contender, timestep_ms, value FROM "values" JOIN cells ON cells.id = cell_id
                   WHERE name = ? AND contender != 'null'""", [name])}

    def test_fastest_within_an_error(self):
        self.measure()
        errors, speeds = self.values("consistency"), self.values("realtime_factor")
        limit = 1.5 * errors["mujoco-rk4", 4.0]
        told = self.assay_json("recommend", "results", "planar-chain", "--error", f"{limit * 1e3}mm",
                               "--measure", "consistency", "--json")
        self.assertAlmostEqual(told["error"], limit)
        self.assertEqual(told["unit"], "m")
        good = {at for at, error in errors.items() if error <= limit and at[1] > 0.125}
        timed = {at: speed for at, speed in speeds.items() if at in good}
        best = max(timed, key=timed.get)
        # 1/4 ms was not timed, and cannot be as fast as 1 ms
        self.assertEqual((told["recommended"]["contender"], told["recommended"]["timestep_ms"]), best)
        for key, values in (("error", errors), ("realtime_factor", speeds)):
            interval = told["recommended"][key]
            self.assertEqual(interval["value"], values[best])
            self.assertLessEqual(interval["low"], interval["value"])
            self.assertGreaterEqual(interval["high"], interval["value"])
        self.assertEqual([row["contender"] for row in told["contenders"]],
                         sorted({at[0] for at in good}, key=lambda name: -max(
                             speed for at, speed in timed.items() if at[0] == name)))
        # the front: slower only where more accurate, and never the reference's own timestep
        front = told["front"]
        self.assertGreater(len(front), 1)
        for faster, slower in zip(front, front[1:]):
            self.assertGreater(faster["realtime_factor"]["value"], slower["realtime_factor"]["value"])
            self.assertGreater(faster["error"]["value"], slower["error"]["value"])
        self.assertNotIn(0.125, [choice["timestep_ms"] for choice in front])
        text = self.assay("recommend", "results", "planar-chain", "--error", f"{limit}m", "--measure", "consistency")
        self.assertIn(f"{best[0]} at {best[1]:g} ms", text.splitlines()[0])

    # A second name of a contender tests the timing: it has speeds and no errors.
    def test_a_twin_is_not_considered(self):
        self.write("twins.toml", small("twins").replace("batch_ms = 1", 'batch_ms = 1\ntwins = ["mujoco-euler"]'))
        self.assay("run", "twins.toml", "--out", "results")
        self.assertIn(("mujoco-euler-twin", 1.0), self.values("aa_ratio"))
        told = self.assay_json("recommend", "results", "planar-chain", "--error", "1um", "--json")
        named = {row["contender"] for row in [*told["contenders"], *told["excluded"]]}
        self.assertEqual(named, {"mujoco-euler", "mujoco-rk4"})

    def test_results_without_a_name_and_other_measures(self):
        self.measure()
        told = self.assay_json("recommend", "planar-chain", "--error", "1m", "--json")
        self.assertEqual(told["measure"], "truth_error_max", "accuracy comes before self-consistency")
        self.assertEqual(told["recommended"]["timestep_ms"], 4)
        told = self.assay_json("recommend", "planar-chain", "--error", "50%", "--measure", "energy_drift_relative",
                               "--json")
        self.assertEqual(told["error"], 0.5)

    def test_nobody_is_good_enough(self):
        self.measure()
        self.refused("recommend", "results", "planar-chain", "--error", "1e-30mm", status=1,
                     naming=["no contender on planar-chain has error within 1e-30mm", "relax the error to "])
        told = self.run_assay("recommend", "results", "planar-chain", "--error", "1e-30m", "--json")
        self.assertEqual(told.returncode, 1)
        self.assertIn('"recommended": null', told.stdout)
        # relaxed as it says, the question has the answer that it names
        told = json.loads(told.stdout)
        relaxed, = told["relaxations"]
        self.assertEqual(relaxed["value"], "truth_error_max")
        again = self.assay_json("recommend", "results", "planar-chain", "--error", relaxed["text"], "--json")
        for key in ("contender", "timestep_ms"):
            self.assertEqual(again["recommended"][key], relaxed["recommended"][key])

    def test_refusals(self):
        self.measure()
        self.refused("recommend", "results", "planar-chian", "--error", "1mm", naming=["did you mean 'planar-chain'?"])
        self.refused("recommend", "results", "planar-chain", "--error", "1mm", "--measure", "consistncy",
                     naming=["consistncy", "did you mean 'consistency'?"])
        self.refused("recommend", "results", "planar-chain", "--error", "1J", naming=["'1J'", "mm"])
        self.refused("recommend", "results", "planar-chain", "--error", "-1mm", naming=["'-1mm'", "not negative"])
        self.refused("recommend", "results", "planar-chain", "--error", "mm", naming=["'mm'"])
        self.refused("recommend", "elsewhere", "planar-chain", "--error", "1mm", naming=["elsewhere"])
        self.refused("recommend", "results", "planar-chain", naming=["--error"])
        self.refused("recommend", "results", "planar-chain", "--error", "1", naming=["'1'", "add a unit", "mm"])
        self.refused("recommend", "results", "planar-chain", "--limit", "truth_eror=1mm",
                     naming=["truth_eror", "did you mean 'truth_error'?"])
        self.refused("recommend", "results", "planar-chain", "--limit", "raw_speed=1kHz", naming=["cannot be limited"])
        self.refused("recommend", "results", "planar-chain", "--limit", "1mm", naming=["NAME=QUANTITY"])
        self.refused("recommend", "results", "planar-chain", "--error", "0mm", naming=["'0mm'", "above"])
        self.refused("recommend", "results", "planar-chain", "--penetration", "1mm", naming=["--penetration", "no penetration is measured"])
        self.refused("recommend", "results", "planar-chain", "--slip", "1mm", naming=["--slip", "nothing is held"])
        self.refused("recommend", "results", "planar-chain", "--penetration", "any", naming=["no limit was given"])
        self.refused("recommend", "results", "planar-chain", "--realtime", "fast", naming=["--realtime", "'fast'"])
        self.refused("recommend", "results", "planar-chain", "--measure", "truth", naming=["--error"])
        self.refused("recommend", "results", "planar-chain", "--error", "1mm", "--limit", "truth_error_max=2mm",
                     naming=["limited twice"])

    def test_results_of_another_version(self):
        self.measure()
        with contextlib.closing(sqlite3.connect(self.dir / "results/assay.sqlite")) as db:
            db.execute("PRAGMA user_version = 7")
        self.refused("recommend", "results", "planar-chain", "--error", "1mm", naming=["version 7"])

    def test_margin_names_the_limit_that_a_larger_timestep_exceeds(self):
        self.measure()
        errors = self.values("consistency")
        limit = 1.5 * errors["mujoco-rk4", 1.0]
        told = self.assay_json("recommend", "results", "planar-chain", "--error", f"{limit * 1e3}mm",
                               "--measure", "consistency", "--json")
        best = told["recommended"]
        larger = {at[1]: error for at, error in errors.items() if at[0] == best["contender"] and at[1] > best["timestep_ms"]}
        first = min((step for step, error in larger.items() if error > limit), default=None)
        self.assertIsNotNone(first, "a limit that some timestep exceeds")
        self.assertEqual(best["exceeds"], {"timestep_ms": first, "value": "consistency", "worst": larger[first]})
        status, text = self.on_terminal("recommend", "results", "planar-chain", "--error", f"{limit * 1e3}mm",
                                        "--measure", "consistency", NO_COLOR="1")
        self.assertIn(f"at {first / best['timestep_ms']:g} times this step ({first:g} ms), above the limit",
                      " ".join(text.split()))

    def test_several_limits_and_what_is_left_out(self):
        self.measure()
        told = self.assay_json("recommend", "results", "planar-chain", "--error", "1m", "--measure", "truth",
                               "--limit", "energy_drift=1J", "--realtime", "0.1", "--json")
        self.assertEqual([limit["value"] for limit in told["limits"]], ["truth_error_max", "energy_drift"])
        self.assertEqual(told["realtime"], 0.1)
        self.assertTrue(told["recommended"]["timed"])
        # 1/8 and 1/4 ms lie below what was timed
        self.assertEqual({tuple(group["timesteps_ms"]) for group in told["excluded"]}, {(0.125, 0.25)})
        status, text = self.on_terminal("recommend", "results", "planar-chain", "--error", "1m", "--measure", "consistency",
                                        "--realtime", "0.1", NO_COLOR="1")
        self.assertEqual(status, 0, text)
        self.assertLessEqual(max(map(len, text.splitlines())), 80)
        text = " ".join(text.split())
        for part in ("margin:", "Not considered", "not timed", "self-consistency is not accuracy"):
            self.assertIn(part, text)
        self.refused("recommend", "results", "planar-chain", "--error", "1m", "--realtime", "1e12", status=1,
                     naming=["relax the speed to ", "real time"])

    def engine_seconds(self, out):
        with contextlib.closing(sqlite3.connect(self.dir / out / "assay.sqlite")) as db:
            return {row[0]: row[1] for row in
                    db.execute("SELECT contender, engine_s FROM cells WHERE measure = 'reference'")}

    def test_references_are_computed_once(self):
        self.measure("small", [1], "one")
        self.assertEqual(len(list((self.dir / "cache/assay/references").glob("*.bin"))), 5, "two references, the pieces of each, one truth")
        self.measure("other", [4], "two")
        for contender in ("mujoco-euler", "mujoco-rk4"):
            self.assertGreater(self.engine_seconds("one")[contender], 0)
            self.assertEqual(self.engine_seconds("two")[contender], 0)
        self.assertEqual(self.values("consistency", "one"), self.values("consistency", "two"))
        # kept elsewhere, or nowhere; what a directory has does not depend on it
        self.measure("third", [2], "three", "--references", "mine")
        self.assertEqual(len(list((self.dir / "mine").glob("*.bin"))), 5)
        self.measure("fourth", [2], "four", "--references", "off")
        self.assertGreater(self.engine_seconds("four")["mujoco-rk4"], 0)
        shutil.rmtree(self.dir / "cache")
        shutil.rmtree(self.dir / "mine")
        self.assertEqual(self.values("consistency", "three"), self.values("consistency", "one"))

    def test_plan_and_share_are_told(self):
        self.write("small.toml", small(timing=[1]))
        done = self.run_assay("run", "small.toml", "--out", "results")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"planar-chain: 2 contenders; .*consistency 8.*raw_speed 2.*; about \d")
        self.assertRegex(done.stdout, r"inside engine steps: [0-9.]+ % of the campaign's processor time")

    def test_settings_are_a_curve_and_the_answer_names_them(self):
        """campaigns/quick-settings.toml, the quick part of settings.toml."""
        known = {row["contender"]: row for row in self.assay_json("engines", "--json")["contenders"]}
        done = self.run_assay("run", "quick-settings", "--out", "results", "--references", "off")
        self.assertEqual(done.returncode, 0, done.stderr)
        if "havok" in known:  # before anything is measured
            self.assertIn("note: a sweep leaves 'havok' as it is: its engine has no setting for 'iterations'", done.stderr)
        depths = self.values("penetration_added_max")
        names = {name for name, _ in depths}
        swept = {"mujoco-euler", "mujoco-euler it=2", "mujoco-euler it=10", "mujoco-euler contact_timeconst=0.005"}
        self.assertLessEqual(swept, names)
        self.assertLess(depths["mujoco-euler contact_timeconst=0.005", 1.0], 0.8 * depths["mujoco-euler", 1.0],
                        "stiffer contacts sink less")
        # each contender that was varied once, with the settings that it takes
        told = self.assay_json("recommend", "results", "capsules-8", "--error", "1m", "--measure", "consistency", "--penetration", "any",
                               "--json")
        lines = [row["varies"] for row in told["contenders"]]
        self.assertEqual(len(lines), len(set(lines)), lines)
        self.assertEqual(set(lines), {name for name in ("mujoco-euler", "ode-quick", "havok") if name in known})
        for row in told["contenders"]:
            self.assertEqual(row["contender"].split(" ")[0], row["varies"])
            changed = {each["setting"]: each["value"] for each in row["settings"]}
            for word in row["contender"].split(" ")[1:]:
                name, value = word.split("=")
                self.assertEqual(changed[{"it": "iterations"}.get(name, name)], value)
        # every question about contacts limits them, and says so
        told = self.assay_json("recommend", "results", "capsules-8", "--error", "1m", "--json")
        limits = {limit["value"]: limit["default"] for limit in told["limits"]}
        self.assertEqual(limits, {"consistency_cold": False, "penetration_added_max": True})
        self.refused("recommend", "results", "capsules-8", "--error", "1m", "--penetration", "any", "--limit", "penetration_max=1m",
                     naming=["--penetration is 'any'", "'penetration_max' is limited"])
        # within what only the stiff contacts keep, the answer is one of their points
        stiff = max(depth for (name, step), depth in depths.items()
                    if name == "mujoco-euler contact_timeconst=0.005" and step <= 1)
        told = self.assay_json("recommend", "results", "capsules-8", "--penetration", f"{stiff * 1.001}m", "--realtime", "1e-6",
                               "--json")
        row = next(row for row in told["contenders"] if row["varies"] == "mujoco-euler")
        self.assertEqual(row["contender"], "mujoco-euler contact_timeconst=0.005")
        change = next(each for each in row["settings"] if each["setting"] == "contact_timeconst")
        self.assertEqual((change["value"], change["default"], change["unit"]), ("0.005", "0.02", "s"))
        text = self.assay("recommend", "results", "capsules-8", "--penetration", f"{stiff * 1.001}m")
        if told["recommended"]["contender"] == row["contender"]:
            self.assertIn("contact_timeconst 0.005 s instead of 0.02 s", text)
        self.assertRegex(text, r"settings?:  ")


if __name__ == "__main__":
    main()
