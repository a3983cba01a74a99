#!/usr/bin/env python3
"""The largest timestep that holds the grasp's object, against the bound of an explicit damper.

    benchmarks/grasp_damper.py ASSAY [--out DIR] [--page docs/lab/self-consistency.md] [--jobs N]

Varies the damping B of the fingers and their armature, measures at which timesteps each contender holds the object, and
compares the largest with the bound 2 I / B that `assay check` computes from the model. I is what the damper of the smallest
link feels, armature included, while the other joints are held, as a grasp does, or free. Writes the table and the figure
of the page. The measurement resumes where it was stopped.
"""

import argparse
import json
import pathlib
import sqlite3
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "docs"))
from tables.plain_figure import Plot  # noqa: E402
from tables.common import milliseconds, table, updated  # noqa: E402

SPRINGS = 'stiffness="0.4" damping="0.005"'  # of the fingers in models/grasp.xml
DAMPING = (0.00125, 0.0025, 0.005, 0.01)  # Nms/rad
ARMATURE = (0, 3e-6)  # kg m^2
STEPS = ("1/4", "3/8", "1/2", "3/4", "1", "3/2", "2", "3", "4", "6", "8", "12", "16")  # ms
# name: whether the damper is explicit, the multiple of I/B that bounds its timestep, colour
CONTENDERS = {
    "mujoco-euler-explicit-pd": ("explicit, Euler", 2, "#1463c4"),
    "mujoco-rk4-explicit-pd": ("explicit, Runge-Kutta 4", 2.785, "#74a9e6"),
    "ode-quick": ("explicit, Euler", 2, "#2b8a3e"),
    "bullet-mb": ("explicit, Euler", 2, "#d4590c"),
    "physx-d6-pgs": ("explicit, Euler", 2, "#8a2be2"),
    "jolt-f32": ("explicit, Euler", 2, "#0b7285"),
    "mujoco-euler": ("implicit", None, "#1463c4"),
    "physx-d6-pgs-native-pd": ("implicit", None, "#8a2be2"),
}


def variants():
    return [(damping, armature) for armature in ARMATURE for damping in DAMPING]


def name_of(damping, armature):
    return f"grasp-b{damping:g}-a{armature:g}"


def write_models(folder):
    text = (ROOT / "models" / "grasp.xml").read_text(encoding="utf-8")
    if text.count(SPRINGS) != 1:
        sys.exit(f"models/grasp.xml does not have {SPRINGS} once: adapt this script")
    for damping, armature in variants():
        changed = text.replace(SPRINGS, f'stiffness="0.4" damping="{damping:g}" armature="{armature:g}"')
        (folder / f"{name_of(damping, armature)}.xml").write_text(changed, encoding="utf-8")


def write_campaign(folder, contenders):
    steps = ", ".join(f'"{step}"' for step in STEPS)
    text = f'name = "grasp-damper"\ncontenders = {json.dumps(contenders)}\ntimesteps_ms = [{steps}]\nmeasures = ["grasp"]\n'
    for damping, armature in variants():
        name = name_of(damping, armature)
        text += (f'\n[[system]]\nname = "{name}"\nmodel = "./{name}.xml"\nduration_s = 2.016\nsample_ms = 48\n'
                 'control = "actuators"\ngrasp = {object = "object", hand = "palm"}\n')
        if armature > 0:
            able = [each for each in contenders if each.startswith("mujoco")]
            text += f"contenders = {json.dumps(able)}\n"
    path = folder / "campaign.toml"
    path.write_text(text, encoding="utf-8")
    return path


def smallest_bounds(program, model):
    """2 I / B of the damper that bears the smallest timestep, ms: with the other joints free, and held."""
    done = subprocess.run([program, "check", model, "--json"], check=True, capture_output=True, text=True)
    springs = json.loads(done.stdout)["timestep"]["springs"]["springs"]
    return tuple(min(spring[key] for spring in springs if spring[key] is not None) for key in ("damper_ms", "damper_held_ms"))


