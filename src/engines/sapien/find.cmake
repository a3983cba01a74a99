assay_find_python_engine(sapien_environment sapien "310 MB")
