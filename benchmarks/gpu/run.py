"""Measures many worlds on a GPU within a limited time: run.py --out DIR [--seconds 720] [--device cuda:0].

Each contender with each model has a child process (worker.py). Children import and compile side by side; one at a time uses the device.
Results are in DIR/records.jsonl, one line a cell, written as soon as a cell ends, and DIR/states.jsonl, states for to_results.py. A second
call goes on where the first one stopped. A cell that cannot be measured has an outcome with its reason.
"""

import argparse
import collections
import fcntl
import json
import os
import selectors
import signal
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
LEAST_SECONDS = 15  # nothing is started with less
PACKAGES = {"mjx": ("jax", "mujoco", "mujoco.mjx"), "genesis": ("torch", "quadrants", "genesis", "mujoco"),
            "mujoco-warp": ("warp", "mujoco", "mujoco_warp"), "newton": ("warp", "newton"), "mujoco-rollout": ("mujoco",),
            "mujoco-warp-anchor": ("warp", "mujoco", "mujoco_warp"), "stand-in": ()}
PROBE = """
import importlib.util, sys
for name in sys.argv[1:]:
    try:
        found = importlib.util.find_spec(name)
    except Exception:
        found = None
    print("" if found else name)
"""
ALL = [1, 4096, 64, 16384, 1024, 16, 256, 4]  # in order of worth
MODELS = ["humanoid", "quadruped", "capsules-27", "g1"]


class Job:
    """A child's work: one contender, one model, some numbers of worlds in this order."""

    def __init__(self, contender, model, worlds, variables=None, alone=False, windows=9):
        self.contender, self.model, self.worlds = contender, model, list(worlds)
        self.variables, self.alone, self.windows = variables or {}, alone, windows


def jobs_by_worth(device):
    """Alone: no other child runs at the same time, because it takes all processors."""
    # products in full single precision: by itself JAX rounds factors to 10 bits on these GPUs
    fast = {"JAX_PLATFORMS": "cuda", "XLA_PYTHON_CLIENT_PREALLOCATE": "false"} if device != "cpu" else {"JAX_PLATFORMS": "cpu"}
    cuda = {**fast, "JAX_DEFAULT_MATMUL_PRECISION": "highest"}
    found = []
    for model in MODELS:
        # XLA compiles for each number of worlds, so each has a process
        found += [Job("mjx", model, [worlds], cuda) for worlds in (ALL if model != "capsules-27" else ALL[:3])]
        found.append(Job("genesis", model, [4096, 1024, 1, 16384, 64]))
        found.append(Job("mujoco-warp", model, ALL))
        found.append(Job("newton-mujoco", model, ALL))
        found.append(Job("newton-steel", model, ALL))
    for model in MODELS[:2]:
        found += [Job("mjx-3-iterations", model, [worlds], cuda) for worlds in (4096, 1024, 16384)]
        found.append(Job("mujoco-warp-3-iterations", model, [4096, 1024, 16384]))
    for model in ("g1",):
        found += [Job("mjx-3-iterations", model, [worlds], cuda) for worlds in (4096, 1024, 16384)]
        found.append(Job("mujoco-warp-3-iterations", model, [4096, 1024, 16384]))
    repeatable = {**cuda, "XLA_FLAGS": "--xla_gpu_deterministic_ops=true"}
    found.append(Job("mujoco-warp-deterministic", "humanoid", [1, 1024, 4096, 16384]))
    found += [Job("mjx-deterministic", "humanoid", [worlds], repeatable) for worlds in (1024, 1)]
    found += [Job("mjx-tf32", "humanoid", [worlds], fast) for worlds in (1, 4096, 64)]
    found.append(Job("mujoco-warp-anchor", "humanoid", [8192, 4096, 1024]))
    found += [Job("genesis-double", model, [1, 4096, 64, 1024]) for model in MODELS[:1]]
    found += [Job("genesis-static", model, [1, 4096, 1024, 64]) for model in MODELS[:1]]
    found += [Job("mujoco-rollout", model, [1, 2, 4, 8, 16], alone=True) for model in MODELS]  # threads
    return found


def cell_of(contender, model, worlds, device):
    return f"{contender}/{model}/{worlds}/{device}"


