#!/usr/bin/env bash
# A ladder program carries a Part in a takt cell: demo.sh BIN [CARRIES] (./dev demo plc). Needs Debian's linuxcnc-uspace.
set -euo pipefail
bin=$1 carries=${2:-6}
[[ $carries =~ ^[1-9][0-9]*$ ]] || { echo "demo plc: found '$carries'; allowed: carries, a whole number from 1 on" >&2; exit 2; }
command -v halrun >/dev/null || { echo 'demo plc: needs the soft PLC: apt-get install --no-install-recommends linuxcnc-uspace' >&2; exit 1; }
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
log=$(mktemp -d)
processes=()
stop() {
  [[ ! -p $log/plc/stop.pipe ]] || timeout 5 "$log/plc/stop.sh" || true
  kill "${processes[@]}" 2>/dev/null || true
  wait 2>/dev/null || true
  rm -rf "$log"
}
trap stop EXIT
trap 'exit 130' INT TERM
fail() {
  tail -n 20 "$log"/*.log >&2
  echo "demo plc: $1" >&2
  exit 1
}
wait_for() {  # FILE WORDS PROCESS
  for ((i = 0; i < 600; ++i)); do
    ! grep -qs "$2" "$1" || return 0
    kill -0 "$3" 2>/dev/null || fail "$(basename "$1" .log) has ended"
    sleep 0.1
  done
  fail "$(basename "$1" .log) is not ready"
}
chmod a+rx "$log"
"$bin/takt-server" "$here/carry.yaml" --cell "$TAKT_CELL" --paused >"$log/server.log" 2>&1 &
processes+=("$!")
"$bin/takt-controller" "$here/carry.lua" --pace realtime >"$log/controller.log" 2>&1 &
processes+=("$!")
"$bin/takt-modbus" "$here/carry_modbus.yaml" --start >"$log/gateway.log" 2>&1 &
processes+=("$!")
wait_for "$log/gateway.log" Listens "${processes[2]}"
python3 -B "$here/ladder.py" "$here/carry.ladder" "$log/plc"
"$log/plc/run.sh" >"$log/ladder.log" 2>&1 &
wait_for "$log/ladder.log" 'The PLC runs' "$!"
for ((i = 1; i <= carries; ++i)); do
  for ((j = 0; j < 300; ++j)); do
    now=$("$bin/takt" state --json | python3 -c '
import json, sys
state = json.load(sys.stdin)
state = state.get("state", state)
devices = state["devices"]
if isinstance(devices, dict):
    print(int(devices["FromPlc"]["signals"]["carries"]))
else:
    print(int(devices[0]["values"][5]))
') || fail 'the state of the cell cannot be read'
    ((now < i)) || break
    sleep 0.2
  done
  ((now >= i)) || fail "carry $i does not come"
  echo "carry $i is done"
done
