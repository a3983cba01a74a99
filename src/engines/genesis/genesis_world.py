"""A scene of Genesis for a model, and one running simulation of it."""

import assay_adapter as assay
import numpy as np
from genesis_start import gs, has_compiled, is_started, start, stop
from genesis_model import Prepared
from mujoco_model import body_label

MOST_WORLDS = 8
INTEGRATORS = {"euler": "Euler", "implicitfast": "implicitfast", "approximate_implicitfast": "approximate_implicitfast"}
SOLVERS = {"newton": "Newton", "cg": "CG"}


def options_of(model, settings):
    """Genesis' own, where README.md does not say why not."""
    pairs = len(model.contacts)
    return gs.options.RigidOptions(
        integrator=getattr(gs.integrator, INTEGRATORS[settings["integrator"]]),
        constraint_solver=getattr(gs.constraint_solver, SOLVERS[settings["solver"]]),
        friction_cone=getattr(gs.friction_cone, settings["cone"]), iterations=settings["iterations"],
        tolerance=settings["tolerance"] or None, constraint_timeconst=settings["constraint_timeconst"],
        enable_collision=pairs > 0, enable_joint_limit=True, enable_self_collision=True, enable_neutral_collision=True,
        enable_adjacent_collision=True, max_collision_pairs=max(150, pairs), use_hibernation=False,
        enable_torsional_friction=any(pair.torsional > 0 or pair.rolling > 0 for pair in model.contacts),
        enable_rolling_friction=any(pair.rolling > 0 for pair in model.contacts))


class Held(gs.morphs.MJCF):
    """Genesis' reader of MJCF takes an mjModel, exact to the last digit; only its option insists on a text."""

    def __init__(self, mujoco, **options):
        super().__init__(file="<mujoco/>", **options)
        object.__setattr__(self, "file", mujoco)

    def _identifier(self):
        return "model"


class Scene:
    """`entity` has the whole model, in each of `worlds` worlds (0: in one, without an index)."""

    def __init__(self, model, settings, worlds=0):
        self.prepared = Prepared(model)
        try:
            self.scene = gs.Scene(
                sim_options=gs.options.SimOptions(dt=settings.timestep, substeps=1, gravity=tuple(model.gravity)),
                rigid_options=options_of(model, settings), show_viewer=False,
                profiling_options=gs.options.ProfilingOptions(show_FPS=False))
            self.entity = self.scene.add_entity(Held(
                self.prepared.mujoco, default_armature=None, align=False, convexify=True, decimate=False,
                decompose_object_error_threshold=float("inf"), decompose_robot_error_threshold=float("inf")))
            self.scene.build(n_envs=worlds)
        except gs.GenesisException as error:
            raise assay.Unsupported(f"Genesis refuses the model: {error}") from error
        self.solver = self.scene.sim.rigid_solver
        self.find_coordinates(model)

    def find_coordinates(self, model):
        """Genesis' numbers of MuJoCo's coordinates: it may order the bodies in another way."""
        m = self.prepared.mujoco
        self.q, self.v = np.zeros(m.nq, dtype=int), np.zeros(m.nv, dtype=int)
        for i in range(m.njnt):
            joint = self.entity.get_joint(m.joint(i).name)
            q, v = m.jnt_qposadr[i], m.jnt_dofadr[i]
            self.q[q:q + joint.n_qs], self.v[v:v + joint.n_dofs] = joint.qs_idx_local, joint.dofs_idx_local
        self.joint_dof = self.v[self.prepared.joint_dof]

    def in_order(self, state):
        """Genesis' positions and velocities of a state."""
        q, v = self.prepared.coordinates(state)
        mine, rates = np.zeros_like(q), np.zeros_like(v)
        mine[self.q], rates[self.v] = q, v
        return mine, rates

    def put(self, q, v):
        self.scene.reset()
        if q.size:
            self.entity.set_qpos(q, zero_velocity=False)
            self.entity.set_dofs_velocity(v)
            self.entity.control_dofs_force(np.zeros_like(v))

    def read(self, q, v):
        return self.prepared.read(q[self.q], v[self.v])

    def fail_if_wrong(self):
        try:
            self.solver.check_errno()
        except gs.GenesisException as error:
            raise assay.EngineFailure(f"Genesis: {error}") from error


