#!/usr/bin/env bash
# package.sh BUILD: the Debian package is complete, and its programs run from /usr.
set -euo pipefail
build=$1
for tool in cpack dpkg-deb dpkg-shlibdeps; do
  command -v $tool >/dev/null || { echo "skipped: $tool is not installed"; exit 77; }
done
for part in bin/takt bin/takt-server bin/takt-run bin/takt-controller bin/takt-ur bin/takt-rsi bin/takt-egm bin/takt-from-cad client_lib/libtakt_client.a python/takt; do
  [[ -e $build/$part ]] || { echo "skipped: $part was not built"; exit 77; }
done
place=$(mktemp -d)
server=
trap '[[ -z $server ]] || kill "$server" 2>/dev/null || true; rm -rf "$place"' EXIT
# The package that `cpack -G DEB` makes of the present build tree, compressed in less time.
cmake --install "$build" --prefix "$place/stage/usr" >"$place/log" || { cat "$place/log"; exit 1; }
(cd "$place" && cpack --config "$build/CPackConfig.cmake" -G DEB -B "$place" -D CPACK_INSTALL_CMAKE_PROJECTS= \
  -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip \
  -D "CPACK_INSTALLED_DIRECTORIES=$place/stage;/") >"$place/log" 2>&1 || { cat "$place/log"; exit 1; }
package=$(echo "$place"/takt_*_*.deb)
field() { dpkg-deb --field "$package" "$1"; }
[[ $(field Package) == takt && $(field Version) =~ ^[0-9]+\.[0-9]+\.[0-9]+$ ]]
for library in libc6 libstdc++6 libyaml-cpp libtinyxml2 libzstd1 liblz4-1 'python3 (<<'; do
  [[ $(field Depends) == *"$library"* ]] || { echo "the package does not depend on $library: $(field Depends)"; exit 1; }
done
dpkg-deb --info "$package" prerm | grep -q __pycache__
# All files are below /usr.
if dpkg-deb --contents "$package" | awk '{print $6}' | grep -v '^\./\(usr/.*\)\?$'; then
  echo 'the package has the files above outside of /usr'
  exit 1
fi

dpkg-deb --extract "$package" "$place/unpacked"
root=$place/unpacked/usr
for program in takt takt-server takt-run takt-controller takt-ur takt-rsi takt-egm takt-from-cad; do
  "$root/bin/$program" --version >/dev/null
  [[ ! -e $build/share/man/man1/$program.1 ]] || grep -q '^\.TH' "$root/share/man/man1/$program.1"
done
export TAKT_DOMAIN=$((RANDOM % 100 + 1)) TAKT_CELL=packaged
"$root/bin/takt-server" "$root/share/takt/config/scenarios/block_assembly.yaml" --cell packaged --paused >"$place/server.log" 2>&1 &
server=$!
"$root/bin/takt" --timeout 60 status --json >"$place/status" || { cat "$place/server.log"; exit 1; }
grep -q '"scenario"\|"state"' "$place/status"
python=$(sed -n 's/^TAKT_PYTHON_EXECUTABLE:[^=]*=//p' "$build/CMakeCache.txt")
PYTHONPATH=$root/lib/python3/dist-packages "${python:-python3}" -c '
import takt
assert takt.__file__.startswith("'"$root"'"), takt.__file__
with takt.Client("packaged", timeout=60) as cell:
    assert cell.state.partner_of("P") in ("", "Table1"), cell.state.partner_of("P")
'
kill "$server"
wait "$server"
server=
