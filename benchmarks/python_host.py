#!/usr/bin/env python3
"""What the host of adapters in Python costs.

    benchmarks/python_host.py build/release/bin/assay_benchmark_python_host [--pairs 15] [--contenders NAME...]

An empty advance(), and for each engine that is installed its chain of five links through the interface, against the same
chain in a program that uses the engine's package alone (benchmarks/direct_<engine>.py), in turns, each in a process of its
own. The figure is the median of the paired ratios with its bootstrap interval (95 %). Prints the rows of
benchmarks/README.md.
"""

import argparse
import json
import os
import pathlib
import random
import statistics
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
# contender: script, its arguments
DIRECT = {"drake-sap": ("direct_drake.py", "discrete"), "drake-rk3": ("direct_drake.py", "runge_kutta3"), "mjx": ("direct_mjx.py",),
          "mujoco-warp": ("direct_mujoco-warp.py", "Euler"), "mujoco-warp-rk4": ("direct_mujoco-warp.py", "RK4"),
          "newton-featherstone": ("direct_newton.py", "featherstone"), "newton-steel": ("direct_newton.py", "steel"),
          "newton-mujoco": ("direct_newton.py", "mujoco"), "dartpy": ("direct_dartpy.py",), "genesis": ("direct_genesis.py",),
          "sapien-tgs": ("direct_sapien.py", "tgs"), "sapien-pgs": ("direct_sapien.py", "pgs"),
          "superdex": ("direct_superdex.py",)}

EMPTY = """
import assay_adapter as assay


class Engine(assay.Engine):
    environment = {environment!r}

    def contenders(self):
        return [assay.Contender(name="empty", summary="does nothing")]

    def capabilities(self, settings):
        return assay.Capabilities(integrator="none")

    def create(self, model, state, settings):
        return Simulation()


class Simulation:
    def advance(self, count):
        pass

    def read_state(self):
        return {{}}
"""


def run(*command, **environment):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True,
                          env={**os.environ, **environment})
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}: {done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def interval(ratios):
    draws = sorted(statistics.median(random.choices(ratios, k=len(ratios))) for _ in range(2000))
    return draws[50], draws[1949]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--contenders", nargs="+", choices=DIRECT, default=list(DIRECT))
    arguments = parser.parse_args()
    engines = pathlib.Path(arguments.program).resolve().parents[1] / "engines"
    search = [engines] + [pathlib.Path(folder) for folder in os.environ.get("ASSAY_ENGINE_PATH", "").split(":") if folder]
    print("| contender | through assay, µs a step | package alone, µs a step | ratio [95 %] |\n| --- | --- | --- | --- |")
    environment = None
    for contender in arguments.contenders:
        script, *more = DIRECT[contender]
        name = script.removeprefix("direct_").removesuffix(".py")
        found = [folder / f"assay-engine-{name}/environment.txt" for folder in search]
        found = [file for file in found if file.exists()]
        if not found:
            continue
        environment = found[0].read_text().strip()
        pairs = []
        for i in range(arguments.pairs):
            through = lambda: statistics.median(run(arguments.program, contender))
            alone = lambda: statistics.median(run(f"{environment}/bin/python", HERE / script, *more))
            pairs.append((through(), alone()) if i % 2 else tuple(reversed((alone(), through()))))
        ratios = [a / b for a, b in pairs]
        low, high = interval(ratios)
        print(f"| `{contender}` | {statistics.median(a for a, _ in pairs):.2f} | "
              f"{statistics.median(b for _, b in pairs):.2f} | {statistics.median(ratios):.3f} [{low:.3f}, {high:.3f}] |")
    if environment is None:
        raise SystemExit("no engine with an adapter in Python is installed: run ./assay setup drake")
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "assay-engine-empty.py").write_text(EMPTY.format(environment=environment))
        times = run(arguments.program, "empty", "--steps", 1, "--calls", 200000,
                    ASSAY_ENGINE_PATH=f"{folder}:{os.environ.get('ASSAY_ENGINE_PATH', '')}")
    print(f"\nAn empty advance(1): {statistics.median(times):.3f} µs a call.")


if __name__ == "__main__":
    main()
