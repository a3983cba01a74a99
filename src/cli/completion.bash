# Completion of `assay` for bash: commands, options, contenders, systems, campaigns, settings. Installed as
# share/bash-completion/completions/assay; in a source tree: `source src/cli/completion.bash`. It asks the program itself.

_assay_names() {  # the first column of a table
  "$1" "$2" 2>/dev/null | sed '1d;/^$/,$d;s/ .*//'
}

_assay() {
  local program="${COMP_WORDS[0]}" word="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD - 1]}"
  local command="" candidates="" i
  COMPREPLY=()
  # a program that is not built yet would be built first
  local -x ASSAY_NO_BUILD=1
  if [[ ${COMP_CWORD} -gt 1 ]]; then command="${COMP_WORDS[1]}"; fi
  case "${before}" in
    --engine) candidates="$(_assay_names "${program}" engines)" ;;
    --contacts | --gravity) candidates="on off" ;;
    --control) candidates="passive actuators sine" ;;
    --format) candidates="csv json" ;;
    --progress) candidates="text json" ;;
    --cells) candidates="accuracy timing runs after-runs" ;;
    --trajectories) candidates="npz csv" ;;
    --test) candidates="$("${program}" conformance --list 2>/dev/null | sed '1d;s/ .*//')" ;;
    --timestep | --duration | --sample | --jobs | --shard | --set | --change-a | --change-b | --seconds | --seeds) return ;;
    --out) ;;
    *)
      if [[ -z ${command} ]]; then
        candidates="$("${program}" --help 2>/dev/null | sed -n '/^Options:/,/^$/d;/^Examples:/q;s/^  \([a-z]*\) .*/\1/p') --help --version"
      elif [[ ${word} == -* ]]; then
        candidates="$("${program}" "${command}" --help 2>/dev/null | sed -nE '/^Examples:/q;s/^  (-.,)?(--[a-z-]+).*/\2/p')"
      else
        case "${command}" in
          check | simulate | snapshot | explain) candidates="$(_assay_names "${program}" systems)" ;;
          conformance) candidates="$(_assay_names "${program}" engines)" ;;
        esac
      fi
      ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "${candidates}" -- "${word}")
  # files where nothing else is meant
  if [[ ${#COMPREPLY[@]} -eq 0 && ${word} != -* && -n ${command} ]]; then
    mapfile -t COMPREPLY < <(compgen -f -- "${word}")
    compopt -o filenames 2>/dev/null
  fi
}

complete -F _assay assay ./assay
