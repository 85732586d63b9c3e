#!/usr/bin/env bash
# ur_rtde.sh BIN FOLDER SCRATCH: the examples of ur_rtde (FOLDER/ur_rtde), unchanged, move the robot of takt-ur, also along paths
# and in force mode, set outputs and grip. Ends with 77 where the peer is missing. Needs Debian's libboost-{system,thread,program-options}-dev.
set -euo pipefail
bin=$(readlink -f "$1") peer=$2/ur_rtde scratch=$3
[[ -f $peer/scripts/rtde_control.script ]] || { echo "ur_rtde: no $peer" >&2; exit 77; }
mkdir -p "$scratch"
# shellcheck source=gateway_run.sh
source "$(dirname "$(readlink -f "$0")")/gateway_run.sh"
build=$scratch/build
cmake -S "$peer" -B "$build" -DPYTHON_BINDINGS=OFF -DCMAKE_CXX_FLAGS=-O0 -DCMAKE_CXX_COMPILER_LAUNCHER=ccache >"$scratch/build.log" 2>&1 &&
  nice cmake --build "$build" -j 2 >>"$scratch/build.log" 2>&1 || { tail -n 20 "$scratch/build.log" >&2; exit 1; }
start_server block_assembly
start_gateway takt-ur 'takt_ur: 1
robot: Robot1
tool: Gripper1
robotiq: Gripper1' --start
await "$scratch/gateway.log" 'RTDE at'
for example in io servoj speedj forcemode move_async movej_path_with_blend move_path_async robotiq_gripper; do
  program=$(find "$build" "$peer/bin" -name "${example}_example" -type f | head -n 1)
  timeout 120 "$program" >"$scratch/$example.log" 2>&1 ||
    { echo "ur_rtde: $example ended with $?"; cat "$scratch/$example.log" "$scratch/gateway.log"; exit 1; }
  echo "ur_rtde $example: ended"
done
