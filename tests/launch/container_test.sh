#!/usr/bin/env bash
# container_test.sh BUILD ROOT: the image of scripts/launch/container, made of the build's packages, works
# for a master on this machine.  Exit status 77: not run here, with the reason.
set -euo pipefail
build=$1
root=$2
command -v podman >/dev/null || { echo 'not run: podman is not installed'; exit 77; }
podman info >/dev/null 2>&1 || { echo 'not run: podman does not work here'; exit 77; }
podman image exists debian:12-slim || podman pull -q docker.io/library/debian:12-slim >/dev/null 2>&1 ||
  { echo 'not run: no image debian:12-slim can be had'; exit 77; }
folder=$(mktemp -d)
trap 'podman rmi -f gapfarm-test >/dev/null 2>&1 || true; rm -rf "$folder"' EXIT
"$root/scripts/package.sh" --build "$build" --out "$folder/packages" >/dev/null
podman build -q -f "$root/scripts/launch/container/Containerfile" -t gapfarm-test "$folder/packages"
podman run --rm gapfarm-test --version
podman run -d --rm --network host --name gapfarm-test gapfarm-test \
  --connect tcp://127.0.0.1:5755 --insecure >/dev/null
"$build/bin/gapfarm" evolve "$root/configs/demo.toml" --out "$folder/run" --generations 1 \
  --population 4 --workers 0 --listen tcp://127.0.0.1:5755 --insecure
podman stop -t 20 gapfarm-test >/dev/null
echo 'container: fine'
