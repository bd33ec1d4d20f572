#!/usr/bin/env bash
# gapfarm workers and gapfarm-worker where no master is, where its work is done, where it was stopped, and
# beside a command that is no run.
#   fleet_test.sh BIN ROOT
set -u
BIN=$1 ROOT=$2
source "$ROOT/tests/launch/common.sh"
T=$(mktemp -d /tmp/gapfarm-fleet-XXXXXX)
trap clean_up EXIT
export HOME=$T/home
mkdir "$HOME"
write_config
"$BIN/gapfarm" keys make --keys "$T/keys" >/dev/null 2>&1 || fail 'no keys'

# expect CODE LOG TEXT COMMAND...
expect() {
  local wanted=$1 log=$T/$2.log text=$3
  shift 3
  "$@" 2>"$log"
  local code=$?
  [[ $code -eq $wanted ]] || fail "exit status $code and not $wanted of $*"
  grep -q -e "$text" "$log" || fail "not said: $text"
  echo "$wanted: $(tail -n 1 "$log")"
}
nobody=tcp://127.0.0.1:9
fleet=("$BIN/gapfarm" workers --on local --max 1 --look-every 0.5 --keys "$T/keys")
worker=("$BIN/gapfarm-worker" --processes 1 --keys "$T/keys")
expect 69 nobody 'waiting for a master at tcp://127.0.0.1:9, and giving up when none has come in 1 s' \
  "${fleet[@]}" --connect $nobody --wait-limit 1
grep -q 'no master at tcp://127.0.0.1:9 for 1 s; does one listen there' "$T/nobody.log" || fail 'no remedy'
expect 69 lonely 'no master at tcp://127.0.0.1:9 for 1 s; does one listen there' \
  "${worker[@]}" --connect $nobody --wait-limit 1

start_master 127.0.0.1
"${worker[@]}" --connect "$endpoint" --wait-limit 1 2>"$T/left.log" &
left=$!
wait_for 'a generation is committed' committed "$T/run" 1
stop_master
wait $left
[[ $? -eq 69 ]] || fail 'the worker took a master that was stopped for one whose work is done'
"$BIN/gapfarm" resume "$T/run" --generations "$(($(status "$T/run" 's["generation"]') + 1))" --workers 0 \
  --listen "$endpoint" --keys "$T/keys" 2>"$T/master.log" &
started+=($!)
expect 0 done "the master's work is done" "${worker[@]}" --connect "$endpoint" --wait-limit 1

# Of another command, by its folder.
"$BIN/gapfarm" diagnose "$T/run.toml" --out "$T/diagnosed" --workers 0 --listen 'tcp://127.0.0.1:*' --keys "$T/keys" \
  2>"$T/diagnose.log" &
master=$!
started+=("$master")
listens() { [[ -n $(status "$T/diagnosed" 's["listen"]') ]]; }
wait_for 'a diagnosis listens' listens
"${fleet[@]}" --run "$T/diagnosed" 2>"$T/workers.log" &
beside=$!
started+=("$beside")
works() { [[ $(status "$T/diagnosed" 's["fleets"][0]["running"], len(s["workers"])') == '1 1' ]]; }
wait_for 'status shows its fleet and its worker' works
"$BIN/gapfarm" status "$T/diagnosed" | grep '^cluster *local: 1 workers asked for, 0 queued, 1 running, 0 lost' ||
  fail 'status does not say so'
# A fleet that a busy machine keeps from reading for a while learns all the same that the master has left.
kill -STOP "$beside"
(sleep 0.4 && kill -CONT "$beside") &
stop_master
wait_for 'the fleet has ended with its master' bash -c "! kill -0 $beside"
wait "$beside" || fail "the fleet ended with $?"
