#!/usr/bin/env bash
# Diagnoses MuJoCo's ground robots on slopes and on level floors (tests/mujoco/ground_robot.cc):
#   scripts/ground_slopes.sh OUT BIN
# Prints a row of a table a log: what was so, and the way down and verdict that were answered.
set -euo pipefail
out=$1
bin=$2
mkdir -p "$out"
echo '| robot | motors, N m s/rad | slope, rad | truth, degrees | answered, degrees | in | verdict |'
echo '|---|---|---|---|---|---|---|'
seed=100
for kind in differential skid; do
  for stiffness in 0.2 1; do
    for tilt in 0 0.02 0.04 0.1; do
      seed=$((seed + 1))
      case=$out/${kind}_${stiffness}_$tilt
      rm -rf "$case"
      "$bin/mujoco_ground_robot" "$kind" "$tilt" "$stiffness" "$seed" "$case"
      "$bin/gapfarm" diagnose "$case/config.toml" --out "$case/out" > "$case/out.txt" 2> "$case/log.txt"
      python3 - "$case" "$kind" "$stiffness" "$tilt" <<'PY'
import json
import math
import re
import sys

case, kind, stiffness, tilt = sys.argv[1:]
truth = math.degrees(float(re.search(r"downhill (\S+)", open(f"{case}/truth.txt").read())[1]))
said = json.load(open(f"{case}/out/diagnosis.json"))
way = [e["parameters"]["direction"] for e in said["effects"] if e["name"] == "floor_tilt"]
text, holds = "not named", ""
if way:
    value, lo, hi = (math.degrees(way[0][k]) for k in ("value", "lo", "hi"))
    text = f"{value:.0f} [{lo:.0f}, {hi:.0f}]"
    holds = "yes" if lo <= value + math.remainder(truth - value, 360) <= hi else "no"
print(f"| {kind} | {stiffness} | {tilt} | {truth:.0f} | {text} | {holds} | {said['verdict']} |")
PY
    done
  done
done
