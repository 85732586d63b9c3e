#!/usr/bin/env bash
# The pictures of docs/cells_from_cad.md, from runs of their own: ./dev figures traps.
#   traps.sh BIN_DIR CONFIG_DIR WORK_DIR PICTURES_DIR
set -euo pipefail
bin=$1 config=$2 work=$3 pictures=$4
here=$(dirname "$(readlink -f "$0")")
mkdir -p "$work" "$pictures"
work=$(readlink -f "$work")

# seat NAME PARAMETER...: the motor drops into its seat, meshes with these parameters.
seat() {
  local name=$1 parameter settings=()
  shift
  for parameter in "$@"; do settings+=(--set "chainsaw.$parameter"); done
  "$bin/takt-make-meshes" --cells "$work/$name" --set chainsaw.housing_facets=160 "${settings[@]}"
  "$bin/takt-run" run "$here/seat.yaml" --set "parts.Motor.mesh=$work/$name/motor.obj" \
    --set "grounds.Housing.mesh=$work/$name/housing.obj" --csv "$work/$name.csv" --csv-period 0.002 --quiet 2>>"$work/notes.txt"
}
seat fine interference=-1e-4
seat sharp interference=-1e-4 boss_chamfer=1e-4 seat_chamfer=1e-4
seat coarse interference=-1e-4 contact_edge=5e-3 motor_facets=20
seat wide interference=-5e-4
seat close interference=-3e-5

# stiffness: what stands on one another yields, and what it costs.
echo 'youngs_modulus_Pa lowering_m solver_steps' >"$work/stiffness.txt"
for modulus in 1e5 1e6 1e7 1e8 1e9 1e10 1e11; do
  "$bin/takt-run" run "$config/scenarios/contact/stack_of_ten.yaml" --set "contact.defaults.youngs_modulus_Pa=$modulus" \
    --set solver.step_s=0.01 --duration 1 --report "$work/stack.json" --quiet 2>>"$work/notes.txt" || true
  awk -v modulus="$modulus" '
    /"S10": \{/ { top = 1 }
    top && /"position": \{/ { getline; getline; getline; z = $2 + 0; top = 0 }
    /"work": \{/ { work = 1 }
    work && /"steps":/ { gsub(/[^0-9]/, ""); steps = $0; work = 0 }
    END { printf "%s %.9g %d\n", modulus, 0.18 - z, steps }' "$work/stack.json" >>"$work/stiffness.txt"
done

# A product of CAD data: exploded, and taken apart by a robot.
"$bin/takt-from-cad" "$config/cad/bearing_block.step" --robot -o "$work/bearing_block" >/dev/null
cp "$work/bearing_block/exploded.png" "$pictures/cad_exploded.png"
"$bin/takt-run" run "$work/bearing_block/Bearing_block_robot.yaml" --quiet --picture "$pictures/cad_robot.png@52" 2>>"$work/notes.txt"

draw() { gnuplot -e "data='$work'; out='$pictures/trap_$1.png'" "$here/trap_$1.gp" && echo "$pictures/trap_$1.png"; }
for name in edges mesh clearance stiffness; do draw $name; done
