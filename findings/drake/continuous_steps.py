"""Drake's fixed steps in continuous time depend on how they are asked for.

A pendulum, 1 ms. The last step of an AdvanceTo() ends at the time that was asked for and the others at sums of steps, so 120 steps
in one call and in 120 calls differ by rounding. Implicit integrators keep the Jacobian of earlier steps, so a simulation that is
begun in the middle of a run goes on otherwise than the run.
"""

from scene import *
from pydrake.multibody.tree import RevoluteJoint

H = 1e-3


def pendulum(integrator, state=None):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=0.0), builder)
    joints, parent = [], plant.world_frame()
    for i in range(3):
        body = plant.AddRigidBody(f"body {i}", SpatialInertia(1.0, [0, 0, -0.3], UnitInertia(0.1, 0.1, 0.01)))
        joints.append(plant.AddJoint(RevoluteJoint(f"joint {i}", parent, body.body_frame(), [0, 1, 0] if i % 2 else [1, 0, 0])))
        parent = body.body_frame()
    plant.Finalize()
    simulator = Simulator(builder.Build())
    ApplySimulatorConfig(SimulatorConfig(integration_scheme=integrator, max_step_size=H, use_error_control=False),
                         simulator)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositionsAndVelocities(context, state if state is not None else [1, 1, 1, 3, 2, 1])
    simulator.Initialize()
    return simulator, lambda: plant.GetPositionsAndVelocities(context)


still_so = True
for integrator in ("runge_kutta3", "radau3", "implicit_euler"):
    one, one_state = pendulum(integrator)
    one.AdvanceTo(500 * H)
    many, many_state = pendulum(integrator)
    for k in range(1, 501):
        many.AdvanceTo(k * H)
    batches = np.abs(one_state() - many_state()).max()
    again, again_state = pendulum(integrator, one_state())
    again.AdvanceTo(250 * H)
    one.AdvanceTo(750 * H)
    restart = np.abs(one_state() - again_state()).max()
    print(f"{integrator}: one call against 500 calls {batches:.1e}, run against restart {restart:.1e}")
    still_so = still_so and (batches > 0) and (integrator == "runge_kutta3" or restart > 1e-11)
finish(still_so)
