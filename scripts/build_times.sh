#!/usr/bin/env bash
# Builds both programs from nothing, without ccache, and prints where the CPU time went: by folder,
# and the twenty dearest objects.
#   scripts/build_times.sh [CMAKE OPTION...]     e.g. -DGAPFARM_JOIN=OFF
set -euo pipefail

# As the compiler's launcher (below): runs one command and notes its CPU seconds.
if [[ "${1:-}" == --note ]]; then
  log=$2
  shift 2
  object=link
  for ((i = 1; i < $#; ++i)); do
    if [[ "${!i}" == -o ]]; then
      next=$((i + 1))
      object=${!next}
    fi
  done
  TIMEFORMAT="%U %S $object"
  # A line is short enough to be appended in one piece.
  { time "$@" 2>&3; } 3>&2 2>>"$log"
  exit
fi

cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
log=$folder/times
: >"$log"
cmake --preset release -B "$folder/build" -DGAPFARM_TESTS=OFF -DGAPFARM_CCACHE=OFF \
  "-DCMAKE_CXX_COMPILER_LAUNCHER=$PWD/scripts/build_times.sh;--note;$log" "$@" >/dev/null
start=$SECONDS
cmake --build "$folder/build" --target gapfarm gapfarm-worker -- --quiet
wall=$((SECONDS - start))

awk -v wall="$wall" '
  NF >= 3 {
    cpu = $1 + $2
    total += cpu
    object = $3
    sub(/CMakeFiles\/[^\/]*\.dir\//, "", object)
    folder = object
    sub(/\/[^\/]*$/, "", folder)
    sub(/\/Unity$/, "", folder)
    by[folder] += cpu
    count[folder]++
    dear[object] = cpu
  }
  END {
    printf "%.0f CPU s in %d objects, %d s\n\n", total, NR, wall
    for (f in by) printf "%7.1f  %3d  %s\n", by[f], count[f], f | "sort -rn"
    close("sort -rn")
    print "\nthe dearest:"
    for (o in dear) printf "%7.1f  %s\n", dear[o], o | "sort -rn | head -20"
  }' "$log"
