#!/usr/bin/env bash
# install.sh BUILD: what cmake --install puts somewhere works there: programs, page, manual pages, and a client of one's own.
set -euo pipefail
build=$1
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
for program in takt takt-server takt-run takt-controller takt-ur takt-rsi takt-egm; do
  [[ -x $build/bin/$program ]] || { echo "skipped: $program was not built"; exit 77; }
done
for library in client_lib/libtakt_client.a python/takt; do
  [[ -e $build/$library ]] || { echo "skipped: $library was not built"; exit 77; }
done
cmake --install "$build" --prefix "$place/usr" >"$place/log" || { cat "$place/log"; exit 1; }
for program in takt takt-server takt-run takt-controller takt-ur takt-rsi takt-egm; do
  [[ $("$place/usr/bin/$program" --version) =~ ^$program\ [0-9]+\.[0-9]+\.[0-9]+\ \(.*\;\ .*,\ GNU\ [0-9.]+,\ .*\)$ ]]
  [[ ! -e $build/share/man/man1/$program.1 ]] || grep -q "^\.TH" "$place/usr/share/man/man1/$program.1"
done
"$place/usr/bin/takt-run" run "$place/usr/share/takt/config/scenarios/block_assembly.yaml" --duration 0.1 --quiet --mcap "$place/run.mcap"
"$place/usr/bin/takt" export "$place/run.mcap" --list >"$place/signals"
grep -q '^state.components.P.position.x$' "$place/signals"
bash -n "$place/usr/share/bash-completion/completions/takt-run"
if command -v zsh >/dev/null; then zsh -n "$place/usr/share/zsh/vendor-completions/_takt"; fi
if command -v fish >/dev/null; then fish -n "$place/usr/share/fish/vendor_completions.d/takt.fish"; fi
[[ ! -e $build/share/takt/view/index.html ]] || grep -q '<script' "$place/usr/share/takt/view/index.html"
[[ ! -e $build/share/takt/view/index.html ]] || grep -q '^three ' "$place/usr/share/takt/view/licenses.txt"
if [[ -e $build/share/takt/opcua/takt-opcua.mjs ]]; then
  [[ $("$place/usr/bin/takt-opcua" --version) =~ ^takt-opcua\ [0-9]+\.[0-9]+\.[0-9]+\  ]]
  grep -q '^node-opcua-server ' "$place/usr/share/takt/opcua/licenses.txt"
fi
test -f "$place/usr/lib/systemd/system/takt-server@.service"

mkdir "$place/mine"
cat >"$place/mine/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.23)
project(mine CXX)
set(CMAKE_CXX_STANDARD 20)
find_package(takt REQUIRED)
add_executable(mine mine.cpp)
target_link_libraries(mine PRIVATE takt::takt_client)
CMAKE
cat >"$place/mine/mine.cpp" <<'CODE'
#include <cstdio>
#include <takt/client.h>
#include <takt/eigen.h>
#include <takt/kinematics.h>
#include <takt/lockstep_controller.h>
int main() {
  try {
    if (!takt::to_eigen(takt_msgs::msg::Transform{}).isApprox(Eigen::Isometry3d::Identity())) return 4;
    takt::Arm({}, "Robot1");
    return 3;
  } catch (const takt::MotionError&) {  // the cell has no robot
  }
  try {
    takt::ClientOptions options;
    options.cell = "nobody_is_called_so";
    options.timeout = takt::Seconds{0.2};
    takt::Client cell(options);
  } catch (const takt::ClientError& error) {
    return error.kind() == takt::ClientError::Kind::not_found ? 0 : 1;
  }
  return 2;
}
CODE
cmake -S "$place/mine" -B "$place/mine/build" -DCMAKE_PREFIX_PATH="$place/usr" >"$place/log" 2>&1 &&
  cmake --build "$place/mine/build" >>"$place/log" 2>&1 || { cat "$place/log"; exit 1; }
"$place/mine/build/mine"
