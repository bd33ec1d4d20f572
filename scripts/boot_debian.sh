#!/usr/bin/env bash
# Boots the systemd of a root folder in namespaces of its own: processes, mounts and cgroups, not the network.
#   scripts/boot_debian.sh FOLDER
# Prints the process id of the system's first process once it is up (`nsenter --all --root --wd --target` goes there) and
# stays in the foreground: what was booted ends with it.  Status 77: this machine does not let it.
set -euo pipefail
box=$(realpath "$1")
# with_cgroups COMMAND: with the folder of our cgroup, wherever this machine mounts that tree, if at all.
with_cgroups() {
  local tree
  tree=$(mktemp -d)
  mount -t cgroup2 none "$tree"
  "$@" "$tree/gapfarm.$owner"
  umount "$tree"
  rmdir "$tree"
}
join() { mkdir "$1" && echo $$ >"$1/cgroup.procs"; }
# shellcheck disable=SC2317
leave() {
  local left
  for left in {1..50}; do  # what was killed is gone in a moment
    find "$1" -depth -type d -exec rmdir {} + 2>/dev/null && return
    sleep 0.1
  done
}

# What systemd wants to find, and no device or setting of this machine with it.
mount_all() {
  mount --make-rprivate /
  mount --bind "$box" "$box"
  mount -t proc none "$box/proc"
  mount --bind "$box/proc/sys" "$box/proc/sys"
  mount -o remount,bind,ro "$box/proc/sys"
  local folder device
  for folder in sys run dev; do mount -t tmpfs none "$box/$folder"; done
  mkdir -p "$box/sys/fs/cgroup" "$box/dev/shm" "$box/dev/pts"
  mount -t cgroup2 none "$box/sys/fs/cgroup"
  ln -s pts/ptmx "$box/dev/ptmx"
  for device in null zero full random urandom tty; do
    touch "$box/dev/$device"
    mount --bind "/dev/$device" "$box/dev/$device"
  done
}

boot() {
  owner=$$
  # shellcheck disable=SC2317
  end() {
    kill -KILL "$booted" 2>/dev/null || true
    wait "$booted" 2>/dev/null || true
    with_cgroups leave
  }
  unshare --mount "$0" "$box" "in_cgroup" "$owner" >&2 &
  booted=$!
  trap end EXIT
  trap 'exit 0' TERM INT
  local first deadline=$((SECONDS + 60))
  until first=$(pgrep -P "$booted" -f '^/lib/systemd/systemd ') &&
    nsenter --all --root --wd --target "$first" systemctl is-system-running 2>/dev/null | grep -q -e running -e degraded; do
    kill -0 "$booted" 2>/dev/null || { echo 'not run: no systemd in namespaces here' >&2; exit 77; }
    ((SECONDS < deadline)) || { echo 'not run: systemd does not come up here' >&2; exit 77; }
    sleep 0.2
  done
  echo "$first"
  wait "$booted"
}

case ${2:-} in
  '') boot ;;
  in_cgroup)
    owner=$3
    with_cgroups join
    exec unshare --cgroup --pid --uts --ipc --mount --fork --kill-child "$0" "$box" first
    ;;
  first)
    mount_all
    # Not chroot alone: services with mounts of their own want a root that can be moved.
    mkdir "$box/run/outside"
    cd "$box"
    pivot_root . run/outside
    exec chroot . /bin/sh -c 'umount -l /run/outside && rmdir /run/outside && exec "$@"' sh \
      /usr/bin/env -i container=gapfarm PATH=/usr/sbin:/usr/bin:/sbin:/bin \
      /lib/systemd/systemd --unit=multi-user.target --log-target=console --show-status=0
    ;;
esac
