#!/usr/bin/env bash
# install_test.sh BUILD: a build of the programs alone installs, with its manual pages.
set -euo pipefail
build=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
rm -f "$build"/install/*.gz "$build"/install/gapfarm.bash
cmake --install "$build" --prefix "$folder" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
"$folder/bin/gapfarm" --version
for page in gapfarm gapfarm-worker; do
  zcat "$folder/share/man/man1/$page.1.gz" | grep '^\.TH' >/dev/null  # -q would close the pipe early
done
grep -q gapfarm "$folder/share/bash-completion/completions/gapfarm"
