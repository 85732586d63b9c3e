# How ctest runs the entries of tests (cmake/test_entries.cmake): regular expressions of ROOM.Suite.* (ROOM.Suite.Case where
# cases are entries). `./dev test` lets ctest have three places for each processor: what computes takes two of them, what
# mostly waits (for discovery, for a frozen process) one.
set(TAKT_PROCESSORS_OF_WORK 2)
set(TAKT_TESTS_THAT_WAIT "^integration\\.")

# These run alone: they measure time.
set(TAKT_TESTS_ALONE "^integration\\.(DdsFrozenClient|EgmOverUdp|ForceSensorInProtocols|FullDisk|ModbusPlc|RsiOverUdp)\\.")

# Long cases that share nothing: an entry a case, so that every processor has one.
set(TAKT_TESTS_BY_CASE "^config\\.(Shipped/RefinedPeaks|BlockContact|ChainsawScenario|RotorScenario)$")

# Only with ./dev test --long: scenarios at other levels of detail than their own (the block assembly has all three), and the
# longest ones, which other tests run as they are shipped.
set(TAKT_TESTS_ONLY_LONG
  "^config\\.ChainsawScenario\\.ThePressForceGrows"
  "^config\\.RotorScenario\\.AllBySurfaceContact"
  "^config\\.Shipped/RefinedPeaks.*/(bev_rotor|chainsaw_motor|furnace)_.$"
  "^config\\.Shipped/RefinedPeaks.*/(block_disassembly|closed_jaws|gear_on_shaft|ring_on_pin|weak_grip)_[23]$"
  "^config\\.Shipped/RefinedPeaks.*/(block_assembly_kr16|robot_r3|robot_r3_single_axis)_[13]$"
  "^config\\.Shipped/RefinedPeaks.*/(contact_(gear_pair|lamp_in_socket|screw_tightened)|nut_on_bolt)_3$"
  "^config\\.Shipped/RefinedPeaks.*/contact_.*_[12]$")

# Suites of files with tests/support/effort.h: their long forms run with ./dev test --long.
set(TAKT_TESTS_WITH_LONG_FORM
  "^client_lib\\.LuaLibraries\\."
  "^config\\.(ContactScenePoses|Shipped/RefinedPeaks)\\."
  "^contact\\.(ContactEnergy|ContactSearch|InteractionAlgorithmsProperty|NearPairs|PolygonalContactLaws)\\."
  "^dds\\.BadCommands"
  "^geometry\\.(ConvexOverlap|ConvexQuery)\\."
  "^idl\\.RtpsGuardRandom\\."
  "^integration\\.(Guard|LockstepBlockScenario)\\."
  "^runtime\\.StepPath\\."
  "^simulation\\.(AnyAssembly|FastBodies|InjectedFailures)\\.")

# Seconds: the longest entries begin first also where ctest has not seen them yet (tests/runs.py). web.orders waits for many
# programs to find each other.
set(TAKT_TEST_COSTS
  "200 ^web\\.orders$"
  "100 ^web\\."
  "50 ^integration\\.LockstepBlockScenario"
  "20 ^python\\."
)
