#!/usr/bin/env bash
# Every source is formatted as .clang-format says.
set -euo pipefail
cd "$1"
if ! command -v clang-format >/dev/null; then
  echo 'format: not checked, clang-format is not installed (scripts/setup.sh --tests)'
  exit 0
fi
find common worker master tests \( -name '*.h' -o -name '*.cc' \) -print0 \
  | xargs -0 clang-format --dry-run -Werror
echo 'format: fine'
