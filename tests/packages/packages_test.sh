#!/usr/bin/env bash
# packages_test.sh BUILD ROOT: packages of what is built there, tried in a bare Debian.
set -euo pipefail
build=$1
cd "$2"
[[ $(id -u) -eq 0 ]] || { echo 'not run: needs root'; exit 77; }
command -v debootstrap >/dev/null || { echo 'not run: debootstrap is not installed (scripts/setup.sh --boxes)'; exit 77; }
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
scripts/package.sh --build "$build" --out "$out"
scripts/try_packages.sh "$out"
