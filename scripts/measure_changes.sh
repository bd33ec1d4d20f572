#!/usr/bin/env bash
# Asks what changed from one floor to another, and from one half of a log to the other.
#   scripts/measure_changes.sh DATA OUT [PAIR...]
# DATA holds dart/ (logs of the DART car), drive/ (a Warthog's), and the robot files of both in
# wrong_robot/case01 and case11.  The table of docs/evidence/ground_diagnosis.md is what it prints.  BIN: where the
# programs are (build/release/bin).
set -euo pipefail
data=$(realpath "$1")
mkdir -p "$2"
out=$(realpath "$2")
shift 2
bin=${BIN:-build/release/bin}
here=$(dirname "$(realpath "$0")")
car=$data/wrong_robot/case01/robot.toml
if [[ $# -eq 0 ]]; then
  set -- rubber_halves rubber_runs rubber_tiles rubber_slippery rubber_no_tape slippery_halves \
         asphalt_halves asphalt_gravel asphalt_sand
fi

# A step is a run; a pose counts where it is new.  Even and odd steps of asphalt are its halves.
warthog() {  # FOLDER NAME
  local file=$data/drive/$2.csv rest='' name=$2
  case $name in
    asphalt*) file=$data/drive/asphalt_a.csv ;;
    sand) file=$data/drive/sand_a.csv ;;
  esac
  case $name in *_even) rest=0 ;; *_odd) rest=1 ;; esac
  mkdir -p "$1"
  awk -F, -v to="$1" -v rest="$rest" '
    BEGIN { print "run,t,left,right" > to "/commands.csv"; print "run,t,x,y,theta" > to "/poses.csv" }
    NR == 1 || (rest != "" && $1 % 2 != rest) { next }
    { t = $2 + 16 * $1; commanded = $1 "," $3 "," $4 }
    commanded != before { printf "%d,%.3f,%s,%s\n", $1, t, $3, $4 > to "/commands.csv"; before = commanded }
    $11 == 1 { printf "%d,%.3f,%s,%s,%s\n", $1, t, $7, $8, $9 > to "/poses.csv" }' "$file"
}

runs_of() (  # NAME: makes its folder
  local to=$out/runs/$1 name=$1 half=()
  [[ -e $to/poses.csv ]] && exit
  cd "$data/dart"
  case $name in
    *_first) half=(--half first) name=${name%_first} ;;
    *_second) half=(--half second) name=${name%_second} ;;
  esac
  case $name in
    asphalt*|gravel|sand) warthog "$to" "$name" && exit ;;
    rubber) set -- rubbery_floor/*09_04_2024_12_34* rubbery_floor/*16_05* rubbery_floor/*16_09* \
                   rubbery_floor/*16_47* ;;
    rubber_a) set -- rubbery_floor/*09_04_2024_12_34* rubbery_floor/*16_05* ;;
    rubber_b) set -- rubbery_floor/*16_47* rubbery_floor/*16_09* rubbery_floor/*12_37* ;;
    tiles) set -- tape_and_tiles/*18_05* ;;
    slippery) set -- slippery_floor/*.csv ;;
    no_tape) set -- slippery_floor_no_tape/*.csv ;;
  esac
  "$here/dart_runs.py" "$to" "$@" "${half[@]}"
)

ask() {  # PAIR ROBOT BEFORE AFTER
  {
    echo 'scenario = "ground"'
    echo '[robot]'
    echo "file = \"$2\""
    echo '[runs]'
    echo "folders = [\"$4\"]"
  } > "$out/$1.toml"
  rm -rf "${out:?}/$1"
  local start=$SECONDS
  "$bin/gapfarm" diagnose "$out/$1.toml" --reference "$3" --out "$out/$1" \
    > "$out/$1.txt" 2> "$out/$1.log"
  python3 - "$1" "$out/$1/diagnosis.json" $((SECONDS - start)) <<'PY'
import json
import sys

name, path, seconds = sys.argv[1:]
said = json.load(open(path, encoding="utf-8"))
words = " ".join(e["text"] for e in said["effects"]) or said["headline"]
print(f"| {name} | {words} | {said['verdict']} | {seconds} |")
PY
}

echo '| pair | what changed | verdict | s |'
echo '|---|---|---|---|'
for pair in "$@"; do
  before=$out/runs/rubber after='' robot=$car
  case $pair in
    rubber_halves) before=$out/runs/rubber_first after=$out/runs/rubber_second ;;
    rubber_runs) before=$out/runs/rubber_a after=$out/runs/rubber_b ;;
    rubber_tiles) after=$out/runs/tiles ;;
    rubber_slippery) after=$out/runs/slippery ;;
    rubber_no_tape) after=$out/runs/no_tape ;;
    slippery_halves) before=$out/runs/slippery_first after=$out/runs/slippery_second ;;
    asphalt_*)
      robot=$data/wrong_robot/case11/robot.toml before=$out/runs/asphalt
      after=$out/runs/${pair#asphalt_} ;;
  esac
  if [[ $pair == asphalt_halves ]]; then
    before=$out/runs/asphalt_even after=$out/runs/asphalt_odd
  fi
  runs_of "$(basename "$before")"
  runs_of "$(basename "$after")"
  ask "$pair" "$robot" "$before" "$after"
done
