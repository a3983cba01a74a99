# Completion of `assay` for bash. Installed as share/bash-completion/completions/assay; in a source tree:
# `source <(./assay completion bash)`. The program itself says what fits, from its own options.

_assay() {
  local word="${COMP_WORDS[COMP_CWORD]}" answer
  # a program that is not built yet would be built first
  local -x ASSAY_NO_BUILD=1
  mapfile -t answer < <("${COMP_WORDS[0]}" completion words "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
  COMPREPLY=("${answer[@]:1}")
  if [[ ${#COMPREPLY[@]} -eq 0 && ${answer[0]} == files ]]; then
    mapfile -t COMPREPLY < <(compgen -f -- "${word}")
    compopt -o filenames 2>/dev/null
  fi
}

complete -F _assay assay ./assay
