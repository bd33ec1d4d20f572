#!/usr/bin/env bash
# completion_test.sh BIN ROOT: the scripts of `gapfarm completion` in the shells that they are for, in a
# folder with a run.  A shell that is not installed is named; without any it ends with status 77.
set -euo pipefail
bin=$1
root=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export PATH="$bin:$PATH" HOME="$folder" TERM=dumb
cd "$folder"
ln -s "$root/configs" configs
gapfarm evolve configs/demo.toml --out run/first --generations 1 --population 4 --workers 1 >/dev/null 2>&1
failures=0 tried=0

# expect SHELL LINE WORD: the line's last word may go on as WORD.
expect() {
  local offered
  offered=$("complete_by_$1" "$2" | cut -f1) || true
  grep -qxF -- "$3" <<<"$offered" && return
  echo "FAILED: $1 does not complete '$2' to '$3' but to: $offered"
  failures=$((failures + 1))
}

complete_by_bash() {
  bash -c 'source <(gapfarm completion bash)
    read -ra COMP_WORDS <<<"$1"; [[ $1 == *" " ]] && COMP_WORDS+=("")
    COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _gapfarm 2>/dev/null || true
    printf "%s\n" "${COMPREPLY[@]}"' bash "$1"
}

# As compinit calls it, with what it offers printed in place of shown.
complete_by_zsh() {
  zsh -f -c 'compdef() { : }
    _describe() { print -rl -- "${(@P)2}" | sed "s/\\\\:/\x01/g; s/:.*//; s/\x01/:/g" }
    compadd() { print -rl -- "${(@P)argv[-1]}" }
    source <(gapfarm completion zsh)
    words=("${(@s: :)1}"); CURRENT=${#words}
    _gapfarm' zsh "$1"
}

complete_by_fish() {
  fish --no-config -c 'gapfarm completion fish | source; complete -C "$argv[1]"' "$1"
}

for shell in bash zsh fish; do
  if ! command -v "$shell" >/dev/null; then
    echo "not tried: $shell is not installed"
    continue
  fi
  tried=$((tried + 1))
  expect "$shell" 'gapfarm evo' evolve
  expect "$shell" 'gapfarm evolve --lis' --listen
  expect "$shell" 'gapfarm evolve configs/de' configs/demo.toml
  expect "$shell" 'gapfarm status run/' run/first
  expect "$shell" 'gapfarm report run/' run/first
  expect "$shell" 'gapfarm simulate configs/demo.toml --set full_sp' full_speed=
  expect "$shell" 'gapfarm plan configs/demo.toml --effects floor_tilt,motor_as' floor_tilt,motor_asymmetry
  expect "$shell" 'gapfarm completion z' zsh
done
[[ $tried -gt 0 ]] || exit 77
[[ $failures -eq 0 ]] && echo 'completion: fine'
