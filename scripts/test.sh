#!/usr/bin/env bash
# Builds and runs all tests.
#   scripts/test.sh [--sanitizers]
# --sanitizers: also the unit and integration tests under AddressSanitizer with UBSan, and what has
# threads under ThreadSanitizer (about as long again, twice); the benchmarks are built, and both
# programs linked with the types of all their files held against one another (-Wodr).
set -euo pipefail
cd "$(dirname "$0")/.."

sanitizers=
if [[ "${1:-}" == --sanitizers ]]; then sanitizers=yes; fi
jobs=$(nproc)
# ThreadSanitizer cannot start where the kernel spreads addresses too widely; a fixed layout can.
runner=(env)
if setarch -R true 2>/dev/null; then runner=(setarch -R); fi

scripts/setup.sh --tests

# check PRESET TARGETS [ctest options]: configures, builds, tests; ctest's words stay in
# build/PRESET.  TARGETS: space-separated, or "all".
check() {
  local preset=$1 targets=$2
  shift 2
  echo "== $preset: build"
  cmake --preset "$preset" >/dev/null
  # shellcheck disable=SC2086
  cmake --build --preset "$preset" --target $targets -- --quiet
  echo "== $preset: test ($SECONDS s so far)"
  # One more than there are cores: tests of launching wait for clusters for most of their time.
  "${runner[@]}" ctest --preset "$preset" --parallel $((jobs + 1)) --output-on-failure "$@" \
    | tee "build/$preset/ctest.log"
}

# ctest's summary in build/PRESET/ctest.log.
summary() { sed -n '/tests passed/,$p' "build/$1/ctest.log"; }

export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
export TSAN_OPTIONS=halt_on_error=1:suppressions=$PWD/tests/tsan.supp

check ci all
if [[ -n "$sanitizers" ]]; then
  echo "== odr: build ($SECONDS s so far)"
  cmake --build --preset ci --target benchmarks -- --quiet  # which no test runs
  cmake --preset odr >/dev/null
  cmake --build --preset odr -- --quiet
  export GAPFARM_FARM_SCHEDULES=1000  # ten times as many went by above
  # The farm's threads and sockets; the rest of the program has one thread.
  check tsan "test_farm test_farm_processes gapfarm-fake-worker" --tests-regex \
    '^(Envelope|FaultSchedules|Farm|Keys|LinkSecurity|PrivateFolder|ProcessPool|Scheduler|Session|Stop)'
  check asan all --label-regex '^(unit|integration)$'
  for preset in asan tsan; do echo "$preset: $(summary "$preset" | head -1)"; done
fi
echo "== Summary after $SECONDS s"
summary ci
