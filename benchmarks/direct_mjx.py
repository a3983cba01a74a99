"""The planar chain as a user of MJX would write it: five capsules of 1 kg on hinges. Prints µs a step, a number a round."""

import json
import os
import time

# one thread, as through assay
os.environ.update(JAX_PLATFORMS="cpu", NPROC="1", XLA_FLAGS="--xla_cpu_multi_thread_eigen=false")
import jax  # noqa: E402
import mujoco  # noqa: E402

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_cpu_enable_async_dispatch", False)
from mujoco import mjx  # noqa: E402

h, steps, rounds = 1e-3, 1000, 20
LINK = """<body pos="{} 0 0"><joint type="hinge" axis="0 1 0"/>
  <inertial pos="0.15 0 0" mass="1" diaginertia="0.00125 0.0263 0.0263"/>{}</body>"""
chain = ""
for i in reversed(range(5)):
    chain = LINK.format(0.3 if i else 0, chain)
model = mujoco.MjModel.from_xml_string(f'<mujoco><option timestep="{h}"/><worldbody>{chain}</worldbody></mujoco>')
engine, data = mjx.put_model(model), mjx.make_data(model)


def roll(data, count):
    return jax.lax.fori_loop(0, count, lambda _, data: mjx.step(engine, data), data)


data = data.replace(qvel=jax.numpy.ones(5))
count = jax.numpy.array(steps, dtype="int32")
run = jax.jit(roll, donate_argnums=0).lower(data, count).compile()
data = jax.block_until_ready(run(data, count))
times = []
for _ in range(rounds):
    start = time.process_time()
    data = jax.block_until_ready(run(data, count))
    times.append((time.process_time() - start) / steps * 1e6)
print(json.dumps(times))
