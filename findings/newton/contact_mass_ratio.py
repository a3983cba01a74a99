"""Newton's SolverMuJoCo: a light body between the ground and a heavy one sinks in proportion to the ratio of the masses, as in MuJoCo
itself.

Two balls on vertical slides stand on each other on the ground. A contact is as soft as the mass that it moves alone is light
(../mujoco/contact_mass_ratio.cc).
"""

from scene import *

depths = {}
for ratio in (1, 10, 100):
    made = builder()
    for mass in (1.0, float(ratio)):
        ball(made, body(made, mass, 3 * [0.004 * mass], "prismatic", axis=(0, 0, 1), target_ke=0.0, target_kd=0.0), 0.1)
    made.add_ground_plane(cfg=newton.ModelBuilder.ShapeConfig(density=0.0))
    run = Run(made, "implicitfast", 1e-3)
    run.start([0.1, 0.3], [0, 0])
    for _ in range(2000):
        run.step()
    depths[ratio] = 0.1 - float(run.q[0])
    print(f"under {ratio} kg: {1e3 * depths[ratio]:.3f} mm deep, {1e3 * depths[ratio] / (1 + ratio):.3f} mm for each load of its weight")
finish(depths[100] > 5 * depths[10] > 10 * depths[1] > 0)
