# Permitted includes (docs/architecture.md). Input: source files, paths relative to the repository's root.
# Output: one line FILE:LINE: rule, per violation.

function complain(rule) { print FILENAME ":" FNR ": " rule }
function starts(text, prefix) { return substr(text, 1, length(prefix)) == prefix }
function starts_any(text, list,    parts, count, i) {
  count = split(list, parts, " ")
  for (i = 1; i <= count; ++i) if (starts(text, parts[i])) return 1
  return 0
}

BEGIN {
  # Rooms, most specific first; each with the prefixes of what it may include. Arrows never turn back.
  rooms = split("plant_models/ idl/common/ idl/vocabulary/ idl/transport/ " \
                "server/geometry/mesh/ server/geometry/convex/ server/geometry/surface/ server/geometry/ server/components/ " \
                "server/contact/collision/ server/contact/holding/ server/contact/clearance/ server/contact/surface/ server/contact/ " \
                "server/simulation/model/ server/simulation/solver/ server/simulation/step/ server/fields/ server/devices/ server/scenario/ " \
                "server/product/ server/cad/ server/fmu/ server/tools/takt_from_cad/ server/tools/takt_fmu_host/ server/runtime/requests/ server/runtime/recording/ server/runtime/loop/ server/runtime/host/ server/runtime/ " \
                "server/messages/ server/dds/ server/headless/ server/fmu_export/ server/tools/ server/server_main.cpp client_lib/kinematics/ client_lib/controller/ " \
                "client_lib/render/ client_lib/recording/ client_lib/gateway/rtde/ client_lib/gateway/urscript/ client_lib/gateway/rsi/ " \
                "client_lib/gateway/egm/ client_lib/gateway/modbus/ client_lib/gateway/ " \
                "client_lib/tools/ client_lib/ idl/command_line/ idl/lua/ idl/ config/", room, " ")
  plant = "plant_models/ idl/common/"
  may["plant_models/"] = "plant_models/"
  may["idl/common/"] = "idl/common/ GENERATED"
  may["idl/lua/"] = "idl/common/ idl/lua/"  # the sandbox: of controller programs and of devices
  may["idl/vocabulary/"] = "idl/common/ idl/vocabulary/ GENERATED"

  # Shapes. Files in the folder itself serve all of its rooms.
  boxes = plant " server/geometry/aabb.h server/geometry/box_tree.h server/geometry/broad_phase.h server/geometry/segment_distance.h"
  may["server/geometry/"] = boxes
  may["server/geometry/mesh/"] = boxes " server/geometry/mesh/"
  may["server/geometry/convex/"] = boxes " server/geometry/mesh/ server/geometry/convex/"
  may["server/geometry/surface/"] = boxes " server/geometry/mesh/ server/geometry/surface/"
  geometry = plant " server/geometry/"
  components = geometry " server/components/"
  may["server/components/"] = components

  # Interaction. Surface contact and holding do not include each other.
  shared = components " server/contact/executor.h server/contact/pair_linearisation.h"
  may["server/contact/"] = shared
  may["server/contact/collision/"] = shared " server/contact/collision/"
  may["server/contact/holding/"] = shared " server/contact/collision/ server/contact/holding/"
  may["server/contact/clearance/"] = shared " server/contact/collision/ server/contact/holding/ server/contact/clearance/"
  may["server/contact/surface/"] = shared " server/contact/surface/"
  contact = components " server/contact/"

  # Solvers use the ODE system, but no gripping.
  model = contact " server/simulation/model/"
  may["server/simulation/model/"] = model
  may["server/simulation/solver/"] = model " server/simulation/solver/"
  simulation = contact " server/simulation/"
  may["server/simulation/step/"] = simulation

  # Tables of fields know values and YAML, no section; devices are described by them, and by the simulation.
  may["server/fields/"] = plant " server/fields/"
  may["server/devices/"] = simulation " server/fields/ server/devices/ idl/lua/"
  scenario = simulation " server/fields/ server/devices/ server/scenario/"
  may["server/scenario/"] = scenario

  # Products of CAD files: what a product is and what follows from it; the reader of STEP files, which the server never links.
  may["server/product/"] = scenario " server/product/"
  may["server/cad/"] = geometry " server/product/ server/cad/"
  may["server/tools/takt_from_cad/"] = scenario " server/product/ server/cad/ server/headless/ server/tools/takt_from_cad/ idl/command_line/ client_lib/render/"

  # FMUs behind the interface that devices know; their process has nothing of takt but the protocol.
  may["server/fmu/"] = simulation " server/fields/ server/devices/ server/fmu/"
  may["server/tools/takt_fmu_host/"] = plant " server/fmu/fmu_wire.h server/fmu/model_description.h server/tools/takt_fmu_host/"

  # The service around the core: requests and events, what is kept on disk, the loop of one scenario, its host.
  waits = "server/runtime/pacer.h server/runtime/monotonic_clock.h server/runtime/auto_reset_event.h"
  may["server/runtime/"] = plant " " waits
  may["server/runtime/requests/"] = scenario " " waits " idl/vocabulary/ server/runtime/requests/"
  may["server/runtime/recording/"] = may["server/runtime/requests/"] " server/runtime/recording/"
  may["server/runtime/loop/"] = may["server/runtime/recording/"] " server/runtime/loop/"
  may["server/runtime/host/"] = scenario " idl/vocabulary/ server/runtime/"
  # The boundary: messages made of the core and the loop, their senders and recorders.
  described = " server/simulation/model/snapshot.h server/simulation/model/pressed_elements.h server/simulation/model/cell_frames.h " \
              "server/simulation/model/cell_description.h"
  may["server/messages/"] = plant described " server/runtime/requests/ server/runtime/loop/loop_output.h server/messages/ GENERATED"
  may["server/dds/"] = plant described " server/simulation/model/command.h server/runtime/ server/messages/ server/dds/ idl/transport/ idl/ GENERATED"
  may["server/headless/"] = scenario " server/messages/ server/headless/ idl/lua/ client_lib/controller/ client_lib/render/ client_lib/recording/ GENERATED"
  may["server/fmu_export/"] = "server/fmu/fmu_archive.h server/fmu_export/ " may["server/headless/"]
  may["server/server_main.cpp"] = "plant_models/ server/ idl/"
  may["server/tools/"] = "server/fmu/ server/fmu_export/ server/runtime/ server/tools/ idl/command_line/ " may["server/headless/"]
  may["client_lib/kinematics/"] = plant " client_lib/kinematics/ GENERATED"
  may["client_lib/controller/"] = plant " idl/lua/ client_lib/kinematics/ client_lib/controller/ GENERATED"
  may["client_lib/render/"] = plant " client_lib/render/"
  may["client_lib/recording/"] = "idl/common/ client_lib/recording/ GENERATED"
  # Coders of protocols are functions on bytes; the gateways around them are clients with a mapping file.
  may["client_lib/gateway/rtde/"] = "client_lib/gateway/rtde/ idl/common/"
  may["client_lib/gateway/urscript/"] = "client_lib/gateway/urscript/ client_lib/gateway/ur/path.h idl/common/"
  units = plant " client_lib/kinematics/ client_lib/gateway/vendor_units.h client_lib/gateway/peer_clock.h"
  may["client_lib/gateway/rsi/"] = units " client_lib/gateway/rsi/"
  may["client_lib/gateway/egm/"] = units " client_lib/gateway/egm/"
  may["client_lib/gateway/modbus/"] = "client_lib/gateway/modbus/ idl/common/"
  may["client_lib/"] = plant " client_lib/ idl/transport/ idl/ GENERATED"
  may["client_lib/gateway/"] = "server/fields/ " may["client_lib/"]
  # takt check reads a section of scenario files; gateways read their mapping files by the same tables.
  may["client_lib/tools/"] = "idl/command_line/ server/fields/ " may["client_lib/"]  # its end says GENERATED
  may["idl/command_line/"] = "idl/common/ idl/command_line/"
  may["idl/transport/"] = "idl/common/ idl/transport/ security_documents.h"  # which CMake makes of config/dds/security
  may["idl/"] = "idl/ GENERATED"
  may["config/"] = plant " config/"

  core = "plant_models/ server/geometry/ server/components/ server/contact/ server/simulation/ server/fields/ server/devices/ server/scenario/"
  timeless = core " idl/common/ idl/lua/ client_lib/kinematics/ client_lib/controller/ client_lib/render/ client_lib/recording/ " \
             "client_lib/gateway/rtde/ client_lib/gateway/urscript/ client_lib/gateway/rsi/ client_lib/gateway/egm/ client_lib/gateway/modbus/ config/"
  clocks_and_threads = " chrono ctime time.h sys/time.h thread mutex shared_mutex condition_variable future semaphore " \
                       "latch barrier stop_token pthread.h "

  # Third-party libraries: include prefixes; where they may be used; in how many .cpp files at most (0: any number).
  libraries = 0
  library("Fast DDS", "fastdds/ fastrtps/ fastcdr/", "idl/transport/ server/dds/ client_lib/ idl/ tests/", "", 0)
  forbidden_in["Fast DDS"] = "client_lib/kinematics/ client_lib/controller/ client_lib/render/ client_lib/recording/"
  library("assimp", "assimp/", "server/ tests/", "server/", 1)
  library("libccd", "ccd/", "server/ tests/", "server/", 1)
  library("qhull", "libqhull", "server/ config/ tests/", "server/", 1)
  library("V-HACD", "VHACD.h", "server/geometry/", "server/", 1)
  library("FCL", "fcl/", "server/geometry/ tests/", "server/", 1)
  library("SUNDIALS", "cvode/ arkode/ ida/ sundials/ sunlinsol/ sunmatrix/ sunnonlinsol/ nvector/", "server/simulation/", "server/", 1)
  library("tinyxml2", "tinyxml2.h", "server/geometry/mesh/ server/scenario/ server/fmu/ client_lib/gateway/rsi/ client_lib/gateway/ur/ client_lib/gateway/urscript/", "server/", 4)
  library("OpenCASCADE", "BRep Geom Gp GProp Interface_ STEP TopExp TopLoc_ TopoDS TopTools TDF_ TDocStd_ TDataStd_ XCAF Quantity_ Bnd_ Poly_ Precision.hxx Standard_ TCol", "server/cad/ tests/cad/", "", 0)
  library("minizip", "minizip/", "server/fmu/ server/fmu_export/ tests/", "server/", 2)
  library("OpenSSL", "openssl/", "server/fmu/ idl/transport/", "server/", 1)
  library("utf8cpp", "utf8cpp/", "idl/common/", "", 0)
  library("yaml-cpp", "yaml-cpp/", "server/fields/ server/scenario/ server/fmu_export/ client_lib/recording/ tests/", "", 0)
  library("Lua", "lua.h lua.hpp lauxlib.h lualib.h", "idl/lua/ client_lib/controller/ server/devices/ server/headless/ tests/", "", 0)
  library("libpng", "png.h", "client_lib/render/ tests/", "", 0)
  library("CLI11", "CLI/", "server/server_main.cpp server/tools/ idl/command_line/ client_lib/tools/ client_lib/examples/ config/ tests/", "", 0)
  library("pybind11", "pybind11/", "client_lib/python/", "", 0)
  library("zstd", "zstd.h", "client_lib/recording/", "", 0)
  library("lz4", "lz4.h lz4frame.h", "client_lib/recording/", "", 0)
  library("Boost", "boost/", "client_lib/view/ client_lib/gateway/event_loop.cpp", "", 0)
  library("prometheus-cpp", "prometheus/", "client_lib/view/", "", 0)
  library("protobuf", "google/protobuf/ egm.pb.h", "client_lib/gateway/egm/", "client_lib/", 1)
  library("KDL", "kdl/", "tests/", "", 0)
}

