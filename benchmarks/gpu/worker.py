"""One engine with one model on one device: the child process of run.py.

It prints one JSON object a line. Before it uses the device at length it prints {"say": "ready"} and waits for a line on its standard
input. The adapters of src/engines step the worlds; this program stands for the host that calls them.
"""

import argparse
import base64
import gc
import hashlib
import importlib.machinery
import importlib.metadata
import json
import os
import resource
import sys
import time
import types

STARTED = time.monotonic()
HERE = os.path.dirname(os.path.abspath(__file__))
STEPS = 32  # with the same torques
KEPT = 16  # worlds whose states are stored
FINE = 8  # steps of the fine-step run in one of the others
FINE_WORLDS = 64
DISTINCT = 1024  # starting states; more worlds start in the same ones with other torques

# contender: folder of its adapter, settings beside the defaults
CONTENDERS = {
    "mjx": ("mjx", {"precision": "single"}),
    "mjx-tf32": ("mjx", {"precision": "single"}),  # as JAX multiplies by itself
    "mjx-3-iterations": ("mjx", {"precision": "single", "iterations": 3, "ls_iterations": 5}),
    "mjx-deterministic": ("mjx", {"precision": "single"}),  # XLA_FLAGS of its job
    "genesis": ("genesis", {"precision": "single"}),
    "genesis-static": ("genesis", {"precision": "single", "static_arrays": True}),
    "genesis-double": ("genesis", {"precision": "double"}),
    "mujoco-warp": ("mujoco-warp", {}),
    "mujoco-warp-3-iterations": ("mujoco-warp", {"iterations": 3}),
    "mujoco-warp-deterministic": ("mujoco-warp", {}),  # repeat_sums
    "newton-mujoco": ("newton", {"solver": "mujoco"}),
    "newton-steel": ("newton", {"solver": "steel"}),
    "stand-in": ("", {}),
}


def say(kind, **facts):
    CHANNEL.write(json.dumps({"say": kind, **facts}) + "\n")
    CHANNEL.flush()


def wait_for_turn(**facts):
    say("ready", **facts)
    if sys.stdin.readline().strip() != "go":
        raise SystemExit(0)


class Absorbing(type):
    """Of classes that take every call and answer with nothing, as their instances do."""

    def __new__(cls, name, bases, members):
        def answer(self, *arguments, **named):
            return self

        members = {**members, "__init__": lambda self, *arguments, **named: None, "__call__": answer, "__getitem__": answer,
                   "__iter__": lambda self: iter(()), "__bool__": lambda self: False, "__len__": lambda self: 0}
        members.setdefault("__getattr__", lambda self, name: self if not name.startswith("__") else object.__getattribute__(self, name))
        return super().__new__(cls, name, bases, members)

    def __getattr__(cls, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return Absorbing(name, (), {})

    def __getitem__(cls, key):
        return None


class Unused:
    """Finds packages that Genesis imports for files of meshes, films and soft bodies, where they are missing: empty ones, which rigid
    bodies of primitive shapes do not use."""

    NAMES = ("pygltflib", "tetgen", "av", "z3", "OpenEXR", "Imath", "imath", "DracoPy", "pygel3d", "coacd", "fast_simplification",
             "rtree", "pyglet", "OpenGL", "freetype", "pymeshlab", "collada", "xacro", "zstandard", "vtk", "moviepy", "pysplashsurf")

    DRAWING = ("genesis.ext.pyrender", "genesis.vis.visualizer")  # need a library for graphics

    class Module(types.ModuleType):
        def __getattr__(self, name):
            if name.startswith("__"):
                raise AttributeError(name)
            return Absorbing(name, (), {})

    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] not in self.NAMES and not name.startswith(self.DRAWING):
            return None
        return importlib.machinery.ModuleSpec(name, self, is_package=True)

    def create_module(self, spec):
        return self.Module(spec.name)

    def exec_module(self, module):
        pass


def load_adapter(root, folder, cache):
    """The adapter's Engine, its modules found where the program's build would put them, compiled code kept in `cache`."""
    engines = os.path.join(root, "src", "engines")
    if folder == "genesis":
        sys.meta_path.append(Unused())
        drawing = Unused()
        drawing.NAMES = ()
        sys.meta_path.insert(0, drawing)
    sys.path[:0] = [os.path.join(engines, folder), os.path.join(engines, "mujoco-warp"), os.path.join(engines, "python-host")]
    kept = types.ModuleType("kernel_folder")
    kept.folder_of_programs = lambda: cache
    sys.modules["kernel_folder"] = kept
    import assay_adapter

    return assay_adapter, assay_adapter._load(os.path.join(engines, folder), folder)


