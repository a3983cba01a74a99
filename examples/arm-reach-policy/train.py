#!/usr/bin/env python3
"""Trains the policy of this folder: a network of two layers that brings the arm's hand to a point, in MuJoCo.

The method is in ../ppo.py. It writes policy.onnx and training.json beside itself. The same packages, seed and processor give the
same network.

    python3.11 -m venv venv && venv/bin/pip install --require-hashes --no-deps -r ../quadruped-policy/requirements.txt
    venv/bin/python train.py
"""

import argparse
import copy
import json
import pathlib
import sys

import jax
import mujoco
import numpy as np
import onnx

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import ppo  # noqa: E402

# The conventions of policy.toml.
TIMESTEP = 0.005  # s
DECIMATION = 4
PERIOD = TIMESTEP * DECIMATION
STIFFNESS = np.array([150, 150, 150, 30, 30, 30.0])
DAMPING = np.array([12, 12, 12, 1.5, 1.5, 1.5])
EFFORT = np.array([50, 50, 50, 12, 12, 12.0])
SCALE, CLIP = 0.5, 4.0  # rad at action 1; of actions
RATE_SCALE, TARGET_SCALE = 0.2, 5.0
FALLEN = {"shoulder": (-1.7, 1.7), "elbow": (-0.1, 2.5), "wrist": (-1.9, 1.9)}
TARGET = (0.35, 0.15, 0.3)  # m

HIDDEN = (64, 64)
SECONDS = 3.0
ROBOTS = 96
TARGETS = np.array([[0.25, 0.4], [-0.2, 0.2], [0.15, 0.4]])  # m, where targets are drawn
SETTLED = 2.0  # s, from when the tests look at the distance

# Half widths of the starts that `assay run` draws (src/measures/initial_states.h), and what training multiplies them with.
START = {"joint_position": 0.02, "joint_rate": 0.2}
WIDER = 10.0
MASS, DRIVE = (0.9, 1.1), (0.95, 1.05)  # factors


def robot_model():
    spec = mujoco.MjSpec.from_file(str(HERE / "arm.xml"))
    spec.add_sensor(type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=mujoco.mjtObj.mjOBJ_GEOM, objname="hand")
    model = spec.compile()
    model.opt.timestep = TIMESTEP
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    ppo.position_drives(model, STIFFNESS, DAMPING, EFFORT)
    return model


def varied(model, rng):
    """An arm like `model`, but with other masses and drives."""
    other = copy.copy(model)
    factors = rng.uniform(*MASS, model.nbody)
    other.body_mass[:] *= factors
    other.body_inertia[:] *= factors[:, None]
    ppo.position_drives(other, STIFFNESS * rng.uniform(*DRIVE), DAMPING * rng.uniform(*DRIVE), EFFORT)
    mujoco.mj_setConst(other, mujoco.MjData(other))
    return other


