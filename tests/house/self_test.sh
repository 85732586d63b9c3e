#!/usr/bin/env bash
# Shows that check.sh can fail: a small tree that keeps the rules passes; each violation put into it is reported with
# file and line, and nothing else is. Violations in different files share a tree. Usage: self_test.sh SCRATCH_DIRECTORY
set -euo pipefail
check=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/check.sh
mkdir -p "$1"
tree=$(mktemp -d "$1/house.XXXXXX")
trap 'rm -rf "$tree" "$tree.differences"' EXIT
failed=0

write() { mkdir -p "$tree/$(dirname "$1")"; printf '%b' "$2" >"$tree/$1"; }
fresh() {
  rm -rf "${tree:?}"/*
  write README.md '# x\n\n    ./dev demo\n    ./dev test\n[all](docs/README.md)\n'
  write docs/README.md '# All\n[a](a.md), [b](b.md#one-two), [d](decisions.md), [r](requests.md), [e](events.md), [w](architecture.md)\n'
  write docs/architecture.md '## The way of a command\n| | function | place |\n|---|---|---|\n| 1 | `Loop::take` | `server/runtime/loop/loop.cpp` |\n'
  write docs/a.md 'x `server/dds/`, `spatial.h`\n'
  write docs/b.md '# B\n## One: `two`\n```\n[c](no.md)\n```\n[above](#b), [net](https://a.example/no.md)\n'
  write docs/requests.md '| [`pause_all`](a.md) | x |\n'
  write docs/events.md '| `robot_idle` | x |\n'
  write docs/decisions.md '**1. Two.**\n*Context:* a\n*Decision:* b *Consequence:* c\n'
  write plant_models/spatial.h '#pragma once\n#include <Eigen/Core>\n#include <vector>\n'
  write server/geometry/mesh/mesh.h '#pragma once\n#include "plant_models/spatial.h"\n'
  write server/geometry/mesh/import.cpp '#include <assimp/scene.h>\n#include <assimp/mesh.h>\n#include "server/geometry/mesh/mesh.h"\n'
  write server/geometry/convex/overlap.cpp '#include <ccd/ccd.h>\n'
  write server/scenario/reader.cpp '#include <yaml-cpp/yaml.h>\n#include "server/simulation/step/simulation.h"\n'
  write server/scenario/urdf.cpp '#include <tinyxml2.h>\n'
  write server/fmu/description.cpp '#include <tinyxml2.h>\n'
  write server/fmu/system.cpp '#include <tinyxml2.h>\n'
  write server/geometry/mesh/dae.cpp '#include <tinyxml2.h>\n'
  write server/simulation/step/simulation.h '#pragma once\n#include "server/contact/holding/search.h"\n'
  write server/runtime/loop/loop.cpp '#include <mutex>\n#include "server/simulation/step/simulation.h"\nvoid Loop::take() {}\n'
  write server/dds/participant.cpp '#include <fastdds/dds/domain/DomainParticipant.hpp>\n#include "server/simulation/model/snapshot.h"\n#include "takt_msgs.h"\n'
  write idl/takt_enumerations.idl 'enum PartState {\n  free,\n  grasped  // held\n};\n'
  write idl/takt_msgs.idl '@final\n@topic(id="state", name="{cell}/state", by="server")\nstruct State { double x; };\n'
  write client_lib/client.cpp '#include <chrono>\n#include <fastdds/x.hpp>\n#include "takt_topics.h"\n#include "client_lib/client.h"\n'
  write client_lib/controller/controller.cpp '#include <lua.hpp>\n#include "plant_models/spatial.h"\n'
  write tests/dds/x_unit_test.cpp '#include <chrono>\n#include <fcl/fcl.h>\n#include "server/dds/x.h"\nTEST(Reader,\n     AllIsRead) {}\nTEST_F(Reader, AllOfIt) {}\n'
  write server/contact/holding/search.h '#pragma once\n'
}
# expect PLACE FILE CONTENT: with that file, check.sh must fail and report PLACE once.
places=() files=() contents=()
expect() {
  places+=("$1") files+=("$2") contents+=("$3")
}
# check_all DIFFERENCES_FILE: a tree takes the first waiting violation of each file.
check_all() {
  local waiting=("${!places[@]}") later index output expected
  while ((${#waiting[@]} > 0)); do
    fresh
    local -A written=()
    later=() expected=()
    for index in "${waiting[@]}"; do
      if [[ -n ${written[${files[index]}]-} ]]; then
        later+=("$index")
        continue
      fi
      written[${files[index]}]=1
      write "${files[index]}" "${contents[index]}"
      expected+=("${places[index]}")
    done
    output=$("$check" "$tree") && { printf 'not found: %s\n' "${expected[*]}"; failed=1; }
    if ! diff <(printf '%s\n' "${expected[@]}" | sort) <(sed 's/: .*//' <<<"$output" | sort) >"$1"; then
      printf 'Violations that were not reported (<), and reports without one (>):\n'
      cat "$1"
      printf 'The reports:\n%s\n' "$output"
      failed=1
    fi
    waiting=("${later[@]}")
  done
}

