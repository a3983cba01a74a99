"""The planar chain as a user of MJX would write it: five capsules of 1 kg on hinges. Prints µs a step, a number a round."""

import os
import time

# one thread, as through assay
os.environ.update(JAX_PLATFORMS="cpu", NPROC="1", XLA_FLAGS="--xla_cpu_multi_thread_eigen=false")
import jax  # noqa: E402
import mujoco  # noqa: E402

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_cpu_enable_async_dispatch", False)
from mujoco import mjx  # noqa: E402
from direct_rounds import chain, print_times  # noqa: E402

h, steps = 1e-3, 1000
model = mujoco.MjModel.from_xml_string(chain(f'timestep="{h}"'))
engine, data = mjx.put_model(model), mjx.make_data(model)


def roll(data, count):
    return jax.lax.fori_loop(0, count, lambda _, data: mjx.step(engine, data), data)


data = data.replace(qvel=jax.numpy.ones(5))
count = jax.numpy.array(steps, dtype="int32")
compiled = jax.jit(roll, donate_argnums=0).lower(data, count).compile()


def run():
    global data
    data = jax.block_until_ready(compiled(data, count))


print_times(run, steps, time.process_time)
