#!/bin/sh
# The container image's recipe has only steps that docker/check_recipe supports, and it reports others. The steps
# themselves take long: ./dev docker-check.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
if ! command -v python3 > /dev/null; then
  echo "skipped: no python3"
  exit 77
fi
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
"$root/docker/check_recipe" --parse-only
sed 's/^WORKDIR/HEALTHCHECK/' "$root/docker/Dockerfile" > "$place/Dockerfile"
if "$root/docker/check_recipe" --parse-only --dockerfile "$place/Dockerfile" 2> "$place/said"; then
  echo "an unknown instruction is let through"
  exit 1
fi
grep -q 'line 5, HEALTHCHECK: not known here' "$place/said" || { cat "$place/said"; exit 1; }
# The files that the recipe copies exist.
for source in dev docker/collect; do test -x "$root/$source"; done
