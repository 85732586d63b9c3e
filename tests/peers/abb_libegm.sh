#!/usr/bin/env bash
# abb_libegm.sh BIN FOLDER SCRATCH: the client library of ROS-Industrial (FOLDER/abb_libegm) guides takt-egm in lockstep and at
# the pace realtime. Needs Debian's libboost-system-dev, libboost-thread-dev, libboost-regex-dev, libprotobuf-dev.
set -euo pipefail
bin=$(readlink -f "$1") peer=$2/abb_libegm scratch=$3
[[ -d $peer/src ]] || { echo "abb_libegm: no $peer" >&2; exit 77; }
mkdir -p "$scratch/build"
# shellcheck source=gateway_run.sh
source "$(dirname "$(readlink -f "$0")")/gateway_run.sh"
cmake -S "$peer" -B "$scratch/build" -G Ninja -DBUILD_SHARED_LIBS=OFF -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS='-w -include cstring' >"$scratch/log" 2>&1 &&
  cmake --build "$scratch/build" -j 2 >>"$scratch/log" 2>&1 || { tail -n 20 "$scratch/log"; exit 1; }
g++ -std=c++17 -O1 -w -DABB_LIBEGM_STATIC_DEFINE -I"$peer/include" -I"$scratch/build" -o "$scratch/client" "$root/tests/peers/abb_libegm_client.cpp" \
  "$scratch/build/libabb_libegm.a" -lprotobuf -lboost_thread -lboost_regex -lboost_system -lpthread
start_server block_assembly
for pace in --lockstep ''; do
  "$scratch/client" 6510 1000 >"$scratch/client.log" 2>&1 &
  client=$!
  processes+=("$client")
  await "$scratch/client.log" ready
  # shellcheck disable=SC2086
  start_gateway takt-egm 'takt_egm: 1
role: controller
robot: Robot1' $pace --start
  wait "$client" || { echo "abb_libegm: the client ended with $?"; cat "$scratch/gateway.log"; exit 1; }
  kill "$gateway"
  wait "$gateway" || { cat "$scratch/gateway.log"; exit 1; }
  echo "abb_libegm ${pace:-realtime}: $(tail -n 1 "$scratch/client.log")"
  "$bin/takt" reset >/dev/null
done
