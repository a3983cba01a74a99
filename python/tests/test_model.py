"""Loading and checking models, with the sentences of the program."""

import inspect
import math
import subprocess

import assay
import numpy as np
import pytest
from assay._program import program
from conftest import PENDULUM


def sentence(*arguments):
    """What the program says of a mistake."""
    done = subprocess.run([program(), *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 2, done
    return done.stderr.strip().splitlines()[-1].removeprefix("assay: ")


def test_systems_come_with_the_package():
    assert {"planar-chain", "humanoid", "grasp", "astronaut"} <= {each["system"] for each in assay.systems()}
    assert assay.load("humanoid").dof > 20
    assert assay.load("capsules-8").dof == 6 * 8


def test_facts_and_parts_of_a_model(pendulum):
    model = assay.load(pendulum)
    assert (model.name, model.dof, model.keyframes) == ("pendulum", 1, ["start"])
    assert model.total_mass == pytest.approx(1)
    assert model.bodies[0].name == "rod" and model.joints[0].name == "hinge"
    assert model.gravity == pytest.approx([0, 0, -9.81])
    assert model.hash == assay.load_text(PENDULUM).hash
    assert model.hash != model.variant(gravity=False).hash
    with pytest.raises(AttributeError, match="no 'wheels'"):
        model.wheels


def test_a_state_follows_from_joint_coordinates(pendulum):
    model = assay.load(pendulum)
    assert model.initial.position == pytest.approx([0.1])
    for angle, rate in ((0.0, 0.0), (0.5, -2.0), (-2.5, 1.0)):
        state = model.state(np.array([angle]), np.array([rate]), time=3)
        assert state.time == 3
        # the centre hangs at half a metre; about y, so that a positive angle takes it to -x
        x, z = -0.5 * math.sin(angle), -0.5 * math.cos(angle)
        assert state.bodies.shape == (1, 13)
        assert state.bodies[0, :3] == pytest.approx([x, 0, z], abs=1e-12)
        assert state.bodies[0, 3:7] == pytest.approx([math.cos(angle / 2), 0, math.sin(angle / 2), 0])
        assert state.bodies[0, 7:10] == pytest.approx([rate * z, 0, -rate * x], abs=1e-12)
        assert state.bodies[0, 10:] == pytest.approx([0, rate, 0], abs=1e-12)
    assert model.keyframe("start").position == pytest.approx([0.1])


@pytest.mark.parametrize("model", ["no-such-robot", "missing.xml", "humanoit"])
def test_a_model_that_is_not_there(model, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(assay.InputError) as raised:
        assay.load(model)
    assert str(raised.value) == sentence("check", model)
    with pytest.raises(assay.InputError) as raised:
        assay.check(model)
    assert str(raised.value) == sentence("check", model)


def test_a_file_that_is_refused(tmp_path):
    file = tmp_path / "bad.xml"
    file.write_text(PENDULUM.replace('type="hinge"', 'type="screw"'))
    with pytest.raises(ValueError) as raised:  # an InputError is one
        assay.load(file)
    assert str(raised.value) == sentence("check", str(file))


def test_what_to_mend_and_what_engines_make_of_it(pendulum):
    with pytest.raises(assay.InputError, match="is a folder: give a model's file"):
        assay.check(pendulum.parent)
    found = assay.check(pendulum)
    assert found.model["dof"] == 1
    engines = {each["engine"] for each in found.engines}
    assert {"mujoco", "ode", "bullet-f64"} <= engines
    refused = assay.limitations(assay.load_text(PENDULUM.replace('type="hinge"', 'type="hinge" armature="0.1"')), "bullet-si-f64")
    assert any(each.fidelity == "refused" and "armature" in each.element + each.how for each in refused)
    assert assay.limitations(assay.load(pendulum), "mujoco-euler") == []


def test_arguments_of_load(pendulum, tmp_path):
    with pytest.raises(assay.InputError, match="base is 'flying': give file, floating or fixed"):
        assay.load(pendulum, base="flying")
    with pytest.raises(assay.InputError, match="ground is 'sea'"):
        assay.load(pendulum, ground="sea")
    assert {"base", "packages", "repair"} <= set(inspect.signature(assay.load).parameters)
    assert "Gives the robot's root a free joint" in assay.load.__doc__
    with pytest.raises(TypeError, match="no argument 'grund'"):
        assay.load(pendulum, grund="plane")
    with pytest.raises(TypeError, match="'repair' cannot be 'yes'"):
        assay.load(pendulum, repair="yes")
    assert assay.load(pendulum, keyframe=0).hash == assay.load(pendulum, keyframe="start").hash
    with pytest.raises(TypeError, match="no argument 'qpos'"):
        assay.load_text(PENDULUM, qpos="x")
    with pytest.raises(assay.InputError, match="no root of the file is fixed to the world"):
        assay.load(pendulum, base="floating")
    assert len(assay.load(pendulum, ground="plane").shapes) == len(assay.load(pendulum).shapes) + 1
