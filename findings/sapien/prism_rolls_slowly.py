"""SAPIEN 3.0.3: a cylinder is a prism, and rolls down a slope slower than a cylinder or a rigid prism does.

SAPIEN's own cylinder is a prism of 32 sides that lies inside of it. A rigid prism without rebound keeps at each edge the part
(I + m r^2 cos(2 pi / n)) / (I + m r^2) of its rate. PhysX's loses about twice as much, at any timestep, and of 126 sides it
keeps so few vertices that nothing is gained.
"""

from scene import *

RADIUS, HALF, ALONG, DURATION = 0.1, 0.15, 0.005, 0.8


def rigid(sides):
    """Loss of a rigid prism against a cylinder: over an angle of s its edges take exp(-k s) of the rate."""
    swinging, step = RADIUS**2, 2 * math.pi / sides
    k = -math.log((ALONG + swinging * math.cos(step)) / (ALONG + swinging)) / step
    way = G * math.sin(math.atan(0.2)) / 3 * DURATION**2 / RADIUS
    return 1 - math.sqrt((1 - math.exp(-2 * k * way)) / (2 * k * way))


still_so = True
for sides in (0, 32, 64, 126):  # 0: SAPIEN's own
    loss = []
    for h in (1e-3, 2.5e-4):
        scene = Scene("pgs", h, tilted(0.2))
        scene.plane(1.0)
        if sides == 0:
            body = scene.free(None, [0.01, ALONG, 0.01], [0, 0, RADIUS])
            shape = scene.shape(physx.PhysxCollisionShapeCylinder(RADIUS, HALF, material(1.0)), turn=(math.sqrt(0.5), 0, 0, math.sqrt(0.5)))
            body.attach(shape)
            kept = "its own cylinder"
        else:
            shape = prism(RADIUS, HALF, sides, 1.0)
            body = scene.free(shape, [0.01, ALONG, 0.01], [0, 0, RADIUS])
            kept = f"{sides} sides, {len(shape.vertices)} of {2 * sides} vertices"
        scene.run(round(DURATION / h))
        loss.append(1 - body.linear_velocity[0] / (G * math.sin(math.atan(0.2)) * 2 / 3 * DURATION))
    wanted = rigid(sides or 32)
    print(f"{kept}: slower than a cylinder by {100 * loss[0]:.1f} % at 1 ms, {100 * loss[1]:.1f} % at 1/4 ms; a rigid prism by "
          f"{100 * wanted:.1f} %")
    still_so = still_so and min(loss) > 1.2 * wanted and min(loss) > 0.06
finish(still_so)
