#!/usr/bin/env bash
# How well models of every second file of a log predict the other files, both ways, in nats a trial:
# motions learned without a simulation, the tuned base, and the model with the effects that the
# diagnosis named.
#
#   scripts/half_predicts_half.sh FOLDER [CONFIG]
#
# FOLDER holds the log's .dat or .csv files, which count in the order of their names.  GAPFARM names
# the program (default: build/release/bin/gapfarm).
set -euo pipefail

folder=${1:?usage: scripts/half_predicts_half.sh FOLDER [CONFIG]}
root=$(cd "$(dirname "$0")/.." && pwd)
config=${2:-$root/configs/srv1_forward.toml}
gapfarm=${GAPFARM:-$root/build/release/bin/gapfarm}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

first=() second=()
while IFS= read -r file; do
  if ((${#first[@]} > ${#second[@]})); then second+=("$file"); else first+=("$file"); fi
done < <(find "$folder" -maxdepth 1 \( -name '*.dat' -o -name '*.csv' \) | LC_ALL=C sort)
((${#second[@]} > 0)) || { echo "$folder: fewer than two .dat or .csv files" >&2; exit 2; }

# The figure behind a word in what 'gapfarm predict' says.
figure() { grep -o "$1 [0-9.-]*" "$2" | head -1 | grep -o '[0-9.-]*$' || echo '-'; }
nats() { grep -o '[0-9.-]* nats a trial,' "$1" | head -1 | grep -o '^[0-9.-]*'; }

row() {  # row NAME; the arrays `train` and `test`
  "$gapfarm" diagnose "$config" --trials "${train[@]}" --out "$scratch/$1" > "$scratch/log" 2>&1 ||
    { cat "$scratch/log" >&2; exit 1; }
  for model in tuned model; do
    "$gapfarm" predict "$scratch/$1/$model.toml" --trials "${test[@]}" --out "$scratch/$1-$model.csv" \
      > "$scratch/$model" 2>&1
  done
  printf '| %-16s | %15s | %12s | %10s | %9s |\n' "$1" "$(figure 'constant motion' "$scratch/model")" \
    "$(figure 'mined motion' "$scratch/model")" "$(nats "$scratch/tuned")" "$(nats "$scratch/model")"
}

echo "| half predicts    | constant motion | mined motion | tuned base | diagnosed |"
echo "|------------------|-----------------|--------------|------------|-----------|"
train=("${first[@]}") test=("${second[@]}")
row first_to_second
train=("${second[@]}") test=("${first[@]}")
row second_to_first
