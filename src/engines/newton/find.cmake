assay_find_python_engine(newton_environment newton "670 MB")
