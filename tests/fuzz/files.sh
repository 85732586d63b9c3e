#!/usr/bin/env bash
# Fuzzes the readers of files and of protocols, one format after the other: files.sh BUILD [--minutes N] [FORMAT...]. Useful
# inputs go to BUILD/fuzz/FORMAT, where the next run continues; an input that ends a reader is named, and belongs
# into tests/fuzz/corpus after the repair. Ends with 1 if there was one.
set -euo pipefail
build=$1 minutes=5
shift
corpus=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/corpus
formats=()
while (($#)); do
  case $1 in
    --minutes) minutes=$2; shift 2 ;;
    obj | stl | glb | dae | urdf | sdf | yaml | rtde | urscript) formats+=("$1"); shift ;;
    *) echo "files: unknown word '$1'; there are --minutes N (for each format), obj, stl, glb, dae, urdf, sdf, yaml, rtde, urscript" >&2; exit 2 ;;
  esac
done
((${#formats[@]})) || formats=(obj stl glb dae urdf sdf yaml rtde urscript)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
status=0
for format in "${formats[@]}"; do
  kept=$build/fuzz/$format
  mkdir -p "$kept"
  log=$build/fuzz/$format.log
  case $format in
    rtde | urscript) program=takt-fuzz-protocols ;;
    *) program=takt-fuzz-files ;;
  esac
  if TAKT_FUZZ_FORMAT=$format TMPDIR=$scratch "$build/bin/$program" -max_total_time=$((minutes * 60)) -max_len=4096 \
    -timeout=20 -rss_limit_mb=2048 -malloc_limit_mb=1024 -artifact_prefix="$build/fuzz/$format-" "$kept" "$corpus/$format" \
    >"$log" 2>&1; then
    echo "$format: $(tail -n 1 "$log")"
  else
    status=1
    echo "$format: a reader did not end as it should ($log):"
    grep -E 'ERROR|SUMMARY|Test unit written|runtime error|what\(\)' "$log" || tail -n 5 "$log"
  fi
done
exit $status
