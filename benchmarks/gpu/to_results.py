"""Makes a results directory of what run.py stored: to_results.py RECORDS STATES MODELS OUT, each but OUT a file or folder of run.py.

OUT/assay.sqlite is a database of schema version 1, which the program migrates and hashes when it opens it to write (`assay merge`).
OUT/checks.csv has what the program has no values for. Needs MuJoCo, NumPy and worker.py's adapters, no GPU.
"""

import csv
import hashlib
import json
import os
import pathlib
import re
import sqlite3
import sys

import checks
import numpy as np
from worker import CONTENDERS, FINE_WORLDS, KEPT, load_adapter, settings_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
BOUND_M = 1e-5  # src/measures/batch.cc: what rounding in single precision explains
OPTIONS = {"mjx-deterministic": "XLA_FLAGS=--xla_gpu_deterministic_ops=true",
           "mujoco-warp-deterministic": "option.deterministic: contacts, constraints and atomics"}
OUTCOMES = {"ok": "ok", "out-of-memory": "crashed", "missing": "unsupported"}
COLUMNS = ("contender", "model", "worlds", "outcome", "reason", "threads", "world_steps_per_s", "low", "high", "simulated_s_per_s",
           "single_step_ms", "first_step_s", "create_s", "memory_bytes_per_world", "process_gpu_bytes", "from_alone_m", "compared_worlds",
           "same_bits", "worlds_with_other_bits", "error_to_reference_m", "largest_error_to_reference_m", "error_to_fine_step_m",
           "share_within_1mm", "depth_m", "largest_depth_m", "energy_to_fine_step_J", "not_finite_worlds")


def lines(path):
    with open(path, encoding="utf-8") as file:
        return [json.loads(line) for line in file if line.endswith("\n")]


def schema():
    """The tables of version 1, by the program's own source."""
    source = (ROOT / "src/results/store/schema.cc").read_text("utf-8")
    now, first = (re.search(rf"{name} = R\"sql\((.*?)\)sql\"", source, re.S).group(1) for name in ("kSchema", "kVersion1"))
    old = {re.search(r"TABLE (\"?\w+\"?)", each).group(1): each for each in first.split(";") if "CREATE" in each}
    for each in now.split(";"):
        name = re.search(r"TABLE (\"?\w+\"?)", each)
        if name and name.group(1) not in (*old, "scenes", "nodes", "plan", "hashes"):
            old[name.group(1)] = each
    application = int(re.search(r"kApplicationId = (0x\w+)", (ROOT / "src/results/store/store.cc").read_text("utf-8")).group(1), 16)
    return ";\n".join(old.values()) + f";\nPRAGMA application_id = {application}; PRAGMA user_version = 1;"


def interval(samples, rng=None):
    """Median and its bootstrap interval (95 %)."""
    samples, rng = np.array(samples), np.random.default_rng(0)
    medians = np.median(rng.choice(samples, (2000, len(samples))), axis=1)
    return float(np.median(samples)), float(np.quantile(medians, 0.025)), float(np.quantile(medians, 0.975))


