"""In Drake's point contact a box touches a plane at one point, so that it turns while it slides; with 'lagged' it sticks.

A box of 0.4 x 0.3 x 0.2 m slides down a slope of 0.7 with friction 0.5, 1 ms, 0.5 s: it should slide 0.201 m and not turn at all.
"""

from scene import *

angle = np.arctan(0.7)
turns = {}
for approximation in APPROXIMATIONS:
    scene = Scene(approximation, 1e-3, (G * np.sin(angle), 0, -G * np.cos(angle)))
    scene.floor()
    size = np.array([0.4, 0.3, 0.2])
    scene.add(Box(*size), 1.0, [(size @ size - s * s) / 12 for s in size])
    scene.start([[0, 0, 0.1]], [[0, 0, 0]]).until(0.5)
    turns[approximation] = scene.rotation().ToAngleAxis().angle()
    print(f"{approximation}: turned by {turns[approximation]:.4f} rad, slid {scene.position()[0]:.4f} m")
finish(min(turns["sap"], turns["similar"]) > 0.01)
