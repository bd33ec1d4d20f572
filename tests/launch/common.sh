# What the launch tests share; sourced with BIN (programs) and ROOT (sources) set.
# shellcheck shell=bash

not_run() {
  echo "not run: $1"
  exit 77
}

fail() {
  echo "FAILED: $1"
  for log in "$T"/*.log; do
    [[ -e $log ]] && { echo "== $log"; tail -n 15 "$log"; }
  done
  exit 1
}

# Ends everything that was started here, newest first.
started=()
clean_up() {
  local i
  for ((i = ${#started[@]} - 1; i >= 0; --i)); do kill "${started[i]}" 2>/dev/null; done
  for pid in "${started[@]}"; do wait "$pid" 2>/dev/null; done
  rm -rf "$T"
}

free_port() {
  /usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("", 0)); print(s.getsockname()[1])'
}

# wait_for WHAT COMMAND...: until it succeeds; a minute is far beyond what anything here takes.
wait_for() {
  local what=$1 deadline=$((SECONDS + 60))
  shift
  until "$@" >/dev/null 2>&1; do
    ((SECONDS < deadline)) || fail "waited in vain until $what"
    sleep 0.1
  done
  echo "$what"
}

# A small problem: generations of a fraction of a second, and a master that notices silence soon.
write_config() {
  cat >"$T/run.toml" <<TEXT
trials = ["$ROOT/configs/demo/trials.csv"]
[genes]
friction = [0.1, 1.5]
contact_length = [0.03, 0.12]
full_speed = [0.1, 0.6]
[parameters]
step_rate = 60
[evolution]
population = 12
[farm]
heartbeat_interval = 0.5
silence_limit = 2
TEXT
}

# status RUN EXPRESSION: of the run's status s, by Python.
status() {
  "$BIN/gapfarm" status "$1" --json | /usr/bin/python3 -c "import json, sys
s = json.load(sys.stdin)
print($2)"
}

committed() { [[ $(status "$1" 's["generation"]') -ge $2 ]]; }

# start_master ADDRESS: a run without end in $T/run, listening there; sets $endpoint and $master.
start_master() {
  "$BIN/gapfarm" keys make --keys "$T/keys" >/dev/null 2>&1 || fail 'no keys'
  "$BIN/gapfarm" evolve "$T/run.toml" --out "$T/run" --generations 1000000 --workers 0 \
    --listen "tcp://$1:*" --keys "$T/keys" 2>"$T/master.log" &
  master=$!
  started+=("$master")
  wait_for 'the master listens' grep -q -- '--connect' "$T/master.log"
  endpoint=$(sed -n 's/.*--connect \([^ ]*\).*/\1/p' "$T/master.log")
}

stop_master() {
  kill -TERM "$master"
  wait "$master"
  local exit_code=$?
  [[ $exit_code -eq 85 ]] || fail "the master ended with $exit_code"
  master=''
}

# Stops the run, if that is to do, and compares it with one on local workers.
compare_with_calm_run() {
  local generation digest calm
  [[ -z $master ]] || stop_master
  generation=$(status "$T/run" 's["generation"]')
  digest=$(status "$T/run" 's["digest"]')
  "$BIN/gapfarm" evolve "$T/run.toml" --out "$T/calm" --generations "$generation" --workers 2 \
    2>"$T/calm.log" || fail 'the calm run failed'
  calm=$(status "$T/calm" 's["digest"]')
  echo "$generation generations, digest $digest, undisturbed $calm"
  [[ -n $digest && $digest == "$calm" ]] || fail 'the digests differ'
}

# idle_seconds N: they are few enough.
idle_seconds() {
  echo "idle core seconds of a worker after the last task: at most $1"
  (($1 < 60)) || fail 'workers idled for too long'
}

# filled CYCLES: of the scheduler, by its own record, from the first submission that it took until as many jobs as it
# allows had begun: few enough.
filled() {
  echo "from none to all that the site allows in ${1:-unknown} of its scheduler's cycles"
  ((${1:-99} <= 2)) || fail 'the farm filled slowly'
}

# expect_taken_away SYSTEM: stops the run; all that $fleet started has to go, and at most four of it stood
# at once ($T/standing).
expect_taken_away() {
  local system=$1 most ended=$SECONDS
  stop_master
  wait_for 'the workers have left' gone
  wait_for 'the fleet has ended' bash -c "! kill -0 $fleet"
  wait "$fleet" || fail "gapfarm workers ended with $?"
  idle_seconds $((SECONDS - ended))
  compare_with_calm_run
  most=$(sort -n "$T/standing" | tail -n 1)
  echo "at most $most jobs stood, of $(find "$T/logs" -name '*.log' | wc -l) in all"
  [[ $most -le 4 ]] || fail "$most jobs stood"
  grep -h -e "$system:" "$T/workers.log"
}
