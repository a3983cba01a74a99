"""The planar chain as a user of Genesis would write it, in double precision on one thread. Prints µs a step, a number a round."""

import os
import pathlib
import sys
import tempfile
import time
import types

os.environ.update(QD_NUM_THREADS="1", OMP_NUM_THREADS="1")
for name in ("pygltflib", "tetgen"):  # only for files of meshes and soft bodies
    sys.modules.setdefault(name, types.ModuleType(name))
import torch  # noqa: E402

torch.set_num_threads(1)
import genesis as gs  # noqa: E402
from direct_rounds import chain, print_times  # noqa: E402

h, steps = 1e-3, 500
gs.init(backend=gs.cpu, precision="64", logging_level="critical", use_deterministic_algorithms=True)
scene = gs.Scene(sim_options=gs.options.SimOptions(dt=h, substeps=1, gravity=(0, 0, 0)), show_viewer=False,
                 rigid_options=gs.options.RigidOptions(enable_collision=False),
                 profiling_options=gs.options.ProfilingOptions(show_FPS=False))
with tempfile.TemporaryDirectory() as folder:
    file = pathlib.Path(folder) / "chain.xml"
    file.write_text(chain())
    robot = scene.add_entity(gs.morphs.MJCF(file=str(file), default_armature=None))
    scene.build()
robot.set_dofs_velocity([1.0] * robot.n_dofs)
robot.control_dofs_force([0.0] * robot.n_dofs)


def run():
    for _ in range(steps):
        scene.step(update_visualizer=False, refresh_visualizer=False)


print_times(run, steps, time.process_time)
