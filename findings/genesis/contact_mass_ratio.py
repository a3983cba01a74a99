"""Genesis: a light body between the ground and a heavy one sinks in proportion to the ratio of the masses, as in MuJoCo.

Two balls on vertical slides stand on each other on the ground. A contact is as soft as the mass that it moves alone is light
(../mujoco/contact_mass_ratio.cc).
"""

from scene import *

PILE = """<mujoco><worldbody><geom type="plane" size="0 0 1"/>
  <body pos="0 0 0.1"><joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.1" mass="1"/></body>
  <body pos="0 0 0.3"><joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.1" mass="{}"/></body></worldbody></mujoco>"""
depths = {}
for ratio in (1, 10, 100):
    # Genesis leaves out the contacts of a body with the world that carries it, unless asked not to
    q, _ = Run(PILE.format(ratio), 1e-3, enable_adjacent_collision=True, enable_neutral_collision=True).roll([0, 0], 2000)
    depths[ratio] = -q[-1, 0]
    print(f"under {ratio} kg: {1e3 * depths[ratio]:.3f} mm deep, {1e3 * depths[ratio] / (1 + ratio):.3f} mm for each load of its weight")
finish(depths[100] > 5 * depths[10] > 10 * depths[1] > 0)
