#!/usr/bin/env bash
# Sources of at most 400 lines: a longer one does more than one thing.
set -euo pipefail
cd "$1"
long=$(find proto common worker master tests \( -name '*.h' -o -name '*.cc' -o -name '*.proto' \) \
  -exec awk 'END { if (NR > 400) print FILENAME ": " NR " lines, at most 400" }' {} \;)
if [[ -n "$long" ]]; then
  echo "$long"
  exit 1
fi
echo 'size: fine'
