#!/usr/bin/env bash
# The robots of a pull request: `assay check` of a folder, `assay parity` of pairs of files, `assay compare` of two results.
# action.yml calls it, and so can you:
#
#   setup/pull_request.sh --out DIR [--folder DIR] [--baseline FILE] [--fail-on LEVEL] [--pairs FILE]
#                         [--fail-above SHARE] [--before DIR --after DIR] [--fail-on-regression SHARE] [-- CHECK-OPTION...]
#
# Writes comment.md, robots.sarif and robots.junit.xml into DIR. SARIF's files count from the current folder, the top of the
# repository. --pairs has two files a line, and options of `assay parity` behind them; "#" begins a comment. What follows
# "--" is given to `assay check`. ASSAY is the program, "assay" unless set. The status is the largest of the programs': 0
# nothing fails, 1 something does, 2 something could not be used.
set -euo pipefail

program="${ASSAY:-assay}"
out="" folder="." baseline="" fail_on="refused" pairs="" fail_above="" before="" after="" regression="5%"
check_options=()

die() {
  echo "pull_request.sh: $1" >&2
  exit 2
}

while (($# > 0)); do
  option="$1"
  shift
  [[ ${option} == -- ]] && { check_options=("$@"); break; }
  (($# > 0)) || die "${option} needs a value"
  case "${option}" in
    --out) out="$1" ;;
    --folder) folder="$1" ;;
    --baseline) baseline="$1" ;;
    --fail-on) fail_on="$1" ;;
    --pairs) pairs="$1" ;;
    --fail-above) fail_above="$1" ;;
    --before) before="$1" ;;
    --after) after="$1" ;;
    --fail-on-regression) regression="$1" ;;
    *) die "there is no option '${option}': see the head of the script" ;;
  esac
  shift
done
[[ -n ${out} ]] || die "--out is missing: give a folder"
[[ -n ${before} && -n ${after} ]] || [[ -z ${before}${after} ]] || die "--before and --after go together: give both"
[[ -z ${pairs} || -r ${pairs} ]] || die "--pairs '${pairs}' cannot be read: give a file with two robots a line"
command -v "${program}" >/dev/null || die "there is no program '${program}': install assay, or set ASSAY"

mkdir -p "${out}"
comment="${out}/comment.md"
rm -f "${comment}" "${out}/robots.sarif" "${out}/robots.junit.xml"
work="$(mktemp -d)"
trap 'rm -rf "${work}"' EXIT
worst=0

# Names come from the files that are examined: within a fence they are text. What a fence of theirs could end is cut.
fenced() {
  [[ -s $1 ]] || return 0
  printf '~~~~~~~~\n'
  head -c 20000 "$1" | sed 's/~~~~/~~ ~~/g'
  printf '\n~~~~~~~~\n\n'
}

# part TITLE text|markdown COMMAND...: runs it and adds what it says to the comment.
part() {
  local title="$1" kind="$2" status=0
  shift 2
  "$@" >"${work}/out" 2>"${work}/err" </dev/null || status=$?
  cat "${work}/err" >&2
  {
    printf '## %s\n\n' "${title}"
    if [[ ${kind} == markdown ]]; then
      head -c 40000 "${work}/out"
      printf '\n'
    else
      fenced "${work}/out"
    fi
    fenced "${work}/err"
  } >>"${comment}"
  ((status <= worst)) || worst="${status}"
}

check=("${program}" check "${folder}" --markdown --fail-on "${fail_on}" --sarif "${out}/robots.sarif"
  --junit "${out}/robots.junit.xml")
[[ -z ${baseline} ]] || check+=(--baseline "${baseline}")
part "Robots" markdown "${check[@]}" ${check_options[@]+"${check_options[@]}"}

# of files in the folder to files in the repository
if [[ -f ${out}/robots.sarif && ${folder%/} != . ]]; then
  python3 - "${out}/robots.sarif" "${folder}" <<'PYTHON'
import json, os, sys, urllib.parse

path, folder = sys.argv[1:]
prefix = urllib.parse.quote(os.path.relpath(folder).replace(os.sep, "/"))
with open(path, encoding="utf-8") as file:
    sarif = json.load(file)
for run in sarif["runs"]:
    for result in run["results"]:
        for location in result["locations"]:
            artifact = location["physicalLocation"]["artifactLocation"]
            artifact["uri"] = prefix + "/" + artifact["uri"]
with open(path, "w", encoding="utf-8") as file:
    json.dump(sarif, file, indent=1)
PYTHON
fi

if [[ -n ${pairs} ]]; then
  number=0
  while read -r -a words || ((${#words[@]} > 0)); do
    [[ ${#words[@]} -gt 0 && ${words[0]} != \#* ]] || continue
    number=$((number + 1))
    ((${#words[@]} >= 2)) || die "--pairs '${pairs}' has '${words[*]}' on a line: write two files"
    parity=("${program}" parity "${words[@]}")
    [[ -z ${fail_above} ]] || parity+=(--fail-above "${fail_above}")
    part "Pair ${number}" text "${parity[@]}"
  done <"${pairs}"
fi

if [[ -n ${before} ]]; then
  part "Results" markdown "${program}" compare "${before}" "${after}" --fail-on-regression "${regression}"
fi

# a forge takes 65536 characters
if (($(wc -c <"${comment}") > 60000)); then
  head -c 60000 "${comment}" >"${work}/cut"
  printf '\n~~~~~~~~\n\nThe rest is cut.\n' >>"${work}/cut"
  mv "${work}/cut" "${comment}"
fi
if [[ -n ${GITHUB_STEP_SUMMARY:-} ]]; then cat "${comment}" >>"${GITHUB_STEP_SUMMARY}"; fi
if [[ -n ${GITHUB_OUTPUT:-} ]]; then
  {
    echo "comment=${comment}"
    [[ ! -f ${out}/robots.sarif ]] || echo "sarif=${out}/robots.sarif"
  } >>"${GITHUB_OUTPUT}"
fi
exit "${worst}"
