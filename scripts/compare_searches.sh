#!/usr/bin/env bash
# Our searches beside pagmo's on the same functions: the tables of docs/evidence/optimisers.md.
#   scripts/compare_searches.sh --fronts    NSGA-II beside pagmo's
#   scripts/compare_searches.sh [--seeds 15] [--budget 20000] [--genes 10,20] [--function NAME] [--searches NAME,NAME] [--population N] [--asynchronous]
# Needs Debian's libpagmo-dev (scripts/setup.sh --bench).  BUILD: a configured build (build/ci).
set -euo pipefail
cd "$(dirname "$0")/.."
build=${BUILD:-build/ci}
if ! dpkg-query --show libpagmo-dev >/dev/null 2>&1; then
  echo 'compare_searches: libpagmo-dev is not installed; run scripts/setup.sh --bench' >&2
  exit 1
fi
if [[ ! -e $build/CMakeCache.txt ]]; then cmake --preset ci >/dev/null; fi
cmake -DGAPFARM_BENCH=ON "$build" >/dev/null  # finds pagmo where it was installed since
bench=bench_searches
if [[ ${1:-} == --fronts ]]; then bench=bench_fronts && shift; fi
cmake --build "$build" --target "$bench" >/dev/null
"$build/bin/$bench" "$@"
