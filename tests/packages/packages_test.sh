#!/usr/bin/env bash
# packages_test.sh BUILD ROOT: packages of what is built there, tried in a bare Debian.
set -euo pipefail
build=$1
cd "$2"
[[ $(id -u) -eq 0 ]] || { echo 'not run: needs root'; exit 77; }
command -v debootstrap >/dev/null || { echo 'not run: debootstrap is not installed (scripts/setup.sh --boxes)'; exit 77; }
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
# Other tests run the programs meanwhile: they must stay what and where they are.
before=$(stat -c '%i %Y' "$build/bin/gapfarm" "$build/bin/gapfarm-worker")
scripts/package.sh --build "$build" --out "$out"
[[ $(stat -c '%i %Y' "$build/bin/gapfarm" "$build/bin/gapfarm-worker") == "$before" ]] ||
  { echo 'FAILED: packaging built again what was built'; exit 1; }
scripts/try_packages.sh "$out"
