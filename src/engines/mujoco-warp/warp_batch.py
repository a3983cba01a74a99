"""Many worlds of MuJoCo Warp, stepped by one captured graph."""

import functools
import time

import assay_adapter as assay
import numpy as np
import warp_graph
import warp as wp
import mujoco_warp as mjw
from warp_world import MANY, compiled_of, engine_and_data, fail_if_full, take


class Batch:
    def __init__(self, model, worlds, settings, device):
        self.device = warp_graph.device_of(device)
        started = time.monotonic()
        with wp.ScopedDevice(self.device):
            try:
                self.compiled = compiled_of(model, settings)
                self.engine, self.data = engine_and_data(model, settings, self.compiled, worlds)
            except (ValueError, NotImplementedError) as error:
                raise assay.EngineFailure(f"MuJoCo Warp refuses the model: {error}") from error
            mjw.step(self.engine, self.data)  # compiles what is not compiled yet
            mjw.reset_data(self.engine, self.data)
            self.one, self.many = (warp_graph.Graph(self.device, functools.partial(take, self.engine, self.data, steps))
                                   for steps in (1, MANY))
            wp.synchronize_device(self.device)
        self.compile_s = time.monotonic() - started
        self.dof = self.compiled.joint_dof
        self.torques = np.zeros(self.data.qfrc_applied.shape, dtype=np.float32)

    def restart(self, states):
        coordinates = [self.compiled.coordinates(state) for state in states]
        with wp.ScopedDevice(self.device):
            mjw.reset_data(self.engine, self.data)
            self.data.qpos.assign(np.array([q for q, _ in coordinates], dtype=np.float32))
            self.data.qvel.assign(np.array([v for _, v in coordinates], dtype=np.float32))
            wp.synchronize_device(self.device)

    def set_torques(self, torques):
        self.torques[:, self.dof] = torques
        self.data.qfrc_applied.assign(self.torques)

    def advance(self, count):
        for _ in range(count // MANY):
            self.many.launch("MuJoCo Warp")
        for _ in range(count % MANY):
            self.one.launch("MuJoCo Warp")

    def synchronize(self):
        wp.synchronize_device(self.device)
        fail_if_full(self.data.overflow.numpy())

    def read_state(self, world):
        return self.compiled.read(self.data.qpos.numpy()[world], self.data.qvel.numpy()[world])

    def facts(self):
        arrays = warp_graph.arrays_of(self.data, warp_graph.arrays_of(self.engine, []))
        return warp_graph.facts_of(self.device, arrays, self.compile_s)
