"""One running simulation by a solver of Newton's: graphs of steps that were captured on the CPU."""

import ctypes
import functools
import os
import sys
import warnings

import assay_adapter as assay
import numpy as np
import warp_graph
import warp as wp
import newton
from contact_room import capacity, contact_room
from newton_model import Built

# contact points that two shapes have at most in Newton's own collision detection, beside eight
POINTS = {frozenset(("plane", "capsule")): 2, frozenset(("capsule",)): 2}
MANY = 32  # steps in the larger graphs: an even number, after which the state is in the same buffer


@wp.kernel
def gather(flags: wp.array(dtype=wp.int32), seen: wp.array(dtype=wp.int32)):
    world = wp.tid()
    seen[world] = seen[world] | flags[world]


class Featherstone:
    flags = None

    def __init__(self, built, settings):
        self.solver = newton.solvers.SolverFeatherstone(built.engine, angular_damping=0.0)

    def step(self, before, after, control, timestep):
        self.solver.step(before, after, control, None, timestep)

    def begin(self, state):
        pass

    def restart(self, state):
        pass

    def fail_if_full(self, flags):
        pass


class Steel:
    def __init__(self, built, settings):
        model, engine = built.source, built.engine
        limits = sum(2 for joint in model.joints if joint.limited)
        contacts = engine.rigid_contact_max  # of all worlds together; the solver's rows are those of one world
        rows = 3 * built.contacts_of_world
        self.solver = newton.solvers.SolverSteel(
            engine, iterations=settings["iterations"] or 12, enable_joint_limits=True,
            articulation_constraint_max=rows + limits + len(model.couplings) + 1, free_body_constraint_max=rows + 1,
            warn_constraint_overflow=False)
        self.pipeline = self.contacts = None
        if built.pairs:
            self.pipeline = newton.CollisionPipeline(
                engine, broad_phase="explicit", shape_pairs_filtered=wp.array(built.pairs, dtype=wp.vec2i),
                rigid_contact_max=contacts)
            self.contacts = self.pipeline.contacts()
        self.flags = self.solver.constraint_overflow  # one a world

    def step(self, before, after, control, timestep):
        if self.pipeline:
            self.pipeline.collide(before, self.contacts)
        self.solver.step(before, after, control, self.contacts, timestep)

    def begin(self, state):
        self.solver.reset(state)

    restart = begin

    def fail_if_full(self, flags):
        if flags.any():
            raise assay.EngineFailure("Newton's SolverSteel: no room for all contacts: raise max_contacts")


class MuJoCo:
    def __init__(self, built, settings):
        load_mujoco()
        contacts, rows = capacity(built.source, settings)
        self.solver = newton.solvers.SolverMuJoCo(
            built.engine, integrator=settings["integrator"], solver=settings["solver_of_mujoco"], cone=settings["cone"],
            iterations=settings["iterations"] or 100, nconmax=contacts, njmax=rows, enable_multiccd=True,
            kinematic_switchable_roots=False)
        import mujoco_warp as mjw

        self.bits = mjw.OverflowType
        # fewer iterations are a setting, not a failure
        self.ignored = int(self.bits.ITERATIONS | self.bits.LS_ITERATIONS)
        self.solver.mjw_model.opt.warn_overflow = 0  # printed inside the step otherwise; the flags are read here
        # each step clears the solver's own flags
        self.flags = wp.zeros_like(self.solver.mjw_data.overflow)
        self.start = None

    def step(self, before, after, control, timestep):
        self.solver.step(before, after, control, None, timestep)
        wp.launch(gather, dim=self.flags.shape[0], inputs=[self.solver.mjw_data.overflow], outputs=[self.flags],
                  device=self.flags.device)

    def keep_start(self):
        self.arrays = warp_graph.arrays_of(self.solver.mjw_data, [])
        self.start = [array.numpy().copy() for array in self.arrays]

    def begin(self, state):
        for array, start in zip(self.arrays, self.start):
            array.numpy()[...] = start
        self.flags.zero_()

    def restart(self, state):
        import mujoco_warp as mjw

        mjw.reset_data(self.solver.mjw_model, self.solver.mjw_data)
        self.flags.zero_()

    def fail_if_full(self, flags):
        full = int(np.bitwise_or.reduce(flags)) & ~self.ignored
        if full:
            raise assay.EngineFailure(f"Newton's SolverMuJoCo: overflow of {self.bits(full)!r}: raise max_contacts")


