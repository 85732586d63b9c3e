# For the scripts of peers: starts a server and a gateway, ends both. Needs $bin, $scratch; sets TAKT_CELL, TAKT_DOMAIN.
root=$(dirname "$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")")
export TAKT_CELL=peer_$$ TAKT_DOMAIN=$((RANDOM % 90 + 5))
processes=()
end_processes() {
  kill "${processes[@]}" 2>/dev/null || true
  wait 2>/dev/null || true
}
trap end_processes EXIT

# await FILE WORDS: until a program has written them, 30 s at most.
await() {
  local tries
  for tries in {1..300}; do
    grep -q "$2" "$1" 2>/dev/null && return
    sleep 0.1
  done
  echo "$1 does not say '$2':" >&2
  cat "$1" >&2
  return 1
}

# start_server SCENARIO [LEVEL]
start_server() {
  "$bin/takt-server" "$root/config/scenarios/$1.yaml" --paused --lod "${2:-1}" >"$scratch/server.log" 2>&1 &
  processes+=($!)
  await "$scratch/server.log" ready
}

# start_gateway PROGRAM MAPPING ARGUMENTS...: the mapping is a text.
start_gateway() {
  local program=$1
  printf '%s\n' "$2" >"$scratch/mapping.yaml"
  shift 2
  cp "$root/config/gateways/rsi_ethernet.xml" "$scratch/"
  "$bin/$program" "$scratch/mapping.yaml" "$@" >"$scratch/gateway.log" 2>&1 &
  gateway=$!
  processes+=("$gateway")
}
