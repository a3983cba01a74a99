"""Genesis, on one thread where it is on the CPU, with compiled kernels in a folder that this process may write; imported before anything else
of it."""

import os
import sys
import tempfile
import types

from kernel_folder import folder_of_programs

tempfile.tempdir = folder_of_programs()  # a confined process may write nowhere else
os.environ.update(QD_OFFLINE_CACHE_FILE_PATH=os.path.join(tempfile.tempdir, "quadrants"),
                  GS_CACHE_FILE_PATH=os.path.join(tempfile.tempdir, "genesis"), QD_NUM_THREADS="1", QD_ENABLE_PYBUF="0",
                  MPLCONFIGDIR=os.path.join(tempfile.tempdir, "matplotlib"),
                  NUMBA_CACHE_DIR=os.path.join(tempfile.tempdir, "numba"), OMP_NUM_THREADS="1")

import assay_adapter as assay  # noqa: E402
import cpuinfo  # noqa: E402
import torch  # noqa: E402

for name in ("pygltflib", "tetgen"):  # only for files of meshes and soft bodies: requirements.txt says why they are not there
    sys.modules.setdefault(name, types.ModuleType(name))
cpuinfo.get_cpu_info = lambda: {"brand_raw": "CPU"}  # it starts processes, only to print a name
torch.set_num_threads(1)

import genesis as gs  # noqa: E402
from quadrants.lang import impl  # noqa: E402

_started = None


def ways(settings, device):
    """Genesis has one device, one precision and one kind of arrays in a process."""
    return {"backend": gs.cpu if device == "cpu" else gs.gpu, "precision": "64" if settings["precision"] == "double" else "32", "performance_mode": settings["static_arrays"]}


def is_started(settings, device="cpu"):
    return _started == ways(settings, device)


def start(settings, device="cpu"):
    global _started
    stop()
    gs.init(logging_level="critical", use_deterministic_algorithms=True, **ways(settings, device))
    _started = ways(settings, device)


def stop():
    """Ends Genesis with all of its scenes. Compiled kernels are written to the folder here and at no other time that is safe: what
    is written is of no use to the process any more."""
    global _started
    if _started is not None:
        gs.destroy()
        _started = None


def has_compiled():
    """Whether a kernel was compiled in this process that the folder did not have."""
    return any(kernel.compiled_kernel_data_by_key and not kernel.fe_ll_cache_observations.cache_hit and
               not kernel.src_ll_cache_observations.cache_loaded for kernel in impl.get_runtime().kernels)
