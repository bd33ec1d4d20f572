#!/usr/bin/env bash
# container_test.sh BUILD ROOT: the image of scripts/launch/container, made of the build's packages, works for
# a master on this machine, with keys; it is stopped in the middle, and another one finishes.  Its base is
# a bare Debian made here (scripts/bare_debian.sh), else a registry's.  Images lie in a folder of the test's own.
# Exit status 77: not run here, with the reason.
set -euo pipefail
build=$(realpath "$1") root=$(realpath "$2")

not_run() { echo "not run: $1"; exit 77; }
fail() { echo "FAILED: $1"; exit 1; }
command -v podman >/dev/null || not_run 'podman is not installed (scripts/setup.sh --boxes)'
# Where cgroups are of both versions, a runtime finds those of version 2 where it looks for them.
if [[ -z ${GAPFARM_CGROUPS:-} && $(id -u) -eq 0 && $(stat -fc %T /sys/fs/cgroup) == tmpfs ]]; then
  # shellcheck disable=SC2016
  GAPFARM_CGROUPS=mounted exec unshare --mount bash -c '
    umount -l /sys/fs/cgroup && mount -t cgroup2 none /sys/fs/cgroup; exec "$@"' bash "$0" "$@"
fi

T=$(mktemp -d)
BIN=$build/bin
storage=(--root "$T/images" --runroot "$T/running")
pod() { podman "${storage[@]}" "$@"; }
master=''
clean_up() {
  if [[ -n $master ]]; then kill "$master" 2>/dev/null || true; fi
  pod rm -fa -t 0 >/dev/null 2>&1 || true
  pod rmi -fa >/dev/null 2>&1 || true
  umount -l "$T/images/overlay" 2>/dev/null || true
  rm -rf "$T"
}
trap clean_up EXIT
pod info >/dev/null 2>&1 || storage+=(--storage-driver vfs)
pod info >"$T/log" 2>&1 || not_run "podman: $(tail -n 1 "$T/log")"

# The packages, and what they stand on.
"$root/scripts/package.sh" --build "$build" --out "$T/packages" >"$T/log" 2>&1 || { cat "$T/log"; exit 1; }
if base=$("$root/scripts/bare_debian.sh" 2>&1); then
  tar -C "$base" --exclude=./var/cache/apt/archives/* -c . | pod import -q - localhost/gapfarm-base >/dev/null
  from=localhost/gapfarm-base
else
  pod pull -q docker.io/library/debian:12-slim >"$T/log" 2>&1 || not_run "$base; podman pull: $(tail -n 1 "$T/log")"
  from=docker.io/library/debian:12-slim
fi
network=()
if [[ $(id -u) -eq 0 ]]; then network=(--network host); fi
pod build -q --isolation chroot --layers=false "${network[@]}" --build-arg "BASE=$from" \
  -f "$root/scripts/launch/container/Containerfile" -t gapfarm "$T/packages" >"$T/log" 2>&1 ||
  { cat "$T/log"; fail 'the image cannot be built'; }
echo "the image is built, from $from"

# As the Containerfile says, else with less than podman wants to set up: that is the machine's matter.
ways=('' '--cgroups=disabled' '--cgroups=disabled --ulimit nofile=1024:1024 --ulimit nproc=1024:1024')
for way in "${ways[@]}"; do
  # shellcheck disable=SC2206
  way=($way)
  if said=$(pod run --rm "${way[@]}" --network host gapfarm --version 2>&1); then break; fi
  way=(none)
done
[[ ${way[*]} != none ]] || not_run "the image is built, but podman starts nothing: $said"
[[ $said == "$("$BIN/gapfarm-worker" --version)" ]] || fail "the image holds another worker: $said"
echo "it runs with: podman run ${way[*]}"

"$BIN/gapfarm" keys make --keys "$T/keys" >/dev/null 2>&1
owner=$(pod run --rm "${way[@]}" --network host --entrypoint /usr/bin/id gapfarm -u)
mkdir -m 700 "$T/theirs"
install -m 600 "$T/keys/worker.key" "$T/keys/master.pub" "$T/theirs"
chmod 755 "$T"
chown -R "$owner" "$T/theirs"
"$BIN/gapfarm" evolve "$root/configs/demo.toml" --out "$T/run" --generations 4 --population 8 --workers 0 \
  --listen 'tcp://127.0.0.1:*' --keys "$T/keys" >"$T/said" 2>"$T/master.log" &
master=$!
wait_for() {
  local what=$1 deadline=$((SECONDS + 120))
  shift
  until "$@" >/dev/null 2>&1; do
    ((SECONDS < deadline)) || { cat "$T/master.log"; pod logs -l || true; fail "waited in vain until $what"; }
    sleep 0.1
  done
  echo "$what"
}
wait_for 'the master listens' grep -q -e --connect "$T/master.log"
endpoint=$(sed -n 's/.*--connect \([^ ]*\).*/\1/p' "$T/master.log" | head -n 1)
worker() {
  pod run -d "${way[@]}" --network host -v "$T/theirs:/keys:ro" --name "$1" gapfarm --connect "$endpoint" \
    --keys /keys --processes 1 >/dev/null
}
generation() { "$BIN/gapfarm" status "$T/run" --json | sed -n 's/.*"generation": *\([0-9]*\).*/\1/p' | head -n 1; }
worked() { [[ $(generation) -ge 1 ]]; }
worker first
wait_for 'the container works for the master' worked
pod stop -t 60 first >/dev/null
code=$(pod inspect first --format '{{.State.ExitCode}}')
[[ $code -eq 0 ]] || fail "the stopped worker ended with $code"
worker second
wait "$master" || { cat "$T/master.log"; fail 'the run did not end well'; }
master=''
pod stop -t 60 second >/dev/null
"$BIN/gapfarm" evolve "$root/configs/demo.toml" --out "$T/calm" --generations 4 --population 8 --workers 1 \
  >/dev/null 2>&1
digest() { "$BIN/gapfarm" status "$1" --json | sed -n 's/.*"digest": *"\([0-9a-f]*\)".*/\1/p'; }
[[ -n $(digest "$T/run") && $(digest "$T/run") == $(digest "$T/calm") ]] || fail 'the digests differ'
echo 'container: fine'
