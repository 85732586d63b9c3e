// Blends of moves beside their closed forms (client_lib/gateway/ur/path.h).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "client_lib/gateway/ur/motion.h"
#include "tests/gateway/ur10e.h"

namespace takt::ur {
namespace {

using test::kHome;
using Outcome = Motion::BlendOutcome;

constexpr double kCycle_s = 0.002;

/// Drives through moves, each offered as the successor of the one before as soon as that is under way.
struct Driver {
  ArmModel arm = test::ur10e();
  Motion motion{arm, kCycle_s};
  std::vector<Vector6> q;  ///< of each cycle
  std::vector<Vec3> tool;
  std::vector<Outcome> outcomes;

  Driver() { motion.reset(kHome); }
  Pose home() const { return motion.tool_pose(kHome); }
  void note() {
    q.push_back(motion.position());
    tool.push_back(motion.tool_pose(motion.position()).p);
  }
  void drive(const std::vector<Move>& moves) {
    note();
    std::size_t at = 0;
    while (at < moves.size()) {
      ASSERT_TRUE(motion.begin(moves[at++]));
      while (motion.follows()) {
        if (at < moves.size() && motion.takes_successor()) {
          outcomes.push_back(motion.blend_into(moves[at]));
          if (outcomes.back() == Outcome::blended) ++at;
        }
        ASSERT_TRUE(motion.advance(1.0));
        note();
      }
    }
  }
  double duration_s() const { return kCycle_s * static_cast<double>(q.size() - 1); }
  double speed(std::size_t i) const { return (tool[i] - tool[i - 1]).norm() / kCycle_s; }
  double acceleration(std::size_t i) const {
    return (tool[i + 1] - 2.0 * tool[i] + tool[i - 1]).norm() / (kCycle_s * kCycle_s);
  }
  double fastest() const {
    double most = 0.0;
    for (std::size_t i = 1; i < tool.size(); ++i) most = std::max(most, speed(i));
    return most;
  }
  double hardest() const {
    double most = 0.0;
    for (std::size_t i = 1; i + 1 < tool.size(); ++i) most = std::max(most, acceleration(i));
    return most;
  }
  std::size_t nearest(const Vec3& point) const {
    std::size_t best = 0;
    for (std::size_t i = 1; i < tool.size(); ++i)
      if ((tool[i] - point).norm() < (tool[best] - point).norm()) best = i;
    return best;
  }
};

Move line(const Pose& X_RT, const MoveOptions& options) {
  return {.kind = Move::Kind::line, .q = {}, .X_RT = X_RT, .options = options};
}
Move joints(const Vector6& q, const MoveOptions& options) {
  return {.kind = Move::Kind::joints, .q = q, .options = options};
}

Pose moved(Pose X, const Vec3& way) {
  X.p += way;
  return X;
}

/// Time from rest over `way` to `end_speed`: a ramp up to the largest speed, a constant part, a ramp down. The mean
/// acceleration of a ramp is two thirds of the largest one.
double time_from_rest(double way, double end_speed, double speed, double acceleration) {
  const double mean = acceleration / 1.5;
  const double top = std::min(speed, std::sqrt(way * mean + 0.5 * end_speed * end_speed));
  const double ramps = (0.5 * top * top + 0.5 * (top * top - end_speed * end_speed)) / mean;
  return (top + top - end_speed) / mean + (way - ramps) / top;
}

struct Corner {
  double turn;  ///< angle between the lines, rad
  double radius, speed, acceleration;
};

class BlendOfTwoLines : public ::testing::TestWithParam<Corner> {};

TEST_P(BlendOfTwoLines, IsItsClosedForm) {
  const Corner corner = GetParam();
  constexpr double kWay = 0.2;
  const Vec3 d(0.0, 1.0, 0.0), e(0.0, std::cos(corner.turn), std::sin(corner.turn));
  const MoveOptions through{corner.acceleration, corner.speed, 0.0, corner.radius},
      stop{corner.acceleration, corner.speed};
  Driver driver;
  const Pose at_corner = moved(driver.home(), kWay * d), end = moved(at_corner, kWay * e);
  driver.drive({line(at_corner, through), line(end, stop)});
  ASSERT_EQ(driver.outcomes, std::vector{Outcome::blended});
  EXPECT_LT((driver.tool.back() - end.p).norm(), 1e-9);

  // The speed in the blend: the limit, or what the largest acceleration 3/4 v^2 |e - d| / r allows, or what the second line
  // can brake from.
  const double bend = (e - d).norm(), r = corner.radius, a = corner.acceleration;
  const double v =
      std::min({corner.speed, std::sqrt(a * r / (0.75 * bend)), std::sqrt((kWay - r) * a / 0.75)});
  // The sampled limit of the blend is that of the curve within 2e-3.
  const auto nearest = driver.nearest(at_corner.p);
  EXPECT_NEAR((driver.tool[nearest] - at_corner.p).norm(), 3.0 / 16.0 * r * bend, v * kCycle_s);
  double slowest = 1e9, farthest_outside = 0.0, farthest_inside = 0.0;
  for (std::size_t i = 1; i < driver.tool.size(); ++i) {
    const Vec3 way = driver.tool[i] - at_corner.p;
    const double off = std::min((way - d * d.dot(way)).norm(), (way - e * e.dot(way)).norm());
    double& farthest = way.norm() < r ? farthest_inside : farthest_outside;
    farthest = std::max(farthest, off);
    if (way.norm() < r) slowest = std::min(slowest, driver.speed(i));
  }
  EXPECT_LT(farthest_outside, 1e-9) << "the lines are left and joined at the radius";
  EXPECT_GT(farthest_inside, 0.05 * r * std::sin(corner.turn));
  // The velocity is v times a mean of d and e.
  EXPECT_NEAR(slowest, v * std::cos(0.5 * corner.turn), 5e-3 * v);
  EXPECT_GT(slowest, 0.0);
  EXPECT_LE(driver.fastest(), corner.speed * (1.0 + 1e-6));
  EXPECT_LE(driver.hardest(), a * (1.0 + 2e-3));
  const double wanted_s = 2.0 * time_from_rest(kWay - r, v, corner.speed, a) + 2.0 * r / v;
  EXPECT_NEAR(driver.duration_s(), wanted_s, 2e-3 * wanted_s + 2.0 * kCycle_s);
  EXPECT_LT(driver.duration_s(), 2.0 * time_from_rest(kWay, 0.0, corner.speed, a));
}

INSTANTIATE_TEST_SUITE_P(Corners, BlendOfTwoLines,
                         ::testing::Values(Corner{1.5707963, 0.05, 0.25, 1.2},
                                           Corner{1.5707963, 0.02, 0.4, 0.8}, Corner{0.5, 0.05, 0.2, 0.6},
                                           Corner{2.6, 0.08, 0.25, 1.2}, Corner{1.0, 0.15, 0.5, 0.5}));

TEST(Blend, OfAChainOfLinesNeverStops) {
  Driver driver;
  const Pose a = moved(driver.home(), {0.0, 0.15, 0.0}), b = moved(a, {0.0, 0.0, 0.15}),
             c = moved(b, {0.0, -0.15, 0.0}), d = moved(c, {0.0, 0.0, -0.15});
  const MoveOptions through{1.2, 0.25, 0.0, 0.04};
  std::vector<Move> moves;
  for (int round = 0; round < 3; ++round)
    for (const Pose& X : {a, b, c, d}) moves.push_back(line(X, through));
  moves.push_back(line(a, {1.2, 0.25}));
  driver.drive(moves);
  EXPECT_EQ(driver.outcomes, std::vector(12, Outcome::blended));
  double slowest = 1e9;
  for (std::size_t i = driver.nearest(a.p); i + 200 < driver.tool.size(); ++i)
    slowest = std::min(slowest, driver.speed(i));
  EXPECT_GT(slowest, 0.1);
  EXPECT_LE(driver.fastest(), 0.25 * (1.0 + 1e-6));
  EXPECT_LE(driver.hardest(), 1.2 * (1.0 + 2e-3));
  EXPECT_LT((driver.tool.back() - a.p).norm(), 1e-9);
}

TEST(Blend, OfJointMovesKeepsTheLimitsOfTheJoints) {
  Driver driver;
  Vector6 via = kHome, end = kHome;
  via[0] += 0.4;
  via[1] -= 0.2;
  end[0] += 0.4;
  end[1] += 0.3;
  end[3] += 0.5;
  driver.drive({joints(via, {1.4, 1.05, 0.0, 0.1}), joints(end, {1.4, 1.05})});
  ASSERT_EQ(driver.outcomes, std::vector{Outcome::blended});
  EXPECT_EQ(driver.q.back(), end);
  const Vec3 corner = driver.motion.tool_pose(via).p;
  double slowest = 1e9;
  for (std::size_t i = 1; i + 1 < driver.q.size(); ++i)
    for (std::size_t k = 0; k < 6; ++k) {
      const double qd = (driver.q[i][k] - driver.q[i - 1][k]) / kCycle_s;
      const double qdd =
          (driver.q[i + 1][k] - 2.0 * driver.q[i][k] + driver.q[i - 1][k]) / (kCycle_s * kCycle_s);
      EXPECT_LE(std::abs(qd), 1.05 * (1.0 + 1e-6));
      EXPECT_LE(std::abs(qdd), 1.4 * (1.0 + 2e-3));
      // Outside of the radius the first move is straight in joint space.
      if ((driver.tool[i] - corner).norm() > 0.1 && driver.q[i][3] == kHome[3]) {
        EXPECT_NEAR(driver.q[i][1] - kHome[1], -0.5 * (driver.q[i][0] - kHome[0]), 1e-9);
      }
    }
  for (std::size_t i = 1; i < driver.q.size(); ++i)
    if ((driver.tool[i] - corner).norm() < 0.1) slowest = std::min(slowest, driver.speed(i));
  EXPECT_GT(slowest, 0.05);
  EXPECT_GT((driver.tool[driver.nearest(corner)] - corner).norm(), 1e-3);
}

TEST(Blend, OfALineWithAJointMoveAndAnArcGoesOn) {
  Driver driver;
  const Pose a = moved(driver.home(), {0.0, 0.15, 0.05});
  Vector6 q = *driver.motion.inverse_kinematics(a, kHome);
  q[0] -= 0.3;
  q[4] += 0.3;
  const Pose b = driver.motion.tool_pose(q);
  const Move arc{.kind = Move::Kind::arc,
                 .q = {},
                 .X_RT = moved(b, {0.0, 0.0, 0.2}),
                 .X_RT_via = moved(b, {0.0, 0.1, 0.1}),
                 .options = {1.2, 0.25}};
  driver.drive({line(a, {1.2, 0.25, 0.0, 0.03}), joints(q, {1.4, 1.05, 0.0, 0.05}), arc});
  EXPECT_EQ(driver.outcomes, std::vector(2, Outcome::blended));
  for (const Vec3& point : {a.p, b.p}) {
    const std::size_t near = driver.nearest(point);
    EXPECT_GT((driver.tool[near] - point).norm(), 1e-4);
    EXPECT_LT((driver.tool[near] - point).norm(), 0.05);
    EXPECT_GT(driver.speed(near), 0.02);
  }
  for (std::size_t i = 1; i < driver.q.size(); ++i)
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_LE(std::abs(driver.q[i][k] - driver.q[i - 1][k]), 2.0 * kCycle_s);
  EXPECT_LT((driver.tool.back() - arc.X_RT.p).norm(), 1e-9);
}

TEST(Blend, ThatOverlapsIsSkipped) {
  Driver driver;
  const Pose a = moved(driver.home(), {0.0, 0.15, 0.0}), b = moved(a, {0.0, 0.0, 0.1}),
             c = moved(b, {0.0, -0.1, 0.0});
  // 0.06 + 0.06 m on a line of 0.1 m: the first blend is skipped, the second has its room.
  const MoveOptions through{1.2, 0.25, 0.0, 0.06};
  driver.drive({line(a, through), line(b, through), line(c, {1.2, 0.25})});
  EXPECT_EQ(driver.outcomes, (std::vector{Outcome::overlapping, Outcome::blended}));
  EXPECT_LT((driver.tool[driver.nearest(a.p)] - a.p).norm(), 1e-9);
  EXPECT_GT((driver.tool[driver.nearest(b.p)] - b.p).norm(), 1e-3);
  // A radius that holds all of the line before it.
  Driver other;
  other.drive({line(a, {1.2, 0.25, 0.0, 0.2}), line(moved(a, {0.0, 0.0, 0.3}), {1.2, 0.25})});
  EXPECT_EQ(other.outcomes, std::vector{Outcome::overlapping});
}

TEST(Blend, IsPossibleUntilTheMoveBrakes) {
  for (const bool late : {false, true}) {
    Driver driver;
    const Pose a = moved(driver.home(), {0.0, 0.2, 0.0}), b = moved(a, {0.0, 0.0, 0.15});
    ASSERT_TRUE(driver.motion.begin(line(a, {1.2, 0.25, 0.0, 0.05})));
    // The ramps last 1.5 v / a = 0.3125 s and take 0.039 m each: it brakes from 0.8 s on.
    for (int i = 0; i < (late ? 460 : 300); ++i) ASSERT_TRUE(driver.motion.advance(1.0));
    const Outcome outcome = driver.motion.blend_into(line(b, {1.2, 0.25}));
    EXPECT_EQ(outcome, late ? Outcome::impossible : Outcome::blended);
    while (driver.motion.follows()) {
      ASSERT_TRUE(driver.motion.advance(1.0));
      driver.note();
    }
    EXPECT_LE(driver.hardest(), 1.2 * (1.0 + 2e-3));
    EXPECT_LT((driver.tool.back() - (late ? a : b).p).norm(), 1e-9);
  }
}

TEST(Blend, ADurationIsThatBetweenTheMiddlesOfBlends) {
  Driver driver;
  const Pose a = moved(driver.home(), {0.0, 0.15, 0.0}), b = moved(a, {0.0, 0.0, 0.15}),
             c = moved(b, {0.0, -0.15, 0.0});
  driver.drive({line(a, {0.0, 0.0, 1.5, 0.03}), line(b, {0.0, 0.0, 1.5, 0.03}), line(c, {0.0, 0.0, 1.5})});
  ASSERT_EQ(driver.outcomes, std::vector(2, Outcome::blended));
  // In these corners the middle is the nearest place.
  const double first = kCycle_s * static_cast<double>(driver.nearest(a.p)),
               second = kCycle_s * static_cast<double>(driver.nearest(b.p));
  EXPECT_NEAR(first, 1.5, 0.01);
  EXPECT_NEAR(second - first, 1.5, 0.01);
  EXPECT_NEAR(driver.duration_s(), 4.5, 0.01);
}

TEST(Blend, TakesTwiceTheTimeAtHalfTheSpeed) {
  std::array<int, 2> cycles{};
  for (const std::size_t run : {0, 1}) {
    Driver driver;
    const Pose a = moved(driver.home(), {0.0, 0.15, 0.0}), b = moved(a, {0.0, 0.0, 0.15});
    ASSERT_TRUE(driver.motion.begin(line(a, {1.2, 0.25, 0.0, 0.05})));
    ASSERT_EQ(driver.motion.blend_into(line(b, {1.2, 0.25})), Outcome::blended);
    for (; driver.motion.follows(); ++cycles.at(run))
      ASSERT_TRUE(driver.motion.advance(run == 0 ? 1.0 : 0.5));
  }
  EXPECT_NEAR(cycles[1], 2 * cycles[0], 1);
}

}  // namespace
}  // namespace takt::ur
