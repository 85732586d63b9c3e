#!/usr/bin/env bash
# run.sh NAME SOURCES BUILD: one of the tests here, in the folder where npm has put its parts.
set -euo pipefail
name=$1 sources=$2 build=$3
place=$build/tests/web bin=$build/bin
command -v node >/dev/null || { echo "skipped: node is not installed (Debian package nodejs)"; exit 77; }
[[ -f $place/installed.txt ]] || { echo "skipped: npm could not be reached when takt was built"; exit 77; }
cp "$sources"/tests/web/*.mjs "$place"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
export TAKT_BIN=$bin TAKT_SOURCES=$sources TAKT_WORK=$work
case $name in
  recording)
    for compression in zstd lz4 none; do
      "$bin/takt-run" run "$sources/config/scenarios/block_assembly.yaml" --duration 12 --lod 2 --mcap run.mcap --quiet \
        --mcap-compression $compression
      "$bin/takt" export run.mcap --json >run.jsonl
      node "$place/recording.mjs" run.mcap run.jsonl "${compression/none/}"
    done
    ;;
esac
if [[ $name != recording ]]; then node "$place/$name.mjs" "${@:4}"; fi