class World(Scene):
    """For one simulation at a time."""

    def __init__(self, model, settings):
        super().__init__(model, settings)
        self.scene.step(False, False)  # compiles what is not compiled yet
        self.scene.step(False, False)
        self.taken = False


_worlds = []  # the last ones, with their models and settings


def world_of(model, settings):
    key = (settings.timestep, *sorted(settings.items()))
    for kept_model, kept_key, world in _worlds:
        if kept_model is model and kept_key == key and not world.taken:
            return world
    begin(settings)
    world = World(model, settings)
    if has_compiled() and not is_used():  # the next process finds what was compiled
        _worlds.clear()
        stop()
        begin(settings)
        world = World(model, settings)
    _worlds.append((model, key, world))
    while len(_worlds) > MOST_WORLDS:
        oldest = next((i for i, (_, _, each) in enumerate(_worlds) if not each.taken), None)
        if oldest is None:
            break
        _worlds.pop(oldest)[2].scene.destroy()
    return world


def is_used():
    return any(world.taken for _, _, world in _worlds)


def begin(settings, device="cpu"):
    if is_used():
        if not is_started(settings, device):
            raise assay.EngineFailure("this process runs Genesis in another precision, with other arrays or on another device: run the "
                                      "contenders in processes of their own")
    elif not is_started(settings, device):
        _worlds.clear()
        start(settings, device)


class Simulation:
    def __init__(self, model, state, settings):
        self.world = world_of(model, settings)
        self.world.put(*self.world.in_order(state))
        self.world.taken = True
        self.step, self.entity = self.world.scene.step, self.world.entity
        self.force = np.zeros(self.entity.n_dofs)

    def __del__(self):
        if hasattr(self, "world"):
            self.world.taken = False

    def set_torques(self, torques):
        self.force[self.world.joint_dof] = torques
        self.entity.control_dofs_force(self.force)

    def advance(self, count):
        step = self.step
        try:
            for _ in range(count):
                step(False, False)
        except gs.GenesisException as error:
            raise assay.EngineFailure(f"Genesis: {error}") from error

    def read_state(self):
        self.world.fail_if_wrong()
        return self.world.read(self.entity.get_qpos().numpy().astype(float), self.entity.get_dofs_velocity().numpy().astype(float))

    def view(self):
        return view_of(self.world)


def rotation(q):
    w, x, y, z = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def view_of(world):
    """Read from Genesis' arrays, with the bodies where its own kinematics puts them."""
    from genesis.utils.misc import qd_to_numpy

    prepared, entity, solver = world.prepared, world.entity, world.solver
    links = solver.dyn_info.links
    held = {name: qd_to_numpy(getattr(links, name)).astype(float)
            for name in ("inertial_mass", "inertial_i", "inertial_pos", "inertial_quat")}
    pose = [each.numpy().astype(float) for each in (solver.get_links_pos(), solver.get_links_quat())]
    mass, com, inertia = [], [], []
    for i, body in enumerate(prepared.body_id):
        if body < 0:
            mass.append(0.0), com.append(np.zeros(3)), inertia.append(np.zeros((3, 3)))
            continue
        link = entity.get_link(body_label(i)).idx
        R = rotation(pose[1][link])
        mass.append(held["inertial_mass"][link])
        com.append(pose[0][link] + R @ held["inertial_pos"][link])
        R = R @ rotation(held["inertial_quat"][link])
        inertia.append(R @ held["inertial_i"][link] @ R.T)
    anchor, axis = [], []
    limits = [each.numpy().astype(float) for each in entity.get_dofs_limit()]
    q = entity.get_qpos().numpy().astype(float)[world.q]
    for joint, at in zip(prepared.joint_id, prepared.joint_qpos):
        each = entity.get_joint(prepared.mujoco.joint(joint).name)
        p, a = each.get_anchor_pos().numpy().astype(float), each.get_anchor_axis().numpy().astype(float)
        if each.type == gs.JOINT_TYPE.PRISMATIC:
            p = p + a * (q[at] - prepared.mujoco.qpos0[at])
        anchor.append(p), axis.append(a)
    gravity = qd_to_numpy(solver.rigid_info.gravity).reshape(-1, 3)[0]
    return {"gravity": gravity, "mass": mass, "com": com, "inertia": inertia, "anchor": np.reshape(anchor, (-1, 3)),
            "axis": np.reshape(axis, (-1, 3)), "lower": limits[0][world.joint_dof], "upper": limits[1][world.joint_dof]}
