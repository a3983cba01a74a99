"""Models run by Genesis' API alone, for the programs of this folder."""

import os
import sys
import types

os.environ.update(QD_NUM_THREADS="1", OMP_NUM_THREADS="1")
for name in ("pygltflib", "tetgen"):  # for files of meshes and soft bodies, absent from assay's environment
    try:
        __import__(name)
    except ImportError:
        sys.modules[name] = types.ModuleType(name)

import genesis as gs  # noqa: E402
import numpy as np  # noqa: E402

gs.init(backend=gs.cpu, precision="64", logging_level="critical")


class Run:
    def __init__(self, xml, timestep, **options):
        """`options` are of Genesis' RigidOptions."""
        self.scene = gs.Scene(sim_options=gs.options.SimOptions(dt=timestep, substeps=1), show_viewer=False,
                              rigid_options=gs.options.RigidOptions(**options),
                              profiling_options=gs.options.ProfilingOptions(show_FPS=False))
        self.entity = self.scene.add_entity(gs.morphs.MJCF(file=xml, default_armature=None))
        self.scene.build()

    def roll(self, v, count, height=None):
        """Positions and velocities after each of `count` steps from the model's own positions and velocities `v`; `height` is that
        of a free body."""
        self.scene.reset()
        if height is not None:
            self.entity.set_qpos(np.array([0, 0, height, 1, 0, 0, 0]), zero_velocity=False)
        self.entity.set_dofs_velocity(np.array(v, dtype=float))
        states = []
        for _ in range(count):
            self.scene.step()
            states.append((self.entity.get_qpos().numpy(), self.entity.get_dofs_velocity().numpy()))
        return tuple(map(np.array, zip(*states)))


def finish(still_so):
    """Status 0 while Genesis behaves so."""
    print("as described" if still_so else "Genesis does not behave so any more: mend the adapter's declaration")
    sys.stdout.flush()
    sys.exit(0 if still_so else 1)
