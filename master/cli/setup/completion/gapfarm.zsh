#compdef gapfarm
# gapfarm for zsh: gapfarm completion zsh
_gapfarm() {
  local line
  local -a whole more
  for line in "${(@f)$(gapfarm completion words -- "${(@)words[2,CURRENT]}" 2>/dev/null)}"; do
    [[ -n $line ]] || continue
    if [[ ${line%%$'\t'*} == *[/=] ]]; then
      more+=("${line%%$'\t'*}")
    else
      whole+=("${${line%%$'\t'*}//:/\\:}:${line#*$'\t'}")
    fi
  done
  (( ${#whole} )) && _describe gapfarm whole
  (( ${#more} )) && compadd -S '' -a more
}
if [[ ${funcstack[1]} == _gapfarm ]]; then _gapfarm "$@"; else compdef _gapfarm gapfarm; fi
