#!/usr/bin/env bash
# The pods of configs/sites/kubernetes/base by `podman kube play`: a worker is killed, one is evicted, the master is
# evicted, too; each is started again as its Job would.  The run is the undisturbed one, and all pods complete.
#   kubernetes_pods_test.sh BIN ROOT
set -u
BIN=$1 ROOT=$2
source "$ROOT/tests/launch/common.sh"
command -v podman >/dev/null || not_run 'podman is not installed (scripts/setup.sh --boxes)'
command -v ip >/dev/null || not_run 'ip is not installed (scripts/setup.sh --tests)'
[[ $(id -u) -eq 0 ]] || not_run 'namespaces want root'
/usr/bin/python3 -c 'import yaml' 2>/dev/null || not_run 'python3-yaml is not installed (scripts/setup.sh --tests)'
if [[ -z ${GAPFARM_INSIDE:-} ]]; then
  unshare --mount --net true 2>/dev/null || not_run 'this sandbox lends no namespaces'
  # A network of its own: port 5555 may be taken outside.  A runtime takes cgroups of one version.  Of podman, locks
  # and states are the machine's whatever --root says, and its runtime gives /dev/null to the pods' user: here all
  # three are the test's own.
  # shellcheck disable=SC2016
  GAPFARM_INSIDE=yes exec unshare --mount --net --propagation private bash -c '
    umount /sys/fs/cgroup/unified 2>/dev/null
    mkdir -p /run/libpod && mount -t tmpfs tmpfs /run/libpod && mount -t tmpfs tmpfs /dev/shm &&
      mknod -m 666 /dev/shm/null c 1 3 && mount --bind /dev/shm/null /dev/null
    ip link set lo up && exec "$@"' bash "$0" "$@"
fi

T=$(mktemp -d /tmp/gapfarm-pods-XXXXXX)
chmod 755 "$T"
# The Service's name, as the pods see it, too: they share this machine's network.
printf '127.0.0.1 localhost %s gapfarm\n' "$(hostname)" >"$T/hosts"
mount --bind "$T/hosts" /etc/hosts
storage=(--root "$T/images" --runroot "$T/running")
# No call may keep the test, and each that fails is named.
pod() {
  timeout -k 5 60 podman "${storage[@]}" "$@"
  local code=$?
  ((code < 124)) || echo "$SECONDS s: podman $* ended with $code" | tee -a "$T/podman.log" >&2
  return $code
}
# step WHAT: what is done next, and after how long.
step() {
  step=$1
  echo "$SECONDS s: $step"
}
take_away() {
  [[ -n ${passed:-} ]] || {
    echo "the step was: $step"
    pod ps -a
    pod ps -aq | while read -r id; do echo "== $id"; pod logs "$id" 2>&1 | tail -n 5; done
  }
  wait
  pod pod rm -fa -t 0 >/dev/null 2>&1
  awk -v t="$T/" 'index($2, t) == 1 { print $2 }' /proc/self/mounts | sort -r | xargs -r umount -l
  clean_up
}
trap take_away EXIT
# As in scripts/launch/container/Containerfile: machines that let podman do less than it wants.
export CONTAINERS_CONF=$T/containers.conf
cat >"$CONTAINERS_CONF" <<'TEXT'
[containers]
default_ulimits = ["nofile=1024:1024", "nproc=1024:1024"]
[engine]
cgroup_manager = "cgroupfs"
events_logger = "file"
TEXT
step 'podman makes an image'
pod info >/dev/null 2>&1 || storage+=(--storage-driver vfs)
pod info >"$T/info.log" 2>&1 || not_run "podman: $(tail -n 1 "$T/info.log")"

