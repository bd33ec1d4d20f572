#!/usr/bin/env bash
# gapfarm workers --on sge on Debian's Grid Engine, started here, that allows a user four jobs: never more, every
# one whose wall time ends is replaced, and none is left after the run.
#   sge_test.sh BIN ROOT
set -u
BIN=$1 ROOT=$2
source "$ROOT/tests/launch/common.sh"
PATH=$PATH:/usr/sbin
for program in sge_qmaster sge_execd qsub qconf setpriv unshare; do
  command -v "$program" >/dev/null || not_run "$program is not installed (scripts/setup.sh --tests)"
done
[[ $(id -u) -eq 0 ]] || not_run 'sge_execd wants to be root'
if [[ -z ${GAPFARM_INSIDE:-} ]]; then
  unshare --mount true 2>/dev/null || not_run 'this sandbox lends no mount namespaces'
  # The cell, its spool and the name of this host are seen by this test only.
  GAPFARM_INSIDE=yes exec unshare --mount --propagation private "$0" "$@"
fi

T=$(mktemp -d /tmp/gapfarm-sge-XXXXXX)
chmod 755 "$T"
interval=6  # of the scheduler, s
# Asked to end, a qmaster takes seven seconds.
sge=()
trap 'kill -KILL "${sge[@]}"; wait "${sge[@]}"; clean_up' EXIT
node=$(hostname)
printf '127.0.0.1 %s localhost\n' "$node" >"$T/hosts"
mount --bind "$T/hosts" /etc/hosts
mkdir -p "$T/cell/common" "$T"/spool/{qmaster/job_scripts,spooldb,execd}
cp /var/lib/gridengine/default/common/bootstrap "$T/cell/common/"
echo "$node" >"$T/cell/common/act_qmaster"
chown -R sgeadmin "$T/cell" "$T/spool"
mount --bind "$T/cell" /var/lib/gridengine/default
mount --bind "$T/spool" /var/spool/gridengine
export SGE_ROOT=/var/lib/gridengine SGE_CELL=default SGE_ND=1
SGE_QMASTER_PORT=$(free_port)
SGE_EXECD_PORT=$(free_port)
export SGE_QMASTER_PORT SGE_EXECD_PORT
as_admin() { setpriv --reuid sgeadmin --regid sgeadmin --clear-groups "$@"; }
as_admin /usr/share/gridengine/scripts/init_cluster "$SGE_ROOT" default /var/spool/gridengine/spooldb sgeadmin \
  >"$T/init.log" 2>&1 || fail 'no cell'
sge_qmaster >"$T/qmaster.log" 2>&1 &
sge+=($!)
wait_for 'the qmaster answers' qconf -sconf
{
  as_admin qconf -am root
  qconf -ah "$node"
  qconf -as "$node"
  printf 'group_name @allhosts\nhostlist %s\n' "$node" >"$T/group"
  qconf -Ahgrp "$T/group"
  # Every row of a queue that Grid Engine wants, with what matters here at the front.
  {
    printf '%s\n' 'qname all.q' 'hostlist @allhosts' 'slots 8' 'notify 00:00:05' 'qtype BATCH' 'shell /bin/sh' \
      'shell_start_mode posix_compliant' 'tmpdir /tmp' 'seq_no 0' 'nsuspend 1' 'suspend_interval 00:05:00' \
      'priority 0' 'min_cpu_interval 00:05:00' 'processors UNDEFINED' 'rerun FALSE' 'initial_state default'
    for key in load_thresholds suspend_thresholds ckpt_list pe_list prolog epilog starter_method suspend_method \
      resume_method terminate_method owner_list user_lists xuser_lists subordinate_list complex_values projects \
      xprojects calendar; do echo "$key NONE"; done
    for key in rt cpu fsize data stack core rss vmem; do printf 's_%s INFINITY\nh_%s INFINITY\n' $key $key; done
  } >"$T/queue"
  qconf -Aq "$T/queue"
  qconf -ssconf | sed "s/^\(schedule_interval\) .*/\1 0:0:$interval/; s/^\(flush_[a-z]*_sec\) .*/\1 1/" >"$T/scheduler"
  qconf -Msconf "$T/scheduler"
  qconf -sconf global | sed 's/^\(min_[ug]id\) .*/\1 0/; s/^\(max_u_jobs\) .*/\1 4/; s/ flush_time=[0-9:]*/ flush_time=0:0:0/' >"$T/global"
  qconf -Mconf "$T/global"
} >"$T/qconf.log" 2>&1
sge_execd >"$T/execd.log" 2>&1 &
sge+=($!)
up() { qhost | grep -q "^$node .*lx-amd64 *[0-9]"; }
wait_for 'the node is there' up

write_config
start_master 127.0.0.1
while sleep 0.2; do qstat -u root -g d 2>/dev/null | grep -c '^ *[0-9]'; done >"$T/standing" &
started+=($!)
"$BIN/gapfarm" workers --on sge --run "$T/run" --keys "$T/keys" --max 8 --wall-time 20 --look-every 1 --block 1 \
  --worker-logs "$T/logs" 2>"$T/workers.log" &
fleet=$!
started+=("$fleet")
workers_are() { [[ $(status "$T/run" 'sum(w["state"] != "gone" for w in s["workers"])') == "$1" ]]; }
wait_for 'four workers have joined' workers_are 4
why() { [[ $(status "$T/run" 's["fleets"][0]["why"]') == *'no more than 4 jobs'* ]]; }
wait_for 'status says why there are no more' why
replaced() { [[ $(find "$T/logs" -name '*.log' | wc -l) -ge 8 ]]; }
wait_for 'every one was replaced' replaced
gone() { [[ -z $(qstat -u root) ]]; }
expect_taken_away sge
# Of the accounting file (sge_accounting(5)) the times of submission and start, in s.
filled "$(grep -v '^#' "$T/cell/common/accounting" | sort -t : -k 10n,10 | awk -F : -v cycle=$interval '
  NR == 1 || $9 < asked { asked = $9 }
  NR == 4 { print int(($10 - asked + cycle - 1) / cycle); exit }')"
exit 0
