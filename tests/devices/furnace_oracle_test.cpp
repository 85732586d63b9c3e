// Furnace and Parts with a temperature against an independent integration of the same equations (classical
// Runge-Kutta in a table of their own), against closed forms, and against the energy that has to be
// somewhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/furnace_cell.h"

namespace takt::test {
namespace {

using F = Furnace;
using P = HeatedPart;

struct Row {
  double time_s, furnace, air, part, power;
};
// Rotor in at 1000 s; integrated elsewhere at steps of 1, 0.5 and 0.1 s, with the same digits.
constexpr Row kHistory[] = {
    {1060, 299.3471, 298.8674, 24.8265, 2079.25},  {1100, 299.3911, 299.3738, 28.0121, 2075.51},
    {1600, 299.8121, 299.8071, 65.8049, 1851.12},  {2800, 300.0451, 300.0447, 141.2702, 1494.49},
    {4600, 300.0539, 300.0540, 217.4805, 1141.18}, {6400, 300.0352, 300.0353, 259.7091, 909.96},
    {8200, 300.0194, 300.0194, 281.0468, 780.75}};

/// Everything that was drawn is somewhere: relative error of the balance.
double energy_gap(const FurnaceRun& run, const FurnaceParameters& p, double part_capacity,
                  double part_initial_degC) {
  const double start = p.initial_K - kZeroCelsius_K;
  const double stored = p.capacity_J_per_K * (run.furnace(F::temperature) - start) +
                        p.air_capacity_J_per_K * (run.furnace(F::air_temperature) - start) +
                        part_capacity * (run.part(P::temperature) - part_initial_degC);
  const double gone = run.furnace(F::energy_lost) + run.furnace(F::energy_of_air) + run.part(P::energy_lost);
  return std::abs(run.furnace(F::energy) - stored - gone) / run.furnace(F::energy);
}

TEST(Furnace, TenThousandSecondsEqualASecondIntegration) {
  for (const std::string solver : {"rk4", "rosenbrock", "cvode"}) {
    FurnaceCell cell(0.5, solver);
    FurnaceRun run(cell);
    ASSERT_TRUE(run.run_until(999.0)) << solver;
    EXPECT_NEAR(run.furnace(F::power), 658.56, 1e-6) << solver;  // 0.8 W/(m^2 K) x 6 x (0.7 m)^2 x 280 K
    EXPECT_NEAR(run.part(P::temperature), 20.0, 1e-9);
    ASSERT_TRUE(run.run_until(1000.0));
    const double before = run.furnace(F::energy);
    run.put(FurnaceCell::kInside);
    for (const Row& row : kHistory) {
      ASSERT_TRUE(run.run_until(row.time_s));
      const std::string where = solver + " at " + std::to_string(row.time_s);
      EXPECT_NEAR(run.furnace(F::temperature), row.furnace, 1e-3) << where;
      EXPECT_NEAR(run.furnace(F::air_temperature), row.air, 1e-3) << where;
      EXPECT_NEAR(run.part(P::temperature), row.part, 1e-3) << where;
      EXPECT_NEAR(run.furnace(F::power), row.power, 0.1) << where;
    }
    EXPECT_NEAR(run.furnace(F::energy) - before, 8.8553e6, 200.0) << solver;
    run.put(FurnaceCell::kOutside);
    ASSERT_TRUE(run.run_until(8224.0));
    EXPECT_NEAR(run.furnace(F::power), 1767.2, 1.0) << solver;  // the second peak
    ASSERT_TRUE(run.run_until(10000.0));
    EXPECT_NEAR(run.furnace(F::power), 655.7, 0.1) << solver;
    EXPECT_NEAR(run.furnace(F::energy), 10.8135e6, 200.0) << solver;
    EXPECT_NEAR(run.part(P::temperature), 281.0468, 1e-3) << solver;  // kept for life
    EXPECT_LT(energy_gap(run, cell.furnace(), cell.part().capacity_J_per_K, 20.0), 1e-9) << solver;
    EXPECT_NEAR(run.furnace(F::energy_of_air), 2.0 * 415.065 * 280.0, 10.0) << solver;
  }
}

TEST(Furnace, FirstPeakAndHeatFlowAtInsertionAreThoseOfTheReference) {
  FurnaceCell cell(0.1);
  FurnaceRun run(cell);
  ASSERT_TRUE(run.run_until(1000.0));
  run.put(FurnaceCell::kInside);
  ASSERT_TRUE(run.run_until(1000.1));
  EXPECT_NEAR(run.furnace(F::heat_to_parts), 1241.7, 1.0);  // 659.7 convection + 582.0 radiation
  EXPECT_NEAR(run.part(P::heat_flow), run.furnace(F::heat_to_parts), 1e-9);
  double peak = 0.0, peak_s = 0.0;
  while (run.simulation().time_s() < 1200.0) {
    ASSERT_TRUE(run.run_until(run.simulation().time_s() + 0.1));
    if (run.furnace(F::power) > peak) peak = run.furnace(F::power), peak_s = run.simulation().time_s();
  }
  EXPECT_NEAR(peak, 2080.0, 0.1);
  EXPECT_NEAR(peak_s, 1068.7, 1.0);  // the top is flat
}

TEST(Furnace, AnOpenedDoorExchangesTheAirOnceAndPartsPassFreely) {
  FurnaceCell cell(0.1);
  FurnaceRun run(cell);
  const auto command = [&](double door) {
    DeviceCommand c;
    c.device = FurnaceCell::kFurnaceDevice;
    c.count = 1;
    c.signals[0] = F::door;
    c.values[0] = door;
    return std::vector<Command>{c};
  };
  ASSERT_TRUE(run.run_until(10.0));
  ASSERT_TRUE(run.simulation().step(command(1.0)));
  ASSERT_TRUE(run.run_until(10.2));
  const double cold = run.furnace(F::air_temperature);
  // Air alone, the furnace hardly colder: T = 300 - 280 exp(-t / 9.41 s).
  EXPECT_NEAR(cold, 300.0 - 280.0 * std::exp(-0.2 / (415.065 / 44.1)), 0.1);
  run.put(FurnaceCell::kInside);
  ASSERT_TRUE(run.simulation().step(command(1.0)));  // still open: not opened again
  ASSERT_TRUE(run.run_until(10.4));
  EXPECT_GT(run.furnace(F::air_temperature), cold);
  EXPECT_EQ(run.furnace(F::parts_inside), 1.0);
  EXPECT_NEAR(run.furnace(F::energy_of_air), 415.065 * 280.0, 1e-3);
}

TEST(Furnace, APartInsideFromTheStartIsHeatedWithoutADoor) {
  FurnaceCell cell(0.5, "rk4", 1e-8, FurnaceCell::kInside);
  FurnaceRun run(cell);
  ASSERT_TRUE(run.run_until(1.0));
  EXPECT_EQ(run.furnace(F::parts_inside), 1.0);
  EXPECT_EQ(run.furnace(F::energy_of_air), 0.0);
  EXPECT_GT(run.part(P::temperature), 20.05);
}

TEST(Furnace, TheHeaterSaturatesAndItsIntegralIsHeld) {
  FurnaceCell cell(0.5);
  cell.furnace().initial_K = 293.15;
  cell.furnace().max_power_W = 5000.0;
  FurnaceRun run(cell);
  ASSERT_TRUE(run.run_until(1000.0));
  EXPECT_EQ(run.furnace(F::power), 5000.0);
  // Body and air as one capacity, warmed by the limit less the loss.
  const double g = 0.8 * 2.94, c = 180000.0 + 415.065;
  EXPECT_NEAR(run.furnace(F::temperature), 20.0 + 5000.0 / g * (1.0 - std::exp(-g * 1000.0 / c)), 0.3);
  double highest = 0.0;
  while (run.simulation().time_s() < 20000.0) {
    ASSERT_TRUE(run.run_until(run.simulation().time_s() + 50.0));
    highest = std::max(highest, run.furnace(F::temperature));
  }
  EXPECT_LT(highest, 301.5);  // a wound-up integral would overshoot by far
  EXPECT_LT(energy_gap(run, cell.furnace(), cell.part().capacity_J_per_K, 20.0), 1e-9);
}

TEST(HeatedPart, APartCoolsExponentiallyOutsideAndNotInside) {
  FurnaceCell cell(1.0);
  cell.part().initial_K = 573.15;
  cell.part().surface_m2 = 0.157080;
  cell.part().cooling_W_per_m2_K = 10.0;
  FurnaceRun run(cell);
  const double tau = 15300.0 / (10.0 * 0.157080);
  ASSERT_TRUE(run.run_until(3600.0));
  EXPECT_NEAR(run.part(P::temperature), 20.0 + 280.0 * std::exp(-3600.0 / tau), 1e-6);
  EXPECT_NEAR(run.part(P::energy_lost), 15300.0 * (300.0 - run.part(P::temperature)), 1e-3);
  run.put(FurnaceCell::kInside);
  ASSERT_TRUE(run.run_until(3601.0));
  EXPECT_GT(run.part(P::heat_flow), 0.0);
}

TEST(HeatedPart, ASavedStateContinuesWithTheSameBits) {
  FurnaceCell cell(0.5);
  FurnaceRun run(cell);
  ASSERT_TRUE(run.run_until(100.0));
  run.put(FurnaceCell::kInside);
  ASSERT_TRUE(run.run_until(200.0));
  std::vector<std::byte> saved;
  run.simulation().save_state(saved);
  FurnaceRun other(cell);
  ASSERT_EQ(other.simulation().restore_state(saved), "");
  ASSERT_TRUE(run.run_until(400.0) && other.run_until(400.0));
  EXPECT_EQ(other.simulation().state_hash(), run.simulation().state_hash());
  EXPECT_EQ(other.furnace(F::energy_of_air), run.furnace(F::energy_of_air));
  EXPECT_EQ(other.furnace(F::parts_inside), 1.0);
  // A reset starts again, with a closed door.
  run.simulation().reset();
  ASSERT_TRUE(run.run_until(10.0));
  EXPECT_EQ(run.furnace(F::parts_inside), 0.0);
  EXPECT_EQ(run.furnace(F::energy_of_air), 0.0);
}

}  // namespace
}  // namespace takt::test
