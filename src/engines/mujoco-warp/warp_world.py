"""MuJoCo Warp's arrays of a model, and one running simulation of it: a graph of steps that was captured on the CPU."""

import assay_adapter as assay
import mujoco as mj
import numpy as np
import warp_graph
import warp as wp
import mujoco_warp as mjw
from contact_room import capacity
from mujoco_model import Compiled

IGNORED = mjw.OverflowType.ITERATIONS | mjw.OverflowType.LS_ITERATIONS  # fewer iterations are a setting, not a failure
MANY = 32  # steps in the larger graph: the call of a graph costs the interpreter's part once for these
INTEGRATORS = {"euler": mj.mjtIntegrator.mjINT_EULER, "rk4": mj.mjtIntegrator.mjINT_RK4,
               "implicitfast": mj.mjtIntegrator.mjINT_IMPLICITFAST}
SOLVERS = {"newton": mj.mjtSolver.mjSOL_NEWTON, "cg": mj.mjtSolver.mjSOL_CG}
CONES = {"pyramidal": mj.mjtCone.mjCONE_PYRAMIDAL, "elliptic": mj.mjtCone.mjCONE_ELLIPTIC}


def compiled_of(model, settings):
    def set_options(option):
        option.timestep = settings.timestep
        option.integrator = INTEGRATORS[settings["integrator"]]
        option.solver, option.cone = SOLVERS[settings["solver"]], CONES[settings["cone"]]
        option.jacobian = mj.mjtJacobian.mjJAC_AUTO
        option.iterations, option.tolerance = settings["iterations"], settings["tolerance"]

    return Compiled(model, set_options)


def engine_and_data(model, settings, compiled, worlds):
    """MuJoCo Warp's model and data, on the current device."""
    engine = mjw.put_model(compiled.mujoco)
    engine.opt.warn_overflow = 0  # printed inside the step otherwise; the flags are read here
    contacts, rows = capacity(model, settings)
    return engine, mjw.make_data(compiled.mujoco, nworld=worlds, nconmax=contacts, njmax=rows)


def fail_if_full(flags):
    """`flags` are MuJoCo Warp's of each world."""
    full = int(np.bitwise_or.reduce(flags)) & ~IGNORED
    if full:
        raise assay.EngineFailure(f"MuJoCo Warp: overflow of {mjw.OverflowType(full)!r}: raise max_contacts")


def take(engine, data, steps):
    for _ in range(steps):
        mjw.step(engine, data)


class World:
    """What depends on the model and the settings alone, for one simulation at a time."""

    def __init__(self, model, settings):
        self.compiled = compiled_of(model, settings)
        self.engine, self.data = engine_and_data(model, settings, self.compiled, 1)
        self.arrays = warp_graph.arrays_of(self.data, [])
        self.start = [array.numpy().copy() for array in self.arrays]
        self.q, self.v, self.torques = (getattr(self.data, name).numpy()[0] for name in ("qpos", "qvel", "qfrc_applied"))
        self.overflow = self.data.overflow.numpy()
        mjw.step(self.engine, self.data)  # compiles what is not compiled yet
        self.one, self.many = self.captured(1), self.captured(MANY)
        self.taken = False

    def captured(self, steps):
        return warp_graph.Graph(wp.get_device("cpu"), lambda: take(self.engine, self.data, steps))

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
        self.overflow, self.replay = self.world.overflow, self.world.one.replay
        self.one, self.many = self.world.one.state, self.world.many.state

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
            fail_if_full(self.overflow)

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
