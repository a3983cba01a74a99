"""Prints a model as adapters in Python get it, with its initial state, as one line of JSON on standard error. It simulates nothing:

ASSAY_ENGINE_PATH=benchmarks/gpu/recorder assay simulate models/humanoid.xml --engine recorder --timestep 2 --duration 0.01 \\
    --out /dev/null 2>&1 | grep '^{"model"' > humanoid.json
"""

import json
import os
import sys

import assay_adapter as assay

FEATURES = ("slide", "ball", "ball-spring", "ball-armature", "massless", "box", "cylinder", "ellipsoid", "hull", "height-field", "dry-friction")


def plain(part):
    if isinstance(part, list):
        return [plain(each) for each in part]
    return {name: plain(value) for name, value in vars(part).items()} if hasattr(part, "__dict__") else part


class Engine(assay.Engine):
    environment = os.environ.get("ASSAY_RECORDER_ENVIRONMENT", "my-environment")
    version = "1"

    def contenders(self):
        return [assay.Contender(name="recorder", summary="writes the model, simulates nothing")]

    def capabilities(self, settings):
        return assay.Capabilities(integrator="none", joint_solver="none", torques=True, contact=True, joint_limits=True, armature=True,
                                  springs="native", features={name: assay.exact() for name in FEATURES})

    def create(self, model, state, settings):
        initial = {name: getattr(state, name).tolist() for name in ("bodies", "position", "velocity", "balls")}
        print(json.dumps({"model": plain(model), "initial": initial}), file=sys.stderr, flush=True)
        return Still(state)


class Still:
    def __init__(self, state):
        self.state = {name: getattr(state, name) for name in ("bodies", "position", "velocity", "balls")}

    def advance(self, count):
        pass

    def set_torques(self, torques):
        pass

    def read_state(self):
        return self.state
