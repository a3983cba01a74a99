"""MJX: bodies that are welded together part with the square of their speed, 17 times as far as in MuJoCo 4.0.1.

A free body is welded to a wheel, off its axis, and both turn at a constant rate. The reference acceleration of a weld's rows has to contain
the constraint's own acceleration (the derivative of its Jacobian times the velocity), or the pull towards the axis has to come from
a gap. MuJoCo 4.0.1 has that term, MJX 3.17 has not.
"""

from scene import *

SCENE = """<mujoco><option gravity="0 0 0"/><worldbody>
  <body name="wheel"><joint axis="0 0 1"/><geom type="sphere" size="0.1" mass="1" contype="0"/></body>
  <body name="rim" pos="0.5 0 0"><freejoint/><geom type="sphere" size="0.1" mass="0.1" contype="0"/></body></worldbody>
  <equality><weld body1="wheel" body2="rim"/></equality></mujoco>"""
RADIUS, STEP, COUNT, run = 0.5, 1e-3, 400, Run(SCENE)


def gap(q):
    """Distance of the body from its place on the wheel, m."""
    return float(np.linalg.norm(q[1:4] - RADIUS * np.array([np.cos(q[0]), np.sin(q[0]), 0])))


def by_mujoco(v):
    model = mujoco.MjModel.from_xml_string(SCENE)
    model.opt.timestep = STEP
    data, largest = mujoco.MjData(model), 0.0
    data.qvel[:] = v
    for _ in range(COUNT):
        mujoco.mj_step(model, data)
        largest = max(largest, gap(data.qpos))
    return largest


gaps = {}
for rate in (1.0, 2.0, 4.0):
    v = [rate, 0, rate * RADIUS, 0, 0, 0, rate]
    q, _ = run.roll(v, STEP, COUNT)
    gaps[rate] = max(map(gap, q))
    print(f"{rate:g} rad/s: {1e3 * gaps[rate]:.3f} mm apart, in MuJoCo {1e3 * by_mujoco(v):.3f} mm")
finish(gaps[4.0] > 2.5 * gaps[2.0] > 6 * gaps[1.0] and gaps[4.0] > 10 * by_mujoco([4.0, 0, 2.0, 0, 0, 0, 4.0]))
