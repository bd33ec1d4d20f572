#!/usr/bin/env bash
# Functions of about 60 lines at most, 70 in all: a longer one has parts that want names.  Tables
# that are filled row by row are as long as their rows are many, and are listed here.
set -euo pipefail
cd "$1"
tables=' push_rows build_catalogue build_push_catalogue srv1_rows judge_rows texts '
long=$(find common worker master tests \( -name '*.h' -o -name '*.cc' \) -print0 | sort -z |
  xargs -0 awk -v tables="$tables" '
  # A definition begins in the first column, ends its head with "{" and ends with a lone "}".
  FNR == 1 { head = "" }
  /^[A-Za-z]/ && !/^(namespace|struct|class|enum|union|extern|using|TEST)/ { head = $0; first = FNR }
  head != "" && !/^[A-Za-z]/ && /^ {4,}/ && first + 6 > FNR { head = head " " $0 }
  /^\}$/ && head ~ /\(/ && head !~ /= *\{/ {
    name = head
    sub(/\(.*/, "", name)
    sub(/.*[ *&:]/, "", name)
    if (FNR - first + 1 > 70 && index(tables, " " name " ") == 0)
      print FILENAME ":" first ": " name " has " FNR - first + 1 " lines"
    head = ""
  }')
if [[ -n "$long" ]]; then
  printf '%s\n' "$long"
  exit 1
fi
echo 'functions: fine'
