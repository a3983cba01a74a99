#!/usr/bin/env bash
# Puts in place what assay is built from: system packages, engines, the page's libraries; with --tests the tools of ./test
# too. What is there already is left alone, so a second run takes a moment. Everything it says goes to standard error.
#
#   setup/setup.sh [--tests]
#
#   ASSAY_CACHE         where downloads, engines and tools live; default: .cache in the repository
#   ASSAY_SKIP_APT      non-empty: do not look at system packages
#   ASSAY_SKIP_ENGINES  engines (src/engines/*/recipe) to do without, space-separated
#
# Every piece is made under a temporary name and renamed when it is whole, and a stamp holds the hash of what it was made
# from; so an interrupted run leaves nothing that passes for done.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cache="${ASSAY_CACHE:-${root}/.cache}"
with_tests=""
case "${1:-}" in
  "") ;;
  --tests) with_tests=1 ;;
  *) echo "setup: unknown argument '$1'; the only one is --tests" >&2; exit 2 ;;
esac
exec 1>&2

mkdir -p "${cache}"
cache="$(cd "${cache}" && pwd)"
log="${cache}/setup.log"

say() { echo "assay setup: $*"; }
die() { say "$*"; exit 1; }

# Others wait for whoever came first and then find everything done. ./assay and ./test hold the lock already.
if [[ -z ${ASSAY_LOCK_HELD:-} ]]; then
  exec {lock}>"${cache}/lock"
  flock -n "${lock}" || { say "waiting for another set-up or build to end"; flock "${lock}"; }
fi
: >"${log}"

# logged COMMAND...: runs it with its output in the log; when it fails, shows the end of it.
logged() {
  echo "+ $*" >>"${log}"
  if ! "$@" >>"${log}" 2>&1 </dev/null; then
    tail -n 25 "${log}"
    die "failed: $* (everything it said: ${log})"
  fi
}

hash_of() { cat "$@" | sha256sum | cut -c1-32; }

# ---- system packages ------------------------------------------------------------------------------------------------

