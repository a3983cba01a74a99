"""Many worlds of Genesis, the environments of one scene."""

import time

import assay_adapter as assay
import numpy as np
from genesis_start import torch  # it sets its threads first
from genesis_world import Scene, begin, gs


class Batch:
    def __init__(self, model, worlds, settings, device):
        if device not in ("cpu", "cuda:0"):
            raise assay.Unsupported(f"the adapter starts Genesis on the CPU or the first GPU, not on '{device}'")
        if device != "cpu" and not torch.cuda.is_available():
            raise assay.Unsupported(f"this PyTorch {torch.__version__} has no '{device}': step worlds of Genesis on the processor")
        started = time.monotonic()
        begin(settings, device)
        self.of, self.worlds = Scene(model, settings, worlds), worlds
        self.step = self.of.scene.step
        self.step(False, False)  # compiles what is not compiled yet
        self.step(False, False)
        self.compile_s = time.monotonic() - started
        self.force = np.zeros((worlds, self.of.entity.n_dofs))

    def restart(self, states):
        q, v = (np.array(rows) for rows in zip(*(self.of.in_order(state) for state in states)))
        self.of.put(q, v)

    def set_torques(self, torques):
        self.force[:, self.of.joint_dof] = torques
        self.of.entity.control_dofs_force(self.force)

    def advance(self, count):
        try:
            for _ in range(count):
                self.step(False, False)
        except gs.GenesisException as error:
            raise assay.EngineFailure(f"Genesis: {error}") from error

    def synchronize(self):
        if torch.cuda.is_available():
            torch.cuda.synchronize()
        self.of.fail_if_wrong()

    def read_state(self, world):
        entity = self.of.entity
        q, v = (each[world].cpu().numpy().astype(float) for each in (entity.get_qpos(), entity.get_dofs_velocity()))
        return self.of.read(q, v)

    def facts(self):
        return {"compile_s": self.compile_s}
