#!/usr/bin/env bash
# What ./dev asks the build for is there: dev_targets.sh SOURCE BUILD, where BUILD is one of Ninja with all options on.
set -euo pipefail
source=$1 build=$2 status=0
command -v ninja >/dev/null && [[ -f $build/build.ninja ]] || exit 77
# Lines `build release TARGET...` and `--target TARGET...`; fuzzers are in a build of their own.
mapfile -t targets < <(sed -nE 's/^ *build release ([a-z].*)$/\1/p; s/.* --target ([a-z].*)$/\1/p' "$source/dev" |
  tr ' ' '\n' | sort -u)
((${#targets[@]} > 10)) || { echo "$source/dev: ${#targets[@]} targets found, more than 10 expected: are they written otherwise?"; exit 1; }
for target in "${targets[@]}"; do
  ninja -C "$build" -t query "$target" >/dev/null 2>&1 || { echo "$source/dev: the build has no target '$target'"; status=1; }
done
exit $status
