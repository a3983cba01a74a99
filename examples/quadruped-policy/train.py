#!/usr/bin/env python3
"""Trains the policy of this folder: a network of two layers that walks forward at a commanded velocity, in MuJoCo.

The method is in ../ppo.py. The actions are learned around an open-loop trot: the network's phase, rectified, moves diagonal legs
in turn, and what is learned is added; both are in policy.onnx. It writes policy.onnx and training.json beside itself. The same
packages, seed and processor give the same network.

    python3.11 -m venv venv && venv/bin/pip install --require-hashes --no-deps -r requirements.txt
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
STIFFNESS, DAMPING, EFFORT = 40.0, 1.0, 17.0
SCALE, CLIP = 0.25, 4.0  # rad at action 1; of actions
GAIT = 0.5  # s
SPIN_SCALE, RATE_SCALE = 0.25, 0.05
FALLEN_HEIGHT, FALLEN_TILT = 0.18, 0.8
COMMAND = 0.5  # m/s, of the tests

HIDDEN = (128, 128)
SECONDS = 10.0
ROBOTS = 96
STANCE = 0.297  # m, the trunk's height with the feet on the ground

# Half widths of the starts that `assay run` draws (src/measures/initial_states.h), and what training multiplies them with.
START = {"joint_position": 0.02, "joint_rate": 0.2, "position": 0.005, "rotation": 0.05, "velocity": 0.05, "spin": 0.2}
WIDER = 3.0
COMMANDS = (0.2, 0.8)  # m/s
PUSH, PUSH_EVERY = 0.6, 2.5  # m/s, s
FRICTION, MASS, DRIVE, ARMATURE = (0.4, 1.2), (0.85, 1.15), (0.9, 1.1), (0.5, 1.5)  # factors of the last three
NOISE = 0.03  # of observations, which are of the order of 1

LEGS = ("FL", "FR", "RL", "RR")
SWINGS_FIRST = np.array([1, 0, 0, 1], bool)  # FL and RR


def centre():
    """(A, B) of the trot: its actions are relu(obs @ A) @ B."""
    waves = np.zeros((47, 4))
    waves[45] = [1, -1, 0, 0]  # the sine, and its negative
    waves[46] = [0, 0, 1, -1]
    trot = np.zeros((4, 12))
    lift, stride = 0.3 / SCALE, COMMAND * GAIT / 4 / 0.28 / SCALE  # of the hip; a leg of 0.28 m
    for leg in range(4):
        swing, forward = (0, 1.0) if SWINGS_FIRST[leg] else (1, -1.0)
        trot[swing, 3 * leg + 1] = lift
        trot[swing, 3 * leg + 2] = -2 * lift
        # the foot is behind when its swing begins: a positive hip is behind
        trot[2, 3 * leg + 1] = forward * stride
        trot[3, 3 * leg + 1] = -forward * stride
    return waves.astype(np.float32), trot.astype(np.float32)


def robot_model():
    spec = mujoco.MjSpec.from_file(str(HERE / "quadruped.xml"))
    for kind in (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtSensor.mjSENS_FRAMELINVEL):
        for leg in LEGS:
            spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_GEOM, objname=f"{leg}_foot")
    model = spec.compile()
    model.opt.timestep = TIMESTEP
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    ppo.position_drives(model, STIFFNESS, DAMPING, EFFORT)
    return model


def varied(model, rng):
    """A robot like `model`, but with another friction, trunk, drive and armature."""
    other = copy.copy(model)
    other.geom_friction[:, 0] = rng.uniform(*FRICTION)
    trunk = other.body("trunk").id
    factor = rng.uniform(*MASS)
    other.body_mass[trunk] *= factor
    other.body_inertia[trunk] *= factor
    other.body_ipos[trunk, :2] += rng.uniform(-0.02, 0.02, 2)
    ppo.position_drives(other, STIFFNESS * rng.uniform(*DRIVE), DAMPING * rng.uniform(*DRIVE), EFFORT)
    other.dof_armature[:] *= rng.uniform(*ARMATURE)
    mujoco.mj_setConst(other, mujoco.MjData(other))
    return other


def axes_of(quaternions):
    """Rotation matrices."""
    w, x, y, z = quaternions.T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


class Walk:
    """Robots that walk, and what their policy sees; `sure` ones are like the model, at one command, without pushes and noise."""

    actions, period_s = 12, PERIOD

    def __init__(self, count, seed, sure=False):
        self.rng, self.sure = np.random.default_rng(seed), sure
        model = robot_model()
        self.start = model.key("stand").qpos.copy()
        self.default = self.start[7:]
        self.robots = ppo.Robots([model if sure else varied(model, self.rng) for _ in range(count)])
        self.centre = centre()
        self.steps, self.last = np.zeros(count, int), np.zeros((count, 12))
        self.phase0, self.command = np.zeros(count), np.full(count, COMMAND)
        self.parts = {}

    def centre_of(self, obs):
        return np.maximum(obs @ self.centre[0], 0) @ self.centre[1]

    def restart(self, which):
        rows, rng = np.flatnonzero(which), self.rng
        count, wide = len(rows), 1.0 if self.sure else WIDER

        def around(name, *shape):
            return wide * START[name] * rng.uniform(-1, 1, (count, *shape))

        qpos = np.tile(self.start, (count, 1))
        qpos[:, :3] += around("position", 3)
        qpos[:, 7:] += around("joint_position", 12)
        turn = around("rotation", 1) * (lambda axis: axis / np.linalg.norm(axis, axis=1, keepdims=True))(rng.standard_normal((count, 3)))
        qpos[:, 4:7] = turn / 2
        qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
        self.robots.qpos[rows] = qpos
        self.robots.qvel[rows] = np.concatenate([around("velocity", 3), around("spin", 3), around("joint_rate", 12)], axis=1)
        self.last[rows] = 0
        if self.sure:
            self.steps[rows] = 0
            return
        # episodes end at different times, and the gait may begin anywhere
        self.steps[rows] = rng.integers(0, int(0.5 * SECONDS / PERIOD), count)
        self.command[rows] = rng.uniform(*COMMANDS, count)

    def observe(self):
        qpos, qvel = self.robots.qpos, self.robots.qvel
        axes = axes_of(qpos[:, 3:7])
        phase = 2 * np.pi * self.steps * PERIOD / GAIT
        obs = np.concatenate([
            SPIN_SCALE * qvel[:, 3:6], -axes[:, 2, :], np.stack([self.command, 0 * phase, 0 * phase], axis=1),
            qpos[:, 7:] - self.default, RATE_SCALE * qvel[:, 6:], self.last, np.stack([np.sin(phase), np.cos(phase)], axis=1)],
            axis=1).astype(np.float32)
        linear = np.einsum("nij,ni->nj", axes, qvel[:, :3])
        feet = self.robots.sensors[:, [2, 5, 8, 11]]
        seen = np.concatenate([obs, linear, 10 * (qpos[:, 2:3] - STANCE), feet < 0.022], axis=1).astype(np.float32)
        if not self.sure:
            obs[:, :33] += NOISE * self.rng.uniform(-1, 1, (len(obs), 33)).astype(np.float32) * np.concatenate(
                [np.ones(6), np.zeros(3), np.ones(24)]).astype(np.float32)
        return obs, seen

    def act(self, actions):
        actions = np.clip(actions, -CLIP, CLIP)
        if not self.sure:
            pushed = self.rng.uniform(size=len(actions)) < PERIOD / PUSH_EVERY
            self.robots.qvel[pushed, :2] += self.rng.uniform(-PUSH, PUSH, (pushed.sum(), 2))
        target = self.default + SCALE * actions
        self.robots.step(target, DECIMATION)
        self.steps += 1
        qpos, qvel, sensors = self.robots.qpos, self.robots.qvel, self.robots.sensors
        axes = axes_of(qpos[:, 3:7])
        heading = np.arctan2(axes[:, 1, 0], axes[:, 0, 0])
        ahead = qvel[:, 0] * np.cos(heading) + qvel[:, 1] * np.sin(heading)
        aside = -qvel[:, 0] * np.sin(heading) + qvel[:, 1] * np.cos(heading)
        feet, speed = sensors[:, [2, 5, 8, 11]], np.linalg.norm(sensors[:, 12:].reshape(-1, 4, 3)[:, :, :2], axis=2)
        down = feet < 0.022
        sine = np.sin(2 * np.pi * self.steps * PERIOD / GAIT)[:, None] * np.where(SWINGS_FIRST, 1, -1)
        torque = np.clip(STIFFNESS * (target - qpos[:, 7:]) - DAMPING * qvel[:, 6:], -EFFORT, EFFORT)
        off = (ahead - self.command) ** 2 + aside**2
        fallen = (qpos[:, 2] < FALLEN_HEIGHT) | (axes[:, 2, 2] < np.cos(FALLEN_TILT)) | ~np.isfinite(qpos).all(axis=1)
        parts = {
            "velocity": 1.5 * np.exp(-off / 0.05),
            "turning": 0.8 * np.exp(-(qvel[:, 5] ** 2) / 0.1),
            "upright": -3 * (axes[:, 2, 0] ** 2 + axes[:, 2, 1] ** 2) - 0.05 * (qvel[:, 3] ** 2 + qvel[:, 4] ** 2),
            "height": -60 * (qpos[:, 2] - STANCE) ** 2 - 0.5 * qvel[:, 2] ** 2,
            "gait": 0.4 * np.where(np.abs(sine) > 0.3, np.where(down == (sine < 0), 1, -1), 0).mean(axis=1),
            "clearance": -0.3 * (np.clip(0.06 - feet, 0, 0.04) / 0.04 * (sine > 0.8)).mean(axis=1),
            "slip": -0.15 * (down * np.minimum(speed, 2)).sum(axis=1),
            "effort": -3e-4 * (torque**2).sum(axis=1) - 2e-4 * np.abs(torque * qvel[:, 6:]).sum(axis=1),
            "smooth": -0.01 * ((actions - self.last) ** 2).sum(axis=1),
            "fall": -20.0 * fallen,
        }
        self.last = actions
        self.parts = {name: float(np.mean(part)) for name, part in parts.items()}
        self.parts["off"] = float(np.sqrt(off).mean())
        self.off, self.ahead = np.sqrt(off), ahead
        return PERIOD * np.nan_to_num(sum(parts.values()), nan=-20.0), fallen, self.steps * PERIOD >= SECONDS

    def figures(self):
        return ", ".join(f"{name} {value:.2f}" for name, value in self.parts.items())


def tested(network, seed, count=100):
    """`count` episodes of 10 s from the starts of `assay run`, of the robot as it is."""
    walk = Walk(count, seed, sure=True)
    walk.restart(np.ones(count, bool))
    act = jax.jit(ppo.forward)
    up, off, ahead = np.ones(count, bool), [], []
    for _ in range(int(round(SECONDS / PERIOD))):
        obs, _ = walk.observe()
        _, fallen, _ = walk.act(np.asarray(act(network, obs)) + walk.centre_of(obs))
        up &= ~fallen
        off.append(np.where(up, walk.off, np.nan))
        ahead.append(np.where(up, walk.ahead, np.nan))
    return {"episodes": count, "stayed_up": int(up.sum()), "command_m_s": COMMAND,
            "mean_velocity_m_s": round(float(np.nanmean(ahead)), 4), "velocity_error_m_s": round(float(np.nanmean(off)), 4)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--iterations", type=int, default=1500)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    settings = ppo.Settings(options.iterations, options.seed)
    walk = Walk(ROBOTS, options.seed)
    network, curve, seconds = ppo.train(walk, settings, HIDDEN)
    ppo.write_onnx(network, HERE / "policy.onnx", "quadruped", walk.centre)
    test = tested(network, options.seed + 1)
    record = {
        "engine": f"MuJoCo {mujoco.__version__}, Euler",
        "timestep_s": TIMESTEP,
        "decimation": DECIMATION,
        "method": "proximal policy optimisation around an open-loop trot",
        "seed": options.seed,
        "robots": ROBOTS,
        "control_steps": options.iterations * settings.steps * ROBOTS,
        "wall_s": round(seconds),
        "settings": vars(settings),
        "hidden": HIDDEN,
        "start_half_widths": {name: WIDER * width for name, width in START.items()},
        "commands_m_s": COMMANDS,
        "push_m_s": PUSH,
        "push_every_s": PUSH_EVERY,
        "friction": FRICTION,
        "factors": {"trunk_mass": MASS, "drive": DRIVE, "armature": ARMATURE},
        "packages": {"numpy": np.__version__, "jax": jax.__version__, "mujoco": mujoco.__version__, "onnx": onnx.__version__},
        "every_10th_iteration": {"reward_of_a_step": [reward for reward, _ in curve[9::10]],
                                 "falls_a_second": [falls for _, falls in curve[9::10]]},
        "test": test,
    }
    (HERE / "training.json").write_text(json.dumps(record, indent=1) + "\n")
    print(f"stayed up in {test['stayed_up']} of {test['episodes']}, {test['mean_velocity_m_s']} m/s of {COMMAND}, "
          f"error {test['velocity_error_m_s']} m/s")


if __name__ == "__main__":
    main()
