#!/usr/bin/env bash
# scripts/launch/slurm.sh on a real Slurm of one node, started here: an array of two workers, one of
# them cancelled and queued again in the middle of the run.
#   slurm_test.sh BIN ROOT
set -u
BIN=$1 ROOT=$2
source "$ROOT/tests/launch/common.sh"
for program in munged slurmctld slurmd sbatch scontrol; do
  command -v $program >/dev/null || PATH=$PATH:/usr/sbin
  command -v $program >/dev/null || not_run "$program is not installed (scripts/setup.sh --tests)"
done
[[ $(id -u) -eq 0 ]] || not_run 'slurmd wants to be root'
mountpoint -q /sys/fs/cgroup || not_run 'slurmd wants /sys/fs/cgroup mounted'

T=$(mktemp -d /tmp/gapfarm-slurm-XXXXXX)
chmod 755 "$T"
trap clean_up EXIT
node=$(hostname -s)
mkdir -m 755 "$T/state" "$T/spool" "$T/munge"
free_port() {
  /usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("", 0)); print(s.getsockname()[1])'
}

dd if=/dev/urandom of="$T/munge/key" bs=128 count=1 2>/dev/null
chmod 400 "$T/munge/key"
munged --foreground --force --key-file="$T/munge/key" --socket="$T/munge/socket" \
  --pid-file="$T/munge/pid" --seed-file="$T/munge/seed" --log-file="$T/munged.log" \
  >"$T/munged-out.log" 2>&1 &
started+=($!)
wait_for 'munge answers' munge --socket="$T/munge/socket" --no-input

export SLURM_CONF=$T/slurm.conf
cat >"$SLURM_CONF" <<TEXT
ClusterName=gapfarm
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$T/munge/socket,cred_expire=5
CredType=cred/munge
StateSaveLocation=$T/state
SlurmdSpoolDir=$T/spool
SlurmctldPidFile=$T/slurmctld.pid
SlurmdPidFile=$T/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,sched_min_interval=0
ReturnToService=2
KillWait=5
MailProg=/bin/true
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=main Nodes=$node Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:4
TEXT
slurmctld -D >"$T/slurmctld.log" 2>&1 &
started+=($!)
slurmd -D -N "$node" >"$T/slurmd.log" 2>&1 &
started+=($!)
idle() { [[ $(sinfo --noheader --format=%t) == idle ]]; }
wait_for 'the node is idle' idle

write_config
start_master 127.0.0.1
array=$("$ROOT/scripts/launch/slurm.sh" workers --connect "$endpoint" --workers 2 --cpus 1 \
  --keys "$T/keys" --bin "$BIN" --logs "$T") || fail 'sbatch'
array=${array%%;*}
state_is() { [[ $(squeue --noheader --array --states=all --jobs="$1" --format=%T) == "$2" ]]; }
workers_are() {
  [[ $(status "$T/run" 'sum(w["state"] != "gone" for w in s["workers"])') == "$1" ]]
}
wait_for 'both workers have joined' workers_are 2
wait_for 'a generation is committed' committed "$T/run" 1
"$ROOT/scripts/launch/slurm.sh" status "$array"
scancel "${array}_1" || fail scancel
wait_for 'the first is cancelled' state_is "${array}_1" CANCELLED
wait_for 'one worker is left' workers_are 1
scontrol requeue "${array}_1" || fail requeue
wait_for 'the first runs again' state_is "${array}_1" RUNNING
wait_for 'both workers are there again' workers_are 2
now=$(status "$T/run" 's["generation"]')
wait_for 'two more generations are committed' committed "$T/run" $((now + 2))
compare_with_calm_run
"$ROOT/scripts/launch/slurm.sh" stop "$array" || fail stop
gone() { [[ -z $(squeue --noheader --jobs="$array" 2>/dev/null) ]]; }
wait_for 'the workers have left' gone
