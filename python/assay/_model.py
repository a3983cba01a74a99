"""Models and the three functions of every contender: create, step, read."""

import dataclasses
import inspect
import os
from typing import Any, Iterable, Mapping, Optional, Union

from . import _program
from ._extension import core
from .adapter import _module
from .errors import InputError

_core = core()  # an older Python is told so here, before NumPy, which it need not have

import numpy as np  # noqa: E402


class State:
    """A state of a model at one time. Arrays are float64.

    time      s
    bodies    (bodies, 13): position of the centre of mass (m), orientation (w, x, y, z), velocity of the centre of mass
              (m/s), angular velocity (rad/s), all in the world frame
    position  (joints,): hinges in rad (they continue past pi), slides in m
    velocity  (joints,): rad/s, m/s

    Free and ball joints have their state in `bodies`. What Simulation.read() gives are views of the simulation's memory:
    the next read() changes them; copy() keeps them."""

    __slots__ = ("time", "bodies", "position", "velocity")

    def __init__(self, time: float, bodies: np.ndarray, position: np.ndarray, velocity: np.ndarray):
        self.time, self.bodies, self.position, self.velocity = time, bodies, position, velocity

    def copy(self) -> "State":
        """The same in memory of its own."""
        return State(self.time, self.bodies.copy(), self.position.copy(), self.velocity.copy())

    def __repr__(self) -> str:
        return f"State(time={self.time:g} s, {len(self.bodies)} bodies, {len(self.position)} joints)"


@dataclasses.dataclass(frozen=True)
class Trajectory:
    """States of a run. n samples, in the units of State.

    time      (n,)
    bodies    (n, bodies, 13)
    position  (n, joints)
    velocity  (n, joints)"""

    time: np.ndarray
    bodies: np.ndarray
    position: np.ndarray
    velocity: np.ndarray

    def __len__(self) -> int:
        return len(self.time)


class Model:
    """A robot model as every engine gets it. Made by load(); never changes.

    name, source, hash  texts; equal hashes mean equal physics
    dof                 degrees of freedom, as MuJoCo's nv
    total_mass          kg
    notes               sentences on what of the file was ignored, fused or left out
    initial             the State in which runs start: the first keyframe, else the reference state at rest
    keyframes           names

    and the parts of src/model/model.h under their names there, as adapters in Python see them: gravity (m/s^2), bodies,
    joints, balls, shapes, hulls, height_fields, contacts, couplings, connects, welds, tendons."""

    _PARTS = ("gravity", "bodies", "joints", "balls", "shapes", "hulls", "height_fields", "contacts", "couplings",
              "connects", "welds", "tendons")

    def __init__(self, loaded: Any):
        self._loaded = loaded
        self.name: str = loaded.name
        self.source: str = loaded.source
        self.hash: str = loaded.hash
        self.dof: int = loaded.dof
        self.total_mass: float = loaded.total_mass
        self.notes: list[str] = loaded.notes
        self.keyframes: list[str] = loaded.keyframes

    @property
    def initial(self) -> State:
        return State(*self._loaded.initial())

    def keyframe(self, name: str) -> State:
        """The state of a keyframe."""
        return State(*self._loaded.keyframe(name))

    def state(self, position: Optional[np.ndarray] = None, velocity: Optional[np.ndarray] = None, time: float = 0) -> State:
        """The initial state with other joint coordinates: position (joints,) in rad and m, velocity (joints,) in rad/s and
        m/s; what is not given stays. Bodies follow from them; free bodies stay."""
        return State(*self._loaded.joint_state(position, velocity, time))

    def variant(self, *, contacts: bool = True, gravity: bool = True) -> "Model":
        """The same without contacts or without gravity."""
        return Model(self._loaded.variant(contacts, gravity))

    def __getattr__(self, name: str) -> Any:
        if name not in Model._PARTS:
            raise AttributeError(f"a model has no '{name}'")
        self.__dict__.update({part: getattr(_module._model(self._loaded.json()), part) for part in Model._PARTS})
        return self.__dict__[name]

    def __repr__(self) -> str:
        return f"Model('{self.name}', {self.dof} DOF, {self.total_mass:.4g} kg)"


# src/load/load_options.h declares them once for the package, the program and campaigns.
_ARGUMENTS = _core.load_arguments()


def _checked(function: str, how: Mapping[str, Any], allowed: Iterable[str]) -> Mapping[str, Any]:
    unknown = sorted(set(how) - set(allowed))
    if unknown:
        raise TypeError(f"{function}() has no argument '{unknown[0]}'")
    return how


def load(model: Union[str, os.PathLike], **how: Any) -> Model:
    """Loads an MJCF, URDF or USD file, or a system by its name ("humanoid", "capsules-27").

    {arguments}

    Raises InputError with element, name, line and how to mend it. The file is parsed in this process; check() parses it in a
    process with limits, for files of strangers."""
    return Model(_core.load(os.fspath(model), False, "", _checked("load", how, [name for name, *_ in _ARGUMENTS])))


def load_text(text: str, name: str = "model", **how: Any) -> Model:
    """The same for the text of an MJCF or URDF document. `name` stands for the file in messages. No argument names a file."""
    allowed = [name for name, _, _, is_path in _ARGUMENTS if not is_path]
    return Model(_core.load(text, True, name, _checked("load_text", how, allowed)))


