#!/usr/bin/env bash
# --dry-run prints what would run, and runs nothing.
#   dry_run_test.sh BIN ROOT
set -u
BIN=$1 ROOT=$2
source "$ROOT/tests/launch/common.sh"
T=$(mktemp -d)
trap clean_up EXIT
mkdir "$T/path"
for program in sbatch scancel squeue ssh; do
  printf '#!/bin/sh\necho "$0 $*" >>%s/ran\n' "$T" >"$T/path/$program"
  chmod +x "$T/path/$program"
done
PATH=$T/path:$PATH
slurm=$ROOT/scripts/launch/slurm.sh ssh=$ROOT/scripts/launch/ssh.sh
expect() {
  local wanted=$1
  shift
  local printed
  printed=$("$@" --dry-run 2>&1) || fail "$* exited with $?: $printed"
  [[ $printed == *"$wanted"* ]] || fail "$* printed: $printed"
}
expect '--array=1-3 --cpus-per-task=2 --signal=B:USR1@60' "$slurm" workers --connect tcp://m:1 \
  --workers 3 --cpus 2 --time 1:00:00 --bin "$BIN"
expect '--lifetime 3570' "$slurm" workers --connect tcp://m:1 --time 1:00:00 --bin "$BIN"
expect '--lifetime 86370' "$slurm" workers --connect tcp://m:1 --time 1-0:0:0 --bin "$BIN"
expect 'scancel 47 48' "$slurm" stop 47 48 --bin "$BIN"
expect 'slurm_master.sh' "$slurm" run --bin "$BIN" --dry-run -- evolve c.toml --out r
for verb in start status stop logs; do
  expect 'ConnectTimeout=10 b ' "$ssh" $verb a,b --connect tcp://m:1
done
printf 'one # first\n\ntwo\n' >"$T/hosts"
expect ' two ' "$ssh" status "@$T/hosts"
[[ ! -e $T/ran ]] || fail "ran $(<"$T/ran")"
"$ssh" start a 2>/dev/null && fail 'started without an endpoint'
"$slurm" workers --bin "$BIN" 2>/dev/null && fail 'submitted without an endpoint'
exit 0