def settings_of(assay, engine, chosen, timestep_s):
    settings = assay.Settings({each.name: each.default for each in engine.settings()})
    unknown = set(chosen) - set(settings)
    if unknown:
        raise ValueError(f"unknown settings {sorted(unknown)}")
    settings.update(chosen)
    settings.timestep = timestep_s
    return settings


class Starts:
    """The starting states and torques of worlds; the first n are the same for every number of worlds."""

    def __init__(self, assay, numpy, given):
        self.np, self.assay = numpy, assay
        self.moments, self.amplitude = given["starts"], numpy.array(given["torque"], dtype=float)
        self.states = []

    def state(self, world):
        """Of one of 64 moments of a run, all phases among the first worlds, with rates drawn around those of the moment."""
        moment = self.moments[int(f"{world % 64:06b}"[::-1], 2)]
        state = self.assay.State()
        state.time = 0.0
        for name, columns in (("bodies", 13), ("balls", 7)):
            setattr(state, name, self.np.array(moment[name], dtype=float).reshape(-1, columns))
        state.position, state.velocity = (self.np.array(moment[name], dtype=float) for name in ("position", "velocity"))
        if world:
            random = self.np.random.default_rng((1, world))
            state.velocity += random.uniform(-0.1, 0.1, state.velocity.shape)
            state.bodies[:, 7:10] += random.uniform(-0.05, 0.05, (len(state.bodies), 3))
            state.bodies[:, 10:13] += random.uniform(-0.1, 0.1, (len(state.bodies), 3))
        return state

    def of(self, worlds):
        while len(self.states) < min(worlds, DISTINCT):
            self.states.append(self.state(len(self.states)))
        return [self.states[world % DISTINCT] for world in range(worlds)]

    def torques(self, worlds, turn):
        drawn = self.np.random.default_rng((2, turn)).uniform(-1, 1, (worlds, len(self.amplitude)))
        return drawn * self.amplitude


def remember(holder, name, is_write=False):
    """States are given again and again: what an adapter computes of one is kept."""
    original, kept = getattr(holder, name), {}

    def compute(state):
        if id(state) not in kept:
            kept[id(state)] = (state, original(state))
        return kept[id(state)][1]

    def write(state, q, v):
        if id(state) not in kept:
            original(state, q, v)
            kept[id(state)] = (state, q.copy(), v.copy())
        q[:], v[:] = kept[id(state)][1:]

    setattr(holder, name, write if is_write else compute)


def repeat_sums():
    """MuJoCo Warp with all of its options for the same bits in each run."""
    import mujoco_warp

    original = mujoco_warp.put_model

    def put_model(*arguments, **named):
        engine = original(*arguments, **named)
        engine.opt.deterministic = mujoco_warp.DeterminismType.ALL
        return engine

    mujoco_warp.put_model = put_model


class Subject:
    def __init__(self, options):
        self.options = options
        folder, chosen = CONTENDERS[options.contender]
        assay, self.engine = load_adapter(options.root, folder, options.cache)
        import numpy

        if options.contender == "mujoco-warp-deterministic":
            repeat_sums()
        self.assay, self.np, self.folder, self.chosen = assay, numpy, folder, chosen
        assay._numpy = numpy
        with open(options.model, encoding="utf-8") as file:
            text = file.read()
        self.given = json.loads(text)
        self.model = assay._model(json.dumps(self.given["model"]))
        self.timestep_s = 1e-3 * self.given["timestep_ms"]
        self.settings = settings_of(assay, self.engine, chosen, self.timestep_s)
        refusals = [f"{each.element}: {each.what['how']}" for each in self.engine.check(self.model, self.settings)
                    if each.what["fidelity"] == "refused"]
        if refusals:
            raise assay.Unsupported("; ".join(refusals[:3]))
        self.starts = Starts(assay, numpy, self.given)

    def made(self, worlds, settings=None):
        batch = self.engine.create_batch(self.model, worlds, settings or self.settings, self.options.device)
        if self.folder in ("mjx", "mujoco-warp"):
            if not hasattr(batch.compiled, "remembers"):
                remember(batch.compiled, "coordinates")
                batch.compiled.remembers = True
        elif self.folder == "genesis":
            remember(batch.of, "in_order")
        elif self.folder == "newton":
            remember(batch.of.built, "write", is_write=True)
        return batch

    def coordinates(self, batch):
        """The engine's own positions and velocities of all worlds, one row a world."""
        if self.folder == "mjx":
            found = batch.state[:2]
        elif self.folder == "mujoco-warp":
            found = (batch.data.qpos.numpy(), batch.data.qvel.numpy())
        elif self.folder == "newton":
            state = batch.of.states[batch.current]
            found = (batch.rows(state.joint_q), batch.rows(state.joint_qd))
        elif self.folder == "genesis":
            entity = batch.of.entity
            found = [each.cpu().numpy() for each in (entity.get_qpos(), entity.get_dofs_velocity())]
        else:
            found = batch.coordinates()
        return self.np.ascontiguousarray(self.np.concatenate([self.np.asarray(each).reshape(batch.worlds_here, -1) for each in found], axis=1))

    def rows(self, batch, worlds):
        """States of some worlds: free bodies' rows of 13, positions and velocities of joints, ball joints."""
        found = []
        for world in worlds:
            state = batch.read_state(world)
            free = [i for i, body in enumerate(self.model.bodies) if body.is_free]
            bodies = self.np.asarray(state["bodies"])[free] if free else self.np.zeros(0)
            balls = state.get("balls", ())
            found.append(self.np.concatenate([self.np.asarray(each, dtype=float).flatten() for each in
                                              (bodies, state["position"], state["velocity"], balls)]))
        return self.np.array(found)

    def gpu_memory(self):
        """Bytes that this process has on the device, as its driver says it; 0 where it does not."""
        if self.options.device == "cpu":
            return 0.0
        try:
            import pynvml

            pynvml.nvmlInit()
            handle = pynvml.nvmlDeviceGetHandleByIndex(int(self.options.device.partition(":")[2] or 0))
            own = [each.usedGpuMemory for each in pynvml.nvmlDeviceGetComputeRunningProcesses(handle) if each.pid == os.getpid()]
            return float(sum(each or 0 for each in own))
        except Exception:
            return 0.0


