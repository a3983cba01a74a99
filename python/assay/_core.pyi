"""The extension. Users meet it through assay.load() and assay.Simulation, which document it."""

from typing import Any, Mapping, Optional

import numpy as np
from numpy.typing import NDArray

_Arrays = tuple[float, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def set_program(path: str) -> None: ...
def load(given: str, is_text: bool, name: str, drop_unsupported: bool, keyframe: str, qpos: str, packages: Mapping[str, str],
         base: str, ground: str, decompose: bool, allow_external_files: bool, within_limits: bool,
         repair: bool) -> Model: ...
def contenders() -> list[str]: ...
def add_engine(path: str) -> None: ...
def limitations(model: Model, contender: str, settings: Mapping[str, str]) -> list[tuple[str, str, str]]: ...

class Model:
    name: str
    source: str
    hash: str
    dof: int
    total_mass: float
    notes: list[str]
    keyframes: list[str]
    def json(self) -> str: ...
    def initial(self) -> _Arrays: ...
    def keyframe(self, name: str) -> _Arrays: ...
    def joint_state(self, position: Optional[NDArray[np.float64]], velocity: Optional[NDArray[np.float64]],
                    time: float) -> _Arrays: ...
    def variant(self, contacts: bool, gravity: bool) -> Model: ...

class Run:
    time: float
    timestep_ms: float
    contender: str
    def __init__(self, model: Model, contender: str, settings: Mapping[str, str], timestep_s: float,
                 state: Optional[tuple[Any, ...]]) -> None: ...
    def step(self, torques: NDArray[np.float64] = ...) -> None:
        """One step: under the array of (joints,) Nm and N, else under `torques`."""
    def advance(self, count: int) -> None:
        """`count` steps under `torques`."""
    def _arrays(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
    def _read(self) -> None: ...
    def _rollout(self, steps: int, every: int, torques: Optional[NDArray[np.float64]]) -> tuple[
        NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
