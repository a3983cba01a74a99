assay_find_python_engine(genesis_environment genesis "5 GB")
