"""A model as MuJoCo's compiler makes it, prepared for Genesis, which reads an mjModel as it reads an MJCF file."""

import mujoco as mj
import numpy as np
from contact_pairs import friction_of_shapes, masks_of
from mujoco_model import Compiled, Pose, turned

UNSPECIFIED = np.finfo(float).eps  # a time constant that Genesis replaces by its own
SCALAR = (int(mj.mjtJoint.mjJNT_HINGE), int(mj.mjtJoint.mjJNT_SLIDE))
ORIGIN = "origin of the world"
INVISIBLE = 3  # a group that Genesis makes no visual meshes of


class Prepared(Compiled):
    def __init__(self, model):
        super().__init__(model, lambda option: None)
        m = self.mujoco
        for solref in (m.jnt_solref, m.geom_solref, m.eq_solref):
            solref[:, 0] = UNSPECIFIED
        m.dof_solref[:, 0] = UNSPECIFIED
        for geom in range(m.ngeom):
            m.geom_group[geom] = 0 if m.geom(geom).name == ORIGIN else INVISIBLE
        masks, friction = masks_of(model) or {}, friction_of_shapes(model) or {}
        for shape in self.plan.shapes:
            geom = m.geom(f"shape{shape}")
            geom.contype[:], geom.conaffinity[:] = masks[shape]
            geom.friction[:] = friction[shape]
            geom.condim[:] = 6 if max(friction[shape][1:]) > 0 else 3  # whether Genesis reads them
        self.rest_at_spring_references()

    def add_pairs(self):
        """Pairs are chosen by masks. Genesis removes a world without a shape, also where a body is held to it."""
        holds = [*self.model.connects, *self.model.welds]
        if any(body < 0 for hold in holds for body in (hold.body_a, hold.body_b)):
            self.spec.worldbody.add_geom(name=ORIGIN, type=mj.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0], contype=0, conaffinity=0)

    def rest_at_spring_references(self):
        """Genesis' springs pull to the positions of the joints where the bodies are placed, so bodies are placed where their
        springs are at rest."""
        m, moved = self.mujoco, False
        before = m.qpos0.copy()
        for body in range(m.nbody):
            joints = range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body])
            if any(m.jnt_type[joint] not in SCALAR for joint in joints):
                continue
            after = Pose()  # of the joints that follow
            for joint in reversed(joints):
                q = m.jnt_qposadr[joint]
                way = m.qpos_spring[q] - m.qpos0[q] if m.jnt_stiffness.reshape(m.njnt, -1)[joint, 0] else 0.0
                motion = motion_of(m.jnt_type[joint], m.jnt_pos[joint], m.jnt_axis[joint], way)
                back = after.inverse()
                m.jnt_pos[joint] = back.p + turned(back.q, m.jnt_pos[joint])
                m.jnt_axis[joint] = turned(back.q, m.jnt_axis[joint])
                after = motion @ after
                m.qpos0[q] += way
                moved = moved or way != 0
            placed = Pose(m.body_pos[body], m.body_quat[body]) @ after
            m.body_pos[body], m.body_quat[body] = placed.p, placed.q
        if not moved:
            return
        for equality in range(m.neq):  # counts positions from these
            if int(m.eq_type[equality]) == int(mj.mjtEq.mjEQ_JOINT):
                data, ends = m.eq_data[equality], (m.eq_obj1id[equality], m.eq_obj2id[equality])
                shift = [m.qpos0[m.jnt_qposadr[joint]] - before[m.jnt_qposadr[joint]] if joint >= 0 else 0.0 for joint in ends]
                data[0] += data[1] * shift[1] - shift[0]
        mj.mj_setConst(m, mj.MjData(m))


def motion_of(kind, p, axis, way):
    if int(kind) == int(mj.mjtJoint.mjJNT_SLIDE):
        return Pose(axis * way)
    q = np.array([np.cos(way / 2), *(np.sin(way / 2) * axis)])
    return Pose(p - turned(q, p), q)

