"""Genesis: a light body between the ground and a heavy one sinks the deeper the heavier that one is, as in MuJoCo.

Two balls on vertical slides stand on each other on the ground. A contact is as soft as the mass that it moves alone is light
(../mujoco/contact_mass_ratio.cc); its impedance, which rises from 0.9 to 0.95 within 1 mm, makes a deeper one twice as stiff.
"""

from scene import *

PILE = """<mujoco><worldbody><geom type="plane" size="0 0 1"/>
  <body pos="0 0 0.1"><joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.1" mass="1"/></body>
  <body pos="0 0 0.3"><joint type="slide" axis="0 0 1"/><geom type="sphere" size="0.1" mass="{}"/></body></worldbody></mujoco>"""
depths = {}
for ratio in (1, 10, 100, 1000):
    # Genesis leaves out the contacts of a body with the world that carries it, unless asked not to
    q, _ = Run(PILE.format(ratio), 1e-3, enable_adjacent_collision=True, enable_neutral_collision=True).roll([0, 0], 2000)
    depths[ratio] = -q[1000:, 0].mean()
    print(f"under {ratio} kg: {1e3 * depths[ratio]:.3f} mm deep, {1e3 * depths[ratio] / (1 + ratio):.3f} mm for each load of its weight")
finish(depths[1] > 0 and all(depths[10 * ratio] > 4 * depths[ratio] for ratio in (1, 10, 100)))
