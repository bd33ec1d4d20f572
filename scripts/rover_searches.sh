#!/bin/sh
# How many evaluations of the rover's shipped log each search needs, 13 genes: the medians over seeds
# in OUT/compared (gapfarm compare), and from convergence.csv the evaluations until each search's
# median is within 1 % of the best value that any of them found.
#
#   scripts/rover_searches.sh OUT [BIN] [SEEDS [EVALUATIONS [SEARCH]]]
#
# SEARCH: genetic, auto or local alone.
set -eu
out=${1:?usage: scripts/rover_searches.sh OUT [BIN] [SEEDS]}
here=$(cd "$(dirname "$0")/.." && pwd)
bin=$(cd "${2:-$here/build/release/bin}" && pwd)
seeds=${3:-3}
evaluations=${4:-200}
mkdir -p "$out"
cd "$out"
rover=$here/configs/rover
"$bin/gapfarm" import runs "$rover/monday_cmd_vel.csv" "$rover/monday_tracker.csv" --out monday
"$bin/gapfarm" robot "$rover/rover.urdf" --controllers "$rover/control.yaml" --out robot.toml \
  --config rover.toml --runs monday
# Each search at its defaults.
awk '/^\[/ { omitted = $0 == "[optimiser]" } !omitted' rover.toml >searched.toml
cat >compare.toml <<END
[compare]
config = "searched.toml"
seeds = $seeds
evaluations = $evaluations
END
for search in ${5:-genetic auto local}; do
  printf '[variants.%s]\noptimiser.kind = "%s"\n' "$search" "$search" >>compare.toml
  if [ "$search" = local ]; then echo 'optimiser.local = "bobyqa"' >>compare.toml; fi
done
"$bin/gapfarm" compare compare.toml --out compared
awk -F, -v most="$evaluations" 'FNR == 1 { next }
  FILENAME ~ /runs/ { if (best == "" || $4 > best) best = $4; next }
  !($1 in at) { at[$1] = "more than " most }
  at[$1] ~ /more/ && $3 >= best - 0.01 * (best < 0 ? -best : best) { at[$1] = $2 }
  END { for (search in at) print search ": " at[search] }' compared/runs.csv compared/convergence.csv
