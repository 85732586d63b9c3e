# How ctest runs the entries of tests (cmake/test_entries.cmake): regular expressions of ROOM.Suite.* (ROOM.Suite.Case where
# cases are entries). `./dev test` lets ctest have three places for each processor: what computes takes two of them, what
# mostly waits (for discovery, for a frozen process) one.
set(TAKT_PROCESSORS_OF_WORK 2)
set(TAKT_TESTS_THAT_WAIT "^integration\\.")

# These run alone: they measure time.
set(TAKT_TESTS_ALONE
  "^integration\\.(DdsFrozenClient|FullDisk|ModbusPlc)\\."
  "^integration\\.EgmOverUdp\\.(ASensorThatFallsSilent|MotorsThatAreOff|RadiansAndCutMessages|TheRobotFollows)"
  "^integration\\.ForceSensorInProtocols\\.Ur"
  "^integration\\.RsiOverUdp\\.(ARestarted|MissingAnswers|PacketsWithout|TheRobotFollows)")

# Long cases that share nothing, so that every processor has one, and suites with cases that run alone: an entry a case.
set(TAKT_TESTS_BY_CASE
  "^config\\.(Shipped/RefinedPeaks|BlockContact|ChainsawScenario|RotorScenario)$"
  "^integration\\.(EgmOverUdp|ForceSensorInProtocols|RsiOverUdp)$")

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

# Seconds: the longest entries begin first also where ctest has not seen them yet (tests/runs.py), so that none of them is left
# over at the end. Tests with a browser run one after the other. web.orders waits for many programs to find each other.
set(TAKT_TEST_COSTS
  "300 ^web\\.look$"
  "200 ^web\\.orders$"
  "150 ^web\\.view$"
  "100 ^web\\."
  "80 ^gateway\\.assembly_by_rsi$"
  "70 ^config\\.Shipped/WrittenScenario"
  "50 ^(docs\\.tutorial_cad|integration\\.LockstepBlockScenario|python\\.test_frozen|simulation\\.Levels/GraspingCells)"
  "45 ^simulation\\.(Solvers/EverySolver|ThrownBricks)$"
  "40 ^(contact\\.(ContactEnergy|FieldContactOracle)|house\\.package|simulation\\.(AnyAssembly|ContactScenes))$"
  "30 ^(cad\\.StepReader|contact\\.(ContactSearch|PolygonalContact)|geometry\\.Decomposition|simulation\\.BoundedSolverOfABlockAssembly)$"
  "25 ^(config\\.(NutOnBolt|Screw)|scenario\\.schema|simulation\\.(SavedContact|SurfaceContactCell))$"
  "20 ^(fmu_export\\.|integration\\.Secured|python\\.|runtime\\.(ContactAllocation|ThreadCount))"
)
