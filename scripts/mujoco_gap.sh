#!/usr/bin/env bash
# A known effect in a log of one simulator, looked for with another one as the base: drives by MuJoCo's
# two-wheeler diagnosed by Bullet's tracked robot, and the other way round.  Each effect is put in ever
# larger until it is named.  One line a log: what was put in, what was named and how large.
#
#   scripts/mujoco_gap.sh [TRIALS]       a session, of two (default 100)
#
# GAPFARM names the program (default: build/release/bin/gapfarm); the bridge is compiled here and needs
# libmujoco-dev.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
gapfarm=${GAPFARM:-$root/build/release/bin/gapfarm}
trials=${1:-100}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

bridge=$root/scripts/bridges/mujoco
c++ -std=c++20 -O2 "$bridge/bridge.cc" -lmujoco -o "$scratch/bridge"

drives='drive_noise_common = 0.012
drive_noise_side = 0.01
pose_noise_position = 0.0015
pose_noise_heading = 0.008
[simulate]
sessions = 2
levels = [0.5, 1.0]
durations = [0.5, 1.0]'
cat >"$scratch/MuJoCo.toml" <<END
scenario = "external"
[external]
program = ["$scratch/bridge", "$bridge/two_wheeler.xml"]
[genes]
full_speed = [0.1, 0.6]
track = [0.05, 0.3]
[parameters]
$drives
END
cat >"$scratch/Bullet.toml" <<END
scenario = "srv1"
[parameters]
step_rate = 120
tread_creep = 0.05
$drives
END

# row DRIVEN DIAGNOSED EFFECT=VALUE
row() {
  local set=()
  [[ $3 == none ]] || set=(--set "$3")
  "$gapfarm" simulate "$scratch/$1.toml" --out "$scratch/log.csv" --trials "$trials" --seed 3 \
    --force "${set[@]}" >"$scratch/said" 2>&1 || { cat "$scratch/said" >&2; exit 1; }
  rm -rf "$scratch/d"
  "$gapfarm" diagnose "$scratch/$2.toml" --trials "$scratch/log.csv" --out "$scratch/d" \
    >"$scratch/said" 2>&1 || { cat "$scratch/said" >&2; exit 1; }
  python3 - "$scratch/d/diagnosis.json" "$@" <<'END'
import json, sys
d = json.load(open(sys.argv[1]))
named = []
for e in d["effects"]:
    values = [f"{k} {v['value']:.3g} [{v['lo']:.3g}, {v['hi']:.3g}]" for k, v in e["parameters"].items()]
    named.append(e["name"] + " " + ", ".join(values))
text = "; ".join(named) or d["verdict"]
print(f"| {sys.argv[2]} | {sys.argv[3]} | {sys.argv[4]} | {text} | "
      f"{d['gap']['tuned']:.2f} | {d['gap']['final']:.2f} |", flush=True)
sys.exit(0 if any(e["name"] == sys.argv[4].split(".")[0] for e in d["effects"]) else 10)
END
}

# ladder DRIVEN DIAGNOSED EFFECT VALUE...: until it is named.
ladder() {
  local driven=$1 diagnosed=$2 effect=$3 value code
  shift 3
  for value in "$@"; do
    code=0
    row "$driven" "$diagnosed" "$effect=$value" || code=$?
    case $code in
      0) return ;;
      10) ;;
      *) exit "$code" ;;
    esac
  done
}

echo '| driven by | diagnosed by | put in | named, with 90 % intervals | gap tuned, nats | with it |'
echo '|---|---|---|---|---|---|'
for ways in 'MuJoCo Bullet' 'Bullet MuJoCo'; do
  read -r driven diagnosed <<<"$ways"
  row "$driven" "$diagnosed" none || [[ $? -eq 10 ]]
  ladder "$driven" "$diagnosed" motor_asymmetry.ratio 0.02 0.05 0.07 0.1 0.15
  ladder "$driven" "$diagnosed" heading_offset.angle 0.02 0.05 0.1 0.2
  ladder "$driven" "$diagnosed" camera_aspect.ratio 1.02 1.06 1.12 1.2
done
