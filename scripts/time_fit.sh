#!/usr/bin/env bash
# What a fit of ten values to a whole log costs: CPU time of the master and its workers.
#   scripts/time_fit.sh SETS OUT SET
# SETS holds SET/robot.toml (a skid-steer of two sides), SET/fit and SET/test, such as
# scripts/ground_sets.py makes of public logs.  BIN: where the programs are (build/release/bin).
set -euo pipefail
sets=$1
out=$2
name=$3
bin=${BIN:-build/release/bin}
mkdir -p "$out"
config=$out/$name.toml
{
  echo 'scenario = "ground"'
  echo '[robot]'
  echo "file = \"$(realpath "$sets/$name/robot.toml")\""
  echo '[runs]'
  echo "folders = [\"$(realpath "$sets/$name/fit")\", \"$(realpath "$sets/$name/test")\"]"
  echo 'horizons = [0.5, 2, 5]'
  echo '[parameters]'
  echo 'step_rate = 240'
  echo '[genes]'
  for gene in wheels.left.radius wheels.right.radius wheelbase friction creep delay lag marker.x \
              marker.y marker.yaw; do
    echo "$gene = \"table\""
  done
  echo '[optimiser]'
  echo 'kind = "cma_es"'
  echo 'sigma = 0.1'
  echo '[evolution]'
  echo 'stop = { evaluations = 60 }'
} > "$config"
rm -rf "${out:?}/$name"
TIMEFORMAT='%R s, of CPU time %U s and %S s'
time "$bin/gapfarm" evolve "$config" --out "$out/$name" > "$out/$name.log" 2>&1
grep -E 'evolving|least squares|used' "$out/$name.log"
