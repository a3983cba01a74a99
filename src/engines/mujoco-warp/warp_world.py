"""MuJoCo Warp's arrays of a model, and one running simulation of it: a graph of steps that was captured on the CPU."""

import os
import sys
import tempfile

import assay_adapter as assay
import mujoco as mj
import numpy as np
import warp as wp


def folder_of_programs():
    """Where compiled kernels are kept: in the cache that set-up made the environment in, where that can be written."""
    shared = os.path.join(os.path.dirname(os.path.dirname(sys.prefix)), "kernels", os.path.basename(sys.prefix))
    try:
        os.makedirs(shared, exist_ok=True)
        with tempfile.TemporaryFile(dir=shared):
            return shared
    except OSError:
        pass
    try:
        return os.path.join(tempfile.gettempdir(), "kernels")
    except OSError as error:
        raise assay.EngineFailure(f"compiled kernels cannot be kept in '{shared}': {error}") from error


wp.config.quiet = True
wp.config.log_level = 40
wp.config.kernel_cache_dir = tempfile.tempdir = folder_of_programs()  # a confined process may write nowhere else
wp.init()
wp.set_device("cpu")

import mujoco_warp as mjw  # noqa: E402  (compiles for the device that is set)
from mujoco_model import Compiled, dimension  # noqa: E402

IGNORED = mjw.OverflowType.ITERATIONS | mjw.OverflowType.LS_ITERATIONS  # fewer iterations are a setting, not a failure
MANY = 32  # steps in the larger graph: the call of a graph costs the interpreter's part once for these
INTEGRATORS = {"euler": mj.mjtIntegrator.mjINT_EULER, "rk4": mj.mjtIntegrator.mjINT_RK4,
               "implicitfast": mj.mjtIntegrator.mjINT_IMPLICITFAST}
SOLVERS = {"newton": mj.mjtSolver.mjSOL_NEWTON, "cg": mj.mjtSolver.mjSOL_CG}
CONES = {"pyramidal": mj.mjtCone.mjCONE_PYRAMIDAL, "elliptic": mj.mjtCone.mjCONE_ELLIPTIC}
# contact points that two shapes have at most
POINTS = {frozenset(("plane", "capsule")): 2, frozenset(("plane", "box")): 4, frozenset(("plane", "cylinder")): 4,
          frozenset(("plane", "hull")): 4, frozenset(("capsule",)): 2, frozenset(("capsule", "box")): 2}
ON_FIELD = 50  # of a shape on a height field
ROWS = {"pyramidal": {1: 1, 3: 4, 4: 6, 6: 10}, "elliptic": {1: 1, 3: 3, 4: 4, 6: 6}}


def capacity(model, settings):
    """Contacts and constraint rows that there is room for. A step's cost grows with both, so there is no more room than all
    pairs can fill, and none for more than eight points a body (beside those on height fields) unless asked for."""
    points = rows = 0
    for pair in model.contacts:
        kinds = {model.shapes[pair.shape_a].type, model.shapes[pair.shape_b].type}
        points += POINTS.get(frozenset(kinds), ON_FIELD if "height-field" in kinds else 1 if "sphere" in kinds else 8)
        rows = max(rows, ROWS[settings["cone"]][dimension(pair)])
    most = 8 * len(model.bodies) + 8 + ON_FIELD * len(model.height_fields)
    contacts = settings["max_contacts"] or min(points, most)
    joints = [*model.joints, *model.balls, *model.tendons]
    others = sum(3 if hasattr(joint, "spring_reference") and isinstance(joint.spring_reference, list) else 1
                 for joint in joints if joint.dry_friction > 0)
    others += sum(2 if hasattr(joint, "lower") else 1 for joint in joints if joint.limited)
    others += len(model.couplings) + 3 * len(model.connects) + 6 * len(model.welds)
    return contacts, max(1, contacts * rows + others)


def arrays_of(record, found):
    """All arrays of a record and of the records in it."""
    for value in vars(record).values():
        if isinstance(value, wp.array):
            found.append(value)
        elif hasattr(value, "__dataclass_fields__"):
            arrays_of(value, found)
    return found


