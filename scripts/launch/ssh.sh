#!/usr/bin/env bash
# Runs gapfarm workers on a list of hosts over ssh.
set -euo pipefail
usage() {
  cat <<'TEXT'
Usage:
  ssh.sh start  HOSTS --connect tcp://MASTER:PORT [options]
  ssh.sh status HOSTS [options]
  ssh.sh stop   HOSTS [options]     they finish the job in hand
  ssh.sh logs   HOSTS [options]     the last lines of each

HOSTS: host,host,... or @FILE with a host on each line (# begins a comment), as ssh knows them.

Options:
  --bin FOLDER      where gapfarm-worker is on the hosts (gapfarm/bin in the home folder)
  --keys FOLDER     key folder on the hosts (.config/gapfarm/keys in the home folder)
  --package FILE    for start: a gapfarm-worker .deb to unpack on hosts without the program; root is
                    not needed, the libraries that it depends on are
  --processes N     on each host (one a core)
  --name NAME       distinguishes farms that share hosts (default)
  --lines N         for logs (20)
  --ssh-config FILE for ssh -F
  --insecure        no keys
  --dry-run         print what would run

Exit status: 0 all hosts did, 1 some did not.

Examples:
  scripts/launch/ssh.sh start rack1,rack2 --connect tcp://10.0.0.5:5555
  scripts/launch/ssh.sh start @hosts.txt --connect tcp://10.0.0.5:5555 --package gapfarm-worker.deb
  scripts/launch/ssh.sh status @hosts.txt
  scripts/launch/ssh.sh stop @hosts.txt --dry-run
TEXT
}
fail() {
  echo "ssh.sh: $1" >&2
  exit 2
}

bin=gapfarm/bin keys=.config/gapfarm/keys processes='' name=default lines=20 connect='' insecure='' dry=''
ssh_config='' package='' hosts='' verb=''
while [[ $# -gt 0 ]]; do
  case $1 in
    --bin | --keys | --processes | --name | --lines | --connect | --ssh-config | --package)
      [[ $# -gt 1 ]] || fail "$1 needs a value"
      option=${1#--}
      printf -v "${option//-/_}" '%s' "$2"
      shift
      ;;
    --insecure) insecure=yes ;;
    --dry-run) dry=yes ;;
    --help | -h) usage; exit 0 ;;
    -*) fail "did not expect '$1'; see --help" ;;
    *) if [[ -z $verb ]]; then verb=$1; elif [[ -z $hosts ]]; then hosts=$1; else
        fail "did not expect '$1'; see --help"; fi ;;
  esac
  shift
done
[[ -n $verb && -n $hosts ]] || { usage >&2; exit 2; }
[[ -z $package || -r $package ]] || fail "cannot read '$package'"
[[ $name =~ ^[A-Za-z0-9._-]+$ ]] || fail "--name takes letters, digits, . _ -"
if [[ $hosts == @* ]]; then
  [[ -r ${hosts#@} ]] || fail "cannot read '${hosts#@}'"
  mapfile -t list < <(sed 's/#.*//; s/[[:space:]]//g; /^$/d' "${hosts#@}")
else
  IFS=, read -ra list <<<"$hosts"
fi
[[ ${#list[@]} -gt 0 ]] || fail "no hosts"

ssh=(ssh -n -o BatchMode=yes -o ConnectTimeout=10)
[[ -z $ssh_config ]] || ssh+=(-F "$ssh_config")

# What a host's shell is given.  Everything of a farm lies in one folder there.
state=".cache/gapfarm/$name"
running="[ -s $state/pid ] && kill -0 \"\$(cat $state/pid)\" 2>/dev/null"
case $verb in
  start)
    [[ -n $connect ]] || fail "start needs --connect tcp://MASTER:PORT"
    worker=("$bin/gapfarm-worker" --connect "$connect")
    if [[ -n $insecure ]]; then worker+=(--insecure); else worker+=(--keys "$keys"); fi
    [[ -z $processes ]] || worker+=(--processes "$processes")
    printf -v quoted '%q ' "${worker[@]}"
    script="mkdir -p $state; if $running; then echo already running; exit 0; fi
nohup setsid $quoted >>$state/log 2>&1 </dev/null & echo \$! >$state/pid
sleep 1; if $running; then echo started; else tail -n 3 $state/log; exit 1; fi"
    ;;
  status)
    script="if $running; then echo running, pid \$(cat $state/pid), \$(grep -c . $state/log || true) log lines; else echo not running; exit 1; fi"
    ;;
  stop)
    script="if ! $running; then rm -f $state/pid; echo not running; exit 0; fi
pid=\$(cat $state/pid); kill -TERM \$pid
for i in \$(seq 60); do kill -0 \$pid 2>/dev/null || { rm -f $state/pid; echo stopped; exit 0; }; sleep 0.5; done
echo still finishing, pid \$pid; exit 1"
    ;;
  logs) script="tail -n $((lines)) $state/log" ;;
  *) fail "unknown verb '$verb'; see --help" ;;
esac

# Unpacks the package, which comes on stdin, beside the folder of programs.
have="[ -x $bin/gapfarm-worker ]"
bring="mkdir -p $bin .cache/gapfarm && cat >.cache/gapfarm/worker.deb &&
dpkg-deb -x .cache/gapfarm/worker.deb $bin/.package && ln -s .package/usr/bin/gapfarm-worker $bin/ &&
if ! $bin/gapfarm-worker --version; then
rm $bin/gapfarm-worker; echo install what it depends on, or the package as root: $(basename "$package"); exit 1; fi"
# on_host HOST: all that the verb does there.
on_host() {
  if [[ $verb == start && -n $package ]] && ! "${ssh[@]}" "$1" "$have"; then
    "${ssh[@]/-n/-T}" "$1" "$bring" <"$package" || return 1
  fi
  "${ssh[@]}" "$1" "$script"
}

if [[ -n $dry ]]; then
  for host in "${list[@]}"; do
    if [[ $verb == start && -n $package ]]; then
      printf '%q ' "${ssh[@]/-n/-T}" "$host" "$bring"
      echo "<$package   # where $bin/gapfarm-worker is missing"
    fi
    printf '%q ' "${ssh[@]}" "$host" "$script"
    echo
  done
  exit 0
fi
results=$(mktemp -d)
trap 'rm -r "$results"' EXIT
for i in "${!list[@]}"; do
  { on_host "${list[i]}" 2>&1 && touch "$results/$i.ok"; } |
    sed "s/^/${list[i]//\//\\/}: /" &
done
wait
for i in "${!list[@]}"; do [[ -e $results/$i.ok ]] || exit 1; done
