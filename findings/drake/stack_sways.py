"""In Drake's point contact a stack of ten boxes sways and sinks into itself, because a pair of boxes has one contact point.

Boxes of 1 kg and 0.1 m, each 1 mm aside and turned by 0.02 rad in turns, friction 1, 4 ms: how far any of them is aside, and how far
the highest has sunk, after 1.5 s. The contact point jumps from corner to corner. The same boxes with a small ball in each lower
corner, which are four contact points, stay.
"""

from scene import *
from pydrake.geometry import CollisionFilterDeclaration, GeometrySet

HALF, BALL, BOXES = 0.05, 5e-3, 10


def ways_of(approximation, feet):
    scene = Scene(approximation, 4e-3, friction=1.0)
    scene.floor()
    inner, starts = HALF - BALL, []
    for i in range(BOXES):
        body = scene.add(Box(*[2 * HALF] * 3), 1.0, [(2 * HALF)**2 / 6] * 3)
        for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)) if feet else ():
            scene.plant.RegisterCollisionGeometry(body, RigidTransform([x * inner, y * inner, -inner]), Sphere(BALL),
                                                  f"{i} {x} {y}", scene.properties)
        sign = 1 if i % 2 == 0 else -1
        starts.append(RigidTransform(RollPitchYaw(0, 0, 0.02 * sign), [1e-3 * sign, 5e-4 * sign, HALF * (2 * i + 1)]))
    scene.start([], [])
    # a box, or its feet, touches the box below it and nothing else of the stack
    parts = [scene.plant.GetCollisionGeometriesForBody(joint.child_body()) for joint in scene.joints]
    declaration = CollisionFilterDeclaration().ExcludeWithin(GeometrySet(sum(parts, [])))
    for lower, upper in zip(parts, parts[1:]):
        declaration.AllowBetween(GeometrySet(lower[:1]), GeometrySet(upper[1:] if feet else upper))
    scene.graph.collision_filter_manager(
        scene.graph.GetMyMutableContextFromRoot(scene.simulator.get_mutable_context())).Apply(declaration)
    for joint, X in zip(scene.joints, starts):
        joint.SetPose(scene.context, X)
    scene.until(1.5)
    moved = [scene.position(i) - X.translation() for i, X in enumerate(starts)]
    return max(np.linalg.norm(each[:2]) for each in moved), -moved[-1][2]


ways = {}
for approximation in APPROXIMATIONS:
    for feet, points in ((False, "one point"), (True, "four points")):
        ways[approximation, feet] = ways_of(approximation, feet)
        print("{}, {} a pair: {:.4f} m aside, {:.4f} m sunk".format(approximation, points, *ways[approximation, feet]))
finish(all(ways[approximation, True][0] < 0.01 < 0.02 < ways[approximation, False][0] and
           ways[approximation, True][1] < 0.02 < 0.5 < ways[approximation, False][1] for approximation in APPROXIMATIONS))