class World:
    """What depends on the model and the settings alone, for one simulation at a time."""

    def __init__(self, model, settings):
        def set_options(option):
            option.timestep = settings.timestep
            option.integrator = INTEGRATORS[settings["integrator"]]
            option.solver, option.cone = SOLVERS[settings["solver"]], CONES[settings["cone"]]
            option.jacobian = mj.mjtJacobian.mjJAC_AUTO
            option.iterations, option.tolerance = settings["iterations"], settings["tolerance"]

        self.compiled = Compiled(model, set_options)
        self.engine = mjw.put_model(self.compiled.mujoco)
        self.engine.opt.warn_overflow = 0  # printed inside the step otherwise; the flags are read here
        contacts, rows = capacity(model, settings)
        self.data = mjw.make_data(self.compiled.mujoco, nworld=1, nconmax=contacts, njmax=rows)
        self.arrays = arrays_of(self.data, [])
        self.start = [array.numpy().copy() for array in self.arrays]
        self.q, self.v, self.torques = (getattr(self.data, name).numpy()[0] for name in ("qpos", "qvel", "qfrc_applied"))
        self.overflow = self.data.overflow.numpy()
        mjw.step(self.engine, self.data)  # compiles what is not compiled yet
        self.one, self.many = self.captured(1), self.captured(MANY)
        self.replay = wp._src.context.runtime.core.wp_apic_cpu_replay_state
        self.taken = False

    def captured(self, steps):
        with wp.ScopedCapture(device="cpu") as capture:
            for _ in range(steps):
                mjw.step(self.engine, self.data)
        return capture.graph

    def begin(self, state, timestep):
        for array, start in zip(self.arrays, self.start):
            array.numpy()[...] = start
        self.engine.opt.timestep.numpy()[...] = timestep
        self.q[:], self.v[:] = self.compiled.coordinates(state)
        self.taken = True


_worlds = []  # the last ones, with their models and settings


def world_of(model, settings):
    key = tuple(sorted(settings.items()))
    for kept_model, kept_key, world in _worlds:
        if kept_model is model and kept_key == key and not world.taken:
            return world
    _worlds.append((model, key, World(model, settings)))
    del _worlds[:-16]
    return _worlds[-1][2]


class Simulation:
    def __init__(self, model, state, settings):
        try:
            self.world = world_of(model, settings)
        except (ValueError, NotImplementedError) as error:
            raise assay.EngineFailure(f"MuJoCo Warp refuses the model: {error}") from error
        self.world.begin(state, settings.timestep)
        self.torques, self.dof = self.world.torques, self.world.compiled.joint_dof
        self.replay, self.overflow = self.world.replay, self.world.overflow
        self.one, self.many = self.world.one.apic_state, self.world.many.apic_state

    def __del__(self):
        if hasattr(self, "world"):
            self.world.taken = False

    def set_torques(self, torques):
        self.torques[self.dof] = torques

    def advance(self, count):
        replay = self.replay
        done = True
        for _ in range(count // MANY):
            done = replay(self.many) and done
        for _ in range(count % MANY):
            done = replay(self.one) and done
        if not done:
            raise assay.EngineFailure("MuJoCo Warp: the captured graph could not be run")
        if self.overflow[0] & ~IGNORED:
            raise assay.EngineFailure(f"MuJoCo Warp: overflow of {mjw.OverflowType(int(self.overflow[0] & ~IGNORED))!r}: "
                                      f"raise max_contacts")

    def read_state(self):
        return self.world.compiled.read(self.world.q, self.world.v)

    def view(self):
        import copy

        engine, held = self.world.engine, copy.copy(self.world.compiled.mujoco)
        for name in ("body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "jnt_pos", "jnt_axis",
                     "jnt_range", "qpos0"):
            values = getattr(engine, name).numpy()
            getattr(held, name)[...] = values.reshape(getattr(held, name).shape)
        held.opt.gravity[:] = engine.opt.gravity.numpy()[0]
        return self.world.compiled.view(held, np.asarray(self.world.q, dtype=float))
