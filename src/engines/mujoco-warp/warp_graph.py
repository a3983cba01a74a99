"""Captured steps of many worlds, on the CPU or a GPU. The engines mujoco-warp and newton have it."""

import warnings

import assay_adapter as assay
import warp_kernels  # noqa: F401  (starts Warp)
import warp as wp


def device_of(name):
    """Warp's device `name`, where this process has it."""
    try:
        return wp.get_device(name)
    except (ValueError, RuntimeError) as error:
        raise assay.Unsupported(f"Warp has no device '{name}': {error}") from error


class Graph:
    """What `run` launches, captured on `device`. launch() may return before it is done."""

    def __init__(self, device, run):
        self.device = device
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with wp.ScopedCapture(device=device) as capture:
                run()
        self.graph = capture.graph
        if not device.is_cuda:
            self.replay, self.state = wp._src.context.runtime.core.wp_apic_cpu_replay_state, capture.graph.apic_state

    def launch(self, engine):
        if self.device.is_cuda:
            wp.capture_launch(self.graph)
        elif not self.replay(self.state):
            raise assay.EngineFailure(f"{engine}: the captured graph could not be run")


def arrays_of(record, found):
    """All arrays of a record and of the records in it."""
    for value in vars(record).values():
        if isinstance(value, wp.array):
            found.append(value)
        elif hasattr(value, "__dataclass_fields__"):
            arrays_of(value, found)
    return found


def bytes_of(arrays):
    """That these arrays of Warp take, each once."""
    return float(sum({array.ptr: array.capacity for array in arrays if array.ptr}.values()))


def facts_of(device, arrays, compile_s):
    driver = ".".join(map(str, wp.get_cuda_driver_version())) if device.is_cuda else ""
    return {"memory_bytes": bytes_of(arrays), "compile_s": compile_s, "device": device.name if device.is_cuda else "",
            "driver": f"CUDA {driver}" if driver else ""}
