# Completion of takt for bash. The command itself knows what may follow.
# SPDX-License-Identifier: Apache-2.0

_takt() {
  # Words by blanks alone: bash takes `takt::Workload` and `--executor=events` apart.
  local line suffix suffixes words
  read -ra words <<<"${COMP_LINE:0:COMP_POINT}"
  [[ ${COMP_LINE:0:COMP_POINT} == *[[:blank:]] ]] && words+=("")
  local last=${words[-1]}
  local kept=${last%"${last##*[:=]}"}  # which bash takes for a word of its own
  COMPREPLY=()
  while IFS= read -r line; do
    if [[ $line != :files* ]]; then
      line=${line%%$'\t'*}
      COMPREPLY+=("${line#"$kept"}")
      continue
    fi
    compopt -o filenames
    read -ra suffixes <<<"${line#:files}"
    if ((${#suffixes[@]} == 0)); then
      mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -f -- "${last#"$kept"}")
    else
      mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -d -- "${last#"$kept"}"
        for suffix in "${suffixes[@]}"; do compgen -f -X "!*.$suffix" -- "${last#"$kept"}"; done)
    fi
  done < <("${words[0]}" complete "${words[@]}" 2>/dev/null)
}
complete -F _takt takt
