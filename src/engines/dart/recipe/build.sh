# Builds DART's core library and its collision detector that uses ODE, with the ODE that plugins link.
fetch_debian "${recipe}/pins.txt"
# Shared with other set-ups: made here if it is not there yet.
set_up_engine ode "${build}"
tar -xJf "${fetched}"/dart_6.13.2+ds.orig.tar.xz -C "${work}"
folder="${out}/dart-6.13.2"
cmake -S "${recipe}" -B "${work}/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="${flags}" \
  -DDART_SOURCE="${work}/dart-6.13.2" -DODE_INCLUDE="$(engine_folder ode "${build}")/ode-0.16.6/include" \
  -DCMAKE_INSTALL_PREFIX="${folder}"
ninja -C "${work}/build" install
write_facts "${folder}" "DART 6.13.2, the authors' sources" "${compiler}" "${flags}"
