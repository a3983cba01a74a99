"""Warp on the CPU, with its compiled kernels in a folder that this process may write; imported before any engine that is made
of Warp's kernels. The engines mujoco-warp and newton have it."""

import tempfile

import warp as wp
from kernel_folder import folder_of_programs

wp.config.quiet = True
wp.config.log_level = 40
wp.config.kernel_cache_dir = tempfile.tempdir = folder_of_programs()  # a confined process may write nowhere else
wp.init()
wp.set_device("cpu")
