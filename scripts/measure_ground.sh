#!/usr/bin/env bash
# Fits robots to their own logs and says how far off each is on the runs that were not fitted, beside
# its own kinematics and constant velocity.
#   scripts/measure_ground.sh SETS OUT [SET...]
# SETS holds folders with robot.toml, fit/ and test/ (commands.csv and poses.csv in each), such as
# scripts/ground_sets.py makes of public logs; the tables of docs/evidence/ground.md are what this prints.
# BIN: where the programs are (build/release/bin).
set -euo pipefail
sets=$1
out=$2
shift 2
bin=${BIN:-build/release/bin}
mkdir -p "$out"
if [[ $# -eq 0 ]]; then
  for folder in "$sets"/*/; do
    if [[ -e "$folder/robot.toml" ]]; then set -- "$@" "$(basename "$folder")"; fi
  done
fi

genes_of() {
  case $1 in
    ackermann) echo 'steering.offset steering.gain understeer friction throttle.gain throttle.zero
                     throttle.back_emf throttle.drag throttle.coulomb throttle.cornering' ;;
    tricycle) echo 'wheels.front.radius steering.offset steering.gain understeer wheelbase friction' ;;
    skid) echo 'wheels.left.radius wheels.right.radius wheelbase friction creep' ;;
    omni) echo 'wheels.w1.radius wheels.w2.radius wheels.w3.radius robot_radius roller_drag friction
                creep' ;;
    mecanum) echo 'wheels.front_left.radius wheels.front_right.radius wheels.rear_left.radius
                   wheels.rear_right.radius wheel_separation roller_drag friction
                   cross_load centre_of_mass.x' ;;
    *) echo 'wheels.left.radius wheels.right.radius wheel_separation friction' ;;
  esac
}

config_of() {  # SET
  local robot drive whole=
  robot=$(realpath "$sets/$1/robot.toml")
  # Whole runs too where there are enough of them to be no luck.
  if [[ $(tail -n +2 "$sets/$1/fit/poses.csv" | cut -d, -f1 | uniq | wc -l) -ge 12 ]]; then
    whole=', 0'
  fi
  drive=$(sed -n 's/^drive = "\(.*\)".*/\1/p' "$robot")
  printf 'scenario = "ground"\n[robot]\nfile = "%s"\n[runs]\nfolders = ["%s"]\n' \
         "$robot" "$(realpath "$sets/$1/fit")"
  printf 'horizons = [0.5, 2, 5%s]\n[parameters]\nstep_rate = %s\n[genes]\n' "$whole" \
         "${STEP_RATE:-120}"
  # Rollers slip and stand a little askew; motors on open duties turn from a certain duty on and give way under load.
  local slip=
  if [[ $drive == mecanum ]]; then slip='creep roller_angle'; fi
  if grep -q '^command_kind = "duties"' "$robot"; then slip='dead_band creep_speed'; fi
  for gene in $(genes_of "$drive") $slip delay lag marker.x marker.y marker.yaw drive_noise_travel \
              drive_noise_turn pose_noise_position pose_noise_heading; do
    echo "$gene = \"table\""
  done
  printf '[optimiser]\nkind = "cma_es"\nsigma = 0.1\n[evolution]\nstop = { evaluations = %s }\n' \
         "${EVALUATIONS:-60}"
}

echo '| set | s | windows | way m | gapfarm mm, mrad | kinematics mm, mrad | constant velocity mm, mrad | over kinematics mm; mrad |'
echo '|---|---|---|---|---|---|---|---|'
for name in "$@"; do
  config_of "$name" > "$out/$name.toml"
  rm -rf "${out:?}/$name"
  if ! "$bin/gapfarm" evolve "$out/$name.toml" --out "$out/$name" > "$out/$name.log" 2>&1; then
    echo "| $name | $(tail -n 1 "$out/$name.log") |"
    continue
  fi
  "$bin/gapfarm" horizons "$out/$name" --trials "$sets/$name/test" --force \
    --out "$out/$name.csv" > "$out/$name.txt" 2>> "$out/$name.log"
  awk -v name="$name" '
    /^ *([0-9.]+|whole) / {
      gsub(/\|/, " ")
      print "| " name " | " $1 " | " $2 " | " $3 " | " $4 ", " $5 " | " $8 ", " $9 " | " $12 ", " $13 \
            " | " $17 " " $18 " " $19 "; " $20 " " $21 " " $22 " |"
    }' "$out/$name.txt"
done
