#!/usr/bin/env bash
# Peers of the gateways: names, builds and runs those that lie in a folder: peers.sh BIN FOLDER [FILTER] (./dev peers). A peer
# is a repository of its maker, fetched by hand; none is part of takt.
#   Universal_Robots_Client_Library    a folder with its CMakeLists.txt; its integration tests run against takt-ur
#   RTDE_Python_Client_Library         a folder with rtde/rtde.py; a client with it reads and writes
#   kuka-external-control-sdk, kuka_drivers, ABB-EGM-Python, abb_libegm, ur_rtde   folders of these names; each has a script here
set -euo pipefail
bin=$(readlink -f "$1") folder=$(readlink -f "$2") filter=${3:-}
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
log=$folder/takt_peers
mkdir -p "$log"
processes=()
stop() {
  kill "${processes[@]}" 2>/dev/null || true
  wait 2>/dev/null || true
}
trap stop EXIT
trap 'exit 130' INT TERM
urcl='' rtde_python=''
for one in "$folder" "$folder"/*/; do
  if grep -qs 'project(ur_client_library' "$one/CMakeLists.txt"; then urcl=${one%/}; fi
  if [[ -f $one/rtde/rtde.py ]]; then rtde_python=${one%/}; fi
done
echo "Universal_Robots_Client_Library: ${urcl:-not in $folder}"
echo "RTDE_Python_Client_Library: ${rtde_python:-not in $folder}"
status=0 others=''
if [[ -z $filter ]]; then
  for peer in kuka_sdk kuka_simulator abb_egm_python abb_libegm ur_rtde; do
    code=0
    "$here/$peer.sh" "$bin" "$folder" "$log/$peer" || code=$?
    ((code == 77)) || others=1
    ((code == 0 || code == 77)) || { echo "$peer: failed with $code"; status=1; }
  done
fi
[[ -n $urcl$rtde_python$others ]] || { echo "peers: no peer lies in $folder; docs/controllers.md names them" >&2; exit 2; }
[[ -n $urcl$rtde_python ]] || exit $status

rm -f "$log/takt_ur.log"  # of an earlier run: it says that takt-ur listens
"$bin/takt-server" "$here/../../config/scenarios/block_assembly.yaml" --cell "$TAKT_CELL" --paused >"$log/server.log" 2>&1 &
processes+=("$!")
(cd "$log" && exec "$bin/takt-ur" "$here/ur_peers.yaml" --start >takt_ur.log 2>&1) &  # flight reports go to $log
processes+=("$!")
for ((i = 0; i < 200; ++i)); do
  ! grep -qs 'RTDE at' "$log/takt_ur.log" || break
  kill -0 "${processes[1]}" 2>/dev/null || { cat "$log"/*.log >&2; exit 1; }
  sleep 0.1
done
if [[ -n $rtde_python ]]; then
  python3 -B "$here/rtde_python.py" "$rtde_python" 127.0.0.2 || status=1
fi
if [[ -n $urcl ]]; then
  build=$log/urcl
  cmake -S "$urcl" -B "$build" -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-O0 -DCMAKE_CXX_COMPILER_LAUNCHER=ccache \
    -DBUILDING_TESTS=ON -DINTEGRATION_TESTS=ON -DINTEGRATION_TESTS_ROBOT_IP=127.0.0.2 \
    -DFETCHCONTENT_SOURCE_DIR_GOOGLETEST=/usr/src/googletest >"$log/urcl_configure.log" 2>&1 ||
    { tail -n 20 "$log/urcl_configure.log" >&2; exit 1; }
  nice cmake --build "$build" -j 2 >"$log/urcl_build.log" 2>&1 || { tail -n 20 "$log/urcl_build.log" >&2; exit 1; }
  python3 -B "$here/urcl.py" "$build" "$urcl" "$filter" || status=1
  [[ -n $filter ]] || "$here/urcl_torque.sh" "$bin" "$build" "$urcl" "$log/urcl_torque" || status=1
fi
exit $status
