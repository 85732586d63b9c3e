#!/usr/bin/env bash
# abb_egm_python.sh BIN FOLDER SCRATCH: the examples of FLo-ABB/ABB-EGM-Python (FOLDER/ABB-EGM-Python), unchanged, guide
# takt-egm by joints, speeds and poses. Needs Debian's python3-protobuf and python3-numpy.
set -euo pipefail
bin=$(readlink -f "$1") peer=$2/ABB-EGM-Python scratch=$3
[[ -d $peer/src/ABBRobotEGM ]] || { echo "abb_egm_python: no $peer" >&2; exit 77; }
mkdir -p "$scratch"
# shellcheck source=gateway_run.sh
source "$(dirname "$(readlink -f "$0")")/gateway_run.sh"
start_server block_assembly
mapping='takt_egm: 1
role: controller
robot: Robot1'
# run EXAMPLE WORDS PACE MAPPING: until the example has said the words.
run() {
  # shellcheck disable=SC2086
  start_gateway takt-egm "$4" $3 --start
  await "$scratch/gateway.log" EGMRun  # the client gives up after 0.5 s without a message
  /usr/bin/python3 -B -u "$root/tests/peers/abb_egm_python.py" "$peer" "$peer/examples/simple/$1" >"$scratch/example.log" 2>&1 &
  local example=$!
  processes+=("$example")
  await "$scratch/example.log" "$2"
  kill "$gateway"
  wait "$gateway" || { cat "$scratch/gateway.log"; exit 1; }
  kill "$example" 2>/dev/null || true
  wait "$example" 2>/dev/null || true
  echo "abb_egm_python $1 ${3:-realtime}: $(tail -n 1 "$scratch/example.log"); $(grep applied "$scratch/gateway.log")"
  "$bin/takt" reset >/dev/null
}
run guidance/example_joint_guidance.py 'Completed movement 4' --lockstep "$mapping"
run guidance/example_joint_guidance.py 'Completed movement 1' '' "$mapping"
run guidance/example_speed_guidance.py 'Speed guidance example completed' '' "$mapping
guidance: pose"
