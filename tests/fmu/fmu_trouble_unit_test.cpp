// FMUs that crash, hang, take all memory, leave, answer errors or change what is not theirs: the cell goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <xmmintrin.h>

#include "tests/support/fmu_cell.h"

namespace takt {
namespace {

using test::FmuCell;
using test::kTestFmus;
using testing::HasSubstr;

// Of support/fmus/motor_fmu.c.
enum class Trouble {
  none,
  crash,
  hang,
  allocate,
  control,
  discard,
  error,
  fatal,
  not_a_number,
  leave,
  write_file,
  network,
  chdir_away
};

struct TroubleCase {
  Trouble trouble;
  const char* sentence;
};

class Troubles : public testing::TestWithParam<TroubleCase> {
 protected:
  static std::string keys(const std::string& more = "") {
    return "timeout_s: 2, memory_MiB: 256, parameters: {trouble: " +
           std::to_string(static_cast<int>(GetParam().trouble)) + ", trouble_at: 0.0095}" + more;
  }
};
INSTANTIATE_TEST_SUITE_P(
    All, Troubles,
    testing::Values(TroubleCase{Trouble::crash, "crashed: signal 11"},
                    TroubleCase{Trouble::hang, "did not answer a step within 2 s (timeout_s)"},
                    TroubleCase{Trouble::allocate, "crashed: signal 11"},
                    TroubleCase{Trouble::discard, "answered fmi2Discard to the step from 0.010000 s"},
                    TroubleCase{Trouble::error,
                                "answered fmi2Error to fmi2DoStep: \"the brushes are worn at 0.01 s\""},
                    TroubleCase{Trouble::fatal, "answered fmi2Fatal to fmi2DoStep"},
                    TroubleCase{Trouble::not_a_number, "an output of the FMU is nan"},
                    TroubleCase{Trouble::leave, "ended its process with exit code 7"}));

TEST_P(Troubles, AreReportedOnceWithHeldOutputsUntilAReset) {
  FmuCell cell(kTestFmus / "motor2.fmu", keys());
  const auto run_into_it = [&] {
    cell.command("motor_u", 12.0);
    ASSERT_TRUE(cell.step(10));
    EXPECT_EQ(cell.notices(), "");
    EXPECT_EQ(cell.value("failed"), 0.0);
    const double held = cell.value("motor_w");
    EXPECT_GT(held, 0.0);
    ASSERT_TRUE(cell.step(20)) << cell.simulation().fault();
    EXPECT_EQ(cell.value("failed"), 1.0);
    EXPECT_EQ(cell.value("motor_w"), held);
  };
  run_into_it();
  EXPECT_THAT(cell.notices(), HasSubstr(GetParam().sentence));
  EXPECT_EQ(std::count(cell.notices().begin(), cell.notices().end(), '\n'), 1) << cell.notices();
  // The failure is part of the saved state.
  std::vector<std::byte> state;
  ASSERT_EQ(cell.simulation().save_state(state), "");
  const std::uint64_t hash = cell.simulation().state_hash();
  cell.simulation().reset();
  EXPECT_EQ(cell.value("failed"), 0.0);
  EXPECT_EQ(cell.value("motor_w"), 0.0);
  ASSERT_TRUE(cell.step(9));
  ASSERT_EQ(cell.simulation().restore_state(state), "");
  EXPECT_EQ(cell.value("failed"), 1.0);
  EXPECT_EQ(cell.simulation().state_hash(), hash);
}

TEST_P(Troubles, AStateOfBeforeBringsBackARunningFmu) {
  FmuCell cell(kTestFmus / "motor2.fmu", keys());
  cell.command("motor_u", 12.0);
  ASSERT_TRUE(cell.step(5));
  std::vector<std::byte> state;
  ASSERT_EQ(cell.simulation().save_state(state), "");
  const std::uint64_t hash = cell.simulation().state_hash();
  ASSERT_TRUE(cell.step(4));
  const double speed = cell.value("motor_w");
  ASSERT_TRUE(cell.step(5));
  ASSERT_EQ(cell.value("failed"), 1.0);
  ASSERT_EQ(cell.simulation().restore_state(state), "");
  EXPECT_EQ(cell.value("failed"), 0.0);
  EXPECT_EQ(cell.simulation().state_hash(), hash);
  ASSERT_TRUE(cell.step(4));
  EXPECT_EQ(cell.value("motor_w"), speed);
}

/// Trouble that is put back or forbidden, with a notice or without: the motor runs on.
double run_with(Trouble trouble, std::string& notices, const char* output = "motor_w") {
  FmuCell cell(kTestFmus / "motor2.fmu",
               "parameters: {trouble: " + std::to_string(static_cast<int>(trouble)) + "}");
  cell.command("motor_u", 12.0);
  EXPECT_TRUE(cell.step(50));
  notices = cell.notices();
  EXPECT_EQ(cell.value("failed"), 0.0) << notices;
  return cell.value(output);
}

TEST(Trouble, WhatAnFmuChangesForItsProcessIsPutBackAndNoted) {
  const unsigned before = _mm_getcsr() & ~0x3fU;
  std::string notices;
  const double usual = run_with(Trouble::none, notices);
  EXPECT_EQ(notices, "");
  EXPECT_EQ(run_with(Trouble::control, notices), usual);
  EXPECT_THAT(notices, HasSubstr("changed the floating-point control"));
  EXPECT_EQ(std::count(notices.begin(), notices.end(), '\n'), 1) << notices;
  EXPECT_EQ(_mm_getcsr() & ~0x3fU, before);
  EXPECT_EQ(run_with(Trouble::chdir_away, notices), usual);
  EXPECT_THAT(notices, HasSubstr("changed the working directory"));
}

TEST(Trouble, TheNetworkIsClosedToAnFmu) {
  std::string notices;
  EXPECT_EQ(run_with(Trouble::network, notices, "result"), 0.0);
}

TEST(Trouble, AnFmuThatCannotBeInitialisedIsRefused) {
  EXPECT_THAT(
      [] { FmuCell(kTestFmus / "motor2.fmu", "parameters: {trouble: 1, trouble_at: -5}"); },
      testing::ThrowsMessage<ScenarioError>(HasSubstr("cannot be initialised: the FMU crashed: signal 11")));
  EXPECT_THAT(
      [] { FmuCell(kTestFmus / "motor2.fmu", "parameters: {trouble: 6, trouble_at: -5}"); },
      testing::ThrowsMessage<ScenarioError>(HasSubstr("answered fmi2Error to fmi2ExitInitializationMode")));
}

}  // namespace
}  // namespace takt