fresh
"$check" "$tree" || { echo 'the clean tree is refused'; failed=1; }

# Direction
expect idl/transport/a.cpp:1 idl/transport/a.cpp '#include "server/dds/participant.h"\n'
expect plant_models/a.h:2 plant_models/a.h '#pragma once\n#include "server/geometry/mesh/mesh.h"\n'
expect plant_models/a.cpp:1 plant_models/a.cpp '#include <yaml.h>\n'
expect server/geometry/a.h:1 server/geometry/a.h '#include "server/components/component.h"\n'
expect server/components/a.h:1 server/components/a.h '#include "server/contact/holding/search.h"\n'
expect server/contact/a.cpp:3 server/contact/a.cpp '\n\n#include "server/simulation/step/simulation.h"\n'
expect server/simulation/step/a.cpp:1 server/simulation/step/a.cpp '#include "server/scenario/scenario.h"\n'
expect server/scenario/a.cpp:1 server/scenario/a.cpp '#include "server/runtime/loop/loop.h"\n'
expect server/runtime/loop/a.cpp:1 server/runtime/loop/a.cpp '#include "server/dds/participant.h"\n'
expect server/geometry/convex/a.cpp:1 server/geometry/convex/a.cpp '#include "server/geometry/surface/elements.h"\n'
expect server/geometry/aabb.cpp:1 server/geometry/aabb.cpp '#include "server/geometry/mesh/mesh.h"\n'
expect server/contact/surface/a.cpp:1 server/contact/surface/a.cpp '#include "server/contact/holding/search.h"\n'
expect server/contact/collision/a.cpp:1 server/contact/collision/a.cpp '#include "server/contact/holding/search.h"\n'
expect server/simulation/solver/a.cpp:1 server/simulation/solver/a.cpp '#include "server/simulation/step/simulation.h"\n'
expect server/simulation/model/a.cpp:1 server/simulation/model/a.cpp '#include "server/simulation/solver/integrator.h"\n'
expect server/runtime/requests/a.cpp:1 server/runtime/requests/a.cpp '#include "server/runtime/loop/loop.h"\n'
expect server/runtime/loop/a.cpp:1 server/runtime/loop/a.cpp '#include "server/runtime/host/cell_host.h"\n'
expect idl/common/a.cpp:1 idl/common/a.cpp '#include "idl/transport/a.h"\n'
expect server/dds/a.cpp:1 server/dds/a.cpp '#include "server/contact/holding/search.h"\n'
expect client_lib/a.cpp:1 client_lib/a.cpp '#include "server/simulation/model/snapshot.h"\n'
expect client_lib/tools/takt/a.cpp:1 client_lib/tools/takt/a.cpp '#include <server/simulation/model/snapshot.h>\n'
expect idl/command_line/a.cpp:1 idl/command_line/a.cpp '#include "client_lib/client.h"\n'
expect client_lib/controller/a.cpp:1 client_lib/controller/a.cpp '#include "client_lib/client.h"\n'
expect client_lib/controller/a.cpp:1 client_lib/controller/a.cpp '#include "server/messages/instant_messages.h"\n'
expect client_lib/kinematics/a.cpp:1 client_lib/kinematics/a.cpp '#include "client_lib/controller/controller.h"\n'
expect client_lib/render/a.cpp:1 client_lib/render/a.cpp '#include "server/geometry/mesh/mesh.h"\n'
expect server/contact/a.cpp:1 server/contact/a.cpp '#  include "../geometry/mesh.h"\n'
expect server/headless/a.cpp:1 server/headless/a.cpp '#include "server/runtime/loop/loop.h"\n'
expect server/tools/takt_run/a.cpp:1 server/tools/takt_run/a.cpp '#include "server/dds/participant.h"\n'
# Libraries in their place
expect server/runtime/loop/a.cpp:1 server/runtime/loop/a.cpp '#include <fastdds/x.hpp>\n'
expect client_lib/controller/a.cpp:1 client_lib/controller/a.cpp '#include <fastrtps/x.h>\n'
expect server/geometry/mesh/x.cpp:1 server/geometry/mesh/x.cpp '#include <assimp/scene.h>\n'
expect server/geometry/mesh/z.cpp:1 server/geometry/mesh/z.cpp '#include <ccd/ccd.h>\n'
expect server/geometry/a.h:1 server/geometry/a.h '#include <ccd/ccd.h>\n'
expect server/scenario/z.cpp:1 server/scenario/z.cpp '#include <tinyxml2.h>\n'
expect server/simulation/step/a.cpp:1 server/simulation/step/a.cpp '#include <yaml-cpp/yaml.h>\n'
expect client_lib/a.cpp:1 client_lib/a.cpp '#include <lua.hpp>\n'
expect client_lib/a.cpp:1 client_lib/a.cpp '#include <png.h>\n'
# Clocks, threads, locks
expect plant_models/a.cpp:1 plant_models/a.cpp '#include <thread>\n'
expect server/simulation/step/a.cpp:1 server/simulation/step/a.cpp '#include <chrono>\n'
expect server/scenario/a.cpp:1 server/scenario/a.cpp '#include <mutex>\n'
expect client_lib/controller/a.cpp:1 client_lib/controller/a.cpp '#include <condition_variable>\n'
# The rest
expect server/contact/a.cpp:601 server/contact/a.cpp "$(printf '//\\n%.0s' {1..601})"
expect docs/a.md:2 docs/a.md 'x\nsee /ho''me/someone/notes\n'
expect tests/contact/a_unit_test.cpp:1 tests/contact/a_unit_test.cpp '  std::this_thread::sleep_for(1s);\n'
expect server/contact/a.cpp:1 server/contact/a.cpp '// TO''DO later\n'
expect server/simulation/model/a.h:1 server/simulation/model/a.h 'enum class PartState : char { free };\n'
expect client_lib/a.cpp:2 client_lib/a.cpp '\nconst char* const topic = "/state";\n'
expect client_lib/a.cpp:1 client_lib/a.cpp 'qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;\n'
expect client_lib/a.cpp:1 client_lib/a.cpp 'qos.ownership().kind = dds::EXCLUSIVE_OWNERSHIP_QOS;\n'
expect client_lib/a.cpp:1 client_lib/a.cpp 'qos.liveliness().lease_duration = DdsDuration(1, 0);\n'
expect client_lib/a.cpp:1 client_lib/a.cpp 'check(IsMember({"free", "grasped"}));\n'
expect client_lib/a.js:1 client_lib/a.js "if (state === 'grasped') f();\\n"
expect server/geometry/mesh/a.h:1 server/geometry/mesh/a.h '#include "takt_msgs.h"\n'
expect server/runtime/a.cpp:1 server/runtime/a.cpp 'if (name == "pause_all") return;\n'
expect client_lib/a.cpp:1 client_lib/a.cpp 'if (event.code == "robot_idle") return;\n'
expect README.md:1 README.md '# x\n./dev test\n'
expect README.md:1 README.md "# x\\n./dev demo\\n$(printf '\\n%.0s' {1..40})./dev test\\n"
expect README.md:120 README.md "# x\\n./dev demo\\n./dev test\\n$(printf '\\n%.0s' {1..120})"
# Documents
expect README.md:4 README.md '# x\n./dev demo\n./dev test\n[a](docs/no.md)\n'
expect docs/a.md:2 docs/a.md 'x\n[b](../no.md)\n'
expect docs/a.md:1 docs/a.md '[b](b.md#three)\n'
expect docs/a.md:1 docs/a.md 'See `server/contact/no.h` and `server/dds`.\n'
expect docs/a.md:1 docs/a.md 'See `no.h`.\n'
expect docs/c.md:1 docs/c.md '# C\n[a](a.md)\n'
expect docs/decisions.md:1 docs/decisions.md '**1. Two.**\n*Context:* a\n*Decision:* c\n'
expect docs/decisions.md:4 docs/decisions.md "$(printf '**1. Two.**\\n*Context:* a *Decision:* b\\n*Consequence:* c\\n%.0s' {1..2})"
expect server/contact/a.cpp:1 server/contact/a.cpp '// See docs/no.md\n'
expect docs/a.md:1 docs/a.md "| a | $(printf 'x%.0s' {1..300}) |\\n"
expect docs/a.md:2 docs/a.md 'x\n`Reader.AllOf*`, `Reader.*`, `Reader.AllIsRead`, `Reader.Nothing`\n'
# Comments
expect server/contact/a.cpp:2 server/contact/a.cpp '\n// Finds who holds a part.\n'
expect server/contact/a.cpp:1 server/contact/a.cpp 'int x;  ///< told twice\n'
expect server/contact/a.cpp:1 server/contact/a.cpp '// The list is no longer sorted.\n'
expect server/contact/a.cpp:1 server/contact/a.cpp '// See holding/no.h, search.h and holding/search.h.\n'
expect client_lib/a.cpp:1 client_lib/a.cpp 'int x;  // for whoever reads\n'
expect idl/takt_msgs.idl:1 idl/takt_msgs.idl '// told once\n'
expect client_lib/view/web/a.js:1 client_lib/view/web/a.js 'f("//a");  // nobody\n'
expect config/programs/a.lua:2 config/programs/a.lua 'who = 1\n-- for whom\n'
expect tests/python/a.py:3 tests/python/a.py '"""One.\n\nIt tells."""\nwho = 1\n'
expect tests/python/a.py:2 tests/python/a.py '"""One."""\nwho = 1  # an''ew\n'
expect config/dds/a.xml:2 config/dds/a.xml '<!-- One,\nnobody -->\n<who/>\n'
expect cmake/a.cmake:1 cmake/a.cmake '# no longer\nset(who 1)\n'
expect tests/dds/y_unit_test.cpp:2 tests/dds/y_unit_test.cpp '\nTEST(Reader, OfAWrongTypeAreTold) {}\n'
expect tests/dds/y_unit_test.cpp:1 tests/dds/y_unit_test.cpp 'TEST(Reader, BrokenOnesAreReported) {}\nTEST(Whole, AllIsRead) {}\n'
expect tests/python/test_a.py:1 tests/python/test_a.py 'def test_a_mistake_is_told(cell):\n'
# The way of a command
expect docs/architecture.md:2 docs/architecture.md '## The way of a command\n| 1 | `Loop::give` | `server/runtime/loop/loop.cpp` |\n'
expect docs/architecture.md:13 docs/architecture.md "## The way of a command\\n$(printf '| 1 | `Loop::take` | `server/runtime/loop/loop.cpp` |\\n%.0s' {1..12})"

check_all "$tree.differences"
printf '%d violations tried\n' "${#places[@]}"
exit $failed
