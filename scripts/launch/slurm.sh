#!/usr/bin/env bash
# Runs gapfarm workers, and the master too if you like, as Slurm jobs.
set -euo pipefail
usage() {
  cat <<'TEXT'
Usage:
  slurm.sh workers --connect tcp://MASTER:PORT [options] [-- SBATCH-OPTIONS]
      a job array of workers for a master that runs elsewhere, the login node for instance
  slurm.sh run [options] -- evolve CONFIG --out RUN [EVOLVE-OPTIONS]
      the master as a job too; workers start with it and end with it
  slurm.sh status JOB...
  slurm.sh stop JOB...

Options:
  --workers N      jobs in the array (4)
  --cpus N         CPUs, and worker processes, of each (1)
  --time [H:]M:S   time limit of each job (none: the partition's)
  --partition P    and --account A, passed to sbatch
  --keys FOLDER    key folder, on a file system that all nodes see (~/.config/gapfarm/keys)
  --bin FOLDER     where gapfarm and gapfarm-worker are (../../build/release/bin)
  --logs FOLDER    of the jobs' output (.)
  --port N         of a master job (5555)
  --insecure       no keys; with a master job, on every network
  --dry-run        print what would run

A worker whose time is nearly up finishes the job in hand and is queued again; so is one whose node
fails or that a more important job displaces.  A master job that is queued again resumes its run.

Examples:
  scripts/launch/slurm.sh workers --connect tcp://login1:5555 --workers 20 --cpus 8 --time 4:00:00
  scripts/launch/slurm.sh run --workers 20 -- evolve configs/demo.toml --out run/demo
  scripts/launch/slurm.sh stop 4711
TEXT
}
fail() {
  echo "slurm.sh: $1" >&2
  exit 2
}

here=$(cd "$(dirname "$0")" && pwd)
workers=4 cpus=1 time='' partition='' account='' connect='' port=5555
keys=${XDG_CONFIG_HOME:-$HOME/.config}/gapfarm/keys
bin=$here/../../build/release/bin
logs=. insecure='' dry=''
[[ $# -gt 0 ]] || { usage >&2; exit 2; }
verb=$1
shift
rest=()
while [[ $# -gt 0 ]]; do
  case $1 in
    --workers | --cpus | --time | --partition | --account | --connect | --port | --keys | --bin | --logs)
      [[ $# -gt 1 ]] || fail "$1 needs a value"
      printf -v "${1#--}" '%s' "$2"
      shift
      ;;
    --insecure) insecure=yes ;;
    --dry-run) dry=yes ;;
    --help | -h) usage; exit 0 ;;
    --) shift; rest+=("$@"); break ;;
    -*) fail "did not expect '$1'; see --help" ;;
    *) rest+=("$1") ;;
  esac
  shift
done
if [[ $verb == workers || $verb == run ]]; then
  [[ -d $bin ]] || fail "there is no folder '$bin'; give --bin FOLDER"
  bin=$(cd "$bin" && pwd)
fi

# Prints the command, or runs it.
run() {
  if [[ -n $dry ]]; then
    printf '%q ' "$@"
    echo
  else
    "$@"
  fi
}

# [D-][H:]M:S, or minutes, in seconds.
seconds_of() {
  local days=0 text=$1 sum=0 part
  case $text in *-*) days=${text%%-*} text=${text#*-} ;; esac
  [[ $text == *:* ]] || text=$text:0
  IFS=: read -ra parts <<<"$text"
  for part in "${parts[@]}"; do sum=$((sum * 60 + 10#$part)); done
  echo $((days * 86400 + sum))
}

common=(--parsable --requeue --open-mode=append)
[[ -z $time ]] || common+=("--time=$time")
[[ -z $partition ]] || common+=("--partition=$partition")
[[ -z $account ]] || common+=("--account=$account")
security=(--keys "$keys")
[[ -z $insecure ]] || security=(--insecure)

# submit_workers CONNECT [SBATCH-OPTIONS]
submit_workers() {
  local to=$1
  shift
  local lifetime=()
  [[ -z $time ]] || lifetime=(--lifetime "$(($(seconds_of "$time") - 30))")
  # USR1 a minute before the end of the time: see slurm_worker.sh.
  run sbatch "${common[@]}" --job-name=gapfarm-worker "--array=1-$workers" "--cpus-per-task=$cpus" \
    --signal=B:USR1@60 "--output=$logs/gapfarm-worker-%A_%a.log" "$@" \
    "$here/slurm_worker.sh" "$bin/gapfarm-worker" "$to" --processes "$cpus" "${security[@]}" \
    "${lifetime[@]}"
}

case $verb in
  workers)
    [[ -n $connect ]] || fail "workers needs --connect tcp://MASTER:PORT"
    submit_workers "$connect" "${rest[@]}"
    ;;
  run)
    [[ ${rest[0]:-} == evolve ]] || fail "run needs -- evolve CONFIG --out RUN"
    out=''
    for ((i = 0; i + 1 < ${#rest[@]}; ++i)); do
      if [[ ${rest[i]} == --out ]]; then out=${rest[i + 1]}; fi
    done
    [[ -n $out ]] || fail "run needs --out RUN"
    endpoint=$out.endpoint
    # The array waits for the master's job, and finds its address in a file.
    [[ -z $insecure ]] || security=(--insecure --insecure-anywhere)
    master=$(run sbatch "${common[@]}" --job-name=gapfarm --signal=B:USR1@60 \
      "--output=$logs/gapfarm-%j.log" "$here/slurm_master.sh" "$bin/gapfarm" "$endpoint" "$port" \
      "$out" "${security[@]}" -- "${rest[@]:1}")
    [[ -z $insecure ]] || security=(--insecure)
    if [[ -n $dry ]]; then
      echo "$master"
      submit_workers "@$endpoint" --dependency=after:MASTER
    else
      array=$(submit_workers "@$endpoint" "--dependency=after:$master")
      echo "$array" >"$endpoint.workers"
      echo "master $master, workers $array; scripts/launch/slurm.sh stop $master $array"
    fi
    ;;
  status)
    [[ ${#rest[@]} -gt 0 ]] || fail "status needs JOB..."
    run squeue --array "--jobs=$(IFS=,; echo "${rest[*]}")" --format='%i %j %T %M %l %N %r'
    ;;
  stop)
    [[ ${#rest[@]} -gt 0 ]] || fail "stop needs JOB..."
    run scancel "${rest[@]}"
    ;;
  --help | -h) usage ;;
  *) fail "unknown verb '$verb'; see --help" ;;
esac
