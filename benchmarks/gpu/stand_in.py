"""An engine that does nothing, for tests of run.py. ASSAY_GPU_STAND_IN has what happens at a number of worlds: "16:memory,64:crash"."""

import json
import os
import signal

import numpy


class Failure(Exception):
    pass


class Assay:
    EngineFailure, Unsupported = Failure, NotImplementedError


class Batch:
    def __init__(self, worlds, joints):
        self.worlds, self.worlds_here, self.q = worlds, worlds, numpy.zeros((worlds, joints))
        self.torques = numpy.zeros((worlds, joints))

    def restart(self, states):
        self.q[:] = 0

    def set_torques(self, torques):
        self.torques[:] = torques

    def advance(self, count):
        self.q += 1e-3 * count * self.torques

    def synchronize(self):
        pass

    def facts(self):
        return {"memory_bytes": float(self.q.nbytes), "compile_s": 0.0}


class Given:
    def __init__(self, worlds):
        self.worlds = worlds


class Subject:
    assay, np, folder, settings = Assay, numpy, "", {}

    def __init__(self, options, starts):
        self.options = options
        with open(options.model, encoding="utf-8") as file:
            self.joints = len(json.load(file)["torque"])
        self.starts = self
        self.happens = dict(each.split(":") for each in os.environ.get("ASSAY_GPU_STAND_IN", "").split(",") if each)

    def of(self, worlds):
        return [Given(world) for world in range(worlds)]

    def torques(self, worlds, turn):
        return numpy.random.default_rng(turn).uniform(-1, 1, (worlds, self.joints))

    def made(self, worlds, settings=None):
        what = self.happens.get(str(worlds))
        if what == "memory":
            raise RuntimeError("RESOURCE_EXHAUSTED: Out of memory")
        if what == "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        if what == "fail":
            raise Failure("contact buffer too small")
        if what == "hang":
            signal.pause()
        return Batch(worlds, self.joints)

    def coordinates(self, batch):
        return batch.q.copy()

    def rows(self, batch, worlds):
        return batch.q[list(worlds)]

    def gpu_memory(self):
        return 0.0
