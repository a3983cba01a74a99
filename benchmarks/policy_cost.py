#!/usr/bin/env python3
"""What a policy costs beside the engine, with a network of two hidden layers of 256.

    benchmarks/policy_cost.py [CONTENDER...] [--program ./assay] [--width 256] [--duration 60] [--runs 5]

The quadruped's policy with its hidden layers widened by zeros, so that it walks as it did, in `assay simulate --time`. Of each
contender's runs the one whose engine and policy took the least time together counts, because other work on the machine only adds. Prints the table of
docs/lab/policies.md.
"""

import argparse
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/cli"))

from onnx_file import message, number, tensor  # noqa: E402

CONTENDERS = ["mujoco-euler", "ode-step", "dart", "jolt-f64", "bullet-mb", "ode-quick", "physx-art-tgs", "rapier-multibody-f64"]
GRAPH, INITIALIZER, DIMENSIONS, NAME, RAW = 7, 5, 1, 8, 9  # fields of ONNX' messages


def fields(data):
    """(number, value) of a protocol buffer; the value is bytes or an integer."""
    at = 0

    def varint_at(at):
        value = shift = 0
        while True:
            byte = data[at]
            value, shift, at = value | (byte & 127) << shift, shift + 7, at + 1
            if byte < 128:
                return value, at

    while at < len(data):
        key, at = varint_at(at)
        if key & 7 == 0:
            value, at = varint_at(at)
        elif key & 7 == 2:
            size, at = varint_at(at)
            value, at = data[at:at + size], at + size
        else:
            raise SystemExit("the network has fields that this program does not read")
        yield key >> 3, value


def again(field, value):
    return number(field, value) if isinstance(value, int) else message(field, value)


def widened(initializer, sizes, width):
    """The tensor with each dimension of a hidden layer's size padded by zeros."""
    shape, name, values = [], "", b""
    for field, value in fields(initializer):
        if field == DIMENSIONS:
            shape += [value] if isinstance(value, int) else packed(value)
        elif field == NAME:
            name = value.decode()
        elif field == RAW:
            values = struct.unpack(f"<{len(value) // 4}f", value)
    if not values:
        raise SystemExit(f"the network's tensor '{name}' does not hold its numbers as raw data")
    new = [width if size in sizes else size for size in shape]
    rows, columns = (1, shape[0]) if len(shape) == 1 else shape
    wide = [0.0] * ((new[0] if len(new) == 2 else 1) * new[-1])
    for row in range(rows):
        wide[row * new[-1]:row * new[-1] + columns] = values[row * columns:(row + 1) * columns]
    return tensor(name, new, wide)


def packed(data):
    numbers, value, shift = [], 0, 0
    for byte in data:
        value, shift = value | (byte & 127) << shift, shift + 7
        if byte < 128:
            numbers, value, shift = [*numbers, value], 0, 0
    return numbers


def widen(network, sizes, width):
    out = b""
    for field, value in fields(network):
        if field == GRAPH:
            value = b"".join(message(INITIALIZER, widened(each, sizes, width)) if of == INITIALIZER else again(of, each)
                             for of, each in fields(value))
        out += again(field, value)
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("contenders", nargs="*", default=CONTENDERS)
    parser.add_argument("--program", default=str(ROOT / "assay"))
    parser.add_argument("--width", type=int, default=256)
    parser.add_argument("--duration", type=float, default=60, help="s")
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    print("| contender | engine's step | policy, a control step of 4 steps | share of both | share of the run's wall time |\n"
          "| --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        example = shutil.copytree(ROOT / "examples/quadruped-policy", pathlib.Path(folder) / "policy")
        network = example / "policy.onnx"
        network.write_bytes(widen(network.read_bytes(), {128}, options.width))
        for contender in options.contenders:
            best = None
            for _ in range(options.runs):
                begin = time.monotonic()
                done = subprocess.run([options.program, "simulate", example / "quadruped.xml", "--engine", contender, "--policy-config",
                                       example / "policy.toml", "--timestep", "5", "--duration", str(options.duration), "--sample", "20",
                                       "--time", "--out", example / "run.csv"], capture_output=True, text=True)
                wall = time.monotonic() - begin
                engine, policy = (re.search(f"inside {what}: ([0-9.]+) s in [0-9]+ [a-z ]+, ([0-9.]+) us", done.stderr)
                                  for what in ("engine steps", "the policy"))
                if done.returncode != 0 or not engine or not policy:
                    sys.exit(f"{contender}: {done.stderr.strip()}")
                times = (float(engine[1]), float(engine[2]), float(policy[1]), float(policy[2]), wall)
                if best is None or times[0] + times[2] < best[0] + best[2]:
                    best = times
            engine_s, step_us, policy_s, act_us, wall = best
            print(f"| `{contender}` | {step_us:.3g} µs | {act_us:.3g} µs | {100 * policy_s / (engine_s + policy_s):.2g} % | "
                  f"{100 * policy_s / wall:.2g} % |", flush=True)


if __name__ == "__main__":
    main()