trim() { local s="$1"; s="${s#"${s%%[![:space:]]*}"}"; printf '%s' "${s%"${s##*[![:space:]]}"}"; }

# Sets missing (of the kinds that are needed) and missing_engines to the packages of the list that are not there.
find_missing_packages() {
  missing=() missing_engines=()
  local installed line package when also purpose
  installed="$(dpkg-query -W -f '${db:Status-Abbrev}|${Package}\n' 2>/dev/null | sed -n 's/^ii *|//p')"
  while IFS= read -r line; do
    [[ -z ${line} || ${line} == \#* ]] && continue
    line="${line//\\|/@or@}"
    IFS='|' read -r package when also purpose <<<"${line}"
    package="$(trim "${package}")" when="$(trim "${when}")" also="$(trim "${also//@or@/|}")"
    [[ ${when} == test && -z ${with_tests} ]] && continue
    grep -qxF -- "${package}" <<<"${installed}" && continue
    [[ -n ${also} ]] && bash -c "${also}" >/dev/null 2>&1 && continue
    if [[ ${when} == engine ]]; then missing_engines+=("${package}"); else missing+=("${package}"); fi
  done <"${root}/setup/apt-packages.txt"
}

install_packages() {
  [[ -n ${ASSAY_SKIP_APT:-} ]] && return
  if ! command -v dpkg-query >/dev/null; then
    say "not a Debian system: make sure that what setup/apt-packages.txt lists is installed"
    return
  fi
  find_missing_packages
  local all=("${missing[@]}" "${missing_engines[@]}")
  [[ ${#all[@]} -eq 0 ]] && return
  if [[ ${EUID} -eq 0 ]]; then
    say "installing ${#all[@]} system packages: ${all[*]}"
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

# make_venv NAME REQUIREMENTS: a virtual environment of exactly these packages at ${cache}/NAME.
make_venv() {
  local folder="${cache}/$1" requirements="$2" stamp
  stamp="$(hash_of "${root}/setup/pip/bootstrap.txt" "${requirements}") $(python3 -V 2>&1) ${folder}"
  [[ -f ${folder}/.stamp && $(<"${folder}/.stamp") == "${stamp}" ]] && return
  say "making the Python environment ${folder}"
  rm -rf "${folder}"
  logged python3 -m venv "${folder}"
  logged "${folder}/bin/python" -m pip install --disable-pip-version-check --require-hashes --no-deps \
    --only-binary :all: -r "${root}/setup/pip/bootstrap.txt"
  [[ ${requirements} -ef ${root}/setup/pip/bootstrap.txt ]] ||
    logged "${folder}/bin/python" -m pip install --disable-pip-version-check --require-hashes --no-deps \
      --only-binary :all: -r "${requirements}"
  echo "${stamp}" >"${folder}/.stamp"
}

# fetch_once PINS COMMAND...: runs COMMAND in a scratch folder that becomes ${fetched}, once for what PINS (a file) says.
fetch_once() {
  fetched="$(folder_of "$1")"
  shift
  [[ -d ${fetched} ]] && return
  mkdir -p "${cache}/downloads"
  # Two engines may want it at once.
  (
    flock 9
    [[ -d ${fetched} ]] && exit
    rm -rf "${fetched}.part"
    mkdir -p "${fetched}.part"
    (cd "${fetched}.part" && logged "$@")
    mv "${fetched}.part" "${fetched}"
  ) 9>"${fetched}.lock"
}
folder_of() { echo "${cache}/downloads/$(hash_of "$1")"; }

# fetch PINS PIP_ARGUMENT...: downloads once what PINS names, and sets fetched to the folder that holds it.
fetch() {
  local pins="$1"
  shift
  if [[ ! -d $(folder_of "${pins}") ]]; then
    (flock 9 && make_venv pip "${root}/setup/pip/bootstrap.txt") 9>"${cache}/pip.lock"
  fi
  fetch_once "${pins}" "${cache}/pip/bin/python" -m pip download --disable-pip-version-check --require-hashes --no-deps \
    "$@" -d . -r "${pins}"
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

# fetch_npm FOLDER: the packages of FOLDER's package-lock.json as ${fetched}/node_modules, checked against its hashes.
fetch_npm() { fetch_once "$1/package-lock.json" install_npm "$1"; }
install_npm() {
  cp "$1/package.json" "$1/package-lock.json" .
  npm ci --ignore-scripts --no-audit --no-fund
}

unzip_python() { python3 -m zipfile -e "$1" "$2"; }

# ---- engines --------------------------------------------------------------------------------------------------------

# write_facts FOLDER SOURCE COMPILER FLAGS: what cmake/Engines.cmake hands to the adapter's build facts.
write_facts() { printf 'source=%s\ncompiler=%s\nflags=%s\n' "$2" "$3" "$4" >"$1/build.txt"; }

# needs PROGRAM WHAT_FOR: for recipes; without the program the engine is left out, which is said, and tried again next time.
needs() {
  command -v "$1" >/dev/null && return
  echo "$1, $2" >"${work}/lacking"
  exit 3
}

# Runs src/engines/<name>/recipe/build.sh in a subshell. It has: recipe (its folder), work (scratch), out (where the engine's
# folders go), flags and compiler (for code built from source), and the functions above.
set_up_engine() {
  local name="$1" recipe="${root}/src/engines/$1/recipe" stamp folder
  local stamp_file="${cache}/engines/.stamp-${name}"
  stamp="$(hash_of "${recipe}"/* "${root}/setup/engine_flags.txt") ${compiler}"
  if [[ -f ${stamp_file} && $(head -n 1 "${stamp_file}") == "${stamp}" ]]; then
    local whole=1
    while IFS= read -r folder; do
      [[ -d ${cache}/engines/${folder} ]] || whole=""
    done < <(tail -n +2 "${stamp_file}")
    [[ -n ${whole} ]] && return
  fi

  say "setting up the engine ${name}"
  local log="${cache}/setup-${name}.log"
  : >"${log}"
  local work="${cache}/work-${name}" out="${cache}/work-${name}/out" fetched
  rm -rf "${work}" "${stamp_file}"
  mkdir -p "${out}" "${cache}/engines"
  build_engine() {
    set -euo pipefail
    # shellcheck source=/dev/null
    source "${recipe}/build.sh"
  }
  # Not `if (...)`: there, set -e would be off inside.
  set +e
  (build_engine) >>"${log}" 2>&1 </dev/null
  local status=$?
  set -e
  if [[ ${status} -eq 3 && -s ${work}/lacking ]]; then
    say "doing without the engine ${name}: it needs $(<"${work}/lacking")"
    rm -rf "${work}"
    return
  fi
  if [[ ${status} -ne 0 ]]; then
    tail -n 25 "${log}"
    say "the engine ${name} could not be set up (everything it said: ${log})"
    die "to go on without it: ASSAY_SKIP_ENGINES='${ASSAY_SKIP_ENGINES:+${ASSAY_SKIP_ENGINES} }${name}'"
  fi
  {
    echo "${stamp}"
    for folder in "${out}"/*; do basename "${folder}"; done
  } >"${work}/stamp"
  for folder in "${out}"/*; do
    rm -rf "${cache}/engines/$(basename "${folder}")"
    mv "${folder}" "${cache}/engines/"
  done
  mv "${work}/stamp" "${stamp_file}"
  rm -rf "${work}"
}

set_up_engines() {
  local flags compiler recipe name
  flags="$(grep -v '^#' "${root}/setup/engine_flags.txt")"
  compiler="$(${CXX:-c++} --version | head -n 1)"
  # Two at a time: much of a recipe is one process that downloads, unpacks, generates or links. Each is a process group of
  # its own, so that an interrupt ends all of it.
  local running=0 failed=""
  set -m
  trap 'for job in $(jobs -p); do kill -TERM -- "-${job}"; done 2>/dev/null; exit 130' INT TERM
  for recipe in "${root}"/src/engines/*/recipe/build.sh; do
    name="${recipe%/recipe/build.sh}" name="${name##*/}"
    if [[ " ${ASSAY_SKIP_ENGINES:-} " == *" ${name} "* ]]; then
      say "doing without the engine ${name} (ASSAY_SKIP_ENGINES)"
      continue
    fi
    if ((running == 2)); then
      wait -n || failed=1
      running=1
    fi
    [[ -n ${failed} ]] && break
    set_up_engine "${name}" &
    running=$((running + 1))
  done
  while ((running > 0)); do
    wait -n || failed=1
    running=$((running - 1))
  done
  trap - INT TERM
  set +m
  [[ -z ${failed} ]] || exit 1
}

# ---- the page's libraries -------------------------------------------------------------------------------------------

# npm ci removes node_modules first, so the stamp inside it is gone until it is whole.
set_up_web() {
  local web="${root}/web" stamp
  [[ -f ${web}/package-lock.json ]] || return 0
  stamp="$(hash_of "${web}/package.json" "${web}/package-lock.json") $(node --version)"
  [[ -f ${web}/node_modules/.assay-stamp && $(<"${web}/node_modules/.assay-stamp") == "${stamp}" ]] && return
  say "fetching the report page's libraries"
  logged npm ci --prefix "${web}" --ignore-scripts --no-audit --no-fund
  echo "${stamp}" >"${web}/node_modules/.assay-stamp"
}

install_packages
set_up_engines
set_up_web
if [[ -n ${with_tests} ]]; then
  make_venv tools "${root}/setup/pip/tools.txt"
fi
