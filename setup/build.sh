# shellcheck shell=bash disable=SC2154
# Sourced by ./assay and ./test, after common.sh: configuring and building with what setup.sh made.

# Where ccache is installed, the clones of a user share compiled objects.
export CCACHE_BASEDIR="${CCACHE_BASEDIR:-${root}}" CCACHE_NOHASHDIR="${CCACHE_NOHASHDIR:-1}"

# What ./assay runs: see hand_over. Its stamp is as old as the start of the last complete build, names what that was made for
# and lists the engines' folders.
product="${root}/build/product"
program="${product}/bin/assay"
made_for="${root}|${HOSTNAME}|${cache}|${ASSAY_SKIP_ENGINES:-}"

up_to_date() {
  local stamp="${product}/stamp" git="${root}/.git" recorded path
  [[ -x ${program} && -f ${stamp} ]] && mapfile -t recorded <"${stamp}" && [[ ${recorded[0]} == "${made_for}" ]] || return 1
  for path in "${recorded[@]:1}"; do [[ -d ${path} ]] || return 1; done
  # Packages came or went; a commit was made, which every result names.
  [[ -f ${git} ]] && read -r _ git <"${git}"
  [[ /var/lib/dpkg/status -nt ${stamp} || ${git}/logs/HEAD -nt ${stamp} ]] && return 1
  # Folders count too: a file that was removed or renamed leaves its trace there.
  local inputs=(CMakeLists.txt CMakePresets.json cmake setup src)
  for path in web/package.json web/package-lock.json web/src benchmarks/CMakeLists.txt tests/CMakeLists.txt; do
    [[ -e ${root}/${path} ]] && inputs+=("${path}")
  done
  [[ -z $(cd "${root}" && find "${inputs[@]}" -newer "${stamp}" -print -quit) ]]
}

# configure PRESET [CMAKE_ARGUMENT...]. A build folder of a tree that was moved is of no use and is made anew.
configure() {
  local preset="$1" folder="${root}/build/$1" home log="${logs}/configure-$1.log"
  shift
  phase "configuring the ${preset} build"
  find_node
  if [[ -f ${folder}/CMakeCache.txt ]]; then
    home="$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "${folder}/CMakeCache.txt")"
    [[ ${home} == "${root}" ]] || rm -rf "${folder}"
  fi
  if ! (cd "${root}" && cmake --preset "${preset}" -DASSAY_CACHE="${cache}" "$@") >"${log}" 2>&1; then
    cat "${log}" >&2
    return 1
  fi
  # Others are set up when somebody asks for them.
  sed -n '/ Run \.\/assay setup /!s/^-- assay: \(engine .*not found.*\)$/assay: \1/p' "${log}" >&2
}

# follow JOB: waits for it, with a line every ten seconds that says how far ninja is.
follow() {
  local began=${SECONDS} spent next=10 edges total text
  trap 'kill "$1" 2>/dev/null' INT TERM
  while kill -0 "$1" 2>/dev/null; do
    spent=$((SECONDS - began))
    if ((spent >= next)); then
      next=$((spent + 10)) total=0
      read -r edges total < <(ninja_progress)
      text="$(<"${root}/build/phase")"
      ((${total:-0} == 0)) || text+=": ${edges} of ${total} files"
      # what comes first is no measure of the rest
      ((${total:-0} == 0 || edges * 10 < total)) || text+=", about $(((spent * (total - edges) / edges + 59) / 60)) min left"
      echo "assay: ${text}" >&2
    fi
    sleep 0.2
  done
  trap - INT TERM
  wait "$1"
}

# build PRESET [TARGET...]: progress on a terminal, else a line now and then and what failed.
build() {
  local preset="$1" log="${logs}/build.log"
  shift
  local command=(cmake --build "${root}/build/${preset}" ${1:+--target "$@"})
  phase "building the ${preset} build"
  rm -f "${log}"
  if [[ -t 2 ]]; then
    NINJA_STATUS="assay: building %f/%t " "${command[@]}" >&2
    return
  fi
  "${command[@]}" >"${log}" 2>&1 </dev/null &
  if ! follow $!; then
    grep -v '^\[[0-9]*/[0-9]*\] \(Building\|Linking\)' "${log}" | tail -n 60 >&2
    return 1
  fi
}

# Sets up and builds what ./assay runs.
build_product() {
  take_lock
  # Somebody else may have done it while we waited.
  if ! up_to_date; then
    local started
    started="$(mktemp)"
    "${root}/setup/setup.sh" || return 1
    find_cache || return 1
    echo "assay: configuring and building the release (a few minutes the first time)" >&2
    configure release || return 1
    build release product || { echo "assay: the build failed" >&2; return 1; }
    hand_over "${started}"
    rm -f "${started}"
  fi
  release_lock
}

# hand_over STARTED: makes the release build what ./assay runs. STARTED is a file as old as the start of the build: a source
# that was saved during the build is newer, and is built next time.
#
# The program and its plugins are linked into a folder of their own, because a later build replaces files while ./assay
# runs. Programs that still run keep their folder: they start workers from it.
hand_over() {
  local folder running old
  folder="$(mktemp -d "${root}/build/product.XXXXXX")"
  chmod 755 "${folder}"
  mkdir "${folder}/bin"
  cp -l "${root}/build/release/bin/assay" "${folder}/bin/" 2>/dev/null ||
    cp "${root}/build/release/bin/assay" "${folder}/bin/"
  cp -al "${root}/build/release/engines" "${folder}/" 2>/dev/null || cp -a "${root}/build/release/engines" "${folder}/"
  cp -a "${root}/build/release/releases" "${folder}/"
  { echo "${made_for}" && cat "${root}/build/engines.txt"; } >"${folder}/stamp"
  touch -r "$1" "${folder}/stamp"
  ln -s "${folder##*/}" "${folder}/link"
  mv -T "${folder}/link" "${product}"
  running="$(readlink /proc/[0-9]*/exe 2>/dev/null)"
  for old in "${root}"/build/product.*; do
    [[ ${old} == "${folder}" || ${running} == *"${old}/"* ]] || rm -rf "${old}"
  done
}