def packed(numpy, rows):
    return {"shape": list(rows.shape), "float32": base64.b64encode(numpy.ascontiguousarray(rows, dtype="<f4").tobytes()).decode()}


def measure(subject, batch, worlds):
    options, np, starts = subject.options, subject.np, subject.starts
    batch.worlds_here = worlds
    record, states = {}, {}
    begin = time.monotonic()
    batch.restart(starts.of(worlds))
    record["restart_s"] = time.monotonic() - begin
    begin = time.monotonic()
    batch.advance(1)
    batch.synchronize()
    record["first_step_s"] = time.monotonic() - begin

    def same_steps(settings_steps=STEPS):
        batch.restart(starts.of(worlds))
        batch.set_torques(starts.torques(worlds, 0))
        batch.advance(settings_steps)
        batch.synchronize()
        return subject.coordinates(batch)

    first = same_steps()
    kept = sorted({*range(min(KEPT if worlds != FINE_WORLDS else FINE_WORLDS, worlds)), worlds - 1})
    states["equal"] = packed(np, subject.rows(batch, kept))
    record["kept_worlds"] = kept
    again = same_steps()
    record["same_bits"] = bool(np.array_equal(first.view(np.uint8), again.view(np.uint8)))
    record["worlds_with_other_bits"] = int(np.sum(np.any(first != again, axis=1)))
    record["bits"] = hashlib.sha256(first.tobytes()).hexdigest()[:16]
    record["not_finite_after_32"] = int(np.sum(~np.all(np.isfinite(first), axis=1)))
    # windows: turns of 32 steps, each with its own torques, the clock without the torques' way to the device
    window_s, limit, spent = [], options.seconds, 0.0
    for turn in range(1 + options.windows):
        batch.set_torques(starts.torques(worlds, 1 + turn))
        batch.synchronize()
        begin = time.perf_counter()
        batch.advance(STEPS)
        batch.synchronize()
        taken = time.perf_counter() - begin
        spent += taken
        if turn:  # the first is the warm-up
            window_s.append(taken)
        if spent > limit and len(window_s) >= 3:
            break
    record["window_s"], record["steps_in_window"] = window_s, STEPS
    record["gpu_process_bytes"] = subject.gpu_memory()
    last = subject.coordinates(batch)
    record["not_finite_at_end"] = int(np.sum(~np.all(np.isfinite(last), axis=1)))
    states["end"] = packed(np, subject.rows(batch, kept[:KEPT]))
    single = []
    for _ in range(8 if spent < limit else 2):
        begin = time.perf_counter()
        batch.advance(1)
        batch.synchronize()
        single.append(time.perf_counter() - begin)
    record["single_step_s"] = single
    record.update({"device_name" if name == "device" else name: value for name, value in batch.facts().items()})
    if worlds == 1:
        rows, end = [], []
        for world in range(KEPT):
            batch.restart([starts.of(KEPT)[world]])
            batch.set_torques(starts.torques(KEPT, 0)[world:world + 1])
            batch.advance(STEPS)
            batch.synchronize()
            rows.append(subject.rows(batch, [0])[0])
        states["alone"] = packed(np, np.array(rows))
    return record, states


