#!/bin/sh
# The tables of Weitnauer, Haschke and Ritter (2010) on a push log of tangram pieces: per-shape and
# shared friction, extrapolation, and single parameters varied alone (docs/evidence/pushing.md).
#
#   scripts/tangram_tables.sh pushes.csv [further options of gapfarm crossfit]
set -eu
here=$(dirname "$0")/..
gapfarm=${GAPFARM:-$here/build/release/bin/gapfarm}
log=$1
shift
fit() {
  "$gapfarm" crossfit "$here/configs/push.toml" --trials "$log" --repeats object start \
    --set model=bullet "$@"
}
# The source's three parameters.
own="shape_factor=0.2,1 ground_friction=0.1,1 finger_friction=0.02,1"

echo "== each shape tuned on its own"
# shellcheck disable=SC2086
fit --by object --train start=0.11,0.15,0.21 --test start=0.13,0.18 --genes $own \
  --sweep shape_factor ground_friction finger_friction "$@"
echo
echo "== frictions shared, a shape factor each"
fit --per object --train start=0.11,0.15,0.21 --test start=0.13,0.18 \
  --genes shape_factor_1=0.2,1 shape_factor_2=0.2,1 shape_factor_3=0.2,1 shape_factor_4=0.2,1 \
  ground_friction=0.1,1 finger_friction=0.02,1 --evaluations 1500 "$@"
echo
echo "== the large triangle beyond the starts that it was tuned on"
# shellcheck disable=SC2086
fit --only object=triangle_l --train start=0.11,0.13,0.15 --test start=0.18,0.21 --genes $own "$@"
