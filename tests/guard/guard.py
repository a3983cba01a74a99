#!/usr/bin/env python3
"""Guards a change of the program's structure: what every command says and answers on many inputs, before and after.

    tests/guard/guard.py record PROGRAM FOLDER     runs every case with that program, a file of FOLDER for each
    tests/guard/guard.py compare FOLDER FOLDER     names the cases that differ, with a diff; status 1 if there are any

The cases: models that load and models that are refused (inputs.py) in the commands that read one; a campaign and 30 faults
planted into it; damaged results; exports, claims, recommendations, comparisons and reports of every committed database; wrong
command lines. What differs from run to run by its nature, times that were measured and names of folders, is left out.
It takes some minutes on two cores, and runs on demand.
"""

import concurrent.futures
import difflib
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import inputs

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "results"))
import packed  # noqa: E402

SYSTEMS = ["astronaut", "capsules-27", "finger", "grasp", "humanoid", "planar-chain", "spatial-chain"]
CONTENDERS = ["mujoco-euler", "bullet-si-f64", "ode-step"]
COMMANDS = ["engines", "systems", "check", "parity", "conformance", "import", "simulate", "run", "paper", "submit", "status", "merge",
            "recommend", "transfer", "explain", "report", "compare", "history", "claims", "export", "movie", "snapshot"]
# Columns of an export that hold measured times, or what follows from them.
TIMED = re.compile(r"time|speed|realtime|throughput|_us\b|cost|load|warm|created|seconds")


class Case:
    """One run of the program. `files`: what it writes and what is compared too; `keep`: which rows of its output count."""

    def __init__(self, name, *arguments, files=(), keep=None):
        self.name, self.arguments, self.files, self.keep = name, arguments, files, keep


def results():
    return sorted(path.parent for path in (SOURCE / "results").glob("*/assay.sqlite.xz"))


def model_cases():
    names = [*SYSTEMS, *inputs.MODELS]
    for name in names:
        yield Case(f"check {name}", "check", name)
        yield Case(f"check json {name}", "check", name, "--json")
        for contender in CONTENDERS if name in SYSTEMS else CONTENDERS[:1]:
            yield Case(f"simulate {name} {contender}", "simulate", name, "--engine", contender, "--timestep", "1", "--duration", "0.02",
                       "--sample", "5", "--out", "-")
    for name in inputs.MODELS:
        yield Case(f"parity {name}", "parity", name, *CONTENDERS, "--samples", "2", "--json")
    for name in ("fluid.xml", "muscle.xml", "flex.xml", "spatial-tendon.xml", "two-roots.urdf"):
        yield Case(f"drop {name}", "check", name, "--drop-unsupported")
    for name in ("impossible-inertia.urdf", "swapped-limits.urdf", "no-mass.xml"):
        yield Case(f"repair {name}", "check", name, "--repair", f"mended-{name}", files=[f"mended-{name}"])
        yield Case(f"repair in memory {name}", "simulate", name, "--repair", "--engine", "mujoco-euler", "--timestep", "1", "--duration",
                   "0.01", "--out", "-")
    for switch in (["--floating-base"], ["--fixed-base"], ["--ground"], ["--no-ground"], ["--within-limits"], ["--keyframe", "0"],
                   ["--keyframe", "none"], ["--allow-external-files"], ["--qpos", "none.txt"]):
        for name in ("arm.urdf", "arm-position.xml"):
            yield Case(f"check {name} {' '.join(switch)}", "check", name, *switch)
    for control in ("passive", "actuators", "hold", "random,seed=3", "sine,amplitude=1,frequency=2", "none.csv", "hold,speed=3"):
        yield Case(f"control {control}", "simulate", "arm-position.xml", "--control", control, "--engine", "ode-step", "--timestep", "1",
                   "--duration", "0.02", "--out", "-")
    yield Case("explain", "explain", "arm-springs.xml", "mujoco-euler", "ode-step", "--seconds", "0.2", "--seeds", "2", "--jobs", "1", "--json")


