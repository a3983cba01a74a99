"""What the stored states of run.py say: worlds against one alone, against a fine step, penetration. Used by to_results.py."""

import base64
import json
import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
ENGINES = os.path.join(os.path.dirname(os.path.dirname(HERE)), "src", "engines")
sys.path[:0] = [os.path.join(ENGINES, "mujoco-warp"), os.path.join(ENGINES, "python-host"), HERE]
import assay_adapter as assay  # noqa: E402
import mujoco as mj  # noqa: E402
from mujoco_model import Compiled  # noqa: E402
from worker import FINE_WORLDS, STEPS, Starts  # noqa: E402

REFERENCE = 16  # steps of MuJoCo's run in double precision in one of the others


def unpacked(row):
    return np.frombuffer(base64.b64decode(row["float32"]), dtype="<f4").reshape(row["shape"]).astype(float)


class Model:
    """Geometry of a model's states by MuJoCo in double precision."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            given = json.load(file)
        self.model = assay._model(json.dumps(given["model"]))
        self.timestep_s = 1e-3 * given["timestep_ms"]
        self.starts = Starts(assay, np, given)

        def set_options(option):
            option.timestep = self.timestep_s / REFERENCE

        self.compiled = Compiled(self.model, set_options)
        self.data = mj.MjData(self.compiled.mujoco)
        self.free = [i for i, body in enumerate(self.model.bodies) if body.is_free]
        self.bodies = [each for each in self.compiled.body_id if each >= 0]

    def state(self, row):
        joints, free = len(self.model.joints), len(self.free)
        state = assay.State()
        state.bodies = np.zeros((len(self.model.bodies), 13))
        state.bodies[self.free] = row[:13 * free].reshape(free, 13)
        row = row[13 * free:]
        state.position, state.velocity = row[:joints], row[joints:2 * joints]
        state.balls = row[2 * joints:].reshape(-1, 7)
        return state

    def placed(self, row):
        q, v = self.compiled.coordinates(self.state(row))
        for _, qpos, _, _ in self.compiled.free:
            q[qpos + 3:qpos + 7] /= np.linalg.norm(q[qpos + 3:qpos + 7])
        self.data.qpos[:], self.data.qvel[:] = q, v
        mj.mj_kinematics(self.compiled.mujoco, self.data)
        mj.mj_comPos(self.compiled.mujoco, self.data)

    def centres(self, rows):
        found = []
        for row in rows:
            self.placed(row)
            found.append(self.data.xipos[self.bodies].copy())
        return np.array(found)

    def depths(self, rows):
        """The deepest contact of each world in m."""
        found = []
        for row in rows:
            self.placed(row)
            mj.mj_collision(self.compiled.mujoco, self.data)
            found.append(max(0.0, -float(self.data.contact.dist.min())) if self.data.ncon else 0.0)
        return np.array(found)

    def energies(self, rows):
        found = []
        for row in rows:
            self.placed(row)
            mj.mj_energyPos(self.compiled.mujoco, self.data)
            mj.mj_crb(self.compiled.mujoco, self.data) if hasattr(mj, "mj_crb") else mj.mj_forward(self.compiled.mujoco, self.data)
            mj.mj_energyVel(self.compiled.mujoco, self.data)
            found.append(float(np.sum(self.data.energy)))
        return np.array(found)

    def reference(self):
        """Centres of bodies after the compared steps, by MuJoCo in double precision at a sixteenth of the timestep."""
        torques, found = self.starts.torques(FINE_WORLDS, 0), []
        for state, torque in zip(self.starts.of(FINE_WORLDS), torques):
            mj.mj_resetData(self.compiled.mujoco, self.data)
            self.data.qpos[:], self.data.qvel[:] = self.compiled.coordinates(state)
            self.data.qfrc_applied[self.compiled.joint_dof] = torque
            for _ in range(STEPS * REFERENCE):
                mj.mj_step(self.compiled.mujoco, self.data)
            mj.mj_kinematics(self.compiled.mujoco, self.data)
            found.append(self.data.xipos[self.bodies].copy())
        return np.array(found)


def distances(a, b):
    """The largest distance of a body in each world."""
    return np.linalg.norm(a - b, axis=2).max(axis=1)
