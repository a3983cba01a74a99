assay_find_python_engine(mujoco_warp_environment mujoco-warp "540 MB")
