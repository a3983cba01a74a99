"""MJX's arrays of a model, its step as a compiled function of the state, and one running simulation."""

import contextlib
import copy
import functools
import warnings

import assay_adapter as assay
import jax
import mujoco as mj
import numpy as np
from xla import mjx
from mujoco_model import Compiled

INTEGRATORS = {"euler": mj.mjtIntegrator.mjINT_EULER, "rk4": mj.mjtIntegrator.mjINT_RK4,
               "implicitfast": mj.mjtIntegrator.mjINT_IMPLICITFAST}
SOLVERS = {"newton": mj.mjtSolver.mjSOL_NEWTON, "cg": mj.mjtSolver.mjSOL_CG}
CONES = {"pyramidal": mj.mjtCone.mjCONE_PYRAMIDAL, "elliptic": mj.mjtCone.mjCONE_ELLIPTIC}


class World:
    """What depends on the model and the settings alone. Simulations share it, because a step changes nothing in it."""

    def __init__(self, model, settings):
        def set_options(option):
            option.integrator = INTEGRATORS[settings["integrator"]]
            option.solver, option.cone = SOLVERS[settings["solver"]], CONES[settings["cone"]]
            option.iterations, option.tolerance = settings["iterations"], settings["tolerance"]
            option.ls_iterations = settings["ls_iterations"]

        self.compiled = Compiled(model, set_options)
        self.type = np.float64 if settings["precision"] == "double" else np.float32
        with self.precision():
            self.engine, self.rest = mjx.put_model(self.compiled.mujoco), mjx.make_data(self.compiled.mujoco)

    @functools.cached_property
    def run(self):
        """Steps of one world, compiled when the first simulation of one world asks for them."""
        with self.precision():
            start = self.begin(self.compiled.mujoco.qpos0, np.zeros(self.compiled.mujoco.nv))
            rest = (self.array(np.zeros(self.compiled.mujoco.nv)), self.array(1e-3))
            run = jax.jit(self.steps, donate_argnums=0).lower(start, *rest, number(1)).compile()
            jax.block_until_ready(run(start, *rest, number(0)))  # the first call loads the compiled code
        return run

    def precision(self):
        """What JAX makes of Python's numbers: MJX's functions ask for it while they are made into a compiled one."""
        return jax.enable_x64(self.type == np.float64)

    def array(self, values):
        return jax.numpy.array(values, dtype=self.type)  # a copy: JAX may go on using memory that it is given

    def begin(self, q, v):
        """A state: positions, velocities, and the accelerations that the constraint solver begins with."""
        return self.array(q), self.array(v), self.array(np.zeros(np.shape(v)))

    def step_of(self, timestep):
        """A step as a function of state and torques. The model is a constant in it, so that XLA computes ahead what follows from it, as
        in the environments that are written with MJX; the timestep is not, so that it is compiled once for all."""
        model = self.engine.tree_replace({"opt.timestep": timestep})

        def step(state, torques):
            q, v, acceleration = state
            data = mjx.step(model, self.rest.replace(qpos=q, qvel=v, qacc_warmstart=acceleration, qfrc_applied=torques))
            return data.qpos, data.qvel, data.qacc_warmstart

        return step

    def steps(self, state, torques, timestep, count):
        step = self.step_of(timestep)
        return jax.lax.fori_loop(0, count, lambda _, state: step(state, torques), state)


@functools.lru_cache(maxsize=64)
def number(count):
    return jax.numpy.array(count, dtype=np.int32)


_worlds = []  # the last ones, with their models and settings


def world_of(model, settings):
    key = tuple(sorted(settings.items()))
    for kept_model, kept_key, world in _worlds:
        if kept_model is model and kept_key == key:
            return world
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "Mesh .* has a coplanar face with more than")  # it would drop vertices
        _worlds.append((model, key, World(model, settings)))
    del _worlds[:-16]
    return _worlds[-1][2]


@contextlib.contextmanager
def refusals():
    """What MJX raises for a model that it does not take, as assay's outcomes."""
    try:
        yield
    except (ValueError, NotImplementedError) as error:
        raise assay.EngineFailure(f"MJX refuses the model: {error}") from error
    except UserWarning as warning:
        raise assay.Unsupported(f"MJX leaves out vertices of a hull: {warning}") from warning


class Simulation:
    def __init__(self, model, state, settings):
        with refusals():
            self.world = world_of(model, settings)
            self.run, self.compiled = self.world.run, self.world.compiled
        self.state = self.world.begin(*self.compiled.coordinates(state))
        self.timestep = self.world.array(settings.timestep)
        self.force = np.zeros(self.compiled.mujoco.nv)
        self.torques = self.world.array(self.force)

    def set_torques(self, torques):
        self.force[self.compiled.joint_dof] = torques
        self.torques = self.world.array(self.force)

    def advance(self, count):
        self.state = self.run(self.state, self.torques, self.timestep, number(count))
        self.state[0].block_until_ready()

    def read_state(self):
        q, v, _ = self.state
        return self.compiled.read(q, v)

    def view(self):
        engine, held = self.world.engine, copy.copy(self.compiled.mujoco)
        for name in ("body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "jnt_pos", "jnt_axis",
                     "jnt_range", "qpos0"):
            getattr(held, name)[...] = getattr(engine, name)
        held.opt.gravity[:] = engine.opt.gravity
        return self.compiled.view(held, np.asarray(self.state[0], dtype=float))
