"""SAPIEN 3.0.3: what an articulation has unless it is told otherwise: friction in its joints, damping of its links.

The planar chain of five links with a rate of 1 rad/s in each hinge, for 1 s at 1 ms: a joint's friction is 0.05 until set_friction(0),
and a link's linear and angular damping 0.05 until they are set. Prints how far the last link is from where it is without them.
"""

from scene import *


def end(**defaults):
    scene = Scene("tgs", 1e-3)
    own = chain(scene, 5)
    for link in own.links[1:]:
        if defaults.get("friction"):
            link.joint.friction = defaults["friction"]
        if defaults.get("damping"):
            link.linear_damping = link.angular_damping = defaults["damping"]
    own.qvel = np.ones(5, dtype=np.float32)
    scene.run(1000)
    return np.array(own.links[-1].entity_pose.p, dtype=float)


scene = Scene("tgs", 1e-3)
made = chain(scene, 2, keep_defaults=True).links[-1]
print(f"joint friction {made.joint.friction:g}, damping {made.linear_damping:g} and {made.angular_damping:g}, largest speeds "
      f"{made.max_linear_velocity:g} m/s, {made.max_angular_velocity:g} rad/s and {made.joint.max_velocity:g} rad/s in the joint")
still_so = all(abs(value - 0.05) < 1e-6 for value in (made.joint.friction, made.linear_damping, made.angular_damping))
right = end()
off = {name: np.linalg.norm(end(**{name: 0.05}) - right) for name in ("friction", "damping")}
print(f"the last link of five is off by {off['friction']:.3f} m with that friction and {off['damping']:.3f} m with that damping")
finish(still_so and min(off.values()) > 0.02)
