"""What an adapter in Python is written with: docs/extending.md, "In Python".

An adapter is a module with a class `Engine`, derived from the one below. assay reads its declarations (settings,
contenders, capabilities, check) with the standard library alone, in every process that lists engines, so the engine and
NumPy are imported where they are needed: in create(), or in a module beside the adapter that create() imports.

Units are SI, the world's z axis points up, quaternions are (w, x, y, z). src/engines/engine.h defines every term.
"""

import json
import os
import posix
import sys
import traceback


class EngineFailure(Exception):
    """The engine reported a failure, as a solver that does not converge: the run ends as diverged. Any other exception
    of an adapter counts as a crash."""


class Unsupported(Exception):
    """create() cannot do what the model asks for. check() is the better place to say so."""


class Record:
    """Named values. An unknown name is an error."""

    _defaults = {}

    def __init__(self, **values):
        for name in values:
            if name not in self._defaults:
                raise TypeError(f"{type(self).__name__} has no '{name}': it has {', '.join(self._defaults)}")
        self.__dict__.update(self._defaults)
        self.__dict__.update(values)

    def __repr__(self):
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in self.__dict__.items())})"


class Setting(Record):
    """A knob: `default` is a bool, an int, a float or a text, and decides the type. `role` is "iterations", "tolerance",
    "contact_softness", "contact_stiffness" or "contact_damping" where it is that; `only_with` names values of other
    settings, as texts, without which it does nothing."""

    _defaults = {"name": "", "default": 0.0, "unit": "", "meaning": "", "choices": (), "minimum": None, "maximum": None,
                 "role": "", "only_with": {}}


class Contender(Record):
    """A choice of settings under a name: `set` holds what differs from the defaults."""

    _defaults = {"name": "", "summary": "", "set": {}}


class Deviation(Record):
    """A departure from the model's physics that is the engine's own: see src/conformance/README.md."""

    _defaults = {"test": "", "bound": 0.0, "reason": ""}


def exact():
    """A feature that is carried over exactly."""
    return {"fidelity": "exact", "how": ""}


def approximated(how):
    """A feature that is carried over in another way: `how`, with its measured bound."""
    return {"fidelity": "approximated", "how": how}


def refused(how):
    """A feature that is refused: why, and what the user can do."""
    return {"fidelity": "refused", "how": how}


class Limitation(Record):
    """What is done with one element of a model: `what` is approximated(...) or refused(...)."""

    _defaults = {"element": "", "what": None}


MOST_NAMED_PAIRS = 500
_SHAPES = {"sphere": "spheres", "capsule": "capsules", "box": "boxes", "cylinder": "cylinders", "ellipsoid": "ellipsoids",
           "hull": "meshes", "plane": "planes", "height-field": "height fields"}


def pair_elements(model, pairs):
    """What Limitations call contact pairs: each by its shapes, "contact of 'a' and 'b'"; those of a model with more than
    MOST_NAMED_PAIRS together where their shapes are of the same two kinds, as class PairGroups of model/pair_groups.h names
    them. `pairs` are some of model.contacts, or tuples of such a pair and what follows on its name: pairs with different
    such texts stay apart."""
    groups = {}
    for each in pairs:
        pair, detail = each if isinstance(each, tuple) else (each, "")
        a, b = model.shapes[pair.shape_a], model.shapes[pair.shape_b]
        named = len(model.contacts) <= MOST_NAMED_PAIRS
        key = len(groups) if named else (frozenset((a.type, b.type)), detail)
        groups.setdefault(key, [a, b, detail, 0])[3] += 1
    elements = []
    for a, b, detail, count in groups.values():
        names = f"'{a.name}' and '{b.name}'"
        if count > 1:
            kinds = _SHAPES[a.type] + ("" if a.type == b.type else f" and {_SHAPES[b.type]}")
            elements.append(f"contacts of {names} and {count - 1} more pairs of {kinds}{detail}")
        else:
            elements.append(f"contact of {names}{detail}")
    return elements


