# Completion for bash: the program says what may stand at the cursor.
_ruedo() {
  local word=${COMP_WORDS[COMP_CWORD]} line
  COMPREPLY=()
  # Bash splits words at : and =, which are parts of ours.
  declare -F _get_comp_words_by_ref >/dev/null && _get_comp_words_by_ref -n := cur words cword 2>/dev/null &&
    local -a COMP_WORDS=("${words[@]}") && local COMP_CWORD=$cword && word=$cur
  while IFS= read -r line; do
    if [[ $line == ' files' ]]; then
      mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -f -- "$word")
    else
      COMPREPLY+=("$line")
    fi
  done < <(ruedo complete -- "${COMP_WORDS[@]:1:COMP_CWORD-1}" "=$word" 2>/dev/null)
  declare -F __ltrim_colon_completions >/dev/null && __ltrim_colon_completions "$word"
  return 0
}
complete -o filenames -F _ruedo ruedo
