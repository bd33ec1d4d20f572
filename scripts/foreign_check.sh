#!/usr/bin/env bash
# Diagnoses logs of tracked robots that are not Bullet's: made by the planar simulator or by MuJoCo
# (tests/planar, tests/mujoco; built with the tests, the second where GAPFARM_MUJOCO is on), judged by
# `gapfarm blind-check`, reported as the tables of docs/evidence/diagnosis.md.
#
#   scripts/foreign_check.sh OUT BIN [--engine planar|mujoco] [--nulls N] [--clear N] [--subtle N]
#                            [--outside N] [--seed S] [--effects NAME...]
#
# BIN: the folder of gapfarm, gapfarm-worker and ENGINE_cases.  CONFIG: the config (configs/srv1.toml).
# JOBS: diagnoses at a time (1).  Given again, it goes on where it was stopped.  Tables of several
# folders together: scripts/foreign_tables.py OUT...
set -euo pipefail
usage='usage: scripts/foreign_check.sh OUT BIN [--engine planar|mujoco] [--nulls N] [--clear N] ...'
out=${1:?$usage}
bin=${2:?$usage}
shift 2
root=$(cd "$(dirname "$0")/.." && pwd)
config=${CONFIG:-$root/configs/srv1.toml}
engine=planar
cases=()
while [[ $# -gt 0 ]]; do
  if [[ $1 == --engine ]]; then engine=${2:?$usage}; shift 2; else cases+=("$1"); shift; fi
done

# The cases are made once; what was asked is kept beside them.
asked="$engine ${cases[*]}"
if [[ ! -e "$out/asked" ]]; then
  mkdir -p "$out"
  "$bin/${engine}_cases" "$out" "${cases[@]}" | tee "$out/made"
  echo "$asked" >"$out/asked"
elif [[ $(cat "$out/asked") != "$asked" ]]; then
  echo "$out: holds what '$(cat "$out/asked")' made, not '$asked'; choose another folder" >&2
  exit 1
fi
"$bin/gapfarm" blind-check "$config" --foreign "$out/cases" --truth "$out/truth" \
  --out "$out/check" --jobs "${JOBS:-1}" --workers 1
"$root/scripts/foreign_tables.py" "$out"
