assay_find_python_engine(dartpy_environment dartpy "170 MB")
