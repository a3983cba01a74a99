assay_find_python_engine(superdex_environment superdex "190 MB")
