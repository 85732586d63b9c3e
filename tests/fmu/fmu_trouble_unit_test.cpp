// FMUs that crash, hang, take all memory, leave, answer errors or change what is not theirs: the cell goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <xmmintrin.h>

#include <array>
#include <cerrno>
#include <iostream>
#include <string_view>

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
  chdir_away,
  others,
  abort_itself,
  stop_itself,
  block,
  close_all,
  big_file,
  garbage,
  print,
  thread
};

struct TroubleCase {
  Trouble trouble;
  const char* sentence;
};

class Troubles : public testing::TestWithParam<TroubleCase> {
 protected:
  static std::string keys(const std::string& more = "") {
    // A busy machine fills memory slowly: only what waits for the limit has a short one.
    const bool waits = std::string_view(GetParam().sentence).find("within 2 s") != std::string_view::npos;
    return std::string(waits ? "timeout_s: 2" : "timeout_s: 60") +
           ", memory_MiB: 256, parameters: {trouble: " +
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
                    TroubleCase{Trouble::not_a_number, "' of the FMU is nan; takt takes numbers up to 1e+30"},
                    TroubleCase{Trouble::leave, "ended its process with exit code 7"},
                    TroubleCase{Trouble::abort_itself, "crashed: signal 6"},
                    TroubleCase{Trouble::stop_itself, "did not answer a step within 2 s (timeout_s)"},
                    TroubleCase{Trouble::block, "did not answer a step within 2 s (timeout_s)"},
                    TroubleCase{Trouble::close_all, " during a step"},
                    TroubleCase{Trouble::big_file, "crashed: signal 25"},
                    TroubleCase{Trouble::garbage, "with bytes that are no answer"}));

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

TEST(Trouble, AnFmuReachesNoOtherProcess) {
  std::string notices;
  EXPECT_EQ(run_with(Trouble::others, notices, "result"), 0.0) << "a bit for each attempt of harm.h";
  EXPECT_EQ(notices, "");
}

TEST(Trouble, OutputWithoutEndAndThreadsThatGoOnChangeNothing) {
  std::string notices;
  const double usual = run_with(Trouble::none, notices);
  for (const Trouble trouble : {Trouble::print, Trouble::thread}) {
    EXPECT_EQ(run_with(trouble, notices), usual);
    EXPECT_EQ(notices, "");
  }
}

/// From here on the kernel refuses to filter system calls, as that of some containers does.
void refuse_filters() {
  constexpr auto kLoad = static_cast<std::uint16_t>(BPF_LD | BPF_W | BPF_ABS);
  constexpr auto kEqual = static_cast<std::uint16_t>(BPF_JMP | BPF_JEQ | BPF_K);
  constexpr auto kReturn = static_cast<std::uint16_t>(BPF_RET | BPF_K);
  std::array<sock_filter, 6> refuse{{{kLoad, 0, 0, offsetof(seccomp_data, nr)},
                                     {kEqual, 0, 3, __NR_prctl},
                                     {kLoad, 0, 0, offsetof(seccomp_data, args[0])},
                                     {kEqual, 0, 1, PR_SET_SECCOMP},
                                     {kReturn, 0, 0, SECCOMP_RET_ERRNO | EINVAL},
                                     {kReturn, 0, 0, SECCOMP_RET_ALLOW}}};
  const sock_fprog program{static_cast<unsigned short>(refuse.size()), refuse.data()};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
      ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) != 0)
    std::_Exit(2);
}

TEST(Trouble, AnFmuThatIsNotConfinedRunsAndIsNoted) {
  const auto run = [] {
    refuse_filters();
    std::string notices;
    const double reached = run_with(Trouble::network, notices, "result");
    std::cerr << notices;
    std::_Exit(reached == 1.0 ? 0 : 1);
  };
  EXPECT_EXIT(run(), testing::ExitedWithCode(0),
              "the FMU is not confined: the kernel refuses a filter of system calls \\(Invalid argument\\)");
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
