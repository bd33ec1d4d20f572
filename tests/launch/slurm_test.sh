#!/usr/bin/env bash
# gapfarm workers --on slurm on a real Slurm of one node, started here, that allows a user four jobs: never
# more, every one whose wall time ends is replaced, and none is left after the run.
#   slurm_test.sh BIN ROOT
set -u
BIN=$1 ROOT=$2
source "$ROOT/tests/launch/common.sh"
source "$ROOT/tests/launch/slurm_cluster.sh"
slurm_needs slurmdbd mariadbd mariadb-install-db sacctmgr

T=$(mktemp -d /tmp/gapfarm-slurm-XXXXXX)
chmod 755 "$T"
trap clean_up EXIT
start_slurm 4

write_config
start_master 127.0.0.1
# What stands, five times a second.
while sleep 0.2; do squeue --noheader --array --format=%i 2>/dev/null | wc -l; done >"$T/standing" &
started+=($!)
"$BIN/gapfarm" workers --on slurm --run "$T/run" --keys "$T/keys" --max 8 --wall-time 8 --look-every 1 \
  --worker-logs "$T/logs" 2>"$T/workers.log" &
fleet=$!
started+=("$fleet")
workers_are() { [[ $(status "$T/run" 'sum(w["state"] != "gone" for w in s["workers"])') == "$1" ]]; }
wait_for 'four workers have joined' workers_are 4
filled "$(awk '/_slurm_rpc_submit_batch_job: JobId=/ { asked = 1 }
  asked && /sched: Running job scheduler/ { ++cycles }
  /sched: Allocate JobId=/ && ++begun == 4 { print cycles; exit }' "$T/slurmctld.log")"
why() { [[ $(status "$T/run" 's["fleets"][0]["why"]') == *'no more than 4 jobs'* ]]; }
wait_for 'status says why there are no more' why
status "$T/run" 's["fleets"]'
# Each lives for six seconds: eight more are two rounds of replacements.
replaced() { [[ $(find "$T/logs" -name '*.log' | wc -l) -ge 12 ]]; }
wait_for 'every one was replaced twice' replaced
gone() { [[ -z $(squeue --noheader 2>/dev/null) ]]; }
expect_taken_away slurm
exit 0
