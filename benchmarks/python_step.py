"""What a step from Python costs above one in C++: python_step.py, with the package installed. Times are the smallest of several
tries, because anything else that runs only adds."""

import time

import assay
import numpy as np

STEPS, TRIES = 200_000, 7


def best(work, steps):
    """Nanoseconds a step."""
    times = []
    for _ in range(TRIES):
        start = time.perf_counter_ns()
        work()
        times.append((time.perf_counter_ns() - start) / steps)
    return min(times)


def loop(function, steps):
    def work():
        for _ in range(steps):
            function()

    return work


def main():
    model = assay.load("planar-chain")
    print(f"{'contender':<16} {'how':<26} {'Python':>9} {'C++':>9} {'above':>9}   ns a step")
    for contender in ("null", "mujoco-euler", "ode-quick"):
        steps = STEPS if contender == "null" else STEPS // 20
        run = assay.Simulation(model, contender)
        cpp = best(lambda: run.advance(steps), steps)
        python = best(loop(run.step, steps), steps)
        print(f"{contender:<16} {'step()':<26} {python:9.0f} {cpp:9.0f} {python - cpp:9.0f}")
        torques = np.zeros(model.dof) if contender == "null" else np.full(model.dof, 1e-6)
        many = np.tile(torques, (steps, 1))
        run = assay.Simulation(model, contender)
        cpp = best(lambda: run.rollout(steps, every=steps, torques=many), steps)
        run = assay.Simulation(model, contender)
        python = best(loop(lambda: run.step(torques), steps), steps)
        print(f"{contender:<16} {'lambda: step(torques)':<26} {python:9.0f} {cpp:9.0f} {python - cpp:9.0f}")
        python = best(loop(run.read, steps), steps)
        print(f"{contender:<16} {'read()':<26} {python:9.0f}")


if __name__ == "__main__":
    main()
