"""Engines in Python, registered by the decorator."""

import importlib.util
import json
import subprocess
import sys

import assay
import numpy as np
import pytest
from assay import adapter
from conftest import CAMPAIGN, dedent

pytest.importorskip("mujoco")


def import_file(file):
    spec = importlib.util.spec_from_file_location(file.stem, file)
    module = importlib.util.module_from_spec(spec)
    sys.modules[file.stem] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def registered(my_engine):
    return import_file(my_engine)


def test_it_is_a_contender_at_once(registered):
    assert "my-mujoco" in assay.contenders()
    model = assay.load("planar-chain")
    mine, native = assay.Simulation(model, "my-mujoco"), assay.Simulation(model, "mujoco-euler")
    mine.advance(250)
    native.advance(250)
    assert mine.read().bodies == pytest.approx(native.read().bodies, abs=1e-12)
    torques = np.linspace(-1, 1, 5)
    for _ in range(10):
        mine.step(torques)
        native.step(torques)
    assert mine.read().position == pytest.approx(native.read().position, abs=1e-12)


def test_what_it_does_not_declare_is_refused(registered):
    with pytest.raises(assay.UnsupportedError, match="has no contacts|has no joint limits"):
        assay.Simulation(assay.load("grasp"), "my-mujoco")


def test_this_process_stays_as_it_was(registered):
    import gc
    import os

    assay.Simulation(assay.load("planar-chain"), "my-mujoco")
    assert sys.stdout is not sys.stderr and gc.isenabled()
    child = os.fork()  # workers refuse it
    if child == 0:
        os._exit(7)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7


def test_it_passes_the_suite_and_takes_part_in_campaigns(registered, tmp_path):
    found = assay.conformance("my-mujoco", tests=["planar-chain", "restart", "torque-for-one-step"])
    assert {each["status"] for each in found["contenders"][0]["results"]} == {"pass"}
    file = tmp_path / "mine.toml"
    file.write_text(CAMPAIGN.replace('"ode-quick", "bullet-si-f64"', '"my-mujoco"').replace('"raw_speed", ', ""))
    results = assay.run(file, tmp_path / "results", progress=False)
    values = results.values("dicts")
    errors = {name: {row["timestep_ms"]: row["value"] for row in values if row["measure"] == "truth_error_max" and row["contender"] == name}
              for name in ("my-mujoco", "mujoco-euler")}
    assert errors["my-mujoco"] == pytest.approx(errors["mujoco-euler"], rel=1e-6)


def test_a_class_of_the_prompt_is_simulated_and_not_measured(tmp_path):
    code = dedent("""
        import json, assay
        from assay import adapter

        @assay.engine("at-the-prompt")
        class Mine(adapter.Engine):
            def contenders(self):
                return [adapter.Contender(name="at-the-prompt", summary="does nothing")]
            def capabilities(self, settings):
                return adapter.Capabilities(integrator="none")
            def create(self, model, state, settings):
                return Still(state)

        class Still:
            def __init__(self, state):
                self.state = {"position": state.position, "velocity": state.velocity, "bodies": state.bodies}
            def advance(self, count):
                pass
            def read_state(self):
                return self.state

        run = assay.Simulation(assay.load("planar-chain"), "at-the-prompt")
        run.advance(10)
        print(json.dumps([run.read().time, [each["reason"] for each in assay.engines()["absent"] if each["engine"] == "at-the-prompt"]]))
        """)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    time, reasons = json.loads(done.stdout)
    assert time == pytest.approx(0.01)
    assert len(reasons) == 1 and "put it into a file and import that" in reasons[0]


def engine_class(name, **members):
    defaults = {"contenders": lambda self: [adapter.Contender(name=name, summary="s")],
                "capabilities": lambda self, settings: adapter.Capabilities(integrator="none")}
    return type("Mine", (adapter.Engine,), {**defaults, **members, "__module__": "__main__"})


@pytest.mark.parametrize("name, members, said", [
    ("Upper", {}, "give a name of lower-case letters"),
    ("mujoco", {}, "there is an engine 'mujoco' already"),
    ("takes-a-name", {"contenders": lambda self: [adapter.Contender(name="ode-quick")]}, "has a contender 'ode-quick', and there is one"),
    ("says-nothing", {"capabilities": lambda self, settings: None}, "capabilities() gave a NoneType"),
    ("fails-early", {"settings": lambda self: 1 / 0}, "ZeroDivisionError"),
    ("bad-word", {"capabilities": lambda self, settings: adapter.Capabilities(precision="half")}, "'precision' is 'half'"),
])
def test_an_engine_that_cannot_be_registered(name, members, said):
    before = assay.contenders()
    with pytest.raises(assay.InputError) as raised:
        assay.engine(name)(engine_class(name, **members))
    assert said in str(raised.value)
    assert assay.contenders() == before


def test_only_engines_are_registered():
    with pytest.raises(assay.InputError, match="no class derived from assay.adapter.Engine"):
        assay.engine("an-int")(int)


def test_what_it_raises_is_an_engine_error():
    class Failing:
        def __init__(self, state):
            self.state = {"position": state.position, "velocity": state.velocity, "bodies": state.bodies}

        def advance(self, count):
            raise ValueError("the third link is loose")

        def read_state(self):
            return self.state

    made = engine_class("failing", create=lambda self, model, state, settings: Failing(state),
                        capabilities=lambda self, settings: adapter.Capabilities(integrator="none"))
    assay.engine("failing")(made)
    run = assay.Simulation(assay.load("planar-chain"), "failing")
    with pytest.raises(assay.EngineError, match="the third link is loose"):
        run.step()


def test_a_file_that_imports_too_early(tmp_path):
    file = tmp_path / "early.py"
    file.write_text(dedent("""
        import assay
        import mujoco
        from assay import adapter

        @assay.engine("early")
        class Mine(adapter.Engine):
            def contenders(self):
                return [adapter.Contender(name="early")]
            def capabilities(self, settings):
                return adapter.Capabilities(integrator="none")
        """))
    import_file(file)
    reason = next(each["reason"] for each in assay.engines()["absent"] if each["engine"] == "early")
    assert "imports 'mujoco' when it is loaded: import it inside create()" in reason
