#!/usr/bin/env bash
# One job of the array that slurm.sh submits.
#   slurm_worker.sh PROGRAM ENDPOINT|@FILE WORKER-OPTIONS    @FILE: a file with the endpoint in it
# TERM (scancel, pre-emption): the worker finishes the job in hand and leaves.  USR1 (time nearly
# up): the same, and the job is queued again.
set -uo pipefail
program=$1 endpoint=$2
shift 2
again='' worker=''
trap 'again=yes; [[ -z $worker ]] || kill -TERM "$worker"' USR1
trap '[[ -z $worker ]] && exit 0 || kill -TERM "$worker"' TERM

options=("$@")
# An older worker does not know how long it has.
if [[ " ${options[*]} " == *" --lifetime "* ]] && ! "$program" --help | grep -q -- --lifetime; then
  for ((i = 0; i < ${#options[@]}; ++i)); do
    if [[ ${options[i]} == --lifetime ]]; then unset 'options[i]' 'options[i+1]'; break; fi
  done
fi
if [[ $endpoint == @* ]]; then
  until [[ -s ${endpoint#@} ]]; do sleep 1; done
  endpoint=$(<"${endpoint#@}")
fi

"$program" --connect "$endpoint" --name "slurm-${SLURM_JOB_ID:-0}-${SLURM_RESTART_COUNT:-0}" \
  ${options[@]+"${options[@]}"} &
worker=$!
# A trapped signal ends `wait` before the worker has ended.
while kill -0 "$worker" 2>/dev/null; do
  wait "$worker"
  status=$?
done
if [[ -n $again ]]; then
  echo "slurm_worker: the time is up; queued again"
  scontrol requeue "$SLURM_JOB_ID"
fi
exit "${status:-0}"
