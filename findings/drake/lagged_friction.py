"""With 'lagged' contacts, Drake's default, a capsule that slides on a plane is braked by far more than Coulomb's friction.

A capsule of 1 kg lies along its velocity of 3 m/s, friction 0.5, 1 ms. It touches the plane at one point, which changes from end
to end. It should slide v^2 / (2 mu g) = 0.917 m. 'lagged' bounds the friction by the normal force of the step before; 'sap' and
'similar' do not.
"""

from scene import *

ways = {}
for approximation in APPROXIMATIONS:
    scene = Scene(approximation, 1e-3)
    scene.floor()
    scene.add(Capsule(0.1, 0.4), 1.0, capsule_moments(1.0, 0.1, 0.2, 0), RigidTransform(RollPitchYaw(0, np.pi / 2, 0), [0, 0, 0]))
    scene.start([[0, 0, 0.1]], [[3, 0, 0]]).until(1.5)
    ways[approximation] = scene.position()[0]
    print(f"{approximation}: {ways[approximation]:.4f} m, Coulomb's law {9 / (2 * 0.5 * G):.4f} m")
finish(ways["lagged"] < 0.8 < 0.9 < min(ways["sap"], ways["similar"]))
