#!/usr/bin/env bash
# Prints the folder of a bare Debian 12, for whoever wants a copy of one: packages, containers.
#   scripts/bare_debian.sh
# It is made once (a minute) in GAPFARM_DEBIAN, by default ~/.cache/gapfarm-debian.  Needs root, debootstrap and a
# Debian mirror; without them it says so on stderr and ends with status 77.
set -euo pipefail

not_run() { echo "not run: $1" >&2; exit 77; }
base=${GAPFARM_DEBIAN:-${XDG_CACHE_HOME:-$HOME/.cache}/gapfarm-debian}
[[ $(id -u) -eq 0 ]] || not_run 'needs root, for a root folder of its own'
mkdir -p "$(dirname "$base")"
exec 9>"$base.lock"
flock 9
if [[ ! -e "$base/.ready" ]]; then
  command -v debootstrap >/dev/null || not_run 'debootstrap is not installed (scripts/setup.sh --boxes)'
  mirror=$(sed -n 's/^URIs: //p; s/^deb \(\[[^]]*\] \)\?\([^ ]*\).*/\2/p' /etc/apt/sources.list \
    /etc/apt/sources.list.d/* 2>/dev/null | head -n 1 || true)
  rm -rf "$base"
  mkdir -p "$base"
  debootstrap --variant=minbase --include=ca-certificates bookworm "$base" "$mirror" \
    >"$base.log" 2>&1 || not_run "debootstrap: $(tail -n 1 "$base.log")"
  touch "$base/.ready"
fi
# What this machine needs to reach its mirror, as it is today.
rm -f "$base"/etc/apt/sources.list "$base"/etc/apt/sources.list.d/*
cp -a /etc/apt/sources.list.d/. "$base/etc/apt/sources.list.d/" 2>/dev/null || true
[[ ! -e /etc/apt/sources.list ]] || cp /etc/apt/sources.list "$base/etc/apt/"
for file in /etc/apt/apt.conf.d/99*; do
  [[ ! -e $file ]] || cp "$file" "$base/etc/apt/apt.conf.d/"
done
cp /etc/resolv.conf /etc/hosts "$base/etc/" 2>/dev/null || true
cp -a /etc/ssl/certs/. "$base/etc/ssl/certs/" 2>/dev/null || true
cp -a /usr/local/share/ca-certificates/. "$base/usr/local/share/ca-certificates/" 2>/dev/null || true
echo "$base"
