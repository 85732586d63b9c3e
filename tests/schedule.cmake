# How ctest runs the entries of tests (cmake/test_entries.cmake): regular expressions of ROOM.Suite.* (ROOM.Suite.Case where
# cases are entries). `./dev test` lets ctest have two places for each processor: what computes takes two of them, what
# mostly waits (for discovery, for a frozen process) one.
set(TAKT_PROCESSORS_OF_WORK 2)
set(TAKT_TESTS_THAT_WAIT "^integration\\.")

# Nothing runs beside these: they measure time.
set(TAKT_TESTS_ALONE "^integration\\.(DdsFrozenClient|FullDisk)\\.")

# Long cases that share nothing: an entry a case, so that every processor has one.
set(TAKT_TESTS_BY_CASE
  "^config\\.Shipped/RefinedPeaks"
)

# Seconds, so that the longest ones begin first also where ctest has not seen them yet.
set(TAKT_TEST_COSTS
  "50 ^integration\\.LockstepBlockScenario"
)
