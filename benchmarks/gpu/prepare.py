"""Writes what run.py measures: a model with the states in which its worlds start.

prepare.py MODEL.json NAME OUT.json --timestep MS --torque TABLE.json: MODEL.json has the model as adapters in Python get it and its initial
state (recorder/). The 64 starting states are spread evenly over 2.048 s of MuJoCo's run in double precision from there, at half the
timestep, under random torques that change every 64 ms. TABLE.json has the largest torque of each joint in Nm.
"""

import argparse
import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ENGINES = os.path.join(os.path.dirname(os.path.dirname(HERE)), "src", "engines")
sys.path[:0] = [os.path.join(ENGINES, "mujoco-warp"), os.path.join(ENGINES, "python-host")]
MOMENTS, DURATION_S, HELD_S = 64, 2.048, 0.064


def state_of(assay, numpy, given):
    state = assay.State()
    state.time = 0.0
    state.bodies = numpy.array(given["bodies"], dtype=float).reshape(-1, 13)
    state.balls = numpy.array(given["balls"], dtype=float).reshape(-1, 7)
    state.position, state.velocity = (numpy.array(given[name], dtype=float) for name in ("position", "velocity"))
    return state


def main():
    parser = argparse.ArgumentParser()
    for name in ("model", "name", "out"):
        parser.add_argument(name)
    parser.add_argument("--timestep", type=float, required=True, help="ms")
    parser.add_argument("--torque", required=True, help="file: largest torque by joint")
    options = parser.parse_args()
    import assay_adapter as assay
    import mujoco as mj
    import numpy as np
    from mujoco_model import Compiled

    with open(options.model, encoding="utf-8") as file:
        given = json.load(file)
    with open(options.torque, encoding="utf-8") as file:
        table = json.load(file)
    model = assay._model(json.dumps(given["model"]))
    torque = [float(table[joint.name]) for joint in model.joints]
    timestep_s = 0.5e-3 * options.timestep

    def set_options(option):
        option.timestep = timestep_s

    compiled = Compiled(model, set_options)
    data = mj.MjData(compiled.mujoco)
    data.qpos[:], data.qvel[:] = compiled.coordinates(state_of(assay, np, given["initial"]))
    random, starts, held = np.random.default_rng(0), [], round(HELD_S / timestep_s)
    between = round(DURATION_S / MOMENTS / timestep_s)
    for step in range(MOMENTS * between):
        if step % between == 0:
            read = compiled.read(data.qpos, data.qvel)
            starts.append({name: np.asarray(values).tolist() for name, values in read.items()})
        if step % held == 0:
            data.qfrc_applied[compiled.joint_dof] = random.uniform(-1, 1, len(torque)) * torque
        mj.mj_step(compiled.mujoco, data)
    with open(options.out, "w", encoding="utf-8") as file:
        json.dump({"name": options.name, "timestep_ms": options.timestep, "torque": torque, **given, "starts": starts}, file)
        file.write("\n")


if __name__ == "__main__":
    main()
