#pragma once
// Number of repetitions of tests with random numbers. Such a suite has two entries in ctest: the short form,
// and "long.*" with ten times as many (tests/schedule.cmake; ./dev test --long).
#include <cstddef>
#include <cstdlib>

namespace takt::test {

/// Repetitions in the short form are multiplied by this: TAKT_TEST_EFFORT, 1 without it, 10 in the long form.
inline std::size_t effort() {
  const char* text = std::getenv("TAKT_TEST_EFFORT");
  const long value = text != nullptr ? std::strtol(text, nullptr, 10) : 1;
  return value > 1 ? static_cast<std::size_t>(value) : 1;
}

}  // namespace takt::test
