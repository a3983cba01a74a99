"""The planar chain as a user of MuJoCo Warp would write it, its steps captured as a graph on the CPU. Prints µs a step, a number a
round."""

import json
import sys
import time

import mujoco
import mujoco_warp as mjw
import warp as wp

wp.set_device("cpu")
h, steps, captured, rounds = 1e-3, 1024, 32, 20
LINK = """<body pos="{} 0 0"><joint type="hinge" axis="0 1 0"/>
  <inertial pos="0.15 0 0" mass="1" diaginertia="0.00125 0.0263 0.0263"/>{}</body>"""
chain = ""
for i in reversed(range(5)):
    chain = LINK.format(0.3 if i else 0, chain)
model = mujoco.MjModel.from_xml_string(
    f'<mujoco><option timestep="{h}" integrator="{sys.argv[1]}" gravity="0 0 0"/><worldbody>{chain}</worldbody></mujoco>')
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


run()
times = []
for _ in range(rounds):
    begin = time.process_time()
    run()
    times.append((time.process_time() - begin) / steps * 1e6)
print(json.dumps(times))
