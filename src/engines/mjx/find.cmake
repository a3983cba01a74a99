assay_find_python_engine(mjx_environment mjx "680 MB")
