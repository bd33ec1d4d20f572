#!/usr/bin/env bash
# Builds both programs from nothing, without ccache, and prints where the CPU time went, by library
# and by the twenty dearest files, as it stands in CONTRIBUTING.md.
#   scripts/build_times.sh [--target NAME]... [CMAKE OPTION...]
# --target: these alone and what they need, e.g. gapfarm_base; -DGAPFARM_JOIN=OFF: file by file.
set -euo pipefail

# As the compiler's launcher (below): runs one command and notes its CPU seconds.
if [[ "${1:-}" == --note ]]; then
  log=$2
  shift 2
  object=other
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
targets=()
while [[ "${1:-}" == --target ]]; do
  targets+=("$2")
  shift 2
done
((${#targets[@]})) || targets=(gapfarm gapfarm-worker)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
log=$folder/times
: >"$log"
cmake --preset release -B "$folder/build" -DGAPFARM_TESTS=OFF -DGAPFARM_CCACHE=OFF \
  "-DCMAKE_CXX_COMPILER_LAUNCHER=$PWD/scripts/build_times.sh;--note;$log" "$@" >/dev/null
start=$SECONDS
cmake --build "$folder/build" --target "${targets[@]}" -- --quiet
wall=$((SECONDS - start))

# "master/cli/CMakeFiles/gapfarm_cli.dir/Unity/unity_0_cxx.cxx.o": library and file.
awk -v wall="$wall" -v cores="$(nproc)" '
  NF >= 3 {
    cpu = $1 + $2
    total += cpu
    library = object = $3
    sub(/.*CMakeFiles\//, "", library)
    sub(/\.dir\/.*/, "", library)
    sub(/CMakeFiles\/[^\/]*\.dir\//, "", object)
    sub(/Unity\/unity_/, "part ", object)
    sub(/(_cxx\.cxx)?\.(o|gch)$/, "", object)
    by[library] += cpu
    count[library]++
    dear[library ": " object] = cpu
  }
  END {
    printf "    %.0f CPU s in %d compilations, %d s on %d cores\n\n", total, NR, wall, cores
    print "    CPU s  compilations  library"
    fflush()
    for (l in by) printf "    %5.1f  %12d  %s\n", by[l], count[l], l | "sort -rn"
    close("sort -rn")
    print "\n    CPU s  the twenty dearest"
    fflush()
    for (o in dear) printf "    %5.1f  %s\n", dear[o], o | "sort -rn | head -20"
    close("sort -rn | head -20")
  }' "$log"
