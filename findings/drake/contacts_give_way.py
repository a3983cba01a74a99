"""Drake's contacts have a stiffness of 1e6 N/m a shape whatever they carry, and leave the ground slowly after an impact.

A ball of 1 kg and 0.1 m reaches a plane at 3 m/s in steps of 4 ms: its depth 0.12 s later, relative to its radius. A bar of
1000 kg lies across two of 1 kg: how far it sinks in 0.5 s at 1 ms, relative to their radius of 0.1 m.
"""

from scene import *

depths, ways = {}, {}
for approximation in APPROXIMATIONS:
    worst = 0
    for phase in range(10):
        scene = Scene(approximation, 4e-3)
        scene.floor()
        scene.add(Sphere(0.1), 1.0, [0.004] * 3)
        scene.start([[0, 0, 0.1 + 3 * 4e-3 * (5 + phase / 10)]], [[0, 0, -3 + 5 * 4e-3 * G]]).until(35 * 4e-3)
        worst = max(worst, 1 - scene.position()[2] / 0.1)
    depths[approximation] = worst
    scene = Scene(approximation, 1e-3, friction=1.0)
    scene.floor()
    half, radius = 0.5, 0.1
    along_y = RigidTransform(RollPitchYaw(np.pi / 2, 0, 0), [0, 0, 0])
    along_x = RigidTransform(RollPitchYaw(0, np.pi / 2, 0), [0, 0, 0])
    for _ in range(2):
        scene.add(Capsule(radius, 2 * half), 1.0, capsule_moments(1.0, radius, half, 1), along_y)
    scene.add(Capsule(radius, 2 * half), 1000.0, capsule_moments(1000.0, radius, half, 0), along_x)
    scene.start([[-0.3, 0, radius], [0.3, 0, radius], [0, 0, 3 * radius]], [[0, 0, 0]] * 3).until(0.5)
    ways[approximation] = np.linalg.norm(scene.position(2) - [0, 0, 3 * radius]) / radius
    print(f"{approximation}: {depths[approximation]:.4f} of the radius deep, sinks by {ways[approximation]:.4f} of the radius")
finish(min(depths.values()) > 0.05 and min(ways.values()) > 0.05)