class Capabilities(Record):
    """What a contender can do and how: struct Capabilities of engine.h. `features` maps the keys of
    `assay list engines --features` to exact(), approximated(...) or refused(...); what it does not name is refused.
    `springs` is "native", "explicit" (assay adds the torques of joints' springs and dampers to those that
    set_torques() gets) or "none". `contact_forces` is "none", "normal" or "all": what contacts() gives."""

    _defaults = {"precision": "double", "coordinates": "joint", "integrator": "", "order": 1, "joint_solver": "",
                 "contact_solver": "", "contact_model": "", "friction_cone": "", "friction_combine": "",
                 "contact": False, "joint_limits": False, "torques": False, "armature": False, "springs": "none",
                 "spring_note": "", "gyroscopic": True, "iterations": "", "sleep": "none (it has none)",
                 "speed_limits": "none", "hidden_damping": "", "other": "", "contact_forces": "none",
                 "contact_forces_note": "", "threads": 1, "deviations": (), "features": {}}


class Settings(dict):
    """Values of all declared settings by name, and the timestep in s."""

    timestep = 0.0


class State:
    """A state at which a simulation starts: `time` in s; `bodies`, an array (bodies, 13) of position of the centre of mass,
    orientation, velocity of the centre of mass, angular velocity, all in the world; `position` and `velocity`, (joints,),
    of hinges and slides; `balls`, (ball joints, 7), of relative orientation and angular velocity in the child's axes."""

    __slots__ = ("time", "bodies", "position", "velocity", "balls")


class Engine:
    """What an adapter declares and makes. An instance lives as long as the process."""

    # The folder of the virtual environment with the engine, relative to the adapter's file; None: the one that set-up made
    # for it, or none at all.
    environment = None
    # Folders of packages, where they are not those of an environment: of an interpreter of the system.
    packages = None
    version = ""
    source = ""
    compiler = "unknown (prebuilt)"
    flags = "as its makers built it"

    def settings(self):
        return []

    def contenders(self):
        raise NotImplementedError("an adapter needs contenders()")

    def capabilities(self, settings):
        raise NotImplementedError("an adapter needs capabilities()")

    def check(self, model, settings):
        """Limitations beyond what the capabilities say."""
        return []

    def create(self, model, state, settings):
        """A simulation of `model` that starts in `state`: an object with

        advance(count)       count calls of the engine's own step function and nothing else: what the clock measures
        set_torques(torques) one number a hinge and slide, (joints,), that acts until the next call, which assay makes after
                             every step with torques; the array is reused
        read_state()         a dict of float64 arrays. In joint coordinates "position" and "velocity" (joints,), "balls"
                             (ball joints, 7) if the model has any, and "bodies" (bodies, 13), of which the rows of free
                             bodies are read, if it has any. In maximal coordinates "bodies".
        view()               what the engine holds, read through its API: a dict of "gravity" (3), "mass" (bodies,), "com"
                             (bodies, 3) and "inertia" (bodies, 3, 3) in the world, "anchor" and "axis" (joints, 3) in the
                             world, "lower" and "upper" (joints,), infinite without a limit
        keep_contacts()      only with contact forces: called before the first step of a run that is not timed; the motion
                             stays the same
        contacts()           after that, the contact points of the last step, one row of 12 numbers each: two shapes
                             (numbers in the model), the point, the unit normal from the first to the second (3 each, in the
                             world), the gap in m where the step began, and the impulse on the second's body in N s (3)
        """
        raise NotImplementedError("an adapter needs create()")

    def create_batch(self, model, worlds, settings, device):
        """Only of engines that step many worlds of one model together; others leave it out. `device` is "cpu" or "cuda:N".
        Each world moves as one of create() does, to rounding. An object with

        restart(states)      a state for each world, a list of State without times: called before the first step, and again
        advance(count)       count steps of all worlds and nothing else; it may return before they are done
        synchronize()        waits for them; raises EngineFailure for what went wrong in any world, as a contact buffer
                             that was too small. The clock measures advance() and synchronize()
        set_torques(torques) (worlds, joints), until the next call, as in create(); only with torques
        read_state(world)    of one world, as in create()
        facts()              a dict, of which all is optional: "memory_bytes" that the worlds take on the device,
                             "compile_s" that compiling took, "device" and "driver" (names), "overflow" (of which buffer)
        """
        raise NotImplementedError("this adapter steps one world")


