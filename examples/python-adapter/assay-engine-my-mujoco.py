import assay_adapter as assay


class Engine(assay.Engine):
    environment = "my-environment"  # a folder beside this file
    version = "4.0.1"

    def contenders(self):
        return [assay.Contender(name="my-mujoco", summary="hinges and free bodies, semi-implicit Euler")]

    def capabilities(self, settings):
        return assay.Capabilities(integrator="semi-implicit Euler", joint_solver="none (joint coordinates)", torques=True)

    def create(self, model, state, settings):
        return Simulation(model, state, settings.timestep)


class Simulation:
    def __init__(self, model, state, timestep):
        import mujoco as mj
        import numpy as np

        self.mj, self.np, spec, made = mj, np, mj.MjSpec(), []
        spec.compiler.degree, spec.option.timestep, spec.option.gravity = False, timestep, model.gravity
        origin = [np.array(body.p_BBcm) * body.is_free for body in model.bodies]  # frames of free bodies: at their centres
        for i, body in enumerate(model.bodies):
            parent, shift = (made[body.parent], origin[body.parent]) if body.parent >= 0 else (spec.worldbody, np.zeros(3))
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.I_BBcm_B
            made.append(parent.add_body(
                name=str(i), pos=body.X_PB.p - shift, quat=body.X_PB.q, mass=body.mass, ipos=body.p_BBcm - origin[i],
                explicitinertial=True, fullinertia=[xx, yy, zz, xy, xz, yz]))
            if body.is_free:
                made[i].add_freejoint(name=str(i))
            else:
                joint = model.joints[body.joint]
                made[i].add_joint(name=str(i), type=mj.mjtJoint.mjJNT_HINGE, pos=joint.p_BJ, axis=joint.axis_B,
                                  ref=joint.reference)
        self.model = spec.compile()
        self.data, self.rows = mj.MjData(self.model), state.bodies
        joints = [self.model.joint(str(joint.body)) for joint in model.joints]
        self.ids = [joint.id for joint in joints]
        self.q, self.v = [joint.qposadr[0] for joint in joints], [joint.dofadr[0] for joint in joints]
        self.data.qpos[self.q], self.data.qvel[self.v] = state.position, state.velocity
        self.free = []  # by free body: its row, and its numbers in qpos and qvel
        for row in (i for i, body in enumerate(model.bodies) if body.is_free):
            at = self.model.joint(str(row))
            self.free.append((state.bodies[row], self.data.qpos[at.qposadr[0]:][:7], self.data.qvel[at.dofadr[0]:][:6]))
        for row, q, v in self.free:
            q[:], v[:3] = row[:7], row[7:10]
            v[3:] = self.turned(row[10:], row[3:7] * [1, -1, -1, -1])
        self.bodies = [self.model.body(str(i)).id for i in range(len(model.bodies))]

    def turned(self, vector, quaternion):
        result = self.np.zeros(3)
        self.mj.mju_rotVecQuat(result, vector, quaternion)
        return result

    def set_torques(self, torques):
        self.data.qfrc_applied[self.v] = torques

    def advance(self, count):  # what is timed
        self.mj.mj_step(self.model, self.data, count)

    def read_state(self):
        for row, q, v in self.free:
            row[:7], row[7:10], row[10:] = q, v[:3], self.turned(v[3:], q[3:])
        return {"position": self.data.qpos[self.q], "velocity": self.data.qvel[self.v], "bodies": self.rows}

    def view(self):  # what the engine holds
        model, data, ids, bodies = self.model, self.data, self.ids, self.bodies
        self.mj.mj_forward(model, data)
        R = data.ximat[bodies].reshape(-1, 3, 3)
        none = self.np.full(len(ids), self.np.inf)
        return {"gravity": model.opt.gravity, "mass": model.body_mass[bodies], "com": data.xipos[bodies],
                "inertia": R * model.body_inertia[bodies, None] @ R.transpose(0, 2, 1), "anchor": data.xanchor[ids],
                "axis": data.xaxis[ids], "lower": -none, "upper": none}
