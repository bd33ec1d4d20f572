#!/usr/bin/env bash
# Fits the robots of practice cases to their own logs and says how far off each is on the runs that
# were not fitted, beside its own kinematics and constant velocity.
#   scripts/measure_ground.sh CASES OUT [CASE...]
# CASES holds folders with robot.toml, fit/ and test/ (commands.csv and poses.csv in each); the
# tables of docs/ground.md are what it prints.  BIN: where the programs are (build/release/bin).
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

genes_of() {
  case $1 in
    ackermann) echo 'steering.offset steering.gain understeer lag delay throttle.gain throttle.drag
                     marker.x marker.y friction' ;;
    skid) echo 'wheels.left.radius wheels.right.radius wheelbase friction creep delay lag
                marker.x marker.y' ;;
    *) echo 'wheels.left.radius wheels.right.radius wheel_separation lag delay marker.x marker.y
             marker.yaw' ;;
  esac
}

for name in "$@"; do
  robot=$(realpath "$cases/$name/robot.toml")
  drive=$(sed -n 's/^drive = "\(.*\)".*/\1/p' "$robot")
  config="$out/$name.toml"
  {
    echo 'scenario = "ground"'
    echo '[robot]'
    echo "file = \"$robot\""
    echo '[runs]'
    echo "folders = [\"$(realpath "$cases/$name/fit")\"]"
    echo '[parameters]'
    echo "step_rate = ${STEP_RATE:-120}"
    echo '[genes]'
    for gene in $(genes_of "$drive") drive_noise_travel drive_noise_turn pose_noise_position \
                pose_noise_heading; do
      echo "$gene = \"table\""
    done
    echo '[optimiser]'
    echo 'kind = "cma_es"'
    echo 'sigma = 0.1'
    echo '[evolution]'
    echo "stop = { evaluations = ${EVALUATIONS:-600} }"
  } > "$config"
  rm -rf "${out:?}/$name"
  start=$SECONDS
  "$bin/gapfarm" evolve "$config" --out "$out/$name" 2> "$out/$name.log"
  echo "== $name: $drive, fitted in $((SECONDS - start)) s; runs that were not fitted:"
  "$bin/gapfarm" horizons "$out/$name" --trials "$cases/$name/test" 2>> "$out/$name.log"
done
