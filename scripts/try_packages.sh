#!/usr/bin/env bash
# Installs, upgrades, removes and purges the Debian packages in a bare Debian 12, as root there, and
# uses them as an ordinary user.
#   scripts/try_packages.sh [FOLDER]     with the .deb files (build/packages)
# Needs root, debootstrap and a Debian mirror; without them it says so and ends with status 77.  The
# bare system is made once (a minute) in GAPFARM_DEBIAN, by default ~/.cache/gapfarm-debian.
set -euo pipefail
cd "$(dirname "$0")/.."
packages=$(cd "${1:-build/packages}" && pwd)

not_run() { echo "not run: $1"; exit 77; }
fail() { echo "FAILED: $1"; exit 1; }
[[ $(id -u) -eq 0 ]] || not_run 'needs root, for a root folder of its own'
command -v debootstrap >/dev/null || not_run 'debootstrap is not installed'
compgen -G "$packages/gapfarm_*.deb" >/dev/null || not_run "no packages in $packages (scripts/package.sh)"

base=${GAPFARM_DEBIAN:-${XDG_CACHE_HOME:-$HOME/.cache}/gapfarm-debian}
mirror=$(sed -n 's/^URIs: //p; s/^deb \(\[[^]]*\] \)\?\([^ ]*\).*/\2/p' /etc/apt/sources.list \
  /etc/apt/sources.list.d/* 2>/dev/null | head -n 1 || true)
if [[ ! -e "$base/.ready" ]]; then
  rm -rf "$base"
  mkdir -p "$base"
  debootstrap --variant=minbase --include=ca-certificates bookworm "$base" "$mirror" \
    >"$base.log" 2>&1 || not_run "debootstrap: $(tail -n 1 "$base.log")"
  # What this machine needs to reach its mirror.
  cp -a /etc/apt/sources.list.d/. "$base/etc/apt/sources.list.d/" 2>/dev/null || true
  [[ ! -e /etc/apt/sources.list ]] || cp /etc/apt/sources.list "$base/etc/apt/"
  for file in /etc/apt/apt.conf.d/99*; do
    [[ ! -e $file ]] || cp "$file" "$base/etc/apt/apt.conf.d/"
  done
  touch "$base/.ready"
fi

box=$(mktemp -d)
clean_up() {
  umount -l "$box/proc" "$box/dev" 2>/dev/null || true
  rm -rf --one-file-system "$box"
}
trap clean_up EXIT
cp -a "$base/." "$box/"
cp /etc/resolv.conf /etc/hosts "$box/etc/" 2>/dev/null || true
cp -a /etc/ssl/certs/. "$box/etc/ssl/certs/" 2>/dev/null || true
cp -a /usr/local/share/ca-certificates/. "$box/usr/local/share/ca-certificates/" 2>/dev/null || true
mount --bind /proc "$box/proc"
mount --bind /dev "$box/dev"
mkdir "$box/debs"
cp "$packages"/gapfarm_*.deb "$packages"/gapfarm-worker_*.deb "$box/debs/"

# in_box COMMAND...: as root; as_user SCRIPT: as somebody who has a home folder and nothing else.
in_box() {
  chroot "$box" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 \
    DEBIAN_FRONTEND=noninteractive ${http_proxy:+http_proxy="$http_proxy"} \
    ${https_proxy:+https_proxy="$https_proxy"} ${no_proxy:+no_proxy="$no_proxy"} "$@"
}
as_user() {
  in_box setpriv --reuid=4711 --regid=4711 --clear-groups \
    env HOME="$home" bash -c "cd && set -e; $1"
}
in_box useradd --uid 4711 --create-home ada
home=$(in_box getent passwd ada | cut -d: -f6)
in_box apt-get update -qq
# What the machine has before: adduser comes with the worker and stays.
in_box apt-get install -y -qq --no-install-recommends adduser >/dev/null 2>&1
files() { in_box find / -xdev \( -path /proc -o -path /dev -o -path /run -o -path /sys -o -path /debs -o -path /tmp \
  -o -path /home -o -path /var/lib/dpkg -o -path /var/lib/apt -o -path /var/cache -o -path /var/log \) \
  -prune -o -print | sort; }
files >"$box/debs/before"

echo '== install'
in_box bash -c 'apt-get install -y -qq --no-install-recommends /debs/*.deb' >/dev/null 2>"$box/debs/log" ||
  fail "apt-get install: $(cat "$box/debs/log")"
as_user 'gapfarm --version; gapfarm-worker --version'
as_user 'gapfarm check configs/demo.toml >/dev/null'
as_user 'gapfarm evolve configs/demo.toml --out run --generations 3 --workers 2 2>/dev/null |
  grep -q "completed 3"'
as_user 'gapfarm predict run --trials /usr/share/gapfarm/configs/demo/trials.csv --out ends.csv >/dev/null 2>&1
  test -s ends.csv'
as_user 'gapfarm simulate run/model.toml --out again.csv --seed 2 >/dev/null 2>&1; test -s again.csv'
# shellcheck disable=SC2016
as_user 'source /usr/share/bash-completion/completions/gapfarm
  COMP_WORDS=(gapfarm evolve --lis) COMP_CWORD=2; _gapfarm || true; [[ ${COMPREPLY[*]} == --listen ]]'
in_box test -s /usr/share/man/man1/gapfarm.1.gz || fail 'no manual page'
in_box test -s /lib/systemd/system/gapfarm-worker.service || fail 'no unit'
[[ $(in_box stat -c '%U %a' /var/lib/gapfarm/keys) == 'gapfarm 700' ]] || fail 'keys folder'

echo '== upgrade'
in_box bash -c 'echo MASTER=tcp://10.0.0.5:5555 >>/etc/gapfarm/worker.env
  for deb in /debs/*.deb; do
    dpkg-deb -R "$deb" /debs/raw
    sed -i "s/^Version: \(.*\)/Version: \1+next/; s/(= \([^)]*\))/(= \1+next)/" /debs/raw/DEBIAN/control
    dpkg-deb --root-owner-group -b /debs/raw "$deb" >/dev/null
    rm -r /debs/raw
  done
  apt-get install -y -qq /debs/*.deb' >/dev/null 2>"$box/debs/log" ||
  fail "upgrade: $(cat "$box/debs/log")"
[[ $(in_box dpkg-query -Wf '${Version}' gapfarm) == *+next ]] || fail 'not upgraded'
in_box grep -q '^MASTER' /etc/gapfarm/worker.env || fail 'the upgrade lost worker.env'
as_user 'gapfarm status run >/dev/null'

echo '== remove and purge'
in_box apt-get remove -y -qq gapfarm gapfarm-worker >"$box/debs/log" 2>&1 ||
  fail "remove: $(cat "$box/debs/log")"
[[ ! -e "$box/usr/bin/gapfarm" && -e "$box/etc/gapfarm/worker.env" ]] || fail 'removed too much or little'
in_box dpkg --purge gapfarm gapfarm-worker >"$box/debs/log" 2>&1 ||
  fail "purge: $(cat "$box/debs/log")"
in_box apt-get autoremove -y -qq >/dev/null 2>&1
files >"$box/debs/after"
left=$(comm -13 "$box/debs/before" "$box/debs/after" | grep -v -e '^/etc/.*-$' -e 'ld.so' || true)
[[ -z $left ]] || fail "purged, but there still is: $left"
! in_box getent passwd gapfarm >/dev/null || fail 'the user gapfarm is still there'
echo 'packages: fine'
