#!/usr/bin/env bash
# Makes the Debian packages gapfarm, gapfarm-worker and python3-gapfarm of the sources that are checked out.
#   scripts/package.sh [--build FOLDER] [--out FOLDER]     (build/release; build/packages)
# FOLDER of a build that is not there yet is made by the preset of its name.  lintian judges the
# packages where it is installed; an error of it is one.
set -euo pipefail
cd "$(dirname "$0")/.."

build=build/release out=build/packages
while [[ $# -gt 0 ]]; do
  case $1 in
    --build) build=$2; shift 2 ;;
    --out) out=$2; shift 2 ;;
    *) sed -n '2,5p' "$0" >&2; exit 2 ;;
  esac
done

# The same sources make the same packages.
if [[ -z "${SOURCE_DATE_EPOCH:-}" ]]; then
  SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || date +%s)
fi
export SOURCE_DATE_EPOCH
umask 022
mkdir -p "$out"
out=$(cd "$out" && pwd)
rm -f "$out"/*.deb
if [[ -e "$build/CMakeCache.txt" ]]; then
  cmake -DGAPFARM_PYTHON=ON "$build" >/dev/null
else
  cmake --preset "$(basename "$build")" -DGAPFARM_PYTHON=ON >/dev/null
fi
cmake --build "$build" --target gapfarm gapfarm-worker -- --quiet
(cd "$build" && cpack -G DEB -B "$out" >"$out/cpack.log") || { cat "$out/cpack.log"; exit 1; }
rm -rf "$out/_CPack_Packages" "$out/cpack.log"
ls "$out"/*.deb
if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error "$out"/*.deb
fi
