#!/usr/bin/env bash
# A client on another machine, over a line that loses, repeats and delays packets, lets later ones overtake earlier
# ones, and is cut: two network namespaces, each with a TUN device, joined by line.py (this needs root). A line of the
# report for each phase; exit code 0 when all guaranteed samples arrived, no command was applied twice or after a
# newer one, the loop never stalled, the memory did not grow, and the client was served again after each cut.
#
#   network.sh BIN_DIRECTORY CONFIG_DIRECTORY [SECONDS_PER_PHASE]
set -euo pipefail
bin=$1 config=$2 phase_s=${3:-10}
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
id=$$
a=takt_a_$id b=takt_b_$id
work=$(mktemp -d)
cleanup() {
  kill "${client:-}" "${server:-}" "${line:-}" 2>/dev/null || true
  wait 2>/dev/null || true
  ip netns del "$a" 2>/dev/null || true
  ip netns del "$b" 2>/dev/null || true
  rm -rf "$work"
}
trap cleanup EXIT
((EUID == 0)) || { echo "network.sh: needs root, for network namespaces" >&2; exit 2; }
[[ -c /dev/net/tun ]] || { echo "network.sh: needs /dev/net/tun" >&2; exit 2; }

ip netns add "$a"
ip netns add "$b"
mkfifo "$work/orders"
python3 "$here/line.py" "$a" "ta$id" "$b" "tb$id" <"$work/orders" >"$work/line.log" &
line=$!
exec 3>"$work/orders"
until grep -q ready "$work/line.log"; do
  kill -0 $line 2>/dev/null || exit 1
  sleep 0.1
done
for end in "$a ta$id 10.177.0.1" "$b tb$id 10.177.0.2"; do
  read -r ns device address <<<"$end"
  ip -n "$ns" addr add "$address/24" dev "$device"
  ip -n "$ns" link set "$device" txqueuelen 10000 multicast on up
  ip -n "$ns" link set lo up
  ip -n "$ns" route add 239.0.0.0/8 dev "$device"
  ip netns exec "$ns" sysctl -qw net.ipv4.ipfrag_time="${TAKT_IPFRAG_TIME:-1}"  # docs/network.md, "Lines that lose packets"
done

profiles=$config/dds/profiles.xml
# With a priority the line delays the loop, not the other load of this machine.
ip netns exec "$a" "$bin/takt-server" "$config/scenarios/block_assembly.yaml" --cell far --set duration_s=1000000 \
  --realtime-priority 20 --profiles "$profiles" --profile takt_server_network >"$work/server.log" 2>&1 3>&- &
server=$!
# Settings of line.py; for a cut, its duration.
phases=(
  "clean|"
  "5 % lost|lose=5"
  "20 % lost|lose=20"
  "every packet twice|twice=100"
  "1 of 5 late, 20 ms|late=20 up_to_ms=20"
  "and 1 of 10 twice|late=20 twice=10 up_to_ms=20"
  "1 of 5 late, 100 ms|late=20 up_to_ms=100"
  "all late, 20 ms|late=100 up_to_ms=20"
  "late, twice, lost|late=20 twice=10 lose=5 up_to_ms=100"
  "cut for 3 s|3"
  "cut for 10 s|10"
  "clean again|"
)
total=$(((${#phases[@]} + 1) * (phase_s + 1) + 25))
ip netns exec "$b" "$bin/takt-soak-clients" --role line --cell far --domain 0 --seconds $total \
  --profiles "$profiles" --profile takt_client_network >"$work/client.log" 2>&1 3>&- &
client=$!

until grep -q '^[0-9]' "$work/client.log"; do
  kill -0 $client 2>/dev/null || { cat "$work/client.log" "$work/server.log" >&2; exit 1; }
  sleep 0.2
done

ordered=0
send_order() {  # an order to line.py; waits for the answer, which counts the packets since the last one
  echo "$1" >&3
  ordered=$((ordered + 1))
  until (($(grep -c carried "$work/line.log") >= ordered)); do sleep 0.01; done
}
resident_kB() { awk '/^VmRSS/ { print $2 }' "/proc/$server/status"; }
for phase in "${phases[@]}"; do
  IFS='|' read -r name order <<<"$phase"
  begin=$(date +%s.%N)
  if [[ $name == cut* ]]; then
    send_order ""
    ip -n "$b" link set "tb$id" down
    sleep "$order"
    ip -n "$b" link set "tb$id" up
    ip -n "$b" route add 239.0.0.0/8 dev "tb$id" 2>/dev/null || true
  else
    send_order "$order"
  fi
  sleep "$phase_s"
  end=$(date +%s.%N)
  send_order ""
  echo "$begin|$end|$(resident_kB)|$(tail -n 1 "$work/line.log")|$name" >>"$work/phases"
done
wait $client || { cat "$work/client.log" >&2; exit 1; }
grep '^#' "$work/client.log" | tail -n 1
awk -v phases="$work/phases" -f "$here/network_report.awk" "$work/client.log"
