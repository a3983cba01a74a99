"""The planar chain as a user of pydrake would write it: five capsules of 1 kg on hinges. Prints µs a step, a number a round."""

import sys

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia, UnitInertia
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder

from direct_rounds import print_times

h, steps = 1e-3, 1000
integrator = sys.argv[1]
builder = DiagramBuilder()
plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=h if integrator == "discrete" else 0.0, contact_model="point",
                                                  discrete_contact_approximation="sap", use_sampled_output_ports=False),
                             builder)
radius, half = 0.05, 0.15

across = 0.0263  # kg m², about the middle
parent = plant.world_body()
for i in range(5):
    p = np.array([half, 0, 0])
    inertia = np.diag([0.00125, across, across]) + (p @ p) * np.eye(3) - np.outer(p, p)
    body = plant.AddRigidBody(f"link {i}", SpatialInertia(
        1.0, p, UnitInertia(inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2])))
    outer = plant.AddFrame(FixedOffsetFrame(
        f"outer {i}", parent.body_frame(), RigidTransform([0 if i == 0 else 2 * half, 0, 0])))
    plant.AddJoint(RevoluteJoint(f"hinge {i}", outer, body.body_frame(), [0, 1, 0]))
    parent = body
plant.Finalize()
simulator = Simulator(builder.Build())
if integrator != "discrete":
    ApplySimulatorConfig(SimulatorConfig(integration_scheme=integrator, max_step_size=h, use_error_control=False,
                                         start_time=0.0), simulator)
context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
plant.SetVelocities(context, np.ones(5))
plant.get_applied_generalized_force_input_port().FixValue(context, np.zeros(5))
simulator.Initialize()
done = 0


def run():
    global done
    done += steps
    simulator.AdvanceTo(done * h)


print_times(run, steps)
