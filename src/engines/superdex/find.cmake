assay_find_python_engine(superdex_environment superdex "160 MB")
