#!/usr/bin/env bash
# lockstep.sh BIN [SCENARIO [LOD]]: the scenario's program commands the cell in lockstep, server and controller as processes
# of this machine, alone and observed; then two controllers with periods of 1 ms, one for each robot of the block scenario.
# Beside it a state and its answer over plain Fast DDS, in the same run.
set -euo pipefail
bin=$1 scenario=${2:-config/scenarios/block_assembly.yaml} lod=${3:-1}
program=$(sed -n 's/^ *program: *//p' "$scenario" | head -1)
program=$(dirname "$scenario")/${program%% *}
[[ -f $program ]] || { echo "lockstep.sh: $scenario names no program (key controller.program)" >&2; exit 2; }
work=$(mktemp -d)
export TAKT_DOMAIN=$((100 + $$ % 90)) TAKT_CELL=lockstep_$$
children=()
trap 'kill "${children[@]}" 2>/dev/null || true; rm -rf "$work"' EXIT

# serve SCENARIO LOD: starts the server of the cell, and waits for it.
serve() {
  "$bin/takt-server" "$1" --cell "$TAKT_CELL" --domain "$TAKT_DOMAIN" --lod "$2" --paused --pace lockstep \
    >"$work/server.log" 2>&1 &
  server=$!
  children=("$server")
  "$bin/takt" --timeout 60 status >/dev/null || { cat "$work/server.log" >&2; exit 1; }
}

# run NAME [COMMAND ...]: with the command beside the controller.
run() {
  local name=$1
  shift
  serve "$scenario" "$lod"
  if (($# > 0)); then
    "$@" >"$work/observer.log" 2>&1 &
    children+=($!)
    sleep 1
  fi
  local said
  said=$("$bin/takt-controller" "$program" --cell "$TAKT_CELL" --domain "$TAKT_DOMAIN" --start | grep 'real-time factor')
  printf '%-22s %s  state hash %s\n' "$name" "$said" "$("$bin/takt" --json state | sed -n 's/.*"state_hash": *"\([^"]*\)".*/\1/p')"
  "$bin/takt" quit >/dev/null
  wait "$server"
  ((${#children[@]} < 2)) || { kill "${children[1]}" 2>/dev/null || true; wait "${children[1]}" || true; }
  children=()
}

run 'controller alone'
run 'beside takt watch' "$bin/takt" watch
run 'beside a recorder' "$bin/takt" record "$work/run.mcap"

# Two controllers; what the slower one says.
two() {
  local robot home
  for robot in 1 2; do
    home='pose{x = -0.30, y = 0.10, z = 1.05, roll = math.pi}'
    ((robot == 1)) || home='pose{x = 0.55, y = -0.15, z = 1.10, roll = math.pi}'
    cat >"$work/robot$robot.lua" <<END
period_s = 0.001
routine("Robot$robot", function(r)
  local home = $home
  for _ = 1, 5 do
    r:move_to(home:offset(0, 0, 0.05), {duration_s = 1})
    r:move_to(home, {duration_s = 1})
  end
end)
END
  done
  serve config/scenarios/block_assembly.yaml 1
  for robot in 1 2; do
    "$bin/takt-controller" "$work/robot$robot.lua" --cell "$TAKT_CELL" --domain "$TAKT_DOMAIN" --name "robot$robot" --start >"$work/said$robot" 2>&1 &
    children+=($!)
  done
  wait "${children[1]}" "${children[2]}"
  printf '%-22s %s\n' 'two controllers, 1 ms' "$(grep -h 'real-time factor' "$work/said1" "$work/said2" | sort -k5 -nr | head -1)"
  "$bin/takt" quit >/dev/null
  wait "$server"
  children=()
}
[[ $scenario != config/scenarios/block_assembly.yaml ]] || two

for answers in 1 4; do
  "$bin/bench_ping_pong" --domain "$TAKT_DOMAIN" --answers "$answers" --udp
  "$bin/bench_ping_pong" --domain "$TAKT_DOMAIN" --answers "$answers"
done
