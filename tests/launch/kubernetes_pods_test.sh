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
  # A network of its own: port 5555 may be taken outside.  A runtime takes cgroups of one version.
  # shellcheck disable=SC2016
  GAPFARM_INSIDE=yes exec unshare --mount --net --propagation private bash -c '
    umount /sys/fs/cgroup/unified 2>/dev/null; ip link set lo up && exec "$@"' bash "$0" "$@"
fi

T=$(mktemp -d /tmp/gapfarm-pods-XXXXXX)
chmod 755 "$T"
# The Service's name, as the pods see it, too: they share this machine's network.
printf '127.0.0.1 localhost %s gapfarm\n' "$(hostname)" >"$T/hosts"
mount --bind "$T/hosts" /etc/hosts
storage=(--root "$T/images" --runroot "$T/running")
pod() { podman "${storage[@]}" "$@"; }
take_away() {
  wait
  [[ -n ${passed:-} ]] || pod ps -aq | while read -r id; do pod logs "$id" 2>&1 | tail -n 5; done
  pod pod rm -fa -t 0 >/dev/null 2>&1
  # The runtime hands it to the pods' user, and then no other namespace may write to it.
  chown --reference=/dev/zero /dev/null
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

play() { pod kube play --network host --configmap "$T/listed.yaml" --configmap "$T/config.yaml" "$1" >>"$T/play.log" 2>&1; }
# start NAME...: as a Job's controller, also again.
start() {
  local name waiting=()
  for name in "$@"; do
    pod pod rm -f -t 0 "$name" >/dev/null 2>&1
    play "$T/pods/$name.yaml" &
    waiting+=($!)
  done
  for name in "${waiting[@]}"; do wait "$name" || fail "cannot play one of $*"; done
}
exit_of() { pod wait "$1" 2>/dev/null; }
workers=("$T"/pods/gapfarm-worker-*.yaml)
workers=("${workers[@]##*/}")
workers=("${workers[@]%.yaml}")
pod kube play "$T/pods/gapfarm-run.yaml" >/dev/null 2>&1 || fail 'no volume'
run=$(pod volume inspect gapfarm-run --format '{{.Mountpoint}}')/r
start gapfarm-master "${workers[@]}"
there() { [[ $(status "$run" 'sum(w["state"] != "gone" for w in s["workers"])') == "$1" ]]; }
wait_for "${#workers[@]} pods work" there "${#workers[@]}"
wait_for 'generations are committed' committed "$run" 2
mapfile -t probe < <(/usr/bin/python3 -c 'import json, sys
print(*json.load(open(sys.argv[1]))["spec"]["containers"][0]["livenessProbe"]["exec"]["command"], sep="\n")' \
  "$T/pods/gapfarm-worker-0.yaml")
pod exec gapfarm-worker-0-worker "${probe[@]}" || fail 'the liveness probe finds no worker'
pod run --rm --network host gapfarm:latest "${probe[@]}" && fail 'the liveness probe finds a worker where there is none'

pod kill -s KILL gapfarm-worker-0-worker >/dev/null
[[ $(exit_of gapfarm-worker-0-worker) -eq 137 ]] || fail 'the killed worker did not die'
pod pod stop -t 60 gapfarm-worker-1 >/dev/null 2>&1
[[ $(exit_of gapfarm-worker-1-worker) -eq 0 ]] || fail 'the evicted worker did not leave well'
start gapfarm-worker-0 gapfarm-worker-1
wait_for 'those killed and evicted are replaced' there "${#workers[@]}"
pod pod stop -t 60 gapfarm-master >/dev/null 2>&1
[[ $(exit_of gapfarm-master-master) -eq 85 ]] || fail 'the evicted master did not stop well'
now=$(status "$run" 's["generation"]')
echo "the master is evicted at generation $now"
# Its last life is long enough for all workers to find it: they try again every five seconds at most.
sed -i "s|gapfarm resume /run/gapfarm/r|& --time $(status "$run" 'int(s["wall_s"]) + 20')|" "$T/pods/gapfarm-master.yaml"
start gapfarm-master
again() { [[ $(status "$run" 's["epoch"]') -ge 2 ]]; }
wait_for 'it resumes' again
wait_for 'all workers are back' there "${#workers[@]}"
finished() { [[ $(status "$run" 's["state"]') == finished ]]; }
wait_for 'the run is finished' finished
ended=$SECONDS
[[ $(exit_of gapfarm-master-master) -eq 0 ]] || fail 'the master did not end well'
master=''
ln -s "$run" "$T/run"
compare_with_calm_run
for worker in "${workers[@]}"; do
  code=$(exit_of "$worker-worker")
  [[ $code -eq 0 ]] || { pod logs "$worker-worker"; fail "$worker ended with $code"; }
done
echo 'all workers are complete'
idle_seconds $((SECONDS - ended))
passed=yes
