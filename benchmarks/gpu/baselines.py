"""What the engines of worker.py are compared with: MuJoCo's own rollout on the processors, and MuJoCo Warp's own benchmark model."""

import gc
import json
import os
import sys
import time

ROLLOUT_WORLDS = 256


def run(options, say, wait_for_turn, outcome_of, versions, starts_kind):
    try:
        (rollout if options.contender == "mujoco-rollout" else anchor)(options, say, wait_for_turn, versions, starts_kind)
    except Exception as error:
        import traceback

        traceback.print_exc()
        outcome, reason = outcome_of(error, None)
        say("failed", worlds=options.worlds[0], stage="measuring", outcome=outcome, reason=reason)


def rollout(options, say, wait_for_turn, versions, starts_kind):
    """`worlds` of a cell are threads here, 256 worlds are stepped."""
    engines = os.path.join(options.root, "src", "engines")
    sys.path[:0] = [os.path.join(engines, "mujoco-warp"), os.path.join(engines, "python-host")]
    import assay_adapter as assay
    import mujoco as mj
    import numpy as np
    from mujoco import rollout as rolling
    from mujoco_model import Compiled

    with open(options.model, encoding="utf-8") as file:
        given = json.load(file)
    model = assay._model(json.dumps(given["model"]))

    def set_options(option):
        option.timestep = 1e-3 * given["timestep_ms"]

    compiled, starts, steps = Compiled(model, set_options), starts_kind(assay, np, given), 32
    m, count = compiled.mujoco, ROLLOUT_WORLDS
    data, initial, size = mj.MjData(m), [], mj.mj_stateSize(m, mj.mjtState.mjSTATE_FULLPHYSICS)
    for state in starts.of(count):
        mj.mj_resetData(m, data)
        data.qpos[:], data.qvel[:] = compiled.coordinates(state)
        row = np.zeros(size)
        mj.mj_getState(m, data, row, mj.mjtState.mjSTATE_FULLPHYSICS)
        initial.append(row)
    for threads in options.worlds:
        wait_for_turn(worlds=threads, stage="measuring")
        workers = [mj.MjData(m) for _ in range(threads)]
        window_s, current = [], np.array(initial)
        spread = int(mj.mjtState.mjSTATE_QFRC_APPLIED)
        with rolling.Rollout(nthread=threads) as pool:
            for turn in range(1 + options.windows):
                force = np.zeros((count, m.nv))
                force[:, compiled.joint_dof] = starts.torques(count, 1 + turn)
                control = np.repeat(force[:, None, :], steps, axis=1)
                out = np.zeros((count, steps, size))
                begin = time.perf_counter()
                pool.rollout(m, workers, current, control, control_spec=spread, state=out)
                taken = time.perf_counter() - begin
                current = np.ascontiguousarray(out[:, -1])
                if turn:
                    window_s.append(taken)
        say("record", worlds=threads, states={}, record={
            "window_s": window_s, "steps_in_window": steps, "worlds_stepped": count, "threads": threads, "versions": versions(),
            "not_finite_at_end": int(np.sum(~np.all(np.isfinite(current), axis=1)))})


def anchor(options, say, wait_for_turn, versions, starts_kind):
    """The humanoid of MuJoCo Warp's own benchmark, with its own numbers of contacts and rows, from its pose of rest."""
    import mujoco as mj
    import numpy as np
    import warp as wp

    import mujoco_warp as mjw

    wp.config.quiet = True
    wp.config.kernel_cache_dir = options.cache
    wp.init()
    path = os.path.join(os.path.dirname(options.model), "anchor", "humanoid.xml")
    m = mj.MjModel.from_xml_path(path)
    data = mj.MjData(m)
    if m.nkey:
        mj.mj_resetDataKeyframe(m, data, 0)
    mj.mj_forward(m, data)
    device = wp.get_device(options.device)
    with wp.ScopedDevice(device):
        engine = mjw.put_model(m)
        mjw.step(engine, mjw.put_data(m, data, nworld=1, nconmax=24, njmax=64))  # compiles
        for worlds in options.worlds:
            wait_for_turn(worlds=worlds, stage="measuring")
            begin = time.monotonic()
            batch = mjw.put_data(m, data, nworld=worlds, nconmax=24, njmax=64)
            mjw.step(engine, batch)
            with wp.ScopedCapture(device=device) as capture:
                mjw.step(engine, batch)
            wp.synchronize()
            created_s, window_s, steps = time.monotonic() - begin, [], 200
            random = np.random.default_rng(0)
            for turn in range(1 + options.windows):
                batch.ctrl.assign(random.uniform(-1, 1, (worlds, m.nu)).astype(np.float32) * 0.1)
                wp.synchronize()
                begin = time.perf_counter()
                for _ in range(steps):
                    wp.capture_launch(capture.graph)
                wp.synchronize()
                if turn:
                    window_s.append(time.perf_counter() - begin)
            overflow = int(np.bitwise_or.reduce(batch.overflow.numpy())) if hasattr(batch, "overflow") else -1
            say("record", worlds=worlds, states={}, record={
                "window_s": window_s, "steps_in_window": steps, "created_s": created_s, "overflow_flags": overflow,
                "timestep_s": float(m.opt.timestep), "iterations": int(m.opt.iterations), "ls_iterations": int(m.opt.ls_iterations),
                "contacts_mean": float(np.mean(batch.nacon.numpy()) / worlds) if hasattr(batch, "nacon") else -1.0,
                "not_finite_at_end": int(np.sum(~np.all(np.isfinite(batch.qpos.numpy()), axis=1))), "versions": versions()})
            del batch, capture
            gc.collect()
