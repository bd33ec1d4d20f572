#!/usr/bin/env bash
# gapfarm workers --on condor on a real HTCondor of one machine, started here by a user, that allows four jobs: never
# more, every one whose wall time ends is replaced, and none is left after the run.
#   condor_test.sh BIN ROOT
set -u
BIN=$1 ROOT=$2
source "$ROOT/tests/launch/common.sh"
PATH=$PATH:/usr/sbin
for program in condor_master condor_schedd condor_startd condor_submit condor_q condor_rm; do
  command -v "$program" >/dev/null || not_run "$program is not installed (Debian 13 has it in minicondor, Debian 12 has none)"
done
# It takes no jobs of root.
[[ $(id -u) -ne 0 ]] || exec setpriv --reuid nobody --regid nogroup --clear-groups "$0" "$@"

T=$(mktemp -d /tmp/gapfarm-condor-XXXXXX)
# Asked by SIGTERM, it waits for its jobs.
condor=''
trap '[[ -z $condor ]] || { kill -QUIT "$condor"; wait "$condor"; }; clean_up' EXIT
mkdir -p "$T"/condor/{log,spool,execute,lock,run}
export CONDOR_CONFIG=$T/condor_config HOME=$T
cat >"$CONDOR_CONFIG" <<TEXT
include : /etc/condor/condor_config
LOCAL_CONFIG_DIR =
LOCAL_CONFIG_FILE =
LOCAL_DIR = $T/condor
LOG = $T/condor/log
SPOOL = $T/condor/spool
EXECUTE = $T/condor/execute
LOCK = $T/condor/lock
RUN = $T/condor/run
use ROLE: Personal
CONDOR_HOST = 127.0.0.1
NETWORK_INTERFACE = 127.0.0.1
COLLECTOR_HOST = 127.0.0.1:$(free_port)
USE_SHARED_PORT = False
SEC_DEFAULT_AUTHENTICATION_METHODS = FS
ALLOW_READ = *
ALLOW_WRITE = *
ALLOW_DAEMON = *
ALLOW_NEGOTIATOR = *
ALLOW_ADMINISTRATOR = *
ENABLE_KERNEL_TUNING = False
NUM_CPUS = 8
MAX_JOBS_PER_OWNER = 4
SCHEDD_INTERVAL = 2
NEGOTIATOR_INTERVAL = 2
NEGOTIATOR_CYCLE_DELAY = 1
TEXT
# It closes all files that it might have open, one by one.
(ulimit -n 1024 && exec condor_master -f) >"$T/condor.log" 2>&1 &
condor=$!
up() { [[ $(condor_status -af Name) == slot1@* ]]; }
wait_for 'the machine is there' up

write_config
start_master 127.0.0.1
sed 's/^system/backoff = 1\n&/' "$ROOT/configs/sites/condor.toml" >"$T/condor.toml"
while sleep 0.2; do condor_q -af ProcId 2>/dev/null | wc -l; done >"$T/standing" &
started+=($!)
"$BIN/gapfarm" workers --on condor --site "$T/condor.toml" --run "$T/run" --keys "$T/keys" --max 8 --wall-time 12 \
  --look-every 1 --worker-logs "$T/logs" 2>"$T/workers.log" &
fleet=$!
started+=("$fleet")
workers_are() { [[ $(status "$T/run" 'sum(w["state"] != "gone" for w in s["workers"])') == "$1" ]]; }
wait_for 'four workers have joined' workers_are 4
replaced() { [[ $(find "$T/logs" -name '*.log' | wc -l) -ge 8 ]]; }
wait_for 'every one was replaced' replaced
gone() { [[ -z $(condor_q -af ProcId) ]]; }
expect_taken_away condor
exit 0