class Reach:
    """Arms that reach, and what their policy sees; `sure` ones are like the model."""

    actions, period_s = 6, PERIOD

    def __init__(self, count, seed, sure=False):
        self.rng, self.sure = np.random.default_rng(seed), sure
        model = robot_model()
        self.default = model.key("ready").qpos.copy()
        self.robots = ppo.Robots([model if sure else varied(model, self.rng) for _ in range(count)])
        self.outside = [(model.joint(name).qposadr[0], low, high) for name, (low, high) in FALLEN.items()]
        self.steps, self.last, self.target = np.zeros(count, int), np.zeros((count, 6)), np.zeros((count, 3))
        self.parts = {}

    def centre_of(self, obs):
        return 0.0

    def restart(self, which):
        rows, wide = np.flatnonzero(which), 1.0 if self.sure else WIDER
        shape = (len(rows), 6)
        self.robots.qpos[rows] = self.default + wide * START["joint_position"] * self.rng.uniform(-1, 1, shape)
        self.robots.qvel[rows] = wide * START["joint_rate"] * self.rng.uniform(-1, 1, shape)
        self.last[rows] = 0
        self.target[rows] = self.rng.uniform(*TARGETS.T, (len(rows), 3))
        self.steps[rows] = 0 if self.sure else self.rng.integers(0, int(SECONDS / PERIOD / 2), len(rows))

    def observe(self):
        obs = np.concatenate([self.robots.qpos - self.default, RATE_SCALE * self.robots.qvel, self.last, TARGET_SCALE * self.target],
                             axis=1).astype(np.float32)
        return obs, obs

    def act(self, actions):
        actions = np.clip(actions, -CLIP, CLIP)
        self.robots.step(self.default + SCALE * actions, DECIMATION)
        self.steps += 1
        qpos, qvel = self.robots.qpos, self.robots.qvel
        self.distance = np.linalg.norm(self.robots.sensors - self.target, axis=1)
        fallen = ~np.isfinite(qpos).all(axis=1)
        for joint, low, high in self.outside:
            fallen |= (qpos[:, joint] < low) | (qpos[:, joint] > high)
        parts = {
            "near": 2 - 5 * self.distance + 2 * np.exp(-((self.distance / 0.05) ** 2)) + 2 * np.exp(-((self.distance / 0.01) ** 2)),
            "rate": -0.02 * (qvel**2).sum(axis=1),
            "posture": -0.1 * ((qpos - self.default) ** 2).sum(axis=1),
            "smooth": -0.05 * ((actions - self.last) ** 2).sum(axis=1),
            "fall": -20.0 * fallen,
        }
        self.last = actions
        self.parts = {name: float(np.mean(part)) for name, part in parts.items()}
        self.parts["distance"] = float(np.mean(self.distance))
        return PERIOD * np.nan_to_num(sum(parts.values()), nan=-20.0), fallen, self.steps * PERIOD >= SECONDS

    def figures(self):
        return ", ".join(f"{name} {value:.3f}" for name, value in self.parts.items())


def tested(network, seed, count=100):
    """`count` episodes from the starts of `assay run`, each with another target; the first has that of policy.toml."""
    reach = Reach(count, seed, sure=True)
    reach.restart(np.ones(count, bool))
    reach.target[0] = TARGET
    act = jax.jit(ppo.forward)
    inside, distances = np.ones(count, bool), []
    for step in range(int(round(SECONDS / PERIOD))):
        _, fallen, _ = reach.act(np.asarray(act(network, reach.observe()[0])))
        inside &= ~fallen
        if step * PERIOD >= SETTLED:
            distances.append(reach.distance.copy())
    distances = np.array(distances)
    return {"episodes": count, "stayed_inside": int(inside.sum()), "mean_distance_m": round(float(distances.mean()), 5),
            "largest_distance_m": round(float(distances.max()), 5), "distance_of_the_file_m": round(float(distances[:, 0].mean()), 5)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--iterations", type=int, default=2500)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    settings = ppo.Settings(options.iterations, options.seed, discount=0.95, entropy=0.0)
    network, curve, seconds = ppo.train(Reach(ROBOTS, options.seed), settings, HIDDEN)
    ppo.write_onnx(network, HERE / "policy.onnx", "arm")
    test = tested(network, options.seed + 1)
    record = {
        "engine": f"MuJoCo {mujoco.__version__}, Euler",
        "timestep_s": TIMESTEP,
        "decimation": DECIMATION,
        "method": "proximal policy optimisation",
        "seed": options.seed,
        "robots": ROBOTS,
        "control_steps": options.iterations * settings.steps * ROBOTS,
        "wall_s": round(seconds),
        "settings": vars(settings),
        "hidden": HIDDEN,
        "start_half_widths": {name: WIDER * width for name, width in START.items()},
        "targets_m": TARGETS.tolist(),
        "factors": {"mass": MASS, "drive": DRIVE},
        "packages": {"numpy": np.__version__, "jax": jax.__version__, "mujoco": mujoco.__version__, "onnx": onnx.__version__},
        "every_10th_iteration": {"reward_of_a_step": [reward for reward, _ in curve[9::10]],
                                 "falls_a_second": [falls for _, falls in curve[9::10]]},
        "test": test,
    }
    (HERE / "training.json").write_text(json.dumps(record, indent=1) + "\n")
    print(f"stayed inside in {test['stayed_inside']} of {test['episodes']}, {1e3 * test['mean_distance_m']:.1f} mm from the "
          f"target from {SETTLED:.0f} s on, {1e3 * test['distance_of_the_file_m']:.1f} mm from that of policy.toml")


if __name__ == "__main__":
    main()