def pinned(package, file):
    """The version of `package` in requirements.txt beside `file`."""
    with open(os.path.join(os.path.dirname(file), "requirements.txt"), encoding="utf-8") as lines:
        for line in lines:
            if line.startswith(package + "=="):
                return line.split()[0].split("==")[1]
    raise LookupError(f"requirements.txt beside '{file}' does not pin '{package}'")


# ---- what the host calls --------------------------------------------------------------------------------------------

_active = None  # the environment that this process has
_numpy = None
_own = False  # the process is assay's own, and not an interpreter that has assay as a library


def _load(path, name, environment=""):
    """The adapter of a file or a folder. `environment` is the folder of its virtual environment."""
    import importlib.util

    file = os.path.join(path, "engine.py") if os.path.isdir(path) else path
    before = set(sys.modules)
    sys.path.insert(0, os.path.dirname(file))
    try:
        spec = importlib.util.spec_from_file_location("assay_engine_" + name.replace("-", "_"), file)
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module
        spec.loader.exec_module(module)
    except ModuleNotFoundError as error:
        raise ImportError(
            f"'{file}' imports '{error.name}' when it is loaded: import it inside create(), because assay reads the "
            f"declarations of all adapters with the standard library alone") from error
    finally:
        sys.path.pop(0)
    loaded = {each: getattr(sys.modules[each], "__file__", None) or "" for each in set(sys.modules) - before}
    # another adapter may have modules of the same names
    for each, its_file in loaded.items():
        if os.path.dirname(its_file) == os.path.dirname(file):
            del sys.modules[each]
    engine = module.Engine()
    engine._name, engine._file, engine._folder, engine._environment = name, file, os.path.dirname(file), environment
    # what else its declarations come from
    own, library = os.path.join(path, ""), os.path.join(os.path.dirname(os.__file__), "")
    engine._others = sorted({each for each in loaded.values() if os.path.isfile(each) and each != path and
                             not each.startswith(own) and (not each.startswith(library) or "-packages" in each)})
    return engine


def _activate(engine):
    """Gives the process the engine's environment, once."""
    global _active, _numpy
    environment = engine._environment
    if not _own:
        import numpy

        _numpy = numpy
        return
    if engine._folder not in sys.path:
        sys.path.append(engine._folder)
    if _active is not None:
        if _active != environment:
            raise EngineFailure(f"this process has the Python environment '{_active}' and cannot have '{environment}' "
                                f"too: run the engines in processes of their own")
        return
    if environment:
        packages = engine.packages
        if packages is None:
            packages = [os.path.join(environment, "lib", f"python{sys.version_info[0]}.{sys.version_info[1]}",
                                     "site-packages")]
        if not any(map(os.path.isdir, packages)):
            again = f"make it again with Python {sys.version_info[0]}.{sys.version_info[1]}"
            if engine.environment is None:
                again = f"run ./assay setup {engine._name}"
            raise EngineFailure(f"the Python environment '{environment}' has no '{packages[0]}': {again}")
        import site

        for folder in packages:
            site.addsitedir(folder)
        # packages of the environment come before those of nobody
        sys.path.sort(key=lambda folder: not folder.startswith(tuple(packages)))
        sys.prefix = sys.exec_prefix = environment
    import gc
    import numpy

    _numpy = numpy
    _active = environment
    gc.disable()


def _declaration(engine):
    """Everything that it declares without a model: PythonDeclaration of python_declaration.h."""
    facts = {name: str(getattr(engine, name)) for name in ("version", "source", "compiler", "flags")}
    settings, contenders = list(engine.settings()), list(engine.contenders())
    defaults = {each.name: each.default for each in settings}
    capabilities = []
    for contender in contenders:
        for name in contender.set:
            if name not in defaults:
                raise KeyError(f"contender '{contender.name}' sets '{name}', which settings() does not declare")
        capabilities.append(_capabilities_with(engine, {**defaults, **contender.set}, 0.0))
    environment = None if engine.environment is None else os.fspath(engine.environment)
    return json.dumps({"build": facts, "environment": environment, "batches": _has_batches(engine),
                       "settings": [vars(each) for each in settings], "contenders": [vars(each) for each in contenders],
                       "capabilities": capabilities, "files": engine._others})


def _declare(path, name):
    return _declaration(_load(path, name))


def _settings(text):
    values = json.loads(text)
    settings = Settings(values["values"])
    settings.timestep = values["timestep"]
    return settings


