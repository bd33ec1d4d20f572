#!/usr/bin/env bash
# Includes run one way, proto <- common <- {worker, master}, and each third-party library that owns
# an idea of the program (transport, physics, storage, config) is seen by one folder alone.
set -euo pipefail
cd "$1"
failures=0

# forbid FOLDER... -- PATTERN REASON: no include in the folders may match.
forbid() {
  local folders=()
  while [[ $1 != -- ]]; do folders+=("$1"); shift; done
  local found
  found=$(grep -rnE --include='*.h' --include='*.cc' "^#include [<\"]$2" "${folders[@]}" || true)
  if [[ -n "$found" ]]; then
    printf '%s\n    %s\n' "$found" "$3"
    failures=$((failures + 1))
  fi
}

forbid common -- '(worker|master|tests)/' 'common includes neither worker nor master'
forbid worker -- '(master|tests)/' 'worker does not include master'
forbid master -- '(worker|tests)/' 'master does not include worker: ask for a job instead'

# outside FOLDER PATTERN REASON: only that folder may include it.
outside() {
  local found
  found=$(grep -rnE --include='*.h' --include='*.cc' "^#include [<\"]$2" common worker master \
    | grep -vE "^$1/" || true)
  if [[ -n "$found" ]]; then
    printf '%s\n    %s\n' "$found" "$3"
    failures=$((failures + 1))
  fi
}

outside common/net 'zmq' 'only common/net includes ZeroMQ'
outside worker/sim '(bullet|Bullet|LinearMath|btBullet)' 'only worker/sim includes Bullet'
outside 'master/(store|io/logs)' 'sqlite3' 'only the run store and the reader of bags include SQLite'
outside master/io/logs '(bzlib|lz4|zstd)' 'only master/io/logs unpacks'
outside common/config 'toml' 'only common/config includes toml++'
outside 'common/(math|score)' 'boost/math' 'probabilities are asked of common/math/laws.h'
outside master/io/robot_files '(tinyxml2|yaml-cpp)' 'only master/io/robot_files includes tinyxml2 and yaml-cpp'

# Headers that take seconds to read: in these places only, and in no header but those named.
# heavy PATTERN PLACES REMEDY: PLACES is a regular expression of file names.
heavy() {
  local found
  found=$(grep -rnE --include='*.h' --include='*.cc' "^#include [<\"]$1" common worker master \
    | grep -vE "^($2):" || true)
  if [[ -n "$found" ]]; then
    printf '%s\n    %s\n' "$found" "$3 (a heavy header: scripts/build_times.sh)"
    failures=$((failures + 1))
  fi
}
source='[a-z_0-9]*\.cc'
heavy 'CLI/' "master/(cli|command)/.*|common/usage/.*|worker/main.cc" \
  'command lines are read in master/cli, master/command and worker/main.cc'
heavy 'nlohmann/json\.hpp' "common/(log|external|json)/$source|master/.*/$source|common/json/(fields|matrix).h|master/command/provenance.h" \
  'headers include json_fwd.hpp, and the worker writes no JSON itself'
heavy 'Eigen/(Dense|SVD|Eigenvalues|QR|Geometry|LU|Cholesky)' ".*/$source|master/io/robot_files/.*" \
  'headers include Eigen/Core'
heavy 'spdlog/' "common/log/$source|master/.*/$source" 'logs go through common/log, fmt is for sources'
heavy '(google/protobuf|boost)/' ".*/$source" 'sources only'

globs=$(grep -rnE --include=CMakeLists.txt 'file\((GLOB|GLOB_RECURSE)' common worker master tests \
  proto || true)
if [[ -n "$globs" ]]; then
  printf '%s\n    %s\n' "$globs" 'list sources by hand'
  failures=$((failures + 1))
fi

if [[ $failures -gt 0 ]]; then exit 1; fi
echo 'includes: fine'
