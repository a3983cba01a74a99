"""Models run by MJX's API alone, for the programs of this folder."""

import os
import sys

os.environ["JAX_PLATFORMS"] = "cpu"
import jax  # noqa: E402
import mujoco  # noqa: E402
import numpy as np  # noqa: E402

jax.config.update("jax_enable_x64", True)
from mujoco import mjx  # noqa: E402


class Run:
    def __init__(self, xml):
        model = mujoco.MjModel.from_xml_string(xml)
        self.model, self.start = mjx.put_model(model), mjx.make_data(model)

    def roll(self, v, timestep, count):
        """Positions and velocities after each of `count` steps from the model's own positions and velocities `v`."""
        def rolled(v, timestep):
            model = self.model.tree_replace({"opt.timestep": timestep})

            def step(data, _):
                data = mjx.step(model, data)
                return data, (data.qpos, data.qvel)

            return jax.lax.scan(step, self.start.replace(qvel=v), length=count)[1]

        return tuple(map(np.asarray, jax.jit(rolled)(np.array(v, dtype=float), timestep)))


def finish(still_so):
    """Status 0 while MJX behaves so."""
    print("as described" if still_so else "MJX does not behave so any more: mend the adapter's declaration")
    sys.exit(0 if still_so else 1)
