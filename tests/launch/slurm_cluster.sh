# A real Slurm of one node with munge, and accounting where a limit on jobs is wanted; sourced after common.sh.
# shellcheck shell=bash

# slurm_needs PROGRAM...
slurm_needs() {
  PATH=$PATH:/usr/sbin
  for program in munged slurmctld slurmd sbatch scontrol "$@"; do
    command -v "$program" >/dev/null || not_run "$program is not installed (scripts/setup.sh --tests)"
  done
  [[ $(id -u) -eq 0 ]] || not_run 'slurmd wants to be root'
  mountpoint -q /sys/fs/cgroup || not_run 'slurmd wants /sys/fs/cgroup mounted'
}

# A database for slurmdbd in $T/sql.
start_database() {
  mkdir -m 755 "$T/sql"
  mariadb-install-db --no-defaults --user=root --datadir="$T/sql" --auth-root-authentication-method=normal \
    --skip-test-db >"$T/sql-install.log" 2>&1 || fail 'no database'
  sql_port=$(free_port)
  mariadbd --no-defaults --user=root --datadir="$T/sql" --socket="$T/sql/socket" --port="$sql_port" \
    --bind-address=127.0.0.1 --innodb-buffer-pool-size=64M --innodb-flush-log-at-trx-commit=0 >"$T/sql.log" 2>&1 &
  started+=($!)
  wait_for 'the database answers' mariadb --no-defaults --socket="$T/sql/socket" --user=root -e 'select 1'
  mariadb --no-defaults --socket="$T/sql/socket" --user=root -e "create user slurm@'127.0.0.1' identified by 'x';
    create user slurm@localhost identified by 'x'; grant all on *.* to slurm@'127.0.0.1'; grant all on *.* to slurm@localhost"
  dbd_port=$(free_port)
  cat >"$T/slurmdbd.conf" <<TEXT
AuthType=auth/munge
AuthInfo=socket=$T/munge/socket
DbdHost=localhost
DbdPort=$dbd_port
SlurmUser=root
StorageType=accounting_storage/mysql
StorageHost=127.0.0.1
StoragePort=$sql_port
StorageUser=slurm
StoragePass=x
PidFile=$T/slurmdbd.pid
TEXT
  chmod 600 "$T/slurmdbd.conf"
  accounting="AccountingStorageType=accounting_storage/slurmdbd
AccountingStorageHost=localhost
AccountingStoragePort=$dbd_port
AccountingStoragePass=$T/munge/socket
AccountingStorageEnforce=limits"
}

# start_slurm [MAX-SUBMIT-JOBS]: sets SLURM_CONF; with a number, no user may have more jobs.
start_slurm() {
  local most=${1:-} node accounting=''
  node=$(hostname -s)
  mkdir -m 755 "$T/state" "$T/spool" "$T/munge"
  dd if=/dev/urandom of="$T/munge/key" bs=128 count=1 2>/dev/null
  chmod 400 "$T/munge/key"
  munged --foreground --force --key-file="$T/munge/key" --socket="$T/munge/socket" \
    --pid-file="$T/munge/pid" --seed-file="$T/munge/seed" --log-file="$T/munged.log" \
    >"$T/munged-out.log" 2>&1 &
  started+=($!)
  [[ -z $most ]] || start_database
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
SchedulerParameters=sched_interval=1,sched_min_interval=0,batch_sched_delay=1
SlurmctldDebug=debug
ReturnToService=2
KillWait=5
MailProg=/bin/true
$accounting
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=main Nodes=$node Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:8
TEXT
  if [[ -n $most ]]; then
    slurmdbd -D >"$T/slurmdbd.log" 2>&1 &
    started+=($!)
    wait_for 'accounting answers' sacctmgr -n show cluster
    { sacctmgr -i add cluster gapfarm && sacctmgr -i modify user root set MaxSubmitJobs="$most"; } \
      >"$T/sacctmgr.log" 2>&1 || fail 'no limit'
  fi
  slurmctld -D >"$T/slurmctld.log" 2>&1 &
  started+=($!)
  slurmd -D -N "$node" >"$T/slurmd.log" 2>&1 &
  started+=($!)
  wait_for 'the node is idle' node_is idle
}

node_is() { [[ $(sinfo --noheader --format=%t) == "$1" ]]; }
