#!/bin/sh
# Diagnoses logs in which hardly a command repeats: twenty of robots from which nothing is missing and
# twenty with one clear effect each, every robot another one.  The result is OUT/check/blind_check.md.
#
#   scripts/free_commands.sh OUT [BIN] [CONFIG] [JOBS]
set -eu
out=${1:?usage: scripts/free_commands.sh OUT [BIN] [CONFIG] [JOBS]}
bin=${2:-build/release/bin}
config=${3:-configs/srv1_free.toml}
jobs=${4:-2}
mkdir -p "$out"

# An effect a line, with values that show clearly in 150 free trials.
effects='motor_asymmetry ratio=0.05
motor_asymmetry ratio=-0.06
motor_deadband duty=0.05
battery_sag rate=0.03
timing_offset offset=0.08
timing_offset offset=-0.08
backlash travel=0.015
slip_events probability=0.15 loss=0.7
floor_tilt angle=0.12 direction=1
floor_nap strength=0.3 direction=-2
friction_patch ratio=0.3 x=1 y=1 radius=0.35
rolling_resistance coefficient=0.15
com_offset x=0.01 y=0.004
camera_aspect ratio=1.08
camera_distortion k1=0.06 x=1 y=1
camera_seam position=1 offset_x=0.04 offset_y=-0.03
heading_offset angle=0.05
marker_offset x=0.015 y=-0.01
pose_latency share=0.2 latency=0.25
pose_quantisation step=0.01'

make_log() {
  folder=$1 robot_seed=$2
  shift 2
  robot=$(awk -v seed="$robot_seed" 'BEGIN { srand(seed)
    printf "contact_length=%.4f track_gauge=%.4f friction_ratio=%.3f full_speed=%.3f friction=%.3f",
      0.07 * 1.1 ^ (2 * rand() - 1), 0.085 * 1.08 ^ (2 * rand() - 1), 1.15 ^ (2 * rand() - 1),
      0.28 * 1.12 ^ (2 * rand() - 1), 0.6 * 1.3 ^ (2 * rand() - 1) }')
  set_all=''
  for value in $robot "$@"; do set_all="$set_all --set $value"; done
  # shellcheck disable=SC2086
  "$bin/gapfarm" simulate "$config" --seed "$robot_seed" --workers 1 $set_all \
    --out "$folder/trials.csv" 2>"$out/simulate.log" || { cat "$out/simulate.log"; exit 1; }
}

# shellcheck source=scripts/labelled_cases.sh
. "$(dirname "$0")/labelled_cases.sh"
judge_labelled_cases