# An image of the programs, what they and the manifests' commands need, and the folders that volumes are mounted on.
mkdir -p "$T"/image/{bin,etc,tmp,keys,secret,listed,config,run/gapfarm}
cp "$BIN/gapfarm" "$BIN/gapfarm-worker" "$(command -v sh)" "$(command -v grep)" "$(command -v install)" "$T/image/bin/"
ldd "$T"/image/bin/* | grep -o '/[^ :]*' | sort -u | grep -v "^$T" | while read -r library; do
  install -D "$library" "$T/image$library"
done
echo 'hosts: files dns' >"$T/image/etc/nsswitch.conf"
tar -C "$T/image" --owner=10001 --group=10001 -c . |
  pod import -q --change 'ENV PATH=/bin' - localhost/gapfarm:latest >/dev/null || fail 'no image'
said=$(pod run --rm --network host gapfarm:latest gapfarm-worker --version 2>&1) ||
  not_run "podman starts nothing here: $said"

# What docs/launching.md has kubectl create.
write_config
sed -i 's|^trials = .*|trials = ["trials.csv"]|' "$T/run.toml"
printf '[evolution.stop]\ngenerations = 1000000\n' >>"$T/run.toml"
cp "$ROOT/configs/demo/trials.csv" "$T/trials.csv"
"$BIN/gapfarm" keys make --keys "$T/keys" >/dev/null 2>&1 || fail 'no keys'
# made KIND NAME FILE...: one with the files' texts (podman 4.3 mounts what a secret holds as it is, undecoded).
made() {
  /usr/bin/python3 - "$@" <<'PY'
import json, pathlib, sys
kind, name, *files = sys.argv[1:]
print(json.dumps({'apiVersion': 'v1', 'kind': kind, 'metadata': {'name': name},
                  'data': {pathlib.Path(f).name: pathlib.Path(f).read_text() for f in files}}))
PY
}
for who in master worker; do
  made Secret "gapfarm-$who" "$T/keys/$who.key" "$T/keys/master.pub" | pod secret create "gapfarm-$who" - >/dev/null ||
    fail 'no secret'
done
made ConfigMap gapfarm-listed "$T"/keys/workers/* >"$T/listed.yaml"
made ConfigMap gapfarm-config "$T/run.toml" "$T/trials.csv" | sed 's/"run.toml"/"config.toml"/' >"$T/config.yaml"
mkdir "$T/pods"
"$ROOT/tests/launch/kubernetes_pods.py" "$ROOT/configs/sites/kubernetes/base" "$T/pods" || fail 'no pods'

play() {
  pod kube play --network host --configmap "$T/listed.yaml" --configmap "$T/config.yaml" "$T/pods/$1.yaml" >>"$T/$1.log" 2>&1
}
# What was killed or stopped is being cleaned up for a moment, and cannot be removed then.
removed() { ! pod pod exists "$1" || pod pod rm -f -t 0 "$1" >>"$T/play.log" 2>&1; }
# start NAME...: as a Job's controller, also again.
start() {
  local name waiting=()
  for name in "$@"; do
    wait_for "$name starts" removed "$name"
    play "$name" &
    waiting+=($!)
  done
  for name in "${waiting[@]}"; do wait "$name" || fail "cannot play one of $*"; done
}
# expect_end CONTAINER CODE: it ends within a minute, with that.
state_of() { pod inspect --format '{{.State.Status}} {{.State.ExitCode}}' "$1"; }
has_ended() { [[ $(state_of "$1") == exited* ]]; }
expect_end() {
  wait_for "$1 has ended" has_ended "$1"
  [[ $(state_of "$1") == "exited $2" ]] || fail "$1: $(state_of "$1"), and not $2"
}
workers=("$T"/pods/gapfarm-worker-*.yaml)
workers=("${workers[@]##*/}")
workers=("${workers[@]%.yaml}")
pod kube play "$T/pods/gapfarm-run.yaml" >>"$T/play.log" 2>&1 || fail 'no volume'
run=$(pod volume inspect gapfarm-run --format '{{.Mountpoint}}')/r
step 'the pods begin'
began=$SECONDS
start gapfarm-master "${workers[@]}"
there() { [[ $(status "$run" 'sum(w["state"] != "gone" for w in s["workers"])') == "$1" ]]; }
wait_for "${#workers[@]} pods work" there "${#workers[@]}"
slow=$((SECONDS - began))
wait_for 'generations are committed' committed "$run" 2
mapfile -t probe < <(/usr/bin/python3 -c 'import json, sys
print(*json.load(open(sys.argv[1]))["spec"]["containers"][0]["livenessProbe"]["exec"]["command"], sep="\n")' \
  "$T/pods/gapfarm-worker-0.yaml")
step 'a probe of a worker, and of none'
pod exec gapfarm-worker-0-worker "${probe[@]}" || fail 'the liveness probe finds no worker'
pod run --rm --network host gapfarm:latest "${probe[@]}"
[[ $? -eq 1 ]] || fail 'the liveness probe does not find that there is no worker'

step 'a worker is killed, and one evicted'
pod kill -s KILL gapfarm-worker-0-worker >>"$T/play.log" || fail 'cannot kill'
expect_end gapfarm-worker-0-worker 137
pod pod stop -t 40 gapfarm-worker-1 >>"$T/play.log" 2>&1
expect_end gapfarm-worker-1-worker 0
start gapfarm-worker-0 gapfarm-worker-1
wait_for 'those killed and evicted are replaced' there "${#workers[@]}"
step 'the master is evicted'
pod pod stop -t 40 gapfarm-master >>"$T/play.log" 2>&1
expect_end gapfarm-master-master 85
echo "at generation $(status "$run" 's["generation"]')"
# Its last life is long enough for all workers to find it: they try again every five seconds at most.
sed -i "s|gapfarm resume /run/gapfarm/r|& --time $(status "$run" "int(s['wall_s']) + 15 + $slow")|" "$T/pods/gapfarm-master.yaml"
start gapfarm-master
again() { [[ $(status "$run" 's["epoch"]') -ge 2 ]]; }
wait_for 'it resumes' again
wait_for 'all workers are back' there "${#workers[@]}"
finished() { [[ $(status "$run" 's["state"]') == finished ]]; }
step 'the rest of the run'
wait_for 'the run is finished' finished
expect_end gapfarm-master-master 0
master=''
ln -s "$run" "$T/run"
compare_with_calm_run
step 'the workers complete'
for worker in "${workers[@]}"; do expect_end "$worker-worker" 0; done
# By podman's record: the undisturbed run takes this test as long as it likes.
mapfile -t ends < <(pod inspect --format '{{.State.FinishedAt.Unix}}' gapfarm-master-master "${workers[@]/%/-worker}")
idle_seconds $(($(printf '%s\n' "${ends[@]}" | sort -n | tail -n 1) - ends[0]))
passed=yes