function library(name, prefixes, where, counted_in, most) {
  ++libraries
  lib_name[libraries] = name; lib_prefixes[libraries] = prefixes; lib_where[libraries] = where
  lib_counted[libraries] = counted_in; lib_most[libraries] = most
}

FNR == 1 {
  here = ""
  for (i = 1; i <= rooms && here == ""; ++i) if (starts(FILENAME, room[i])) here = room[i]
}

/^[ \t]*#[ \t]*include[ \t]*["<]/ {
  target = $0
  sub(/^[ \t]*#[ \t]*include[ \t]*/, "", target)
  quoted = substr(target, 1, 1) == "\""
  target = substr(target, 2)
  sub(/[">].*/, "", target)

  third_party = 0
  for (i = 1; i <= libraries; ++i) third_party = third_party || starts_any(target, lib_prefixes[i])
  if (!third_party && (quoted || starts_any(target, "plant_models/ idl/ server/ client_lib/"))) {
    # What is generated of idl/*.idl is included by its bare name. Enumerations are everybody's.
    if (target == "takt_enumerations.h") next
    generated = target ~ /^([a-z0-9_]*_msgs|takt_topics|takt_actions)\.h$/
    # Those of requests and events belong to the vocabulary.
    if (target ~ /^takt_(request|event|player|pendant)(s|_table)?\.h$/) target = "idl/vocabulary/" target
    if (target ~ /(^|\/)\.\.?\//) complain("includes are relative to the repository's root: " target)
    else if (here != "" && generated && index(may[here] " ", "GENERATED ") == 0 && may[here] !~ /GENERATED$/)
      complain(here " must not know the messages of the wire: " target)
    else if (here != "" && !generated && !starts_any(target, may[here])) complain(here " must not include " target)
  }

  if (here == "plant_models/" && !quoted && target ~ /[\/.]/ && !starts(target, "Eigen/"))
    complain("plant_models/ knows only Eigen and the standard library: " target)

  if (index(clocks_and_threads, " " target " ") > 0 && starts_any(FILENAME, timeless))
    complain(here " has no clock, thread or lock: <" target ">")

  for (i = 1; i <= libraries; ++i) {
    if (!starts_any(target, lib_prefixes[i])) continue
    name = lib_name[i]
    if (!starts_any(FILENAME, lib_where[i]) || (name in forbidden_in && starts_any(FILENAME, forbidden_in[name])))
      complain(name " is not used here, only in " lib_where[i] ": " target)
    if (lib_most[i] > 0 && starts(FILENAME, lib_counted[i])) {
      if (FILENAME ~ /\.h$/) complain(name " stays out of headers: " target)
      else if (!((i, FILENAME) in users)) {
        users[i, FILENAME] = 1
        if (++user_count[i] > lib_most[i])
          complain(name " is wrapped in one place (" first_user[i] "), not here: " target)
        if (first_user[i] == "") first_user[i] = FILENAME
      }
    }
  }
}
