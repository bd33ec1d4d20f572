#!/usr/bin/env bash
# gapfarm submit --on slurm on a real Slurm: the master is a job with workers as jobs beside it; warned in the middle
# as of its time's end, it stops, queues itself again and resumes its run.
#   slurm_run_test.sh BIN ROOT
set -u
BIN=$1 ROOT=$2
source "$ROOT/tests/launch/common.sh"
source "$ROOT/tests/launch/slurm_cluster.sh"
slurm_needs

T=$(mktemp -d /tmp/gapfarm-slurm-XXXXXX)
chmod 755 "$T"
trap clean_up EXIT
start_slurm
write_config
"$BIN/gapfarm" keys make --keys "$T/keys" >/dev/null 2>&1 || fail 'no keys'
# With a port of its own the master finds the workers of its first life again.
job=$("$BIN/gapfarm" submit --on slurm --keys "$T/keys" --listen "tcp://*:$(free_port)" --max 2 --look-every 1 --worker-logs "$T" -- \
  evolve "$T/run.toml" --out "$T/run" --generations 40 2>"$T/submit.log") || fail 'submit'
echo "$job"
job=$(grep -o '[0-9]*' <<<"$job" | head -n 1)
wait_for 'the master and its workers have committed a generation' committed "$T/run" 2
# What slurmctld sends of itself --signal=B:USR1@60 before the end.
scancel --batch --signal=USR1 "$job" || fail 'no signal'
before=$(status "$T/run" 's["generation"]')
again() { [[ $(status "$T/run" 's["epoch"]') -ge 2 && $(status "$T/run" 's["state"]') != stopped ]]; }
wait_for 'the master is queued again and resumes' again
finished() { [[ $(status "$T/run" 's["state"]') == finished ]]; }
wait_for "the run goes on after generation $before to its end" finished
gone() { [[ -z $(squeue --noheader 2>/dev/null) ]]; }
ended=$SECONDS
wait_for 'no job is left' gone
idle_seconds $((SECONDS - ended))
record=$(scontrol show job "$job")
[[ $record == *' Restarts=1 '* && $record == *JobState=COMPLETED* ]] || fail "not queued again once: $record"
"$BIN/gapfarm" evolve "$T/run.toml" --out "$T/calm" --generations 40 --workers 2 2>"$T/calm.log" ||
  fail 'the calm run failed'
digest=$(status "$T/run" 's["digest"]') calm=$(status "$T/calm" 's["digest"]')
echo "digest $digest, undisturbed $calm"
[[ -n $digest && $digest == "$calm" ]] || fail 'the digests differ'
