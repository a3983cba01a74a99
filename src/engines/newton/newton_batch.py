"""Many worlds of Newton: copies of the model in one, stepped by graphs."""

import time
import warnings

import assay_adapter as assay
import numpy as np
import warp_graph
import warp as wp
import newton
from newton_world import MANY, Worlds


class Batch:
    def __init__(self, model, worlds, settings, friction, device):
        device = warp_graph.device_of(device)
        started = time.monotonic()
        with wp.ScopedDevice(device), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of experimental parts
            try:
                self.of = Worlds(model, settings, friction, worlds, device)
            except (ValueError, NotImplementedError) as error:
                raise assay.EngineFailure(f"Newton refuses the model: {error}") from error
            wp.synchronize_device(device)
        self.compile_s = time.monotonic() - started
        self.worlds, self.device, self.current = worlds, device, 0
        self.dof = self.of.built.joint_v
        self.torques = np.zeros((worlds, self.of.control.joint_f.shape[0] // worlds), dtype=np.float32)

    def restart(self, states):
        q, v = (self.rows(array).copy() for array in (self.of.states[0].joint_q, self.of.states[0].joint_qd))
        for world, state in enumerate(states):
            self.of.built.write(state, q[world], v[world])
        self.of.control.joint_f.zero_()
        with wp.ScopedDevice(self.device):
            for each in self.of.states:
                each.joint_q.assign(q.flatten())
                each.joint_qd.assign(v.flatten())
                each.body_f.zero_()
                newton.eval_fk(self.of.built.engine, each.joint_q, each.joint_qd, each)
            self.of.solver.restart(self.of.states[0])
            wp.synchronize_device(self.device)
        self.current = 0

    def rows(self, array):
        return array.numpy().reshape(self.worlds, -1)

    def set_torques(self, torques):
        self.torques[:, self.dof] = torques
        self.of.control.joint_f.assign(self.torques.flatten())

    def advance(self, count):
        for _ in range(count // MANY):
            self.of.many[self.current].launch("Newton")
        for _ in range(count % MANY):
            self.of.one[self.current].launch("Newton")
            self.current = 1 - self.current

    def synchronize(self):
        wp.synchronize_device(self.device)
        if self.of.solver.flags is not None:
            self.of.solver.fail_if_full(self.of.solver.flags.numpy())

    def read_state(self, world):
        state = self.of.states[self.current]
        return self.of.built.read(*(self.rows(array)[world].astype(float) for array in (state.joint_q, state.joint_qd)))

    def facts(self):
        arrays = []
        for record in (self.of.built.engine, *self.of.states, self.of.solver, self.of.solver.solver):
            warp_graph.arrays_of(record, arrays)
        return warp_graph.facts_of(self.device, arrays, self.compile_s)
