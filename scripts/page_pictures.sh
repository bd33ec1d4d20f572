#!/usr/bin/env bash
# page_pictures.sh RUN: makes docs/pictures/page.png of a finished run's page, with chromium.
# GAPFARM: the program, build/release/bin/gapfarm unless configured otherwise.
set -euo pipefail
run=${1:?give the folder of a run that has ended}
run=${run%/}
here=$(cd "$(dirname "$0")/.." && pwd)
gapfarm=${GAPFARM:-$here/build/release/bin/gapfarm}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# The same page without a server: one that is reported what is new never stops loading.
"$gapfarm" report "$run" --out "$folder/page.html"
chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --user-data-dir="$folder/profile" \
  --virtual-time-budget=6000 --window-size=1000,1900 --force-device-scale-factor=0.7 \
  --screenshot="$here/docs/pictures/page.png" "file://$folder/page.html" 2>/dev/null
