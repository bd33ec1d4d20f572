#!/usr/bin/env bash
# A fleet with all that clusters do to it: one worker is suspended (SIGSTOP) and continued, one is pre-empted again
# and again, and on one of the nodes workers die at once.  The run is the undisturbed one, and says what happened.
#   disturbed_test.sh BIN ROOT [SUSPENDED_s PREEMPTED-EVERY_s]
set -u
BIN=$1 ROOT=$2 SUSPENDED=${3:-8} EVERY=${4:-3}
source "$ROOT/tests/launch/common.sh"
T=$(mktemp -d /tmp/gapfarm-fleet-XXXXXX)
trap clean_up EXIT

# Nodes are folders here: jobs are put on them as on hosts that ssh reaches; on "bad" a library is missing.
export HOME=$T/home
mkdir -p "$HOME"
sed -e 's/^hosts.*/hosts = ["good", "other", "bad"]\njobs_per_host = 1/' -e 's/^system.*/system = "nodes"/' \
  -e 's|^setsid nohup {worker}|[ {node} != bad ] \|\| set -- /bin/sh -c "echo libzmq.so.5: cannot open shared object file >\&2; exit 127"\nsetsid nohup "$@" {worker}|' \
  "$ROOT/configs/sites/local.toml" >"$T/nodes.toml"

write_config
start_master 127.0.0.1
"$BIN/gapfarm" workers --on nodes --site "$T/nodes.toml" --connect "$endpoint" --keys "$T/keys" --max 3 \
  --look-every 1 2>"$T/workers.log" &
fleet=$!
started+=("$fleet")
workers_are() { [[ $(status "$T/run" 'sum(w["state"] != "gone" for w in s["workers"])') == "$1" ]]; }
wait_for 'two workers have joined' workers_are 2
says() { grep -q -e "$1" "$T/workers.log"; }
wait_for 'the log of the dead worker is shown' says 'libzmq.so.5: cannot open'
why() { [[ $(status "$T/run" 's["fleets"][0]["why"]') == *'died at once on bad'* ]]; }
wait_for 'status names the bad node' why

# The supervisor of a job and its worker, as a cluster stops a job.
pids() { local one; one=$(<"$1"); echo "$one $(ps -o pid= --ppid "$one" | tr '\n' ' ')"; }
suspended=$(find "$HOME" -name '*.pid' | while read -r f; do kill -0 "$(<"$f")" 2>/dev/null && echo "$f"; done | head -n 1)
name=$(basename "$suspended" .pid)
# shellcheck disable=SC2046
kill -STOP $(pids "$suspended")
since=$SECONDS
wait_for 'the suspended worker is missed' workers_are 1
events() {
  /usr/bin/python3 - "$T/run/run.sqlite" "$1" "$2" <<'PY'
import sqlite3, sys
rows = sqlite3.connect(f'file:{sys.argv[1]}?mode=ro', uri=True).execute('SELECT * FROM worker_events').fetchall()
found = [r for r in rows if all(word in ' '.join(map(str, r)) for word in sys.argv[2:])]
print(*found[:3], sep='\n')
sys.exit(not found)
PY
}
# Sets $one to a job that has joined, is not the suspended one and was not killed.
another() {
  for one in $(find "$HOME" -name '*.pid'); do
    local id
    id=$(basename "$one" .pid)
    [[ " $name $killed " != *" $id "* ]] || continue
    [[ $(status "$T/run" "any(w['state'] != 'gone' for w in s['workers'] if '-$id-' in w['name'])") != True ]] || return 0
  done
  return 1
}
killed='' preempted=0
while ((SECONDS - since < SUSPENDED || preempted < 2)); do
  sleep "$EVERY"
  wait_for 'another one works, and is pre-empted' another
  # shellcheck disable=SC2046
  kill -KILL $(pids "$one") && preempted=$((preempted + 1))
  killed+=" $(basename "$one" .pid)"
done
echo "pre-empted $preempted times"
# shellcheck disable=SC2046
kill -CONT $(pids "$suspended")
wait_for 'the suspended worker is welcomed back' events "$name" 'without a word: it was suspended or cut off'
events "$name" 'without a word'
wait_for 'both work again' workers_are 2
now=$(status "$T/run" 's["generation"]')
wait_for 'two more generations are committed' committed "$T/run" $((now + 2))
deaths=$(grep -c 'ended before its worker joined' "$T/workers.log")
submitted=$(find "$HOME/.cache/gapfarm" -name '*.log' | xargs grep -l 'libzmq' | wc -l)
echo "submissions to the bad node: $submitted in $SECONDS s"
((submitted <= 2 + SECONDS / 30)) || fail 'no back-off'
ended=$SECONDS
stop_master
wait_for "the fleet has ended" bash -c "! kill -0 $fleet"
wait "$fleet" || fail "gapfarm workers ended with $?"
idle_seconds $((SECONDS - ended))
echo "$deaths notes of deaths"
compare_with_calm_run
cat "$T/workers.log"
left=$(pgrep -f -- "--connect $endpoint" | wc -l)
[[ $left -eq 0 ]] || fail "$left processes are left"
