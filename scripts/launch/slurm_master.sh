#!/usr/bin/env bash
# The master's job that slurm.sh submits.
#   slurm_master.sh GAPFARM ENDPOINT-FILE PORT RUN SECURITY-OPTIONS -- EVOLVE-OPTIONS
# TERM and USR1 (time nearly up) stop the run at a committed generation; after USR1 the job is queued
# again and resumes it.  The workers' array is cancelled when the run has ended.
set -uo pipefail
gapfarm=$1 endpoint=$2 port=$3 run=$4
shift 4
security=()
while [[ $1 != -- ]]; do security+=("$1"); shift; done
shift
again='' master=''
trap 'again=yes; [[ -z $master ]] || kill -TERM "$master"' USR1
trap '[[ -z $master ]] || kill -TERM "$master"' TERM

listen=(--workers 0 --listen "tcp://0.0.0.0:$port" "${security[@]}")
echo "tcp://$(hostname):$port" >"$endpoint"
if [[ -e $run/run.sqlite ]]; then
  "$gapfarm" resume "$run" "${listen[@]}" &
else
  "$gapfarm" evolve "$@" "${listen[@]}" &
fi
master=$!
while kill -0 "$master" 2>/dev/null; do
  wait "$master"
  status=$?
done
rm -f "$endpoint"
if [[ -n $again && $status -ne 0 ]]; then
  scontrol requeue "$SLURM_JOB_ID"
elif [[ -s $endpoint.workers ]]; then
  scancel "$(<"$endpoint.workers")"
  rm -f "$endpoint.workers"
fi
exit "$status"
