# Sourced by scripts that have `gapfarm blind-check` judge logs of their own making.  Twenty without
# an effect and one a line of $effects (NAME KEY=VALUE...), in $out/cases, with what is in them in
# $out/truth.  Wants $out, $bin, $config, $jobs, and make_log FOLDER SEED [NAME.KEY=VALUE...].

# make_case ID SEED [NAME KEY=VALUE...]
make_case() {
  id=$1 seed=$2
  shift 2
  answer=none values='' arguments=''
  if [ $# -gt 0 ]; then
    answer=effect name=$1
    shift
    for value in "$@"; do
      arguments="$arguments $name.$value"
      values="$values${values:+, }\"${value%%=*}\": ${value#*=}"
    done
    values="\"$name\": {$values}"
  fi
  mkdir -p "$out/cases/$id" "$out/truth"
  # shellcheck disable=SC2086
  make_log "$out/cases/$id" "$seed" $arguments
  printf '{"effects": {%s}, "level": "clear", "answer": "%s"}\n' "$values" "$answer" \
    >"$out/truth/$id.json"
}

judge_labelled_cases() {
  seed=100
  while [ $seed -lt 120 ]; do
    make_case "null$seed" $seed
    seed=$((seed + 1))
  done
  echo "$effects" | while read -r line; do
    # shellcheck disable=SC2086
    make_case "effect$seed" $seed $line
    seed=$((seed + 1))
  done
  "$bin/gapfarm" blind-check "$config" --foreign "$out/cases" --truth "$out/truth" \
    --out "$out/check" --jobs "$jobs" --workers 1
}
