#!/usr/bin/env bash
# From a fresh Debian 12 to an evolved model: installs what is missing, builds, evolves the demo.
set -euo pipefail
cd "$(dirname "$0")/.."

echo "== Packages"
scripts/setup.sh

echo "== Build (build/release)"
cmake --preset release >/dev/null
cmake --build --preset release --target gapfarm gapfarm-worker

# An earlier demo stays as it is.
run=run/demo
for ((n = 2; ; ++n)); do
  [[ -e "$run" ]] || break
  run="run/demo-$n"
done

echo "== Evolve: gapfarm evolve configs/demo.toml --out $run"
start=$SECONDS
build/release/bin/gapfarm evolve configs/demo.toml --out "$run"
echo "== Done in $((SECONDS - start)) s"
build/release/bin/gapfarm status "$run"
echo
echo "model    $run/model.toml   (gapfarm predict $run/model.toml --trials FILE)"
echo "report   $run/report.html  (fitness, parameters, the floor, drives; open it in a browser)"
echo "picture  $run/poses.svg    (measured and simulated end poses, before and after)"
echo "run      $run/run.sqlite   (docs/run_store.md)"
