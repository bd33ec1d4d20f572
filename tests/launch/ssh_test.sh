#!/usr/bin/env bash
# gapfarm workers --on ssh with three hosts: network namespaces with an sshd and a home folder each.
# One lacks the program for a while; one is cut off in the middle of the run and comes back.
#   ssh_test.sh BIN ROOT [SECONDS]    how long it is cut off, at least until the master has noticed
set -u
BIN=$1 ROOT=$2 CUT=${3:-0}
source "$ROOT/tests/launch/common.sh"
PATH=$PATH:/usr/sbin:/sbin
for program in sshd ssh ssh-keygen ip unshare; do
  command -v $program >/dev/null || not_run "$program is not installed (scripts/setup.sh --tests)"
done
[[ $(id -u) -eq 0 ]] || not_run 'namespaces want root'
if [[ -z ${GAPFARM_INSIDE:-} ]]; then
  unshare --net --mount --pid --fork ip link add gf0 type veth peer name gf1 2>/dev/null ||
    not_run 'this sandbox lends no network namespaces or no veth'
  # All that follows has a network, mounts and processes of its own, gone when it ends.
  GAPFARM_INSIDE=yes exec unshare --net --mount --propagation private --pid --fork --mount-proc \
    "$0" "$@"
fi

T=$(mktemp -d /tmp/gapfarm-ssh-XXXXXX)
chmod 755 "$T"
trap clean_up EXIT
ip link set lo up
ip address add 10.77.0.1/32 dev lo
mkdir -p /run/sshd /run/netns
mount -t tmpfs none /run/netns
ssh-keygen -q -t ed25519 -N '' -f "$T/hostkey"
ssh-keygen -q -t ed25519 -N '' -f "$T/user"
home=$(getent passwd root | cut -d: -f6)
"$BIN/gapfarm" keys make --keys "$T/keys" >/dev/null || fail 'no keys'

for i in 1 2 3; do
  ip netns add "h$i"
  ip link add "gf$i" type veth peer name eth0 netns "h$i"
  ip address add "10.77.$i.1/24" dev "gf$i"
  ip link set "gf$i" up
  ip -n "h$i" address add "10.77.$i.2/24" dev eth0
  ip -n "h$i" link set eth0 up
  ip -n "h$i" link set lo up
  ip -n "h$i" route add default via "10.77.$i.1"
  mkdir -p "$T/home$i/gapfarm/bin" "$T/home$i/.config/gapfarm"
  # The third lacks the program at first.
  [[ $i == 3 ]] || ln -s "$BIN/gapfarm-worker" "$T/home$i/gapfarm/bin/gapfarm-worker"
  "$BIN/gapfarm" keys worker "h$i" --keys "$T/keys" --out "$T/home$i/.config/gapfarm/keys" \
    >/dev/null || fail "no keys for h$i"
  cat >"$T/sshd$i.conf" <<TEXT
ListenAddress 10.77.$i.2:22
HostKey $T/hostkey
AuthorizedKeysFile $T/user.pub
StrictModes no
UsePAM no
PermitRootLogin yes
PidFile none
TEXT
  ip netns exec "h$i" bash -c "mount --bind '$T/home$i' '$home' && exec $(command -v sshd) -D -e \
    -f '$T/sshd$i.conf'" >"$T/sshd$i.log" 2>&1 &
  started+=($!)
  printf 'Host h%s\n  HostName 10.77.%s.2\n' "$i" "$i" >>"$T/ssh_config"
done
cat >>"$T/ssh_config" <<TEXT
Host *
  User root
  IdentityFile $T/user
  IdentitiesOnly yes
  UserKnownHostsFile /dev/null
  StrictHostKeyChecking no
  LogLevel ERROR
TEXT
write_config
start_master 10.77.0.1
for i in 1 2 3; do
  wait_for "h$i answers" ssh -n -F "$T/ssh_config" -o BatchMode=yes "h$i" true
done
sed 's/^interval.*/&\nbackoff = 4/' "$ROOT/configs/sites/ssh.toml" >"$T/ssh.toml"
"$BIN/gapfarm" workers --on ssh --site "$T/ssh.toml" --host h1 --host h2 --host h3 --ssh-config "$T/ssh_config" --max 3 \
  --connect "$endpoint" --keys "$T/keys" --look-every 1 2>"$T/workers.log" &
fleet=$!
started+=("$fleet")
workers_are() {
  [[ $(status "$T/run" 'sum(w["state"] != "gone" for w in s["workers"])') == "$1" ]]
}
wait_for 'two workers have joined' workers_are 2
says() { grep -q -e "$1" "$T/workers.log"; }
wait_for 'the log of h3 is shown' says 'No such file or directory'
ln -s "$BIN/gapfarm-worker" "$T/home3/gapfarm/bin/gapfarm-worker"
wait_for 'h3 is tried again, and there are three' workers_are 3
second=$(basename "$(find "$T/home2/.cache/gapfarm" -name '*.pid')" .pid)
second_works() { [[ $(status "$T/run" "any(w['state'] != 'gone' for w in s['workers'] if '-$second-' in w['name'])") == "$1" ]]; }
ip link set gf2 down
wait_for 'h2 is cut off, and missed' second_works False
sleep "$CUT"
ip link set gf2 up
wait_for 'h2 is back' second_works True
now=$(status "$T/run" 's["generation"]')
wait_for 'two more generations are committed' committed "$T/run" $((now + 2))
compare_with_calm_run
wait_for "the fleet has ended" bash -c "! kill -0 $fleet"
wait "$fleet" || fail "gapfarm workers ended with $?"
left=$(pgrep -c gapfarm-worker)
[[ $left -eq 0 ]] || fail "$left workers are left"
cat "$T/workers.log"