def _document_load() -> None:
    """What help(), Jupyter and Sphinx show of load()'s arguments."""
    own = inspect.signature(load)
    named = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default) for name, default, *_ in _ARGUMENTS]
    load.__signature__ = own.replace(parameters=[own.parameters["model"], *named])  # type: ignore[attr-defined]
    width = max(len(name) for name, *_ in _ARGUMENTS)
    rows = [f"{name:{width}}  {meaning}" for name, _, meaning, _ in _ARGUMENTS]
    load.__doc__ = (load.__doc__ or "").replace("{arguments}", "\n    ".join(rows))


_document_load()


def _text(name: str, value: Any) -> str:
    if isinstance(value, (bool, np.bool_)):
        return "on" if value else "off"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, str):
        return value
    raise InputError(f"setting '{name}' is a {type(value).__name__}: give a bool, a number or a text")


def _texts(settings: Optional[Mapping[str, Any]]) -> dict[str, str]:
    return {name: _text(name, value) for name, value in (settings or {}).items()}


@dataclasses.dataclass(frozen=True)
class Limitation:
    """What a contender does with one element of a model: `fidelity` is "approximated" or "refused", `how` says what it does
    instead, or what you can do."""

    fidelity: str
    element: str
    how: str


def limitations(model: Model, contender: str, settings: Optional[Mapping[str, Any]] = None) -> list[Limitation]:
    """Everything of the model that the contender does not carry over exactly; empty when all is exact."""
    return [Limitation(*each) for each in _core.limitations(model._loaded, contender, _texts(settings))]


class Simulation(_core.Run):
    """One running simulation of a contender: create, step, read.

        run = assay.Simulation(model, "ode-quick", timestep_ms=2, settings={"iterations": 20})
        run.torques[:] = 0.1
        run.step()              # one step under run.torques
        run.step(array)         # one step under an array of (joints,) float64
        run.advance(1000)       # many at once
        run.read().bodies       # (bodies, 13)

    `state` is a State to start in, at any time; without one the model's initial state. `settings` are the contender's own
    (assay.engines() lists them with units and defaults).

    torques   (joints,) what step() without an argument and advance() apply: Nm of hinges, N of slides. Write into it.
    bodies, position, velocity   what the last read() wrote, as State has them
    time      s, of the last read()

    The arrays are views of the simulation's memory; nothing is copied or converted on the way in or out. While an engine
    works, other threads of the interpreter run (not with engines in Python). A simulation belongs to one thread at a time.

    Raises InputError for what cannot be used, UnsupportedError for what the contender refuses, EngineError when it fails."""

    def __init__(self, model: Model, contender: str, timestep_ms: float = 1, *, state: Optional[State] = None,
                 settings: Optional[Mapping[str, Any]] = None):
        if not isinstance(model, Model):
            raise InputError(f"the model is a {type(model).__name__}: load one with assay.load()")
        start = None if state is None else (float(state.time), state.bodies, state.position, state.velocity)
        super().__init__(model._loaded, contender, _texts(settings), float(timestep_ms) * 1e-3, start)
        self.model = model
        self.torques, self.bodies, self.position, self.velocity = self._arrays()
        self._state = State(self.time, self.bodies, self.position, self.velocity)

    def read(self) -> State:
        """The state now, as views. Not timed by campaigns, and not free: it asks the engine for every body."""
        self._read()
        self._state.time = self.time
        return self._state

    def rollout(self, steps: int, *, every: int = 1, torques: Optional[np.ndarray] = None) -> Trajectory:
        """`steps` steps with the states before the first and after each `every` of them. `torques`: float64 (steps, joints);
        without it those of `self.torques`."""
        return Trajectory(*self._rollout(steps, every, torques))

    def __repr__(self) -> str:
        return f"Simulation('{self.model.name}', '{self.contender}', {self.timestep_ms:g} ms, time={self.time:g} s)"


@dataclasses.dataclass(frozen=True)
class Check:
    """What `assay check MODEL --json` tells.

    model     facts: bodies, degrees of freedom, masses
    problems  what was left out of the file
    findings  what to mend in the model and what to know, each with its places in the file
    timestep  the largest timestep of explicit springs and dampers
    engines   by engine: its contenders, and what they approximate or refuse
    elements  the same by element of the model"""

    model: dict
    problems: list
    findings: list
    timestep: Any
    engines: list
    elements: Any

    def __repr__(self) -> str:
        return f"Check('{self.model['system']}', {len(self.findings)} findings, {len(self.problems)} problems)"


def check(model: Union[str, os.PathLike], **options: Any) -> Check:
    """What is wrong with a model or worth knowing of it, and what each engine makes of it. Options are those of `assay check`:
    check(file, drop_unsupported=True, packages={"robot": folder}). The file is read in a process with limits."""
    if os.path.isdir(model):
        raise InputError(f"'{os.fspath(model)}' is a folder: give a model's file, or run `assay check` with --json for the folder")
    renamed = {("package" if name == "packages" else name): value for name, value in options.items()}
    found = _program.call_json("check", os.fspath(model), "--json", *_program.words(renamed), accept=(2,))
    if "engines" not in found:
        # the same refusal, in the program's words
        _program.call("check", os.fspath(model), *_program.words(renamed))
    return Check(found["model"], found["problems"], found["model_findings"], found["timestep"], found["engines"],
                 found["elements"])
