"""The planar chain as a user of MuJoCo Warp would write it, its steps captured as a graph on the CPU. Prints µs a step, a number a
round."""

import sys

import mujoco
import mujoco_warp as mjw
import warp as wp

from direct_rounds import chain, print_times

wp.set_device("cpu")
h, steps, captured = 1e-3, 1024, 32
model = mujoco.MjModel.from_xml_string(chain(f'timestep="{h}" integrator="{sys.argv[1]}"'))
start = mujoco.MjData(model)
start.qvel[:] = 1
engine, data = mjw.put_model(model), mjw.put_data(model, start, nconmax=1, njmax=1)
mjw.step(engine, data)  # compiles
with wp.ScopedCapture() as capture:
    for _ in range(captured):
        mjw.step(engine, data)


def run():
    for _ in range(steps // captured):
        wp.capture_launch(capture.graph)


print_times(run, steps)