class Child:
    def __init__(self, job, options, number):
        self.job, self.left = job, collections.deque(job.worlds)
        self.log = os.path.join(options.scratch, f"{job.contender}-{job.model}-{number}.log")
        command = [sys.executable, os.path.join(HERE, "worker.py"), "--contender", job.contender, "--model",
                   os.path.join(options.models, job.model + ".json"), "--device", options.device, "--cache",
                   os.path.join(options.scratch, "cache"), "--worlds", ",".join(map(str, job.worlds)), "--windows", str(job.windows),
                   "--seconds", str(options.cell_seconds), "--wait-from", str(options.wait_from)]
        environment = {**os.environ, **job.variables, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
        if job.contender.startswith("newton"):
            environment["PYTHONPATH"] = os.pathsep.join(filter(None, [options.newton_site, environment.get("PYTHONPATH", "")]))
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, env=environment,
                                            start_new_session=True)
        os.set_blocking(self.process.stdout.fileno(), False)
        self.text, self.is_ready, self.is_running, self.since = b"", False, False, time.monotonic()
        self.failed = None

    def messages(self):
        """What it has said since; None where it is over."""
        found, over = [], False
        while True:
            try:
                chunk = os.read(self.process.stdout.fileno(), 1 << 20)
            except BlockingIOError:
                break
            if not chunk:
                over = True
                break
            self.text += chunk
        while b"\n" in self.text:
            line, _, self.text = self.text.partition(b"\n")
            try:
                found.append(json.loads(line))
            except ValueError:
                continue
        return found, over

    def go(self):
        self.is_ready, self.is_running, self.since = False, True, time.monotonic()
        try:
            self.process.stdin.write(b"go\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass

    def end(self):
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()

    def last_words(self):
        with open(self.log, "rb") as file:
            file.seek(max(0, os.path.getsize(self.log) - 4000))
            lines = [line.strip() for line in file.read().decode(errors="replace").splitlines() if line.strip()]
        return lines[-1][:300] if lines else ""


class Runner:
    def __init__(self, options):
        self.options = options
        self.deadline = time.monotonic() + options.seconds
        os.makedirs(options.out, exist_ok=True)
        os.makedirs(options.scratch, exist_ok=True)
        self.records_path, self.states_path = (os.path.join(options.out, name) for name in ("records.jsonl", "states.jsonl"))
        self.done = set()
        if os.path.exists(self.records_path):
            with open(self.records_path, encoding="utf-8") as file:
                for line in file:
                    try:
                        self.done.add(json.loads(line).get("cell"))
                    except ValueError:
                        continue  # the line that a killed run was writing
            with open(self.records_path, "ab+") as file:
                file.seek(max(0, file.tell() - 1))
                if file.read(1) not in (b"\n", b""):
                    file.write(b"\n")
        self.children, self.number, self.waiting, self.on_device = [], 0, [], None
        self.no_room = {}
        self.lock, self.has_lock, self.lock_from = open(options.lock, "a", encoding="utf-8") if options.lock else None, False, 0.0

    def write(self, path, row):
        with open(path, "a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def put(self, job, worlds, outcome, reason="", record=None, states=None):
        cell = cell_of(job.contender, job.model, worlds, self.options.device if not job.alone else "cpu")
        self.done.add(cell)
        for name, rows in (states or {}).items():
            self.write(self.states_path, {"cell": cell, "name": name, **rows})
        self.write(self.records_path, {"cell": cell, "contender": job.contender, "model": job.model, "worlds": worlds,
                                       "device": self.options.device, "outcome": outcome, "reason": reason, "time": time.time(),
                                       "others_running": len(self.children) - 1, **(record or {})})
        rate = ""
        if record and record.get("window_s"):
            middle = sorted(record["window_s"])[len(record["window_s"]) // 2]
            rate = f"{record.get('worlds_stepped', worlds) * record['steps_in_window'] / middle:.3g} world-steps/s"
        print(f"[{self.options.seconds - self.left():5.0f} s] {cell}: {outcome} {rate} {reason[:160]}", flush=True)

    def takes_device(self):
        """Whether no other run.py that was given the same file measures."""
        if not self.lock:
            return True
        if time.monotonic() < self.lock_from:
            return False
        try:
            fcntl.flock(self.lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        self.has_lock = True
        return True

    def give_device(self):
        if self.has_lock:
            fcntl.flock(self.lock, fcntl.LOCK_UN)
            self.has_lock, self.lock_from = False, time.monotonic() + 0.5  # the others' turn

    def left(self):
        return self.deadline - time.monotonic()

    def plan(self):
        chosen = self.options.only.split(",") if self.options.only else None
        jobs = jobs_by_worth(self.options.device) if chosen != ["stand-in"] else [Job("stand-in", model, ALL) for model in MODELS]
        for job in jobs:
            device = self.options.device if not job.alone else "cpu"
            if chosen and job.contender not in chosen or self.options.model and job.model not in self.options.model.split(","):
                continue
            if not os.path.exists(os.path.join(self.options.models, job.model + ".json")):
                print(f"{job.contender}, {job.model}: '{job.model}.json' is missing in {self.options.models}: make it with prepare.py")
                continue
            only = [int(each) for each in self.options.worlds.split(",")] if self.options.worlds else job.worlds
            job.worlds = [worlds for worlds in job.worlds if worlds in only and cell_of(job.contender, job.model, worlds, device) not in self.done and
                          (job.alone or worlds <= self.options.most)]
            if job.worlds:
                self.waiting.append(job)
        self.waiting.sort(key=lambda job: job.alone)

    def leave_out_missing(self):
        """Says once what is missing, and goes on with the others."""
        said = {}
        for job in list(self.waiting):
            kind = next(each for each in sorted(PACKAGES, key=len, reverse=True) if job.contender.startswith(each))
            if kind not in said:
                environment = dict(os.environ)
                if kind == "newton":
                    own = [self.options.newton_site, environment.get("PYTHONPATH", "")]
                    environment["PYTHONPATH"] = os.pathsep.join(filter(None, own))
                answer = subprocess.run([sys.executable, "-c", PROBE, *PACKAGES[kind]], capture_output=True, text=True,
                                        env=environment)
                missing = answer.stdout.split()
                said[kind] = missing
                if missing:
                    print(f"{kind} is left out: the Python package{'s' if len(missing) > 1 else ''} {', '.join(missing)} "
                          f"{'are' if len(missing) > 1 else 'is'} missing", flush=True)
            if said[kind]:
                self.waiting.remove(job)

    def start_children(self):
        while self.waiting and len(self.children) < self.options.at_once and self.left() > LEAST_SECONDS:
            job = self.waiting[0]
            if job.alone and self.children or any(child.job.alone for child in self.children):
                return
            self.waiting.pop(0)
            if self.give_up_larger(job):
                continue
            self.number += 1
            self.children.append(Child(job, self.options, self.number))

    def give_up_larger(self, job):
        """Where fewer worlds had no room, more have none."""
        least = self.no_room.get((job.contender, job.model))
        if least is None:
            return False
        for worlds in [each for each in job.worlds if each > least]:
            job.worlds.remove(worlds)
            self.put(job, worlds, "out-of-memory", f"not tried: {least} worlds had no room")
        return not job.worlds

    def over(self, child, outcome, reason, worlds=None):
        """A child has ended before its work: its cell has this outcome, the rest another child."""
        child.end()
        self.children.remove(child)
        if self.on_device is child:
            self.on_device = None
        if not child.left:
            return
        worlds = worlds if worlds is not None else child.left[0]
        if worlds in child.left:
            child.left.remove(worlds)
            self.put(child.job, worlds, outcome, reason)
        if outcome == "out-of-memory":
            key = (child.job.contender, child.job.model)
            self.no_room[key] = min(worlds, self.no_room.get(key, worlds))
        if outcome in ("unsupported", "missing"):
            for each in child.left:
                self.put(child.job, each, outcome, reason)
            child.left.clear()
        if child.left:
            self.waiting.insert(0, Job(child.job.contender, child.job.model, child.left, child.job.variables, child.job.alone,
                                       child.job.windows))

    def hear(self, child):
        found, over = child.messages()
        for message in found:
            if message["say"] == "ready":
                if self.on_device is child:  # it has measured and made the next worlds
                    self.on_device = None
                child.is_ready, child.is_running = True, False
            elif message["say"] == "record":
                worlds = message["worlds"]
                if worlds in child.left:
                    child.left.remove(worlds)
                self.put(child.job, worlds, "ok", "", message["record"], message["states"])
                child.is_running, child.since = False, time.monotonic()
                if self.on_device is child:
                    self.on_device = None
            elif message["say"] == "failed":
                child.failed = message
        if not over:
            return
        status = child.process.wait()
        if child.failed:
            self.over(child, child.failed["outcome"], f"{child.failed['stage']}: {child.failed['reason']}", child.failed["worlds"])
            self.examine_device()
        elif child.left:
            how = f"ended by signal {-status}" if status < 0 else f"ended with status {status}"
            words = child.last_words()
            lower = words.lower()
            outcome = "out-of-memory" if "out of memory" in lower or "resource_exhausted" in lower or status == -9 else "crashed"
            self.over(child, outcome, f"the process {how}: {words}")
            self.examine_device()
        else:
            self.over(child, "ok", "")

    def examine_device(self):
        if self.options.device != "cpu" and not gpu_name():
            for child in list(self.children):
                child.end()
            raise SystemExit(f"the GPU does not answer any more: {len(self.done)} cells are stored, call again to go on")

    def run(self):
        self.plan()
        self.leave_out_missing()
        total = sum(len(job.worlds) for job in self.waiting)
        print(f"{total} cells to measure, {len(self.done)} are stored, {self.options.seconds:.0f} s", flush=True)
        while (self.waiting or self.children) and self.left() > 3:
            self.start_children()
            selector = selectors.DefaultSelector()
            for child in self.children:
                selector.register(child.process.stdout, selectors.EVENT_READ)
            selector.select(timeout=0.2)
            selector.close()
            for child in list(self.children):
                self.hear(child)
            if self.on_device is None:
                self.give_device()
                ready = [child for child in self.children if child.is_ready]
                if ready and self.takes_device():
                    self.on_device = ready[0]
                    ready[0].go()
            for child in list(self.children):
                spent = time.monotonic() - child.since
                if child.is_running and spent > self.options.measure_limit:
                    self.over(child, "timeout", f"measuring took longer than {self.options.measure_limit:.0f} s")
                elif not child.is_running and not child.is_ready and spent > self.options.compile_limit:
                    self.over(child, "timeout", f"making the worlds took longer than {self.options.compile_limit:.0f} s")
        left = sum(len(child.left) for child in self.children) + sum(len(job.worlds) for job in self.waiting)
        for child in list(self.children):
            child.end()
        print(f"{left} cells are left: call again to go on" if left else "all cells are measured", flush=True)


def gpu_name():
    try:
        answer = subprocess.run(["nvidia-smi", "--query-gpu=name,driver_version,memory.total", "--format=csv,noheader"],
                                capture_output=True, text=True, timeout=20)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return answer.stdout.splitlines()[0].strip() if answer.returncode == 0 and answer.stdout.strip() else ""


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        cpu = next((line.partition(":")[2].strip() for line in file if line.startswith("model name")), "")
    return {"cpu": cpu, "processors": len(os.sched_getaffinity(0)), "gpu": gpu_name(), "kernel": os.uname().release,
            "python": sys.version.split()[0]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", required=True)
    parser.add_argument("--seconds", type=float, default=720)
    parser.add_argument("--device", default="cuda:0")
    parser.add_argument("--models", default=os.path.join(HERE, "models"))
    parser.add_argument("--only", default="", help="contenders, with commas")
    parser.add_argument("--model", default="", help="models, with commas")
    parser.add_argument("--most", type=int, default=16384, help="worlds")
    parser.add_argument("--at-once", type=int, default=max(1, len(os.sched_getaffinity(0)) - 2), help="children")
    parser.add_argument("--scratch", default="", help="folder for logs and compiled code, by default in the temporary folder")
    parser.add_argument("--newton-site", default="", help="folder with Newton, its MuJoCo and its MuJoCo Warp")
    parser.add_argument("--cell-seconds", type=float, default=4.0)
    parser.add_argument("--lock", default="", help="file, by which several of these scripts take the device in turns")
    parser.add_argument("--worlds", default="", help="numbers of worlds, with commas; by default all of the list")
    parser.add_argument("--wait-from", type=int, default=1024)
    parser.add_argument("--measure-limit", type=float, default=60.0)
    parser.add_argument("--compile-limit", type=float, default=300.0)
    options = parser.parse_args()
    options.scratch = options.scratch or os.path.join(os.environ.get("TMPDIR", "/tmp"), "assay-gpu")
    if options.device != "cpu" and not gpu_name():
        sys.exit("no NVIDIA GPU answers nvidia-smi: use a machine with one, or try the script with --device cpu")
    runner = Runner(options)
    runner.write(os.path.join(options.out, "machine.jsonl"), {"time": time.time(), "device": options.device, **machine()})
    try:
        runner.run()
    finally:
        for child in runner.children:
            child.end()


if __name__ == "__main__":
    main()
