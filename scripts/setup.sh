#!/usr/bin/env bash
# Installs the Debian 12 packages that gapfarm is built from.  Does nothing when all are there.
#   scripts/setup.sh [--tests] [--boxes] [--bench]
# --tests: also what only the tests need (format, browser, Slurm, Grid Engine, sshd).  --boxes: also what bare Debians and
# containers are made with, for machines that let root make them; without it the tests that want them say so.
# --bench: also what searches are compared with (scripts/compare_searches.sh).
set -euo pipefail

packages=(
  build-essential ccache cmake git ninja-build pkg-config
  cppzmq-dev libbenchmark-dev libboost-dev libbullet-dev libbz2-dev libcli11-dev libeigen3-dev
  libgmock-dev
  libgtest-dev liblz4-dev libnlopt-cxx-dev libprotobuf-dev librandom123-dev libsodium-dev
  libspdlog-dev libsqlite3-dev libtinyxml2-dev libtomlplusplus-dev libyaml-cpp-dev libzmq3-dev
  libzstd-dev nlohmann-json3-dev
  protobuf-compiler
)
wanted=" $* "
if [[ $wanted == *' --tests '* ]]; then
  packages+=(chromium clang-format fonts-dejavu-core)
  if ! command -v node >/dev/null; then packages+=(nodejs); fi  # drives the browser
  packages+=(fish lintian zsh)  # shells that complete commands; what judges packages
  # A simulator by MuJoCo, and the Python package.
  packages+=(libmujoco-dev mypy python3-numpy python3-pandas python3-pytest)
  # Farms over Slurm (with a database for its limits), Grid Engine and ssh, and Kubernetes' types (tests/launch).
  packages+=(gridengine-client gridengine-exec gridengine-master iproute2 mariadb-client-core mariadb-server-core munge
    openssh-client openssh-server python3-kubernetes python3-yaml slurm-wlm slurmdbd)
fi
if [[ $wanted == *' --boxes '* ]]; then
  packages+=(catatonit debootstrap podman)
fi
if [[ $wanted == *' --bench '* ]]; then
  packages+=(libpagmo-dev)
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query --show --showformat '${db:Status-Status}' "$package" 2>/dev/null || true)
  if [[ "$status" != installed ]]; then missing+=("$package"); fi
done
if [[ ${#missing[@]} -eq 0 ]]; then exit 0; fi

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "setup: run as root, or install sudo; missing packages: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
echo "setup: installing ${missing[*]}"
"${as_root[@]}" apt-get update -qq
# Clusters are started by the tests that want them, and by nothing else.
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive bash -c '
  policy=/usr/sbin/policy-rc.d
  if [[ ! -e $policy ]]; then
    trap "rm -f $policy" EXIT
    printf "#!/bin/sh\nexit 101\n" >$policy
    chmod +x $policy
  fi
  echo "gridengine-common shared/gridengineconfig boolean false" | debconf-set-selections
  apt-get install -y -qq --no-install-recommends "$@"' bash "${missing[@]}"
