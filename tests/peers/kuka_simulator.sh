#!/usr/bin/env bash
# kuka_simulator.sh BIN FOLDER SCRATCH: takt-rsi as the sensor PC follows KUKA's public RSI simulator
# (FOLDER/kuka_drivers, rsi_simulator.py, unchanged, on a stub of rclpy). It stands at 0, -90, 90, 0, 90, 0 degrees.
set -euo pipefail
bin=$(readlink -f "$1") scratch=$3
simulator=$(find "$2" -path "*/kuka_drivers/*" -name rsi_simulator.py | head -n 1)
[[ -n $simulator ]] || { echo "kuka_simulator: no kuka_drivers in $2" >&2; exit 77; }
mkdir -p "$scratch"
# shellcheck source=gateway_run.sh
source "$(dirname "$(readlink -f "$0")")/gateway_run.sh"
start_server block_assembly_kr16
start_gateway takt-rsi 'takt_rsi: 1
role: sensor_pc
robot: Robot1
configuration: rsi_ethernet.xml
first_command: {ramp_speed_rad_per_s: 1.5}' --start
await "$scratch/gateway.log" Listens
PYTHONPATH=$root/tests/peers/rclpy_stub /usr/bin/python3 -B "$simulator" >"$scratch/simulator.log" 2>&1 &
processes+=($!)
await "$scratch/gateway.log" 'follows its controller'
python3 - "$("$bin/takt" --json state)" <<'END'
import json, math, sys
robot = json.loads(sys.argv[1])["robots"]["Robot1"]
axes = [math.degrees(q) for q in robot["position"].values()]
print("kuka_simulator: axes", [round(a, 4) for a in axes])
sys.exit(max(abs(a - b) for a, b in zip(axes, [0, -90, 90, 0, 90, 0])) > 0.6)
END
late=$(grep -c -e 'Packet is late' -e 'timed out' "$scratch/simulator.log" || true)
echo "kuka_simulator: $(grep -c 'msg: ' "$scratch/simulator.log") answers, $late late"
((late == 0))
