#!/usr/bin/env bash
# Builds and runs all tests.
#   scripts/test.sh [--sanitizers]
# --sanitizers, or CI in the environment: also the unit and integration tests under
# AddressSanitizer with UBSan and under ThreadSanitizer.
set -euo pipefail
cd "$(dirname "$0")/.."

sanitizers=${CI:-}
if [[ "${1:-}" == --sanitizers ]]; then sanitizers=yes; fi
jobs=$(nproc)
# ThreadSanitizer cannot start where the kernel spreads addresses too widely; a fixed layout can.
runner=(env)
if setarch -R true 2>/dev/null; then runner=(setarch -R); fi

scripts/setup.sh --tests

# check PRESET [ctest options]: configures, builds, tests; ctest's words stay in build/PRESET.
check() {
  local preset=$1
  shift
  echo "== $preset: build"
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" -- --quiet
  echo "== $preset: test"
  "${runner[@]}" ctest --preset "$preset" --parallel "$jobs" --output-on-failure "$@" \
    | tee "build/$preset/ctest.log"
}

# ctest's summary in build/PRESET/ctest.log.
summary() { sed -n '/tests passed/,$p' "build/$1/ctest.log"; }

check ci
if [[ -n "$sanitizers" ]]; then
  export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1
  export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
  export TSAN_OPTIONS=halt_on_error=1
  check asan --label-regex '^(unit|integration)$'
  check tsan --label-regex '^(unit|integration)$'
  echo "== Summary"
  for preset in asan tsan; do echo "$preset: $(summary "$preset" | head -1)"; done
  summary ci
fi
