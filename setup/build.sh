# Sourced by ./assay and ./test, which set root: configuring and building with what setup.sh made.

cache="${ASSAY_CACHE:-${root}/.cache}"

# One set-up or build at a time in a tree; the lock goes with the process that holds it.
take_lock() {
  mkdir -p "${cache}" || return 1
  exec {assay_lock}>"${cache}/lock" || return 1
  if ! flock -n "${assay_lock}"; then
    echo "assay: waiting for another set-up or build to end" >&2
    flock "${assay_lock}"
  fi
  export ASSAY_LOCK_HELD=1
}

# Programs that are started later must neither hold the lock nor believe they have it.
release_lock() {
  exec {assay_lock}>&-
  unset ASSAY_LOCK_HELD
}

# configure PRESET [CMAKE_ARGUMENT...]. A build folder of a tree that was moved is of no use and is made anew.
configure() {
  local preset="$1" folder="${root}/build/$1" home log="${cache}/configure-$1.log"
  shift
  if [[ -f ${folder}/CMakeCache.txt ]]; then
    home="$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "${folder}/CMakeCache.txt")"
    [[ ${home} == "${root}" ]] || rm -rf "${folder}"
  fi
  if ! (cd "${root}" && cmake --preset "${preset}" -DASSAY_CACHE="$(cd "${cache}" && pwd)" "$@") >"${log}" 2>&1; then
    cat "${log}" >&2
    return 1
  fi
  sed -n 's/^-- assay: \(engine .*not found.*\)$/assay: \1/p' "${log}" >&2
}

# build PRESET [TARGET...]: progress on a terminal, else only what failed.
build() {
  local preset="$1" log="${cache}/build-$1.log"
  shift
  local command=(cmake --build "${root}/build/${preset}" ${1:+--target "$@"})
  if [[ -t 2 ]]; then
    NINJA_STATUS="assay: building %f/%t " "${command[@]}" >&2
  elif ! "${command[@]}" >"${log}" 2>&1; then
    grep -v '^\[[0-9]*/[0-9]*\] \(Building\|Linking\)' "${log}" | tail -n 60 >&2
    return 1
  fi
}

# Everything that ./assay runs.
build_product() {
  take_lock || return 1
  # Somebody else may have done it while we waited.
  if ! up_to_date; then
    local started
    started="$(mktemp)"
    "${root}/setup/setup.sh" || return 1
    echo "assay: configuring and building the release (a few minutes the first time)" >&2
    configure release || return 1
    build release product || { echo "assay: the build failed" >&2; return 1; }
    # A file that was saved during the build is newer than its start and is built next time.
    echo "${made_for}" >"${stamp}"
    touch -r "${started}" "${stamp}"
    rm -f "${started}"
  fi
  release_lock
}
