"""assay: one robot model in many physics engines, measured side by side.

    import assay

    model = assay.load("humanoid")                      # a system's name, or an MJCF, URDF or USD file
    run = assay.Simulation(model, "mujoco-euler", timestep_ms=1)
    run.step()                                          # create, step, read: the three functions
    run.read().position                                 # a view, (joints,), rad and m

    results = assay.paper("results", quick=True)        # a campaign, in worker processes; the same call resumes
    results.values()                                    # a pandas table; frame="polars"
    results.recommend("humanoid", error="1mm")

Units are SI and radians, timesteps are milliseconds where the name says so, the world's z axis points up, quaternions are
(w, x, y, z). Everything is imported when it is used first, so that `import assay` costs little.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import adapter, plots
    from ._campaign import paper, run
    from ._engines import conformance, contenders, engine, engines, systems
    from ._fetch import fetch
    from ._match import LogCheck, Match, check_logs, match
    from ._model import Check, Limitation, Model, Simulation, State, Trajectory, check, limitations, load, load_text
    from ._results import Comparison, Results
    from ._version import __commit__, __version__
    from .errors import AssayError, EngineError, InputError, MachineError, RunError, UnsupportedError

_WHERE = {
    "paper": "_campaign", "run": "_campaign",
    "conformance": "_engines", "contenders": "_engines", "engine": "_engines", "engines": "_engines", "systems": "_engines",
    "fetch": "_fetch",
    "LogCheck": "_match", "Match": "_match", "check_logs": "_match", "match": "_match",
    "Check": "_model", "Limitation": "_model", "Model": "_model", "Simulation": "_model", "State": "_model",
    "Trajectory": "_model", "check": "_model", "limitations": "_model", "load": "_model", "load_text": "_model",
    "Comparison": "_results", "Results": "_results",
    "__version__": "_version", "__commit__": "_version",
    "AssayError": "errors", "EngineError": "errors", "InputError": "errors", "MachineError": "errors", "RunError": "errors",
    "UnsupportedError": "errors",
}
_MODULES = ("adapter", "plots")

__all__ = sorted([name for name in _WHERE if not name.startswith("_")] + list(_MODULES))


def __getattr__(name):
    import importlib

    if name in _MODULES:
        return importlib.import_module(f"{__name__}.{name}")
    if name not in _WHERE:
        raise AttributeError(f"module 'assay' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"{__name__}.{_WHERE[name]}"), name)
    globals()[name] = value
    return value


def __dir__():
    return sorted([*globals(), *_WHERE, *_MODULES])
