#!/usr/bin/env bash
# page_pictures.sh RUN: makes docs/pictures/page.png of a finished run's page, with chromium.
# GAPFARM: the program, build/release/bin/gapfarm unless told otherwise.
set -euo pipefail
run=${1:?give the folder of a run that has ended}
run=${run%/}
here=$(cd "$(dirname "$0")/.." && pwd)
gapfarm=${GAPFARM:-$here/build/release/bin/gapfarm}
profile=$(mktemp -d)
coproc server { exec "$gapfarm" serve "$run" --port 0; }
trap 'kill "$server_pid"; rm -rf "$profile"' EXIT
server_pid=$server_PID
read -r _ address <&"${server[0]}"
chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --user-data-dir="$profile" \
  --virtual-time-budget=6000 --window-size=1000,1500 --force-device-scale-factor=0.6 \
  --screenshot="$here/docs/pictures/page.png" "${address}view?of=$run" 2>/dev/null
