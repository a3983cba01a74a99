"""What the tests of the package share. They run against the installed package, in any folder."""

import os
import pathlib
import textwrap

import pytest

# a user's cache and engines are not the tests'
os.environ.pop("ASSAY_ENGINE_PATH", None)
os.environ.pop("ASSAY_DATA", None)

SOURCE = pathlib.Path(__file__).resolve().parents[2]

PENDULUM = """<mujoco model="pendulum">
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    <body name="rod">
      <joint name="hinge" type="hinge" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0 0 -1" size="0.02" mass="1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <keyframe><key name="start" qpos="0.1"/></keyframe>
</mujoco>
"""

CAMPAIGN = """name = "small"
contenders = ["mujoco-euler", "ode-quick", "bullet-si-f64"]
timesteps_ms = [1, 2, 4]
reference_ms = 1
[timing]
rounds = 2
batch_ms = 1
[[system]]
name = "planar-chain"
duration_s = 0.064
sample_ms = 4
pieces = 2
piece_ms = 16
timing_ms = [1, 4]
measures = ["raw_speed", "consistency", "truth", "drift"]
"""


@pytest.fixture(autouse=True, scope="session")
def own_cache(tmp_path_factory):
    os.environ["XDG_CACHE_HOME"] = str(tmp_path_factory.mktemp("cache"))
    os.environ.pop("ASSAY_CACHE", None)


@pytest.fixture
def pendulum(tmp_path):
    file = tmp_path / "pendulum.xml"
    file.write_text(PENDULUM)
    return file


@pytest.fixture(scope="session")
def campaign(tmp_path_factory):
    file = tmp_path_factory.mktemp("campaign") / "small.toml"
    file.write_text(CAMPAIGN)
    return file


@pytest.fixture(scope="session")
def measured(campaign, tmp_path_factory):
    """(results, the events of its progress)."""
    import assay

    events = []
    results = assay.run(campaign, tmp_path_factory.mktemp("measured") / "results", progress=events.append)
    return results, events


@pytest.fixture(scope="session")
def my_engine(tmp_path_factory):
    """A file with an engine in Python: the adapter of examples/python-adapter, registered by the decorator."""
    text = (SOURCE / "examples/python-adapter/assay-engine-my-mujoco.py").read_text()
    text = text.replace("import assay_adapter as assay", "import assay\nfrom assay import adapter")
    text = text.replace("class Engine(assay.Engine):\n    environment = \"my-environment\"  # a folder beside this file\n",
                        "@assay.engine(\"my-mujoco\")\nclass Engine(adapter.Engine):\n")
    text = text.replace("assay.Contender", "adapter.Contender").replace("assay.Capabilities", "adapter.Capabilities")
    assert "@assay.engine" in text and "assay_adapter" not in text
    file = tmp_path_factory.mktemp("engine") / "my_engine.py"
    file.write_text(text)
    return file


def dedent(text):
    return textwrap.dedent(text).lstrip()
