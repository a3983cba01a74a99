"""On a slope a capsule of 1 g and 2.5 mm radius leaves the plane in Drake's 'sap' and 'similar' contacts; with 'lagged' it sticks
where it should slide.

Slopes of 0.9 and 1.1 times the friction of 0.5, 1 ms, 0.6 s: the largest distance of its centre's height from its radius,
relative to it, and its way. The same with 1 kg and 0.05 m.
"""

from scene import *

heights, ways = {}, {}
for approximation in APPROXIMATIONS:
    for share in (0.9, 1.1):
        angle = np.arctan(share * 0.5)
        for mass, radius in ((1e-3, 2.5e-3), (1.0, 0.05)):
            scene = Scene(approximation, 1e-3, (G * np.sin(angle), 0, -G * np.cos(angle)))
            scene.floor()
            scene.add(Capsule(radius, 4 * radius), mass, capsule_moments(mass, radius, 2 * radius, 0),
                      RigidTransform(RollPitchYaw(0, np.pi / 2, 0), [0, 0, 0]))
            scene.start([[0, 0, radius]], [[0, 0, 0]])
            heights[approximation, share, mass] = max(
                abs(scene.until(step * 1e-3).position()[2] / radius - 1) for step in range(1, 601))
            ways[approximation, share, mass] = scene.position()[0]
            coulomb = max(0, (np.sin(angle) - 0.5 * np.cos(angle)) * G * 0.6**2 / 2)
            print(f"{approximation}, slope {share:g} mu, {mass:g} kg: {heights[approximation, share, mass]:.3f} of the radius, "
                  f"way {scene.position()[0]:.4f} m, Coulomb's law {coulomb:.4f} m")
finish(max(heights["sap", share, 1e-3] for share in (0.9, 1.1)) > 0.1 and ways["lagged", 1.1, 1.0] < 0.01)