def load_mujoco():
    """Newton's MuJoCo is another version than that of assay, which this process has, too, and whose functions its modules would
    find first."""
    flags, load, apart = sys.getdlopenflags(), ctypes.CDLL, os.RTLD_NOW | os.RTLD_DEEPBIND
    sys.setdlopenflags(apart)
    ctypes.CDLL = functools.partial(load, mode=apart)  # for MuJoCo's own plugins
    try:
        import mujoco  # noqa: F401
    finally:
        sys.setdlopenflags(flags)
        ctypes.CDLL = load


SOLVERS = {"featherstone": Featherstone, "steel": Steel, "mujoco": MuJoCo}


class Worlds:
    """A solver with its graphs: of the model itself, or of `worlds` copies."""

    def __init__(self, model, settings, friction, worlds, device):
        self.device, self.timestep = device, settings.timestep
        self.built = Built(model, settings["solver"], friction, contact_room(model, settings, POINTS), worlds, device)
        engine = self.built.engine
        self.control = engine.control()
        self.states = (engine.state(), engine.state())
        self.solver = SOLVERS[settings["solver"]](self.built, settings)
        self.keep_start()
        for first in (0, 1):
            self.step(first)  # compiles what is not compiled yet
        # a solver counts its steps: graphs that begin with the second buffer are captured after an odd number of them
        even, odd_many = self.captured(0, 1), self.captured(1, MANY)
        odd, even_many = self.captured(1, 1), self.captured(0, MANY)
        self.one, self.many = (even, odd), (even_many, odd_many)

    def keep_start(self):
        pass

    def step(self, first):
        self.solver.step(self.states[first], self.states[1 - first], self.control, self.timestep)

    def captured(self, first, steps):
        def run():
            for i in range(steps):
                self.step((first + i) % 2)

        return warp_graph.Graph(self.device, run)


class World(Worlds):
    """What depends on the model, the settings and the timestep alone, for one simulation at a time."""

    def __init__(self, model, settings, friction):
        super().__init__(model, settings, friction, 0, wp.get_device("cpu"))
        self.q = [state.joint_q.numpy() for state in self.states]
        self.v = [state.joint_qd.numpy() for state in self.states]
        self.torques = self.control.joint_f.numpy()
        self.full = None if self.solver.flags is None else self.solver.flags.numpy()
        self.taken = False

    def keep_start(self):
        if isinstance(self.solver, MuJoCo):
            self.solver.keep_start()

    def begin(self, state):
        for q, v in zip(self.q, self.v):
            self.built.write(state, q, v)
        self.torques[:] = 0
        for each in self.states:
            each.body_f.zero_()
            newton.eval_fk(self.built.engine, each.joint_q, each.joint_qd, each)
        self.solver.begin(self.states[0])
        self.taken = True


_worlds = []  # the last ones, with their models and settings


def world_of(model, settings, friction):
    key = (settings.timestep, *sorted(settings.items()))
    for kept_model, kept_key, world in _worlds:
        if kept_model is model and kept_key == key and not world.taken:
            return world
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of experimental parts, to whoever writes Newton's models by hand
        _worlds.append((model, key, World(model, settings, friction)))
    del _worlds[:-16]
    return _worlds[-1][2]


class Simulation:
    def __init__(self, model, state, settings, friction):
        try:
            self.world = world_of(model, settings, friction)
        except (ValueError, NotImplementedError) as error:
            raise assay.EngineFailure(f"Newton refuses the model: {error}") from error
        self.world.begin(state)
        self.replay, self.torques, self.dof = self.world.one[0].replay, self.world.torques, self.world.built.joint_v
        self.one = [graph.state for graph in self.world.one]
        self.many = [graph.state for graph in self.world.many]
        self.current = 0  # the buffer that has the state

    def __del__(self):
        if hasattr(self, "world"):
            self.world.taken = False

    def set_torques(self, torques):
        self.torques[self.dof] = torques

    def advance(self, count):
        done, replay = True, self.replay
        many = self.many[self.current]
        for _ in range(count // MANY):
            done = replay(many) and done
        for _ in range(count % MANY):
            done = replay(self.one[self.current]) and done
            self.current = 1 - self.current
        if not done:
            raise assay.EngineFailure("Newton: the captured graph could not be run")
        self.world.solver.fail_if_full(self.world.full)

    def read_state(self):
        q, v = (np.asarray(each[self.current], dtype=float) for each in (self.world.q, self.world.v))
        return self.world.built.read(q, v)

    def view(self):
        return self.world.built.view(self.world.states[self.current])