def campaign_cases():
    yield Case("run", "run", "guard.toml", "--out", "guard-results", "--jobs", "1", "--no-set-up", keep=lambda line: False)
    for fault in inputs.CAMPAIGN_FAULTS:
        yield Case(f"campaign {fault}", "run", f"{fault}.toml", "--out", f"{fault}-results", "--jobs", "1", "--no-set-up")
    for damage in ("truncated", "flipped", "empty", "text"):
        yield Case(f"damaged {damage}", "export", f"damaged-{damage}", "--format", "csv")
        yield Case(f"damaged {damage} report", "report", f"damaged-{damage}")
    yield Case("removed", "recommend", "none", "all", "--error", "1mm")


def after_campaign_cases():
    yield Case("run: values", "export", "guard-results", "--format", "csv", keep=lambda line: not TIMED.search(line))
    yield Case("run: status", "status", "guard-results", "--json", keep=lambda line: not TIMED.search(line))


def database_cases():
    folders = [path.name for path in results()]
    for name in folders:
        yield Case(f"{name}: export", "export", name, "--format", "csv")
        yield Case(f"{name}: export json", "export", name, "--format", "json")
        yield Case(f"{name}: claims", "claims", name)
        yield Case(f"{name}: claims json", "claims", name, "--json")
        yield Case(f"{name}: status", "status", name)
        yield Case(f"{name}: transfer", "transfer", name, "--json")
        for limits in (["--error", "1mm"], ["--error", "10%"], ["--error", "10mm", "--realtime", "5"], ["--error", "1%", "--measure", "consistency"],
                       ["--error", "1mm", "--penetration", "2mm", "--slip", "5mm"]):
            yield Case(f"{name}: recommend {' '.join(limits)}", "recommend", name, "all", *limits)
            yield Case(f"{name}: recommend json {' '.join(limits)}", "recommend", name, "all", *limits, "--json")
        yield Case(f"{name}: report", "report", name, files=[f"{name}/report.html"])
        yield Case(f"{name}: compare with itself", "compare", name, name, "--format", "json")
    for other in folders[1:]:
        yield Case(f"compare {folders[0]} {other}", "compare", folders[0], other, "--across-machines", "--across-programs")
    yield Case("history", "history", *folders, "--across-machines", "--across-programs")
    yield Case("merge", "merge", *folders[:2], "--out", "merged")


def command_line_cases():
    yield Case("help", "--help")
    yield Case("version", "--version", keep=lambda line: False)
    yield Case("no command")
    yield Case("engines", "engines")
    yield Case("engines features", "engines", "--features", "--markdown")
    yield Case("systems", "systems")
    yield Case("conformance", "conformance", "mujoco-euler", "ode-step", "--json")
    yield Case("systems json", "systems", "--json")
    for command in COMMANDS:
        yield Case(f"{command} help", command, "--help")
        if command not in ("paper", "conformance"):  # these need nothing, and take minutes
            yield Case(f"{command} nothing", command)
        yield Case(f"{command} unknown option", command, "--speed")
        yield Case(f"{command} too much", command, "arm.xml", "b", "c", "d", "--out", "none/x")
    for case in (["--engine", "none"], ["--engine", "ode-step", "--timestep", "0"], ["--engine", "ode-step", "--timestep", "1/3"],
                 ["--engine", "ode-step", "--duration", "-1"], ["--engine", "ode-step", "--set", "speed=1"],
                 ["--engine", "ode-step", "--gravity", "maybe"]):
        given = {"--timestep": "1", "--duration": "0.01", "--out": "-", **dict(zip(case[::2], case[1::2]))}
        yield Case(f"simulate {' '.join(case)}", "simulate", "arm.xml", *[word for pair in given.items() for word in pair])


