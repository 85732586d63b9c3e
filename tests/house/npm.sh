#!/usr/bin/env bash
# npm.sh SOURCES: without npm, and where its registry cannot be reached, a build continues and reports the missing parts.
set -euo pipefail
sources=$1
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
get() { # WHERE [cmake -D...]
  cmake "${@:2}" -DTAKT_NPM_LOCK_DIR="$sources/client_lib/view/web" -DTAKT_NPM_OUT="$place/$1" \
    -DTAKT_NPM_RUN=build -DTAKT_NPM_STAMP="$place/$1.stamp" "-DTAKT_NPM_WHAT=There is no page." \
    -P "$sources/cmake/npm.cmake" 2>&1
}
said=$(get none -DNPM_PROGRAM=)
[[ $said == *"not installed (Debian package npm). There is no page."* ]] || { echo "without npm: $said"; exit 1; }
[[ ! -e $place/none.stamp ]]
command -v npm >/dev/null || exit 0
# Port 9 has no listener, and the cache is empty.
said=$(npm_config_registry=http://127.0.0.1:9/ npm_config_cache="$place/cache" get dead)
[[ $said == *"npm install failed ("*"ECONNREFUSED"*"). There is no page."* && $(wc -l <<<"$said") -le 2 ]] ||
  { echo "without its registry: $said"; exit 1; }
[[ ! -e $place/dead.stamp && ! -e $place/dead/installed.txt ]]
