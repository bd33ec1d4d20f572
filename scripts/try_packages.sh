#!/usr/bin/env bash
# Installs, upgrades, removes and purges the Debian packages in a bare Debian 12, as root there, uses
# them as an ordinary user, and lets the worker's service work.
#   scripts/try_packages.sh [FOLDER]     with the .deb files (build/packages)
# Needs root, debootstrap and a Debian mirror (scripts/bare_debian.sh); without them it says so and ends with
# status 77.  Where systemd cannot be booted (scripts/boot_debian.sh) the service is omitted, and it says so.
set -euo pipefail
cd "$(dirname "$0")/.."
packages=$(cd "${1:-build/packages}" && pwd)

not_run() { echo "not run: $1"; exit 77; }
fail() { echo "FAILED: $1"; exit 1; }
compgen -G "$packages/gapfarm_*.deb" >/dev/null || not_run "no packages in $packages (scripts/package.sh)"
base=$(scripts/bare_debian.sh 2>&1) || not_run "${base#not run: }"

box=$(mktemp -d) booted='' system=''
clean_up() {
  if [[ -n $booted ]]; then kill "$booted" 2>/dev/null && wait "$booted"; fi
  umount -l "$box/proc" "$box/dev" 2>/dev/null || true
  rm -rf --one-file-system "$box"
}
trap clean_up EXIT
cp -a "$base/." "$box/"
mount --bind /proc "$box/proc"
mount --bind /dev "$box/dev"
mkdir "$box/debs"
cp "$packages"/gapfarm_*.deb "$packages"/gapfarm-worker_*.deb "$box/debs/"

# in_box COMMAND...: as root; as_user SCRIPT: as somebody who has a home folder and nothing else.
in_box() {
  local enter=(chroot "$box")
  if [[ -n $system ]]; then enter=(nsenter --all --root --wd --target "$system"); fi
  "${enter[@]}" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 \
    DEBIAN_FRONTEND=noninteractive ${http_proxy:+http_proxy="$http_proxy"} \
    ${https_proxy:+https_proxy="$https_proxy"} ${no_proxy:+no_proxy="$no_proxy"} "$@"
}
as_user() {
  in_box setpriv --reuid=4711 --regid=4711 --clear-groups \
    env HOME="$home" bash -c "cd && set -e; $1"
}
# Turns the box on: from here on everything happens inside.
switch_on() {
  scripts/boot_debian.sh "$box" >"$box/debs/booted" 2>"$box/debs/boot.log" &
  booted=$!
  until [[ -s "$box/debs/booted" ]]; do
    kill -0 "$booted" 2>/dev/null || return 1
    sleep 0.2
  done
  system=$(<"$box/debs/booted")
}
# wait_for WHAT COMMAND...: until it succeeds; two minutes are far beyond what anything here takes.
wait_for() {
  local what=$1 deadline=$((SECONDS + 120))
  shift
  until "$@" >/dev/null 2>&1; do
    ((SECONDS < deadline)) || fail "waited in vain until $what: $(in_box journalctl -qn 20 2>&1)"
    sleep 0.2
  done
}
worker_pid() { in_box systemctl show --property MainPID --value gapfarm-worker; }
worker_is_on() { [[ $(in_box systemctl is-active gapfarm-worker) == active ]]; }

in_box useradd --uid 4711 --create-home ada
home=$(in_box getent passwd ada | cut -d: -f6)
in_box apt-get update -qq
# What the machine has before: adduser comes with the worker and stays.
in_box apt-get install -y -qq --no-install-recommends adduser systemd >/dev/null 2>&1
if ! switch_on; then
  booted=''
  echo "the service is not tried: $(sed 's/not run: //' "$box/debs/boot.log")"
fi
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
as_user 'gapfarm diagnose configs/demo.toml --out diagnosis --workers 2 2>/dev/null
  test -s diagnosis/report.html; test -s diagnosis/model.toml'
# shellcheck disable=SC2016
as_user 'source /usr/share/bash-completion/completions/gapfarm
  COMP_WORDS=(gapfarm evolve --lis) COMP_CWORD=2; _gapfarm || true; [[ ${COMPREPLY[*]} == --listen ]]'
in_box test -s /usr/share/man/man1/gapfarm.1.gz || fail 'no manual page'
in_box test -s /lib/systemd/system/gapfarm-worker.service || fail 'no unit'
[[ $(in_box stat -c '%U %a' /var/lib/gapfarm/keys) == 'gapfarm 700' ]] || fail 'keys folder'

if [[ -n $system ]]; then
  echo '== service'
  worker_is_on && fail 'the service was started unasked'
  as_user 'gapfarm keys make --keys keys >/dev/null 2>&1
    gapfarm evolve configs/demo.toml --out far --generations 1000000 --workers 0 \
      --listen tcp://127.0.0.1:* --keys keys >/dev/null 2>far.log &'
  wait_for 'the master listens' grep -q -e --connect "$box$home/far.log"
  endpoint=$(sed -n 's/.*--connect \([^ ]*\).*/\1/p' "$box$home/far.log")
  in_box install -o gapfarm -g gapfarm -m 600 "$home/keys/worker.key" "$home/keys/master.pub" \
    /var/lib/gapfarm/keys
  in_box bash -c "echo MASTER=$endpoint >>/etc/gapfarm/worker.env"
  in_box systemctl enable --now gapfarm-worker 2>/dev/null
  generations() { as_user 'gapfarm status far --json' | sed -n 's/.*"generation":[ ]*\([0-9]*\).*/\1/p' | head -n 1; }
  at_least() { [[ $(generations) -ge $1 ]]; }
  wait_for 'the service works for the master' at_least 2
  echo "the service works as $(in_box stat -c %U "/proc/$(worker_pid)")"
else
  in_box bash -c 'echo MASTER=tcp://10.0.0.5:5555 >>/etc/gapfarm/worker.env'
fi

echo '== upgrade'
before=${system:+$(worker_pid)}
in_box bash -c 'for deb in /debs/*.deb; do
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
if [[ -n $system ]]; then
  wait_for 'the service is on again' worker_is_on
  [[ $(worker_pid) != "$before" ]] || fail 'the upgrade left the old worker at work'
  wait_for 'the new worker works' at_least "$(($(generations) + 2))"
fi

echo '== remove and purge'
in_box apt-get remove -y -qq gapfarm gapfarm-worker >"$box/debs/log" 2>&1 ||
  fail "remove: $(cat "$box/debs/log")"
[[ ! -e "$box/usr/bin/gapfarm" && -e "$box/etc/gapfarm/worker.env" ]] || fail 'removed too much or little'
if [[ -n $system ]]; then worker_is_on && fail 'the service outlived its package'; fi
in_box dpkg --purge gapfarm gapfarm-worker >"$box/debs/log" 2>&1 ||
  fail "purge: $(cat "$box/debs/log")"
in_box apt-get autoremove -y -qq >/dev/null 2>&1
files >"$box/debs/after"
left=$(comm -13 "$box/debs/before" "$box/debs/after" | grep -v -e '^/etc/.*-$' -e 'ld.so' || true)
[[ -z $left ]] || fail "purged, but there still is: $left"
! in_box getent passwd gapfarm >/dev/null || fail 'the user gapfarm is still there'
echo 'packages: fine'