class Results:
    def __init__(self, records, states, models, out):
        last = {record["cell"]: record for record in lines(records)}  # the last of a cell counts
        self.records = {record["cell"]: record for record in sorted(
            last.values(), key=lambda record: (record["model"], record["contender"], record["worlds"]))}
        self.states = {(row["cell"], row["name"]): checks.unpacked(row) for row in lines(states)}
        self.models = {model: checks.Model(os.path.join(models, model + ".json"))
                       for model in sorted({record["model"] for record in self.records.values()})}
        self.references = {name: model.reference() for name, model in self.models.items()}
        self.out = pathlib.Path(out)

    def checked(self, record):
        """Values of a cell's states."""
        model, reference = self.models[record["model"]], self.references[record["model"]]
        equal, found = self.states.get((record["cell"], "equal")), {}
        if equal is None:
            return found
        alone = self.states.get((record["cell"].replace(f"/{record['worlds']}/", "/1/"), "alone"))
        worlds = min(record["worlds"], KEPT)
        if alone is not None:
            apart = checks.distances(model.centres(equal[:worlds]), model.centres(alone[:worlds]))
            found["from_alone_m"], found["compared_worlds"] = float(apart.max()), worlds
        if worlds >= KEPT:
            count = FINE_WORLDS if record["worlds"] == FINE_WORLDS else KEPT
            centres = model.centres(equal[:count])
            error, depth = checks.distances(centres, reference[:count]), model.depths(equal[:count])
            found.update(error_to_reference_m=float(np.median(error)), largest_error_to_reference_m=float(error.max()),
                         share_within_1mm=float(np.mean(error < 1e-3)), depth_m=float(np.median(depth)),
                         largest_depth_m=float(depth.max()))
            fine = self.states.get((record["cell"], "fine"))
            if fine is not None:
                found["error_to_fine_step_m"] = float(np.median(checks.distances(centres, model.centres(fine))))
                found["energy_to_fine_step_J"] = float(np.median(np.abs(model.energies(equal[:count]) - model.energies(fine))))
        return found

    def row(self, record):
        row = {"contender": record["contender"], "model": record["model"], "worlds": record.get("worlds_stepped", record["worlds"]),
               "threads": record.get("threads", ""), "outcome": record["outcome"], "reason": record["reason"]}
        if record["outcome"] != "ok":
            return row
        per_window = row["worlds"] * record["steps_in_window"]
        middle, low, high = interval(record["window_s"])
        timestep_s = record.get("timestep_s") or self.models[record["model"]].timestep_s
        row.update(world_steps_per_s=per_window / middle, low=per_window / high, high=per_window / low,
                   simulated_s_per_s=timestep_s * per_window / middle,
                   not_finite_worlds=record.get("not_finite_at_end", "") or record.get("not_finite_after_32", 0))
        for name, given, factor in (("single_step_ms", "single_step_s", 1e3),):
            if record.get(given):
                row[name] = factor * float(np.median(record[given]))
        for name, given in (("first_step_s", "first_step_s"), ("create_s", "created_s"), ("process_gpu_bytes", "gpu_process_bytes"),
                            ("same_bits", "same_bits"), ("worlds_with_other_bits", "worlds_with_other_bits")):
            row[name] = record.get(given, "")
        if record.get("memory_bytes"):
            row["memory_bytes_per_world"] = record["memory_bytes"] / row["worlds"]
        row.update(self.checked(record))
        if row.get("from_alone_m", 0) > BOUND_M:
            row["outcome"] = "diverged"
            row["reason"] = (f"a world of {row['worlds']} is {row['from_alone_m']:.2g} m from its run alone after 32 steps, where rounding "
                             f"explains {BOUND_M:g} m")
        return row

    def write(self):
        self.out.mkdir(parents=True, exist_ok=True)
        rows = [self.row(record) for record in self.records.values()]
        with open(self.out / "checks.csv", "w", newline="", encoding="utf-8") as file:
            table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            table.writeheader()
            for row in rows:
                table.writerow({name: f"{value:.6g}" if isinstance(value, float) else value for name, value in row.items()})
        (self.out / "assay.sqlite").unlink(missing_ok=True)
        db = sqlite3.connect(self.out / "assay.sqlite")
        db.executescript(schema())
        self.fill(db, rows)
        db.commit()
        db.close()

    def fill(self, db, rows):
        with open(self.out / "machine.json", encoding="utf-8") as file:
            machine = json.load(file)
        times = [record["time"] for record in self.records.values()]
        manifest = {"assay_version": "0.1.0", "build_type": "Release", "campaign": "gpu", "campaign_hash": "", "commit": machine["commit"],
                    "campaign_title": "Many worlds on a GPU", "command": "benchmarks/gpu/run.sh", "compiler": "", "flags": "",
                    "cores": str(machine["processors"]), "cpu": machine["cpu"], "cpu_s": "0", "engine_s": "0", "seed": "0",
                    "finished": machine["finished"], "started": machine["started"], "governor": "unknown",
                    "kernel": machine["kernel"], "memory": machine["memory"], "sandbox": "none", "virtual_machine": "yes",
                    "timing": machine["timing"], "wall_s": f"{max(times) - min(times):.0f}", "device cuda:0": machine["gpu"]}
        manifest["part"] = hashlib.sha256(json.dumps(manifest, sort_keys=True).encode()).hexdigest()[:32]
        db.executemany("INSERT INTO manifest VALUES(?, ?)", manifest.items())
        for name, model in self.models.items():
            db.execute("INSERT INTO systems VALUES(?, ?)", (name, json.dumps(self.system(name, model))))
        contenders = {}
        for cell, (record, row) in enumerate(zip(self.records.values(), rows), start=1):
            name = record["contender"] + (f"-{record['threads']}-threads" if record.get("threads") else "")
            contenders.setdefault(name, record)
            measure = f"batch-{row['worlds']}" + ("" if record.get("threads") else f"-{record['cell'].rpartition('/')[2]}")
            timestep_ms = 1e3 * (record.get("timestep_s") or self.models[record["model"]].timestep_s)
            key = hashlib.sha256(record["cell"].encode()).hexdigest()[:32]
            outcome = OUTCOMES.get(row["outcome"], row["outcome"])
            # the anchor has a model of its own
            system = record["model"] if not record["contender"].endswith("anchor") else "mujoco-warp-humanoid"
            db.execute("INSERT INTO cells VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, 0, ?, 0, ?, ?)", (
                cell, key, system, name, timestep_ms, measure, outcome, row["reason"],
                record.get("since_start_s", 0.0), sum(record.get("window_s", ())), record["time"], record["time"]))
            db.executemany('INSERT INTO "values" VALUES(?, ?, ?, ?, ?, ?)', [(cell, *each) for each in self.values(record, row)])
            for kind, samples in (("batch_step_time_us", [1e6 * each / record.get("steps_in_window", 1) for each in record.get("window_s", ())]),
                                  ("batch_latency_us", [1e6 * each for each in record.get("single_step_s", ())])):
                db.executemany("INSERT INTO samples VALUES(?, ?, ?, ?)", [(cell, kind, i, each) for i, each in enumerate(samples)])
        if any(record["contender"].endswith("anchor") for record in self.records.values()):
            facts = self.system("humanoid", self.models["humanoid"])
            db.execute("INSERT INTO systems VALUES(?, ?)", ("mujoco-warp-humanoid", json.dumps(
                {**facts, "model": "test_data/humanoid/humanoid.xml of mujoco-warp", "model_hash": "", "timesteps_ms": [5.0],
                 "timing_ms": [5.0]})))
        for name, record in contenders.items():
            db.execute("INSERT INTO contenders VALUES(?, ?, ?, ?, ?, ?, ?)", self.contender(name, record))

    def system(self, name, model):
        records = [record for record in self.records.values() if record["model"] == name]
        m, timestep_ms = model.model, 1e3 * model.timestep_s
        return {"bodies": len(m.bodies), "contact_pairs": len(m.contacts), "contacts": True, "control": "passive",
                "dof": model.compiled.mujoco.nv, "duration_s": 2.048, "gravity": list(m.gravity), "hinges": len(m.joints),
                "mass_kg": sum(body.mass for body in m.bodies), "measures": ["batch"], "model": name + ".xml", "model_hash": m.hash,
                "piece_ms": 128.0, "pieces": 10, "reference_ms": timestep_ms / checks.REFERENCE, "sample_ms": timestep_ms,
                "shapes": len(m.shapes), "timesteps_ms": [timestep_ms], "timing_ms": [timestep_ms],
                "worlds": sorted({record["worlds"] for record in records if not record.get("threads")})}

    def values(self, record, row):
        found = [("batch_worlds", "1", float(row["worlds"]), None, None)]
        if "from_alone_m" in row:
            found += [("batch_equivalence", "m", row["from_alone_m"], None, None), ("batch_bound", "m", BOUND_M, None, None),
                      ("batch_compared", "1", float(row["compared_worlds"]), None, None)]
        if row["outcome"] != "ok":
            return found
        step = [1e6 * each / record["steps_in_window"] for each in interval(record["window_s"])]
        found += [("batch_rate", "1/s", row["world_steps_per_s"], row["low"], row["high"]), ("batch_step_time", "us", *step)]
        if record.get("single_step_s"):
            found.append(("batch_latency", "us", *(1e6 * each for each in interval(record["single_step_s"]))))
        if record.get("memory_bytes"):
            found.append(("batch_memory", "B", float(record["memory_bytes"]), None, None))
        if record.get("compile_s"):
            found.append(("batch_compile_time", "s", record["compile_s"], None, None))
        return found

    def contender(self, name, record):
        folder, chosen = CONTENDERS.get(record["contender"], ("mujoco-warp", {}))
        assay, engine = load_adapter(str(ROOT), folder, "")
        capabilities = {key: value for key, value in vars(engine.capabilities(settings_of(assay, engine, chosen, 1e-3))).items()
                        if key not in ("features", "deviations", "contact_forces_note")}
        if record["contender"] == "mujoco-rollout":
            capabilities.update(precision="double", threads=record["threads"], other="MuJoCo's own rollout")
        defaults = {each.name: each for each in engine.settings()}
        if record["contender"] in OPTIONS:
            capabilities["other"] = OPTIONS[record["contender"]]
        capabilities["changes"] = [{"setting": key, "value": str(value), "default": str(defaults[key].default), "unit": defaults[key].unit,
                                    "meaning": defaults[key].meaning} for key, value in chosen.items()]
        capabilities.update(contact_forces="not given", deviations=[])
        build = {"build": "wheels", "compiler": str(engine.compiler), "flags": "for this GPU", "plugin": "", "source": "PyPI " + ", ".join(
            f"{key} {value}" for key, value in record.get("versions", {}).items()), "version": str(engine.version)}
        return (name, folder if record["contender"] != "mujoco-rollout" else "mujoco", str(engine.version), name,
                ",".join(f"{key}={value}" for key, value in chosen.items()), json.dumps(capabilities, sort_keys=True),
                json.dumps(build, sort_keys=True))


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    Results(*sys.argv[1:]).write()