def largest_held(db, system, contender):
    """The largest timestep up to which the object is held at every smaller one, ms; None where it never is."""
    largest = None
    for timestep, outcome, held in db.execute(
            'SELECT timestep_ms, outcome, (SELECT value FROM "values" WHERE cell_id = id AND name = \'grasp_held\') FROM cells'
            " WHERE system = ? AND contender = ? AND measure = 'grasp' ORDER BY timestep_ms", (system, contender)):
        if outcome != "ok" or held != 1:
            break
        largest = timestep
    return largest


def results(program, out):
    with sqlite3.connect(out / "results" / "assay.sqlite") as db:
        for damping, armature in variants():
            name = name_of(damping, armature)
            free, held = smallest_bounds(program, out / f"{name}.xml")
            for contender, (kind, multiple, color) in CONTENDERS.items():
                largest = largest_held(db, name, contender)
                if largest is not None:
                    scale = None if multiple is None else multiple / 2
                    yield damping, armature, contender, kind, free, held, scale, largest, color


def write_page(page, rows):
    lines, explicit = [], []
    for damping, armature, contender, kind, free, held, scale, largest, _ in rows:
        cells = [f"{1000 * damping:g}", f"{1e6 * armature:g}", f"`{contender}`", kind]
        if scale is None:
            cells += ["none", milliseconds(largest), ""]
        else:
            explicit.append((largest, free * scale, held * scale))
            cells += [f"{free * scale:.2f} to {held * scale:.2f}", milliseconds(largest), f"{largest / (held * scale):.2f}"]
        lines.append(cells)
    inside = sum(free <= largest <= held for largest, free, held in explicit)
    to_free = [largest / free for largest, free, _ in explicit]
    to_held = [largest / held for largest, _, held in explicit]
    block = (f"While B varies by a factor of {max(DAMPING) / min(DAMPING):g}, the largest timestep of the {len(explicit)} cases with an explicit damper "
             f"stays within {min(to_free):.2f} to {max(to_free):.2f} times the bound with the other joints free, and {min(to_held):.2f} to "
             f"{max(to_held):.2f} times the bound with them held; {inside} lie between the two. Timesteps were tried at "
             f"{', '.join(STEPS)} ms, from the model's own state.\n\n"
             "![Largest timestep that holds the object against 2I/B](grasp-damper.svg)\n\n")
    block += table(["B (mNms/rad)", "armature (1e-6 kg m²)", "contender", "damper", "bounds: joints free to held (ms)",
                    "holds up to (ms)", "over the held bound"], lines)
    plot = Plot("2I/B of the smallest link, other joints held (ms)", "largest timestep that holds (ms)",
                [row[5] for row in rows], [row[7] for row in rows])
    bounds = sorted({row[5] for row in rows})
    plot.line([(bounds[0], bounds[0]), (bounds[-1], bounds[-1])], "#888888", "4 3")
    labelled = set()
    for _, _, contender, kind, _, held, _, largest, color in rows:
        fresh = contender not in labelled and held == bounds[-1]
        plot.mark(held, largest, color, contender if fresh else "", hollow=kind == "implicit")
        labelled |= {contender} if fresh else set()
    page.with_name("grasp-damper.svg").write_text(plot.svg(), encoding="utf-8")
    page.write_text(updated(page.read_text(encoding="utf-8"), {"damper": block}), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("grasp-damper"))
    parser.add_argument("--page", type=pathlib.Path, default=ROOT / "docs" / "self-consistency.md")
    parser.add_argument("--jobs", default="2")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    write_models(options.out)
    campaign = write_campaign(options.out, list(CONTENDERS))
    subprocess.run([options.program, "run", campaign, "--out", options.out / "results", "--jobs", options.jobs], check=True)
    write_page(options.page, list(results(options.program, options.out)))


if __name__ == "__main__":
    main()
