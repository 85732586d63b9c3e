#!/usr/bin/env bash
# urcl_torque.sh BIN BUILD SOURCE SCRATCH: the example direct_torque_control of Universal_Robots_Client_Library, unchanged, moves
# a robot at level of detail 2.
set -euo pipefail
bin=$(readlink -f "$1") build=$2 source=$3 scratch=$4
mkdir -p "$scratch"
# shellcheck source=gateway_run.sh
source "$(dirname "$(readlink -f "$0")")/gateway_run.sh"
start_server block_assembly 2
start_gateway takt-ur 'takt_ur: 1
robot: Robot1
listen: {address: 127.0.0.3}
controller: {version: 5.25.1}' --start
await "$scratch/gateway.log" 'RTDE at'
(cd "$source" && timeout 120 "$build/examples/direct_torque_control_example" 127.0.0.3 5) >"$scratch/example.log" 2>&1 ||
  { echo "direct_torque_control ended with $?"; cat "$scratch/example.log" "$scratch/gateway.log"; exit 1; }
if grep -q 'failed at line' "$scratch/gateway.log"; then cat "$scratch/gateway.log"; exit 1; fi
grep 'Movement done' "$scratch/example.log"
