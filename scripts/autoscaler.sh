#!/usr/bin/env bash
# Draws docs/pictures/autoscaler.svg and prints what the autoscaler costs on a simulated cluster.
#   scripts/autoscaler.sh [BUILD]
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/release}
cmake --build "$build" --target fleet_forecast >/dev/null
"$build/bin/fleet_forecast" --picture docs/pictures/autoscaler.svg
