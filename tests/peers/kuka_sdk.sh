#!/usr/bin/env bash
# kuka_sdk.sh BIN FOLDER SCRATCH: KUKA's RSI client (FOLDER/kuka-external-control-sdk) drives takt-rsi in lockstep and at the
# pace realtime. Ends with 77 where the peer is missing.
set -euo pipefail
bin=$(readlink -f "$1") sdk=$2/kuka-external-control-sdk/kuka_external_control_sdk scratch=$3
[[ -d $sdk/kss ]] || { echo "kuka_sdk: no $sdk" >&2; exit 77; }
mkdir -p "$scratch"
# shellcheck source=gateway_run.sh
source "$(dirname "$(readlink -f "$0")")/gateway_run.sh"
g++ -std=c++17 -O1 -w -I"$sdk/common/include" -I"$sdk/kss/include" -I"$sdk/utils/include" -o "$scratch/kuka_sdk_client" \
  "$root/tests/peers/kuka_sdk_client.cpp" "$sdk"/kss/src/message_builder.cc "$sdk"/kss/src/rsi/*.cc \
  "$sdk"/common/src/status.cc "$sdk"/utils/src/os-core-udp-communication/{socket,replier}.cc
start_server block_assembly_kr16
mapping='takt_rsi: 1
role: controller
robot: Robot1
configuration: rsi_ethernet.xml'
for pace in --lockstep ''; do
  "$scratch/kuka_sdk_client" 59152 1000 >"$scratch/client.log" 2>&1 &
  client=$!
  processes+=("$client")
  await "$scratch/client.log" ready
  # shellcheck disable=SC2086
  start_gateway takt-rsi "$mapping" $pace --start
  wait "$client" || { echo "kuka_sdk: the client ended with $?"; cat "$scratch/gateway.log"; exit 1; }
  wait "$gateway" || { cat "$scratch/gateway.log"; exit 1; }
  echo "kuka_sdk ${pace:-realtime}: $(tail -n 1 "$scratch/client.log")"
  # In lockstep the robot is where the command of the cycle before has sent it. At the pace realtime the difference is that
  # of the machine's latency: a cycle's way of the sine is 0.126 degrees.
  if [[ -n $pace ]]; then
    python3 -c 'import json, sys; sys.exit(json.loads(sys.argv[1])["worst_deg"] > 2e-6)' "$(tail -n 1 "$scratch/client.log")"
  fi
  "$bin/takt" reset >/dev/null
done
