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
# Folders of at most 25 sources: what a reader takes in at a glance.
full=$(find proto common worker master \( -name '*.h' -o -name '*.cc' -o -name '*.inc' \) \
  -printf '%h\n' | sort | uniq -c | awk '$1 > 25 { print $2 ": " $1 " sources, at most 25" }')
if [[ -n "$full" ]]; then
  echo "$full"
  exit 1
fi
# A newcomer reads master/ from top to bottom.
folders=$(find master -mindepth 1 -maxdepth 1 -type d | wc -l)
if [[ $folders -gt 14 ]]; then
  echo "master: $folders folders, at most 14"
  exit 1
fi
echo 'size: fine'
