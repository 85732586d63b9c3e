#!/bin/sh
# systemd accepts the unit, and finds it hardened. The program it names is not installed here; /bin/true stands for it.
set -eu
if ! command -v systemd-analyze > /dev/null; then
  echo "skipped: no systemd-analyze"
  exit 77
fi
root=$(cd "$(dirname "$0")/../.." && pwd)
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
unit="$place/takt-server@demo.service"
sed 's#^ExecStart=/usr/bin/takt-server#ExecStart=/bin/true#' "$root/config/systemd/takt-server@.service" > "$unit"
grep -q '^ExecStart=/bin/true .*--supervised' "$unit"
complaints=$(systemd-analyze verify "$unit" 2>&1) || { echo "$complaints"; exit 1; }
if [ -n "$complaints" ]; then
  echo "$complaints"
  exit 1
fi
# A key that systemd does not know must be noticed, else this test shows nothing.
sed 's/^ProtectHome=/ProtectHouse=/' "$unit" > "$place/takt-broken@demo.service"
if [ -z "$(systemd-analyze verify "$place/takt-broken@demo.service" 2>&1)" ]; then
  echo "systemd-analyze verify accepts an unknown key"
  exit 1
fi
systemd-analyze security --offline=true --threshold=30 "$unit" > "$place/security" || { cat "$place/security"; exit 1; }
