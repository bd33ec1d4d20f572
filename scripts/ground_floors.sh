#!/usr/bin/env bash
# Diagnoses ground robots of other simulators on level floors, slopes, over edges and over patches
# (tests/mujoco/ground_robot.cc, tests/planar/ground_robot.cc):
#   scripts/ground_floors.sh OUT BIN
# Prints a row of a table a log: what was so, what was answered, and whether its intervals hold it.
set -euo pipefail
out=$1
bin=$2
mkdir -p "$out"
echo '| robot | motors, N m s/rad | floor | truth | answered | in | beside it | verdict |'
echo '|---|---|---|---|---|---|---|---|'
seed=100
for kind in differential skid tricycle omni mecanum car; do
  case $kind in
    differential | skid | tricycle) engine=mujoco ;;
    *) engine=planar ;;
  esac
  for stiffness in 0.2 1; do
    if [[ $kind == car && $stiffness == 1 ]]; then continue; fi # a throttle holds no speed
    for floor in 'tilt 0' 'tilt 0.02' 'tilt 0.04' 'tilt 0.1' 'edge 0.003' 'edge 0.008' 'patch 0.003' 'patch 0.008'; do
      read -r what size <<< "$floor"
      seed=$((seed + 1))
      case=$out/${kind}_${stiffness}_${what}_$size
      rm -rf "$case"
      "$bin/${engine}_ground_robot" "$kind" "$what" "$size" "$stiffness" "$seed" "$case"
      "$bin/gapfarm" diagnose "$case/config.toml" --out "$case/out" > "$case/out.txt" 2> "$case/log.txt"
      python3 - "$case" "$kind" "$stiffness" "$what" "$size" <<'PY'
import json
import math
import sys

case, kind, stiffness, what, size = sys.argv[1:]
truth = {k: float(v) for k, v in (line.split() for line in open(f"{case}/truth.txt"))}
said = json.load(open(f"{case}/out/diagnosis.json"))
name = {"tilt": "floor_tilt", "edge": "floor_edge", "patch": "friction_patch"}[what]
named = {e["name"]: e["parameters"] for e in said["effects"]}
way = math.degrees(truth["direction"])


def degrees(p):
    """A direction beside the truth's, with its interval, and whether that holds it."""
    v, lo, hi = (math.degrees(p[k]) for k in ("value", "lo", "hi"))
    return f"{v:.0f} [{lo:.0f}, {hi:.0f}] degrees", lo <= v + math.remainder(way - v, 360) <= hi


def metres(key, p, so):
    return f"{key} {p['value']:.2f} [{p['lo']:.2f}, {p['hi']:.2f}] m", p["lo"] <= so <= p["hi"]


p = named.get(name, {})
answers = []
if what == "tilt":
    floor, so = f"tilt {size} rad", f"{way:.0f} degrees"
    if p:
        answers = [degrees(p["direction"])]
        if "angle" in p:
            a = p["angle"]
            answers.append((f"{a['value']:.3f} [{a['lo']:.3f}, {a['hi']:.3f}] rad",
                            a["lo"] <= float(size) <= a["hi"]))
elif what == "edge":
    floor = f"edge, {size} m"
    # The line that was answered, across the truth's.
    across = lambda x, y: x * math.cos(truth["direction"]) + y * math.sin(truth["direction"])
    at = across(truth["x"], truth["y"])
    so = f"{way:.0f} degrees, {at:.2f} m"
    if p:
        found = across(p["x"]["value"], p["y"]["value"])
        half = sum(abs(p[k]["hi"] - p[k]["lo"]) / 2 * abs(f(truth["direction"]))
                   for k, f in (("x", math.cos), ("y", math.sin)))
        answers = [degrees(p["angle"]),
                   metres("at", {"value": found, "lo": found - half, "hi": found + half}, at)]
else:
    floor = f"patch, {size} m"
    so = ", ".join(f"{k} {truth[k]:.2f}" for k in ("x", "y", "radius")) + " m"
    if p:
        answers = [metres(k, p[k], truth[k]) for k in ("x", "y", "radius")]
if size == "0":
    floor, so = "level", "-"
text = ", ".join(a for a, _ in answers) if answers else "not named"
holds = f"{sum(h for _, h in answers)} of {len(answers)}" if answers else ""
rest = ", ".join(n for n in named if n != name) or "-"
print(f"| {kind} | {stiffness} | {floor} | {so} | {text} | {holds} | {rest} | {said['verdict']} |")
PY
    done
  done
done
