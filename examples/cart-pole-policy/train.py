#!/usr/bin/env python3
"""Trains the policy of this folder: a network of two layers of 32 that balances the pole in MuJoCo.

The method is augmented random search: H. Mania, A. Guy, B. Recht, "Simple random search of static policies is competitive
for reinforcement learning", NeurIPS 2018 (version V1 with the best directions). It writes policy.onnx and training.json
beside itself. The same packages, seed and processor give the same network.

    python3 -m venv venv && venv/bin/pip install --require-hashes --no-deps -r requirements.txt
    venv/bin/python train.py
"""

import argparse
import json
import pathlib
import time

import mujoco
import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

HERE = pathlib.Path(__file__).resolve().parent

# The conventions of policy.toml.
TIMESTEP = 0.005  # s
DECIMATION = 4
FORCE = 10.0  # N at action 1
SECONDS = 10.0

HIDDEN = 32
OBSERVATIONS = 4  # cart position, pole angle, and their rates
ACTIONS = 1

# Widths of the uniform distributions that episodes start from: m, rad, m/s, rad/s.
START = np.array([0.4, 0.25, 0.4, 0.5])
FALLEN_POSITION, FALLEN_ANGLE = 2.4, 0.8


def sizes():
    return [(OBSERVATIONS, HIDDEN), (HIDDEN,), (HIDDEN, HIDDEN), (HIDDEN,), (HIDDEN, ACTIONS), (ACTIONS,)]


def unpacked(parameters):
    parts, at = [], 0
    for shape in sizes():
        count = int(np.prod(shape))
        parts.append(parameters[at : at + count].reshape(shape))
        at += count
    return parts


def action_of(parts, observation):
    hidden = np.tanh(observation @ parts[0] + parts[1])
    hidden = np.tanh(hidden @ parts[2] + parts[3])
    return np.tanh(hidden @ parts[4] + parts[5])


def episode(model, data, parameters, start):
    """The return of an episode, and whether the pole stayed up."""
    parts = unpacked(parameters)
    mujoco.mj_resetData(model, data)
    data.qpos[:] = start[:2]
    data.qvel[:] = start[2:]
    total, steps = 0.0, int(round(SECONDS / (TIMESTEP * DECIMATION)))
    for _ in range(steps):
        observation = np.concatenate([data.qpos, data.qvel])
        action = action_of(parts, observation)[0]
        data.ctrl[0] = FORCE * min(max(action, -1.0), 1.0)
        mujoco.mj_step(model, data, DECIMATION)
        position, angle = data.qpos
        if abs(position) > FALLEN_POSITION or abs(angle) > FALLEN_ANGLE:
            return total / steps, False
        total += 1 - 0.15 * position**2 - 0.5 * angle**2 - 0.02 * action**2 - 0.01 * (data.qvel[0] ** 2)
    return total / steps, True


def network(parameters, path):
    """Writes the network as ONNX: one observation in, one action out, both float32."""
    weights = [part.astype(np.float32) for part in unpacked(parameters)]
    names = ["w1", "b1", "w2", "b2", "w3", "b3"]
    nodes, last = [], "obs"
    for layer in range(3):
        nodes.append(helper.make_node("Gemm", [last, names[2 * layer], names[2 * layer + 1]], [f"sum{layer + 1}"]))
        last = "actions" if layer == 2 else f"layer{layer + 1}"
        nodes.append(helper.make_node("Tanh", [f"sum{layer + 1}"], [last]))
    graph = helper.make_graph(
        nodes,
        "cart-pole",
        [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, OBSERVATIONS])],
        [helper.make_tensor_value_info("actions", TensorProto.FLOAT, [1, ACTIONS])],
        [numpy_helper.from_array(weight, name) for weight, name in zip(weights, names)],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], producer_name="assay cart-pole")
    model.ir_version = 8
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--iterations", type=int, default=120)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    model = mujoco.MjModel.from_xml_path(str(HERE / "cart_pole.xml"))
    model.opt.timestep = TIMESTEP
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    data = mujoco.MjData(model)

    directions, best, step, noise = 16, 8, 0.05, 0.1
    parameters = np.concatenate(
        [(rng.standard_normal(shape) / np.sqrt(shape[0])).ravel() if len(shape) == 2 else np.zeros(shape) for shape in sizes()]
    )
    began, episodes, curve = time.monotonic(), 0, []
    for iteration in range(options.iterations):
        deltas = rng.standard_normal((directions, parameters.size))
        starts = rng.uniform(-1, 1, (4, 4)) * START
        returns = np.zeros((directions, 2))
        for i, delta in enumerate(deltas):
            for side, sign in enumerate((1, -1)):
                tried = parameters + sign * noise * delta
                returns[i, side] = np.mean([episode(model, data, tried, start)[0] for start in starts])
        episodes += directions * 2 * len(starts)
        order = np.argsort(-returns.max(axis=1))[:best]
        spread = returns[order].std() + 1e-6
        gradient = ((returns[order, 0] - returns[order, 1])[:, None] * deltas[order]).sum(axis=0)
        parameters = parameters + step / (best * spread) * gradient
        curve.append(round(float(returns.mean()), 4))
        if iteration % 10 == 9:
            print(f"iteration {iteration + 1}: mean return {curve[-1]:.3f}, {time.monotonic() - began:.0f} s", flush=True)

    parameters = parameters.astype(np.float32).astype(float)
    tests = np.random.default_rng(options.seed + 1).uniform(-1, 1, (100, 4)) * START
    results = [episode(model, data, parameters, start) for start in tests]
    network(parameters, HERE / "policy.onnx")
    record = {
        "engine": f"MuJoCo {mujoco.__version__}, Euler",
        "timestep_s": TIMESTEP,
        "decimation": DECIMATION,
        "method": "augmented random search, V1-t",
        "seed": options.seed,
        "iterations": options.iterations,
        "episodes": episodes,
        "episode_s": SECONDS,
        "directions": directions,
        "best_directions": best,
        "step": step,
        "noise": noise,
        "packages": {"numpy": np.__version__, "mujoco": mujoco.__version__, "onnx": onnx.__version__},
        "start_half_widths": START.tolist(),
        "mean_return": curve,
        "test": {
            "episodes": len(results),
            "stayed_up": sum(up for _, up in results),
            "mean_return": round(float(np.mean([value for value, _ in results])), 4),
        },
    }
    (HERE / "training.json").write_text(json.dumps(record, indent=2) + "\n")
    print(f"stayed up in {record['test']['stayed_up']} of {len(results)}, mean return {record['test']['mean_return']}")


if __name__ == "__main__":
    main()
