#!/usr/bin/env bash
# A client on another machine, over a line that loses, repeats and delays packets and is cut: two network
# namespaces joined by a pair of virtual interfaces, filtered by nft (this needs root). One line of the report for
# each phase; exit code 0 when nothing was lost that must not be, and the client was served again after each cut.
#
#   network.sh BIN_DIRECTORY CONFIG_DIRECTORY [SECONDS_PER_PHASE]
set -euo pipefail
bin=$1 config=$2 phase_s=${3:-10}
id=$$
a=takt_a_$id b=takt_b_$id
work=$(mktemp -d)
cleanup() {
  kill "${client:-}" "${server:-}" 2>/dev/null || true
  wait 2>/dev/null || true
  ip netns del "$a" 2>/dev/null || true
  ip netns del "$b" 2>/dev/null || true
  rm -rf "$work"
}
trap cleanup EXIT
((EUID == 0)) || { echo "network.sh: needs root, for network namespaces" >&2; exit 2; }

ip netns add "$a"
ip netns add "$b"
ip link add "ta$id" netns "$a" type veth peer name "tb$id" netns "$b"
for end in "$a ta$id 10.177.0.1" "$b tb$id 10.177.0.2"; do
  read -r ns device address <<<"$end"
  ip -n "$ns" addr add "$address/24" dev "$device"
  ip -n "$ns" link set "$device" up
  ip -n "$ns" link set lo up
  ip -n "$ns" route add 239.0.0.0/8 dev "$device"
done

profiles=$config/dds/profiles.xml
ip netns exec "$a" "$bin/takt-server" "$config/scenarios/block_assembly.yaml" --cell far --set duration_s=1000000 \
  --profiles "$profiles" --profile takt_server_network >"$work/server.log" 2>&1 &
server=$!
phases=(
  "clean" "5 % lost" "20 % lost" "every packet twice" "cut for 3 s" "cut for 10 s" "clean again"
)
total=$(((${#phases[@]} + 1) * phase_s + 20))
ip netns exec "$b" "$bin/takt-soak-clients" --role line --cell far --domain 0 --seconds $total \
  --profiles "$profiles" --profile takt_client_network >"$work/client.log" 2>&1 &
client=$!

touch "$work/client.log"
until grep -q '^[0-9]' "$work/client.log"; do
  kill -0 $client 2>/dev/null || { cat "$work/client.log" "$work/server.log" >&2; exit 1; }
  sleep 0.2
done

rules() {  # what both ends do with what comes in
  for ns in "$a" "$b"; do
    ip netns exec "$ns" nft flush ruleset
    [[ -z $1 ]] || ip netns exec "$ns" nft -f - <<EOF
table ip line {
  chain in {
    type filter hook input priority 0; policy accept;
    $1
  }
}
EOF
  done
}
for phase in "${phases[@]}"; do
  begin=$(date +%s)
  pause=$phase_s
  case $phase in
    clean*) rules "" ;;
    5*) rules "numgen random mod 100 < 5 drop" ;;
    20*) rules "numgen random mod 100 < 20 drop" ;;
    every*)
      for way in "$a 10.177.0.2 ta$id" "$b 10.177.0.1 tb$id"; do
        read -r ns other device <<<"$way"
        ip netns exec "$ns" nft -f - <<EOF
table ip line {
  chain out {
    type filter hook output priority 0; policy accept;
    ip daddr $other dup to $other device "$device"
  }
}
EOF
      done
      ;;
    cut*)
      rules ""
      ip -n "$b" link set "tb$id" down
      sleep "$(tr -dc 0-9 <<<"${phase#cut}")"
      ip -n "$b" link set "tb$id" up
      ip -n "$b" route add 239.0.0.0/8 dev "tb$id" 2>/dev/null || true
      ;;
  esac
  sleep "$pause"
  rules ""
  echo "$begin $(date +%s) $phase" >>"$work/phases"
done
wait $client || { cat "$work/client.log" >&2; exit 1; }
grep '^#' "$work/client.log" | tail -n 1
awk -v phases="$work/phases" '
  BEGIN {
    while ((getline line < phases) > 0) {
      split(line, field, " ")
      n++; from[n] = field[1]; to[n] = field[2]
      name[n] = substr(line, length(field[1]) + length(field[2]) + 3)
    }
    printf "%-20s %10s %10s %10s %8s %8s %10s %12s %12s\n", "phase", "states/s", "sent", "applied", "events", "missed",
      "answered", "unanswered", "slowest ms"
  }
  /^[0-9]/ { rows++; t[rows] = $1; for (i = 2; i <= 9; ++i) v[rows, i] = $i }
  END {
    for (p = 1; p <= n; ++p) {
      first = 0; last = 0; states = 0; slowest = 0; end_states = 0
      for (r = 1; r <= rows; ++r) {
        if (t[r] <= from[p] || t[r] > to[p]) continue
        if (!first) first = r
        last = r; states += v[r, 2]
        if (v[r, 9] > slowest) slowest = v[r, 9]
        if (t[r] > to[p] - 3) end_states += v[r, 2]
      }
      before = first > 1 ? first - 1 : first
      missed = v[last, 6] - v[before, 6]
      unanswered = v[last, 8] - v[before, 8]
      printf "%-20s %10.0f %10d %10d %8d %8d %10d %12d %12.0f\n", name[p], states / (last - first + 1), v[last, 3] - v[before, 3],
        v[last, 4] - v[before, 4], v[last, 5] - v[before, 5], missed, v[last, 7] - v[before, 7], unanswered, slowest
      if (v[last, 4] - v[before, 4] > v[last, 3] - v[before, 3] + 2) { bad = 1; print "  a command was applied twice" }
      if (missed > 0 && name[p] != "cut for 10 s") { bad = 1; print "  events were lost" }
      if (end_states == 0) { bad = 1; print "  the client is not served at the end of the phase" }
      if (name[p] ~ /^clean/ && unanswered > 0) { bad = 1; print "  requests were not answered" }
    }
    exit bad
  }' "$work/client.log"
