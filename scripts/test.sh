#!/usr/bin/env bash
# Builds and runs all tests.
#   scripts/test.sh [--sanitizers]
# --sanitizers: also the unit and integration tests under AddressSanitizer with UBSan, and what has
# threads under ThreadSanitizer.  With CI in the environment the sanitizers run as far as a budget
# of time allows, and the summary says what was left out.
set -euo pipefail
cd "$(dirname "$0")/.."

budget_s=0  # for starting another preset; 0: none is started
if [[ -n "${CI:-}" ]]; then budget_s=660; fi
if [[ "${1:-}" == --sanitizers ]]; then budget_s=1000000; fi
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
  "${runner[@]}" ctest --preset "$preset" --parallel "$jobs" --output-on-failure "$@" \
    | tee "build/$preset/ctest.log"
}

# ctest's summary in build/PRESET/ctest.log.
summary() { sed -n '/tests passed/,$p' "build/$1/ctest.log"; }

notes=()
# sanitize PRESET TARGETS [ctest options]: as check, while the budget lasts.
sanitize() {
  if ((SECONDS > budget_s)); then
    ((budget_s == 0)) || notes+=("$1: left out after $SECONDS s; run scripts/test.sh --sanitizers")
    return 0
  fi
  check "$@"
  notes+=("$1: $(summary "$1" | head -1)")
}

export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
export TSAN_OPTIONS=halt_on_error=1:suppressions=$PWD/tests/tsan.supp

check ci all
# The farm's threads and sockets; the rest of the program has one thread.
sanitize tsan "test_farm test_farm_processes gapfarm-fake-worker" \
  --tests-regex '^(Envelope|FaultSchedules|Farm|PrivateFolder|ProcessPool|Scheduler|Session|Stop)'
sanitize asan "all" --label-regex '^(unit|integration)$'
echo "== Summary after $SECONDS s"
for note in "${notes[@]}"; do echo "$note"; done
summary ci