def write_inputs(work):
    for name, text in inputs.MODELS.items():
        (work / name).write_text(text, encoding="utf-8")
    (work / "guard.toml").write_text(inputs.CAMPAIGN, encoding="utf-8")
    for name, (text, planted) in inputs.CAMPAIGN_FAULTS.items():
        if text not in inputs.CAMPAIGN:
            sys.exit(f"guard: the fault {name} has nothing to be planted into")
        (work / f"{name}.toml").write_text(inputs.CAMPAIGN.replace(text, planted, 1), encoding="utf-8")
    for folder in results():
        packed.database(folder, work / folder.name)
    whole = (work / results()[0].name / "assay.sqlite").read_bytes()
    flipped = bytearray(whole)
    for place in range(5000, len(flipped), 4096):
        flipped[place] ^= 0x20
    for name, content in (("truncated", whole[: len(whole) // 2]), ("flipped", bytes(flipped)), ("empty", b""), ("text", b"no database\n")):
        (work / f"damaged-{name}").mkdir()
        (work / f"damaged-{name}" / "assay.sqlite").write_bytes(content)


def run(case, program, work):
    environment = {key: value for key, value in os.environ.items() if not key.startswith("ASSAY_")}
    environment.update(XDG_CACHE_HOME=str(work / "cache"), NO_COLOR="1", COLUMNS="120")
    done = subprocess.run([program, *case.arguments], cwd=work, env=environment, capture_output=True, stdin=subprocess.DEVNULL,
                          timeout=900, check=False)

    def plain(content):
        text = content.decode(errors="replace").replace(str(work), "WORK").replace(str(program), "assay")
        text = re.sub(r"[0-9.]+ m?s\b(?= of| each|$)", "TIME", text)
        return "".join(line for line in text.splitlines(keepends=True) if case.keep is None or case.keep(line))

    parts = [f"$ assay {' '.join(case.arguments)}\nstatus {done.returncode}\n", plain(done.stdout), "-- errors\n", plain(done.stderr)]
    for name in case.files:
        path = work / name
        content = path.read_bytes() if path.exists() else None
        parts.append(f"-- {name}: {'none' if content is None else hashlib.sha256(content).hexdigest()}\n")
    return "".join(parts)


def record(program, folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    program = pathlib.Path(program).resolve()
    with tempfile.TemporaryDirectory(prefix="assay-guard-") as scratch:
        work = pathlib.Path(scratch)
        write_inputs(work)
        first = [*command_line_cases(), *model_cases(), *campaign_cases(), *database_cases()]
        for cases in (first, list(after_campaign_cases())):
            with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
                for number, (case, text) in enumerate(zip(cases, pool.map(lambda each: run(each, program, work), cases)), 1):
                    (folder / (re.sub(r"[^\w.,=-]+", "_", case.name) + ".txt")).write_text(text, encoding="utf-8")
                    if number % 25 == 0:
                        print(f"guard: {number} of {len(cases)}", file=sys.stderr)


def compare(before, after):
    names = sorted({path.name for folder in (before, after) for path in pathlib.Path(folder).glob("*.txt")})
    different = 0
    for name in names:
        texts = [path.read_text(encoding="utf-8") if path.exists() else "" for path in (pathlib.Path(before, name), pathlib.Path(after, name))]
        if texts[0] == texts[1]:
            continue
        different += 1
        lines = list(difflib.unified_diff(*(text.splitlines() for text in texts), "before", "after", lineterm="", n=0))
        print(f"== {name}", *(line[:300] for line in lines[2:22]), sep="\n")
    print(f"{len(names) - different} cases equal, {different} different")
    return 1 if different or not names else 0


def main():
    if len(sys.argv) != 4 or sys.argv[1] not in ("record", "compare"):
        sys.exit(__doc__)
    if sys.argv[1] == "record":
        record(*sys.argv[2:])
    else:
        sys.exit(compare(*sys.argv[2:]))


if __name__ == "__main__":
    main()