def _capabilities(engine, settings):
    settings = _settings(settings)
    return json.dumps(_capabilities_with(engine, settings, settings.timestep))


def _capabilities_with(engine, values, timestep):
    settings = Settings(values)
    settings.timestep = timestep
    capabilities = engine.capabilities(settings)
    if not isinstance(capabilities, Capabilities):
        raise TypeError(f"capabilities() gave a {type(capabilities).__name__}: return assay_adapter.Capabilities(...)")
    values = dict(vars(capabilities))
    values["deviations"] = [vars(each) for each in values["deviations"]]
    return values


class _Object:
    """A part of a model: struct of the same name in model.h, with its names; vectors and matrices are lists."""

    def __init__(self, values):
        self.__dict__.update(values)


def _model(text):
    return json.loads(text, object_hook=_Object)


def _check(engine, model, settings):
    return json.dumps([{"element": each.element, **each.what} for each in engine.check(model, _settings(settings))])


def _create(engine, model, time, bodies, position, velocity, balls, settings):
    _activate(engine)
    import gc

    if _own:
        gc.collect()
    state = State()
    state.time = time

    def array(memory, columns):
        values = _numpy.frombuffer(memory, dtype=_numpy.float64).copy()
        return values.reshape(-1, columns) if columns > 1 else values

    state.bodies, state.balls = array(bodies, 13), array(balls, 7)
    state.position, state.velocity = array(position, 1), array(velocity, 1)
    made = engine.create(model, state, _settings(settings))
    if _own:
        gc.freeze()
    return made


def _has_batches(engine):
    return type(engine).create_batch is not Engine.create_batch


def _create_batch(engine, model, worlds, settings, device):
    _activate(engine)
    import gc

    if _own:
        gc.collect()
    made = engine.create_batch(model, worlds, _settings(settings), device)
    if _own:
        gc.freeze()
    return made


def _by_world(values, worlds):
    return values.reshape(worlds, -1)


def _restart(batch, worlds, bodies, position, velocity, balls):
    states = [State() for _ in range(worlds)]
    parts = (bodies.reshape(worlds, -1, 13), position.reshape(worlds, -1), velocity.reshape(worlds, -1),
             balls.reshape(worlds, -1, 7))
    for state, *own in zip(states, *parts):
        state.time = 0.0
        state.bodies, state.position, state.velocity, state.balls = (part.copy() for part in own)
    batch.restart(states)


def _batch_facts(batch):
    facts = {"memory_bytes": 0.0, "compile_s": 0.0, "device": "", "driver": "", "overflow": ""}
    told = batch.facts() if hasattr(batch, "facts") else {}
    for name in told:
        if name not in facts:
            raise ValueError(f"facts() gave '{name}': it may give {', '.join(facts)}")
    return json.dumps({name: type(otherwise)(told.get(name, otherwise)) for name, otherwise in facts.items()})


def _array(memory):
    return _numpy.frombuffer(memory, dtype=_numpy.float64)


def _view(simulation):
    view = {name: _numpy.asarray(values, dtype=_numpy.float64) for name, values in simulation.view().items()}
    for name in ("lower", "upper"):
        view[name] = _numpy.clip(view[name], -1e300, 1e300)
    return json.dumps({name: values.tolist() for name, values in view.items()})


def _contacts(simulation):
    return json.dumps(_numpy.asarray(simulation.contacts(), dtype=_numpy.float64).reshape(-1, 12).tolist())


def _fork_is_refused():
    raise RuntimeError("an adapter must not fork: the worker would go on twice")


def _describe(error):
    """One line: the exception and where it comes from, the innermost call last."""
    kind, text = type(error).__name__, " ".join(str(error).split())
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename != __file__]
    where = " > ".join(f"{os.path.basename(frame.filename)}:{frame.lineno} in {frame.name}" for frame in frames)
    text = f"{kind}: {text}" if text else kind
    return f"{text} [{where}]" if where else text


def _own_process():
    """Called once, where assay started the interpreter."""
    global _own
    _own = True
    # No audit hook: it would be called for every audited event, which Genesis' step has many of
    os.fork = os.forkpty = posix.fork = posix.forkpty = _fork_is_refused
    sys.stdout = sys.stderr  # standard output belongs to the program
