"""Where the engines that compile kernels for a model keep them: mujoco-warp, newton, mjx and genesis."""

import os
import sys
import tempfile

import assay_adapter as assay


def folder_of_programs():
    """A folder in the cache that set-up made the environment in, where that can be written, because a confined process may
    write nowhere else."""
    shared = os.path.join(os.path.dirname(os.path.dirname(sys.prefix)), "kernels", os.path.basename(sys.prefix))
    try:
        os.makedirs(shared, exist_ok=True)
        with tempfile.TemporaryFile(dir=shared):
            return shared
    except OSError:
        pass
    try:
        return os.path.join(tempfile.gettempdir(), "kernels")
    except OSError as error:
        raise assay.EngineFailure(f"compiled kernels cannot be kept in '{shared}': {error}") from error
