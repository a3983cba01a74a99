"""JAX and MJX, on the CPU unless JAX_PLATFORMS names another platform, with compiled steps kept in a folder that this process may
write; imported before anything else of them."""

import contextlib
import hashlib
import os
import tempfile

from kernel_folder import folder_of_programs

# XLA reads these when it starts. Its pool has as many threads as NPROC says.
os.environ.setdefault("JAX_PLATFORMS", "cpu")
if os.environ["JAX_PLATFORMS"] == "cpu":
    os.environ.update(NPROC="1", XLA_FLAGS="--xla_cpu_multi_thread_eigen=false")

import jax  # noqa: E402


def processor():
    """A name for what the processor can execute: a step that was compiled on another machine may not run on this one."""
    with open("/proc/cpuinfo", encoding="utf-8") as lines:
        flags = next((line for line in lines if line.startswith("flags")), "")
    return hashlib.sha256(" ".join(sorted(flags.split())).encode()).hexdigest()[:12]


tempfile.tempdir = folder_of_programs()  # a confined process may write nowhere else
for option, value in {"jax_enable_x64": True, "jax_cpu_enable_async_dispatch": False,
                      "jax_compilation_cache_dir": os.path.join(tempfile.tempdir, processor()),
                      "jax_persistent_cache_min_compile_time_secs": 0.0,
                      "jax_persistent_cache_min_entry_size_bytes": -1}.items():
    jax.config.update(option, value)

with contextlib.redirect_stdout(None):  # it says that it has no Warp
    from mujoco import mjx  # noqa: E402, F401
