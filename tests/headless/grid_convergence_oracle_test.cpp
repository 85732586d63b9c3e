// Observed order, Richardson extrapolation and grid convergence index against manufactured series of known order, and
// against the published example of Roache.
#include "server/headless/grid_convergence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace takt::test {
namespace {

std::vector<GridPoint> series(double limit, double factor, double order, const std::vector<double>& sizes) {
  std::vector<GridPoint> points;
  for (const double h : sizes) points.push_back({h, limit + factor * std::pow(h, order)});
  return points;
}

TEST(GridConvergence, FindsOrderAndLimitOfAManufacturedSeries) {
  for (const double order : {0.7, 1.0, 2.0, 3.0, 4.5})
    for (const auto& sizes : std::vector<std::vector<double>>{
             {0.4, 0.2, 0.1}, {0.1, 0.15, 0.35}, {0.2, 0.5, 0.1}}) {  // ratios differ; any sequence
      const GridConvergence found = grid_convergence(series(3.25, -1.7, order, sizes), order);
      ASSERT_EQ(found.state, GridState::monotone);
      EXPECT_NEAR(found.order, order, 1e-7);
      EXPECT_NEAR(found.extrapolated, 3.25, 1e-9);
      EXPECT_TRUE(found.asymptotic);
      EXPECT_EQ(found.safety_factor, 1.25);
      // The index is the safety factor times the true error of the finest point.
      EXPECT_NEAR(found.index, 1.25 * 1.7 * std::pow(0.1, order), 1e-9);
    }
}

// Roache, NPARC tutorial: pressure recovery in an inlet, 0.97050, 0.96854, 0.96178 at ratio 2.
TEST(GridConvergence, AgreesWithThePublishedExample) {
  const GridConvergence found = grid_convergence({{1, 0.97050}, {2, 0.96854}, {4, 0.96178}}, {});
  EXPECT_NEAR(found.order, 1.786170, 1e-5);
  EXPECT_NEAR(found.extrapolated, 0.97130, 1e-5);
  EXPECT_FALSE(found.asymptotic);  // three points without a formal order do not show it
  EXPECT_NEAR(found.index / 3.0 * 1.25 / 0.97050, 0.00103083, 1e-7);
}

TEST(GridConvergence, AWrongFormalOrderLeavesTheAsymptoticRange) {
  const GridConvergence found = grid_convergence(series(1.0, 1.0, 1.0, {0.4, 0.2, 0.1}), 2.0);
  EXPECT_NEAR(found.order, 1.0, 1e-9);
  EXPECT_FALSE(found.asymptotic);
  EXPECT_EQ(found.safety_factor, 3.0);
  EXPECT_NEAR(found.index, 3.0 * 0.1, 1e-9);
  // A high observed order does not make the index smaller than the formal order allows.
  EXPECT_NEAR(grid_convergence(series(1.0, 1.0, 4.0, {0.4, 0.2, 0.1}), 1.0).index_order, 1.0, 1e-12);
}

TEST(GridConvergence, FourPointsShowTheAsymptoticRangeWithoutAFormalOrder) {
  EXPECT_TRUE(grid_convergence(series(1.0, 1.0, 2.0, {0.8, 0.4, 0.2, 0.1}), {}).asymptotic);
  std::vector<GridPoint> bent = series(1.0, 1.0, 2.0, {0.8, 0.4, 0.2, 0.1});
  bent[0].value += 0.5;
  EXPECT_FALSE(grid_convergence(bent, {}).asymptotic);
}

TEST(GridConvergence, SeriesWithoutAnOrderHaveNoIndex) {
  for (const auto& [state, points] : std::vector<std::pair<GridState, std::vector<GridPoint>>>{
           {GridState::oscillatory, {{1, 1.0}, {2, 1.1}, {4, 0.8}}},
           {GridState::diverging, {{1, 1.0}, {2, 1.2}, {4, 1.3}}},
           {GridState::diverging, {{1, 1.0}, {2, 1.1}, {4, 1.2}}},  // order zero
           {GridState::no_difference, {{1, 1.0}, {2, 1.0}, {4, 1.2}}},
           {GridState::no_difference, {{1, 0.9}, {2, 1.0}, {4, 1.0}}},
           {GridState::no_difference, {{1, 0.0}, {2, 0.0}, {4, 0.0}}}}) {
    const GridConvergence found = grid_convergence(points, 2.0);
    EXPECT_EQ(found.state, state);
    EXPECT_FALSE(found.asymptotic);
    EXPECT_EQ(found.index, 0.0);
  }
}

TEST(GridConvergence, RefusesUnusablePoints) {
  EXPECT_THROW(grid_convergence({{1, 1}, {2, 2}}, {}), std::invalid_argument);
  EXPECT_THROW(grid_convergence({{1, 1}, {2, 2}, {2, 3}}, {}), std::invalid_argument);
  EXPECT_THROW(grid_convergence({{0, 1}, {2, 2}, {3, 3}}, {}), std::invalid_argument);
}

TEST(GridConvergence, OrderOfErrors) {
  EXPECT_NEAR(*error_order({0.1, 1.01}, {0.2, 0.92}, 1.0), 3.0, 1e-9);
  EXPECT_FALSE(error_order({0.1, 1.0}, {0.2, 0.92}, 1.0));
}

}  // namespace
}  // namespace takt::test
