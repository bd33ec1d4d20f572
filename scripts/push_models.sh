#!/bin/sh
# How far the three models of a pushed piece end from where it ended, tuned on a part of a log and
# judged on another (docs/evidence/pushing.md): tangram pieces, and a real triangle of Carnegie Mellon's.
#
#   scripts/push_models.sh TANGRAM/pushes.csv CMU/pushes.csv [further options of gapfarm crossfit]
set -eu
here=$(dirname "$0")/..
gapfarm=${GAPFARM:-$here/build/release/bin/gapfarm}
tangram=$1
cmu=$2
shift 2

# fit_models MODEL TANGRAM_EVALUATIONS TANGRAM_GENES TRIANGLE_GENES [options]
fit_models() {
  model=$1 evaluations=$2 genes=$3 triangle_genes=$4
  shift 4
  echo "== $model on tangram pieces"
  # shellcheck disable=SC2086
  "$gapfarm" crossfit "$here/configs/push.toml" --trials "$tangram" --repeats object start \
    --train start=0.11,0.15,0.21 --test start=0.13,0.18 --set "model=$model" --genes $genes \
    --evaluations "$evaluations" "$@"
  echo "== $model on a triangle's whole face, on wood, and on three feet"
  # shellcheck disable=SC2086
  "$gapfarm" crossfit "$here/configs/push_triangle.toml" --trials "$cmu" \
    --train session=patch trial=1,3,5,7,9,11,13,15,17,19,21,23,25 \
    --test "session=patch trial=2,4,6,8,10,12,14,16,18,20,22,24" \
    --test session=wood_patch --test session=30_90_30_30_30_90 --set "model=$model" \
    --genes $triangle_genes finger_friction=0.02,1 "$@"
}

# A support plate is each piece's own; a pressure is one for all.
plates="shape_factor_1=0.2,1 shape_factor_2=0.2,1 shape_factor_3=0.2,1 shape_factor_4=0.2,1"
fit_models bullet 1500 "$plates ground_friction=0.1,1 finger_friction=0.02,1" \
  shape_factor=0.2,1 "$@"
fit_models limit_surface 300 "$plates finger_friction=0.02,1" shape_factor=0.2,1 "$@"
fit_models distributed 60 "pressure=0.2,8 ground_friction=0.1,1 finger_friction=0.02,1" \
  pressure=0.2,8 "$@"