def fine_steps(subject, batch, states):
    """The same torques and the same time in steps of an eighth."""
    np, starts, worlds = subject.np, subject.starts, FINE_WORLDS
    settings = subject.assay.Settings(subject.settings)
    settings.timestep = subject.timestep_s / FINE
    if subject.folder == "mjx":  # the timestep is an argument of its compiled steps
        before, batch.timestep = batch.timestep, batch.world.array(settings.timestep)
    else:
        batch = subject.made(worlds, settings)
    batch.worlds_here = worlds
    batch.restart(starts.of(worlds))
    batch.set_torques(starts.torques(worlds, 0))
    batch.advance(STEPS * FINE)
    batch.synchronize()
    states["fine"] = packed(np, subject.rows(batch, range(worlds)))
    if subject.folder == "mjx":
        batch.timestep = before


NO_MEMORY = ("out of memory", "out-of-memory", "resource_exhausted", "cuda_error_out_of_memory", "failed to allocate", "memoryerror",
             "unable to allocate", "bad_alloc")


def outcome_of(error, assay):
    text = " ".join(f"{type(error).__name__}: {error}".split())[:600]
    if isinstance(error, MemoryError) or any(sign in text.lower() for sign in NO_MEMORY):
        return "out-of-memory", text
    if assay and isinstance(error, assay.Unsupported):
        return "unsupported", str(error)[:600]
    if isinstance(error, ModuleNotFoundError):
        return "missing", f"the Python package '{error.name}' is missing"
    if assay and isinstance(error, assay.EngineFailure):
        return "diverged", str(error)[:600]
    return "crashed", text


def versions():
    found = {}
    for name in ("numpy", "jax", "jaxlib", "mujoco", "mujoco-core", "mujoco-mjx", "mujoco-warp", "warp-lang", "newton", "genesis-world",
                 "quadrants", "torch"):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            pass
    return found


def run(options):
    assay, stage, worlds = None, "loading", options.worlds[0]
    try:
        if options.contender == "stand-in":
            import stand_in

            subject = stand_in.Subject(options, Starts)
        else:
            subject = Subject(options)
        assay = subject.assay
        # XLA compiles for each number of worlds, Genesis for minutes: not while they have the device
        wait_from = options.wait_from if subject.folder not in ("mjx", "genesis") else float("inf")
        if options.worlds[0] >= wait_from:
            subject.made(1)  # the others compile once for all
        for worlds in options.worlds:
            stage = "making the worlds"
            if worlds >= wait_from:
                wait_for_turn(worlds=worlds, stage=stage)
            begin = time.monotonic()
            batch = subject.made(worlds)
            created_s = time.monotonic() - begin
            since_start_s = time.monotonic() - STARTED
            if worlds < wait_from:
                wait_for_turn(worlds=worlds, stage="measuring")
            stage = "measuring"
            record, states = measure(subject, batch, worlds)
            if worlds == FINE_WORLDS and not options.without_fine:
                try:
                    fine_steps(subject, batch, states)
                except Exception as error:
                    record["fine_failed"] = " ".join(str(error).split())[:300]
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
            say("record", worlds=worlds, record={
                **record, "created_s": created_s, "since_start_s": since_start_s, "process_rss_bytes": memory,
                "versions": versions(), "settings": dict(subject.settings)}, states=states)
            del batch
            gc.collect()
        if subject.folder == "genesis":  # another process finds its kernels, which it writes when it ends
            import genesis_start

            genesis_start.stop()
    except Exception as error:
        outcome, reason = outcome_of(error, assay)
        import traceback

        traceback.print_exc()
        say("failed", worlds=worlds, stage=stage, outcome=outcome, reason=reason)


def parsed():
    parser = argparse.ArgumentParser()
    parser.add_argument("--root", default=os.path.dirname(os.path.dirname(HERE)))
    parser.add_argument("--contender", required=True, choices=tuple(CONTENDERS) + ("mujoco-rollout", "mujoco-warp-anchor"))
    parser.add_argument("--model", required=True)
    parser.add_argument("--device", required=True)
    parser.add_argument("--cache", required=True)
    parser.add_argument("--worlds", required=True, type=lambda text: [int(each) for each in text.split(",")])
    parser.add_argument("--windows", type=int, default=9)
    parser.add_argument("--seconds", type=float, default=6.0, help="of windows for one number of worlds")
    parser.add_argument("--wait-from", type=int, default=1024, help="worlds from which the device is asked for before they are made")
    parser.add_argument("--without-fine", action="store_true")
    return parser.parse_args()


if __name__ == "__main__":
    CHANNEL = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what engines print belongs to the log
    given = parsed()
    os.makedirs(given.cache, exist_ok=True)
    if given.contender in ("mujoco-rollout", "mujoco-warp-anchor"):
        import baselines

        baselines.run(given, say, wait_for_turn, outcome_of, versions, Starts)
    else:
        run(given)
