#!/usr/bin/env bash
# --dry-run prints what would be submitted, for every system, and runs nothing.
#   dry_run_test.sh BIN ROOT
set -u
BIN=$1 ROOT=$2
source "$ROOT/tests/launch/common.sh"
T=$(mktemp -d)
trap clean_up EXIT
mkdir "$T/path"
for program in sbatch scancel squeue qsub qstat condor_submit kubectl ssh; do
  printf '#!/bin/sh\necho "$0 $*" >>%s/ran\n' "$T" >"$T/path/$program"
  chmod +x "$T/path/$program"
done
PATH=$T/path:$PATH
cd "$ROOT" || exit 1
"$BIN/gapfarm" keys make --keys "$T/keys" >/dev/null 2>&1 || fail 'no keys'
# expect SYSTEM WANTED OPTIONS...
expect() {
  local system=$1 wanted=$2 printed
  shift 2
  printed=$("$BIN/gapfarm" workers --on "$system" --connect tcp://m:1 --keys "$T/keys" --max 12 --dry-run "$@" 2>&1) ||
    fail "$system exited with $?: $printed"
  [[ $printed == *"$wanted"* ]] || fail "$system printed: $printed"
}
expect slurm '--array=0-5 --cpus-per-task=2' --workers-per-job 2
expect slurm '--time=60' --wall-time 1:00:00
expect slurm '--lifetime 3570' --wall-time 1:00:00
expect slurm '--lifetime 86370' --wall-time 1-00:00:00
expect slurm '--partition=short' -- --partition=short
expect sge '-t 1-12 ' --wall-time 90
expect sge 'h_rt=90' --wall-time 90
expect sge '-pe smp 4' --workers-per-job 4
expect pbs 'walltime=3600' --wall-time 3600
expect condor 'queue 12'
expect condor '+ProjectName = "robots"' -- '+ProjectName = "robots"'
expect kube 'runAsNonRoot: true'
expect kube 'activeDeadlineSeconds: 600' --wall-time 600
expect ssh ' a sh ' --host a --host b
expect ssh ' b sh ' --host a --host b
expect local '--processes 1 --wait-limit 30'
# No secret goes anywhere but by its file.
printed=$("$BIN/gapfarm" workers --on slurm --connect tcp://m:1 --keys "$T/keys" --max 2 --dry-run 2>&1)
[[ $printed == *"--keys $T/keys"* ]] || fail "no key folder: $printed"
secret=$(sed -n 's/.*secret[^A-Za-z0-9]*//p' "$T/keys/worker.key" | head -n 1)
[[ -z $secret || $printed != *"$secret"* ]] || fail 'a secret key is printed'
# expect_submit SYSTEM WANTED...
expect_submit() {
  local system=$1 wanted printed
  shift
  printed=$("$BIN/gapfarm" submit --on "$system" --keys "$T/keys" --max 8 --dry-run -- evolve configs/demo.toml --out "$T/r" 2>&1) ||
    fail "$printed"
  for wanted in "$@"; do [[ $printed == *"$wanted"* ]] || fail "submit printed: $printed"; done
}
expect_submit slurm '--signal=B:USR1@60' 'scontrol requeue' '--workers-on slurm'
expect_submit sge '-notify' 'exit 99' '--workers-on sge'
printed=$("$BIN/gapfarm" evolve configs/demo.toml --out "$T/run" --keys "$T/keys" --workers-on slurm --max 9 --dry-run 2>&1) ||
  fail "$printed"
[[ $printed == *'up to 9 workers'*'sbatch '*'--array=0-8'* ]] || fail "evolve printed: $printed"
expect_submit pbs '-r y' 'qrerun' '--workers-on pbs'
printed=$("$BIN/gapfarm" submit --on slurm --mx 3 -- evolve configs/demo.toml --out "$T/r" 2>&1) && fail 'knew --mx'
[[ $printed == *"'--mx'; did you mean '--max'?"* ]] || fail "submit printed: $printed"
# What the job would find wrong is found before it is queued.
for wrong in 'none.toml' 'configs/demo.toml --generatons 4'; do
  # shellcheck disable=SC2086
  printed=$("$BIN/gapfarm" submit --on slurm --keys "$T/keys" --max 8 -- evolve $wrong --out "$T/r" 2>&1) &&
    fail "submitted $wrong"
  [[ $printed == *'the job would fail: '* ]] || fail "submit printed: $printed"
done
"$BIN/gapfarm" workers --on slurm --max 2 2>/dev/null && fail 'submitted without an endpoint'
"$BIN/gapfarm" workers --on nowhere --max 2 --connect tcp://m:1 2>/dev/null && fail 'knew a system nowhere'
[[ ! -e $T/ran ]] || fail "ran $(<"$T/ran")"
exit 0
