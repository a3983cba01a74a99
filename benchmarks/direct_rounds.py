"""What the loops of engines' packages alone (direct_<engine>.py) share: the clock, and the planar chain as MJCF."""

import json
import time

ROUNDS = 20
LINK = """<body pos="{} 0 0"><joint type="hinge" axis="0 1 0"/>
  <inertial pos="0.15 0 0" mass="1" diaginertia="0.00125 0.0263 0.0263"/>{}</body>"""


def chain(options=""):
    """Five links of 1 kg on hinges; `options` are attributes of <option>."""
    links = ""
    for i in reversed(range(5)):
        links = LINK.format(0.3 if i else 0, links)
    return f'<mujoco><option gravity="0 0 0" {options}/><worldbody>{links}</worldbody></mujoco>'


def print_times(run, steps, clock=time.thread_time):
    """run() takes `steps` steps. Prints µs a step, a number a round, of the processor's time; the first run is not timed. Engines that
    step in a thread of their own need time.process_time, which counts what other threads do beside, too."""
    run()
    times = []
    for _ in range(ROUNDS):
        begin = clock()
        run()
        times.append((clock() - begin) / steps * 1e6)
    print(json.dumps(times))
