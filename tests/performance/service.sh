#!/usr/bin/env bash
# service.sh BIN SCENARIO LOD [OPTION OF takt-server ...]: the cell paced in real time as a service, its program sent
# by takt-controller over DDS and its contacts watched by one more client. Prints the server's own measurements, then those
# of bench_wire: latency beside raw Fast DDS, cost by subscribers, unseen servers, cells.
set -euo pipefail
bin=$1 scenario=$2 lod=$3
shift 3
program=$(sed -n 's/^ *program: *//p' "$scenario" | head -1)
program=$(dirname "$scenario")/${program%% *}
[[ -f $program ]] || { echo "service.sh: $scenario names no program (key controller.program)" >&2; exit 2; }
work=$(mktemp -d)
export TAKT_DOMAIN=$((100 + $$ % 90)) TAKT_CELL=service_$$
"$bin/takt-server" "$scenario" --cell "$TAKT_CELL" --domain "$TAKT_DOMAIN" --lod "$lod" --paused "$@" >"$work/server.log" 2>&1 &
server=$!
trap 'kill $server 2>/dev/null || true; rm -rf "$work"' EXIT
takt() { "$bin/takt" --cell "$TAKT_CELL" --domain "$TAKT_DOMAIN" "$@"; }
takt --timeout 60 status >/dev/null || { cat "$work/server.log" >&2; exit 1; }
takt contacts --watch --json >"$work/contacts.jsonl" &
watcher=$!
"$bin/takt-controller" "$program" --cell "$TAKT_CELL" --domain "$TAKT_DOMAIN" --start
takt status
takt check "$scenario" || true
kill $watcher 2>/dev/null || true
echo "contacts watched: $(wc -l <"$work/contacts.jsonl") samples, $(wc -c <"$work/contacts.jsonl") bytes"
takt quit
wait $server
"$bin/bench_wire" --domain "$TAKT_DOMAIN"
