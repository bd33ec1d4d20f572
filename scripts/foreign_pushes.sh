#!/bin/sh
# Diagnoses push logs by a simulator that shares nothing with gapfarm's (tests/planar_push): twenty-two
# with one effect each and twenty from which nothing is missing, 95 pushes of four pieces each, every
# log with frictions and pressures of its own.  The result is OUT/check/blind_check.md.
#
#   scripts/foreign_pushes.sh OUT [BIN] [CONFIG] [JOBS]
set -eu
out=${1:?usage: scripts/foreign_pushes.sh OUT [BIN] [CONFIG] [JOBS]}
here=$(dirname "$0")/..
bin=${2:-$here/build/release/bin}
config=${3:-$here/configs/push.toml}
jobs=${4:-2}
mkdir -p "$out"
c++ -std=c++20 -O2 "$here/tests/planar_push/make_log.cc" -o "$out/make_log"

# An effect a line, with values that show clearly in 95 pushes.
effects='friction_anisotropy ratio=1.8 direction=0.4
friction_anisotropy ratio=0.6 direction=1.3
friction_speed slope=12
friction_speed slope=-4
friction_patch ratio=0.35 x=0.5 y=0.45 radius=0.12
friction_patch ratio=2.2 x=0.4 y=0.6 radius=0.15
table_tilt angle=0.08 direction=0.7
table_tilt angle=0.05 direction=-2
com_offset x=0.006 y=-0.004
com_offset x=-0.005 y=0.006
pressure_distribution stretch=0.5 direction=0.5
pressure_distribution stretch=-0.5 direction=0.2
finger_compliance compliance=0.004
placement_bias x=0.005 y=-0.003 angle=0.02
placement_bias x=0 y=0.004 angle=-0.05
camera_aspect ratio=1.06
camera_aspect ratio=0.95
camera_distortion k1=0.15 x=0.5 y=0.5
camera_distortion k1=-0.12 x=0.3 y=0.4
marker_offset x=0.005 y=-0.004
frame_offset x=0.003 y=-0.002
pose_scale ratio=1.06'

make_log() { "$out/make_log" "$@"; }

# shellcheck source=scripts/labelled_cases.sh
. "$here/scripts/labelled_cases.sh"
judge_labelled_cases
