assay_find_python_engine(drake_environment drake "300 MB")
