"""Many worlds of MJX, stepped by one compiled function: `jax.vmap` of the step of one world."""

import time

import assay_adapter as assay
import jax
import numpy as np
from mjx_world import number, refusals, world_of


def place_of(device):
    """JAX's device of that name. A process has the platform that JAX_PLATFORMS names, and its first device is the default."""
    platform, _, index = device.partition(":")
    try:
        return jax.devices(platform)[int(index or 0)]
    except (RuntimeError, IndexError) as error:
        raise assay.Unsupported(f"JAX {jax.__version__} has no code for '{device}' in this process: step worlds of MJX on the "
                                f"processor ({' '.join(str(error).split())[:200]})") from error


class Batch:
    def __init__(self, model, worlds, settings, device):
        self.place = place_of(device)
        with refusals():
            self.world, self.worlds = world_of(model, settings), worlds
        self.compiled = self.world.compiled
        dof = self.compiled.mujoco.nv
        self.timestep = self.world.array(settings.timestep)
        self.force = np.zeros((worlds, dof))
        self.torques = self.world.array(self.force)
        started = time.monotonic()
        with self.world.precision(), refusals():
            begin = self.world.begin(np.tile(self.compiled.mujoco.qpos0, (worlds, 1)), np.zeros((worlds, dof)))
            arguments = (begin, self.torques, self.timestep)
            self.run = jax.jit(self.steps, donate_argnums=0).lower(*arguments, number(1)).compile()
            self.state = jax.block_until_ready(self.run(*arguments, number(0)))
        self.compile_s = time.monotonic() - started

    def steps(self, state, torques, timestep, count):
        step = jax.vmap(self.world.step_of(timestep))
        return jax.lax.fori_loop(0, count, lambda _, state: step(state, torques), state)

    def restart(self, states):
        coordinates = [self.compiled.coordinates(state) for state in states]
        self.state = self.world.begin(np.array([q for q, _ in coordinates]), np.array([v for _, v in coordinates]))

    def set_torques(self, torques):
        self.force[:, self.compiled.joint_dof] = torques
        self.torques = self.world.array(self.force)

    def advance(self, count):
        self.state = self.run(self.state, self.torques, self.timestep, number(count))

    def synchronize(self):
        jax.block_until_ready(self.state)

    def read_state(self, world):
        q, v, _ = self.state
        return self.compiled.read(q[world], v[world])

    def facts(self):
        memory = self.run.memory_analysis()
        return {"compile_s": self.compile_s, "device": self.place.device_kind if self.place.platform != "cpu" else "", "memory_bytes": memory.argument_size_in_bytes + memory.output_size_in_bytes +
                memory.temp_size_in_bytes - memory.alias_size_in_bytes}
