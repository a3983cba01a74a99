# ODE: built from source, double precision.
set(version 0.16.6)
assay_engine_folder(made ode)
find_package(Threads REQUIRED)
assay_built_engine(ode VERSION ${version} FOLDER "${made}/ode-${version}" LIBRARY libode.a DEFINITIONS dIDEDOUBLE
  LINK Threads::Threads)
