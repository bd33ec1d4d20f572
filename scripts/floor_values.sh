#!/usr/bin/env bash
# What each log says of a robot's own values, with 90 % intervals, in the words of its controller.
#   scripts/floor_values.sh SETS OUT [SET...]
# SETS holds folders with robot.toml and fit/, such as scripts/ground_sets.py makes of public logs; the
# table of docs/evidence/ground.md is what this prints.  BIN: where the programs are (build/release/bin).
set -euo pipefail
sets=$1
out=$2
shift 2
bin=${BIN:-build/release/bin}
mkdir -p "$out"
if [[ $# -eq 0 ]]; then set -- drive_asphalt drive_gravel drive_sand; fi
echo '| log | value | the file has | the log says |'
echo '|---|---|---|---|'
for name in "$@"; do
  config=$out/$name.toml
  # Intervals are of the kinematics that the export fits; the run is only asked for its log.
  {
    echo 'scenario = "ground"'
    echo '[robot]'
    echo "file = \"$(realpath "$sets/$name/robot.toml")\""
    echo '[runs]'
    echo "folders = [\"$(realpath "$sets/$name/fit")\"]"
    echo '[parameters]'
    echo 'step_rate = 60'
    echo '[genes]'
    echo 'friction = "table"'
    echo '[evolution]'
    echo 'population = 4'
    echo 'seed_nominal = false'
    echo 'stop = { generations = 1 }'
  } > "$config"
  rm -rf "${out:?}/$name"
  "$bin/gapfarm" evolve "$config" --out "$out/$name" > "$out/$name.log" 2>&1
  "$bin/gapfarm" export ros "$out/$name" --json > "$out/$name.json" 2>> "$out/$name.log"
  python3 - "$name" "$out/$name.json" <<'PY'
import json
import sys

name, path = sys.argv[1:]
rows = json.load(open(path, encoding="utf-8"))
for row in rows["values"]:
    says = f"{row['says']:.4g} [{row['lo']:.4g}, {row['hi']:.4g}]" if row["known"] else "-"
    print(f"| {name} | `{row['key']}` | {row['had']:.4g} | {says} |")
PY
done
