"""With 'lagged' contacts, Drake's default, a capsule that slides on a plane is braked by far more than Coulomb's friction.

A capsule of 1 kg lies along its velocity of 3 m/s, friction 0.5, 1 ms. It touches the plane at one point, which changes from end
to end. It should slide v^2 / (2 mu g) = 0.917 m. 'lagged' bounds the friction by the normal force of the step before; 'sap' and
'similar' do not. A sled on two such capsules is braked too strongly, too.
"""

from scene import *

COULOMB = 9 / (2 * 0.5 * G)  # m


def way(approximation, runners):
    """Of a body whose capsules lie at these y, m."""
    scene = Scene(approximation, 1e-3)
    scene.floor()
    lying = [RigidTransform(RollPitchYaw(0, np.pi / 2, 0), [0, y, 0]) for y in runners]
    body = scene.add(Capsule(0.1, 0.4), 1.0, capsule_moments(1.0, 0.1, 0.2, 0), lying[0])
    for X in lying[1:]:
        scene.plant.RegisterCollisionGeometry(body, X, Capsule(0.1, 0.4), "other", scene.properties)
    return scene.start([[0, 0, 0.1]], [[3, 0, 0]]).until(1.5).position()[0]


ways = {}
for approximation in APPROXIMATIONS:
    ways[approximation] = [way(approximation, runners) for runners in ([0], [-0.3, 0.3])]
    print(f"{approximation}: capsule {ways[approximation][0]:.4f} m, sled {ways[approximation][1]:.4f} m, Coulomb's law {COULOMB:.4f} m")
finish(max(ways["lagged"]) < 0.8 < 0.9 < min(ways["sap"] + ways["similar"]))
