"""A ball or weld constraint between a body and the world's own body ends the process in the first step.

With a body that is welded to the world in its place the same constraint works.
"""

import subprocess

from scene import *

if len(sys.argv) == 1:
    ends = [subprocess.run([sys.executable, __file__, other], capture_output=True).returncode
            for other in ("world", "welded")]
    print(f"with the world's body: status {ends[0]}; with one welded to it: status {ends[1]}")
    finish(ends[0] != 0 and ends[1] == 0)

builder = DiagramBuilder()
plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=1e-3, discrete_contact_approximation="sap"), builder)
body = plant.AddRigidBody("body", SpatialInertia(1.0, [0, 0, 0], UnitInertia.SolidSphere(0.1)))
other = plant.world_body()
if sys.argv[1] == "welded":
    other = plant.AddRigidBody("anchor", SpatialInertia.Zero())
    plant.WeldFrames(plant.world_frame(), other.body_frame())
plant.AddWeldConstraint(body, RigidTransform(), other, RigidTransform())
plant.Finalize()
Simulator(builder.Build()).AdvanceTo(0.01)
