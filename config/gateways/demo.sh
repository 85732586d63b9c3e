#!/usr/bin/env bash
# A client of a vendor's protocol moves a robot of a takt cell: demo.sh BIN ur (./dev demo ur). The client is written in Python
# with its standard library alone.
set -euo pipefail
bin=$1 protocol=$2
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
log=$(mktemp -d)
processes=()
stop() {
  kill "${processes[@]}" 2>/dev/null || true
  wait 2>/dev/null || true
  rm -rf "$log"
}
trap stop EXIT
trap 'exit 130' INT TERM
fail() {
  tail -n 20 "$log"/*.log >&2
  echo "demo $protocol: $1" >&2
  exit 1
}
case $protocol in
  ur) gateway=("$bin/takt-ur" "$here/ur_block.yaml" --start) client=("$here/ur_client.py") ready='RTDE at' ;;
  *) echo "demo: unknown protocol '$protocol'; there is ur" >&2; exit 2 ;;
esac
"$bin/takt-server" "$here/../scenarios/block_assembly.yaml" --cell "$TAKT_CELL" --paused >"$log/server.log" 2>&1 &
processes+=("$!")
"${gateway[@]}" >"$log/gateway.log" 2>&1 &
processes+=("$!")
for ((i = 0; i < 200; ++i)); do
  ! grep -q "$ready" "$log/gateway.log" || break
  kill -0 "${processes[1]}" 2>/dev/null || fail 'the gateway has ended'
  sleep 0.1
done
cat "$log/gateway.log"
timeout 120 python3 "${client[@]}" || fail 'the client did not reach its targets'
