#!/usr/bin/env bash
# No type is defined twice in one namespace: two layouts under one name in one program are undefined
# behaviour that no compiler has to report.
set -euo pipefail
cd "$1"
twice_in() {
  find "$@" -name '*.h' -print0 | xargs -0 awk '
  FNR == 1 { space = "" }
  /^namespace [a-z_:]+ \{/ { space = space "::" $2 }
  /^\}  \/\/ namespace/ { sub(/::[^:]*$/, "", space) }
  /^(struct|class|enum|enum class) [A-Za-z_]+( final)?( :.*)? \{/ || /^using [A-Za-z_]+ =/ {
    name = $2 == "class" ? $3 : $2
    where[space "::" name] = where[space "::" name] " " FILENAME
    count[space "::" name]++
  }
  END { for (n in count) if (count[n] > 1) print n ":" where[n] }' | sort
}
# Worker and master are two programs.
twice=$(twice_in common worker && twice_in common master)
if [[ -n "$twice" ]]; then
  printf 'defined more than once:\n%s\n' "$twice"
  exit 1
fi
echo 'names: fine'
