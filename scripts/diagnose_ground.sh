#!/usr/bin/env bash
# Diagnoses practice cases: what of each robot's file or log is wrong?
#   scripts/diagnose_ground.sh CASES OUT [CASE...]
# CASES holds folders with robot.toml, fit/ and test/ (commands.csv and poses.csv in each).  Leaves
# OUT/CASE/diagnosis.json and prints a row of a table a case.  BIN: where the programs are
# (build/release/bin).
set -euo pipefail
cases=$1
out=$2
shift 2
bin=${BIN:-build/release/bin}
mkdir -p "$out"
if [[ $# -eq 0 ]]; then
  for folder in "$cases"/*/; do
    if [[ -e "$folder/robot.toml" ]]; then set -- "$@" "$(basename "$folder")"; fi
  done
fi
echo '| case | said | closes | s |'
echo '|---|---|---|---|'
for name in "$@"; do
  config="$out/$name.toml"
  {
    echo 'scenario = "ground"'
    echo '[robot]'
    echo "file = \"$(realpath "$cases/$name/robot.toml")\""
    echo '[runs]'
    echo "folders = [\"$(realpath "$cases/$name/fit")\", \"$(realpath "$cases/$name/test")\"]"
  } > "$config"
  rm -rf "${out:?}/$name"
  start=$SECONDS
  "$bin/gapfarm" diagnose "$config" --out "$out/$name" > "$out/$name.txt" 2> "$out/$name.log"
  python3 - "$name" "$out/$name/diagnosis.json" $((SECONDS - start)) <<'PY'
import json
import sys

name, path, seconds = sys.argv[1:]
said = json.load(open(path, encoding="utf-8"))
closed = ", ".join(f"{100 * e['closed']:.0f} %" for e in said["effects"])
print(f"| {name} | {' '.join(e['text'] for e in said['effects']) or said['headline']} | {closed} | {seconds} |")
PY
done
