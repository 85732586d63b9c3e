// Trajectories: the polynomials, the refusals at the boundary, and the motion of robots along them.
#include "plant_models/robot/joint_path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/simulation/step/simulation.h"
#include "tests/support/constants.h"
#include "tests/support/service_cell.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

TEST(JointPath, PiecesMeetTheirEndsAndReproducePolynomials) {
  // q(t) = 1 + 2 t - t^2 + 0.5 t^3 - 0.25 t^4 + 0.125 t^5, from 0.5 to 2.
  const auto q = [](double t) { return 1 + t * (2 + t * (-1 + t * (0.5 + t * (-0.25 + t * 0.125)))); };
  const auto v = [](double t) { return 2 + t * (-2 + t * (1.5 + t * (-1 + t * 0.625))); };
  const auto a = [](double t) { return -2 + t * (3 + t * (-3 + t * 2.5)); };
  JointPathPoint from, to;
  from.t = 0.5, to.t = 2.0;
  for (JointPathPoint* point : {&from, &to})
    point->q[3] = q(point->t), point->qd[3] = v(point->t), point->qdd[3] = a(point->t);
  const PathPiece quintic = path_piece(PathOrder::quintic, from, to, 3);
  for (int i = 0; i <= 10; ++i) {
    const double u = 0.1 * i, t = 0.5 + 1.5 * u;
    EXPECT_NEAR(quintic.position(u), q(t), 1e-14);
    EXPECT_NEAR(quintic.velocity(u), v(t), 1e-13);
    EXPECT_NEAR(quintic.derivative().position(u), v(t), 1e-13);
  }
  const PathPiece cubic = path_piece(PathOrder::cubic, from, to, 3);
  const PathPiece linear = path_piece(PathOrder::linear, from, to, 3);
  for (const double end : {0.0, 1.0}) {
    const double t = 0.5 + 1.5 * end;
    EXPECT_NEAR(cubic.position(end), q(t), 1e-14);
    EXPECT_NEAR(cubic.velocity(end), v(t), 1e-14);
    EXPECT_NEAR(linear.position(end), q(t), 1e-14);
    EXPECT_NEAR(linear.velocity(end), (q(2.0) - q(0.5)) / 1.5, 1e-14);
  }
}

TEST(JointPath, ValuesOutsideAreFoundExactly) {
  JointPathPoint from, to;
  to.t = 1.0;
  from.qd[0] = 4.0, to.qd[0] = -4.0;  // cubic 4 u - 4 u^2: from 0 to 0 by way of 1
  const PathPiece piece = path_piece(PathOrder::cubic, from, to, 0);
  EXPECT_TRUE(std::isnan(value_outside(piece, -1e-12, 1.0 + 1e-9)));
  EXPECT_NEAR(value_outside(piece, -1e-12, 1.0 - 1e-9), 1.0, 2e-9);
  EXPECT_LT(value_outside(piece, 1e-3, 2.0), 1e-3);
  EXPECT_TRUE(std::isnan(value_outside(piece.derivative(), -4.0 - 1e-12, 4.0 + 1e-12)));
  EXPECT_FALSE(std::isnan(value_outside(piece.derivative(), -3.9, 4.1)));
}

class Trajectory : public ::testing::Test {
 protected:
  RawTrajectory raw(std::vector<RawTrajectoryPoint> points) const {
    RawTrajectory raw{{}, {}, std::move(points)};
    for (const JointModel& joint : arm().joints) raw.names.push_back(joint.name);
    return raw;
  }
  const ArmModel& arm() const { return model_->description.robots[0].arm; }
  static std::vector<double> at(double first) {
    return {first,
            -test::kQuarterTurn_rad,
            test::kQuarterTurn_rad,
            -test::kQuarterTurn_rad,
            -test::kQuarterTurn_rad,
            0.0};
  }
  static std::vector<double> moving(double first) { return {first, 0.0, 0.0, 0.0, 0.0, 0.0}; }
  Rejection refused(const RawTrajectory& wrong) const {
    const auto result = validate(model_->description, 0, wrong);
    EXPECT_TRUE(std::holds_alternative<Rejection>(result));
    return std::holds_alternative<Rejection>(result) ? std::get<Rejection>(result) : Rejection{};
  }
  void step(const std::vector<Command>& commands = {}) {
    ASSERT_TRUE(simulation_.step(commands)) << simulation_.fault();
    simulation_.read_snapshot(snapshot_);
    for (const MotionNotice& notice : simulation_.events().motion_notices) notices_.push_back(notice);
  }
  Command good(std::vector<RawTrajectoryPoint> points, double stamp_s = -1.0) const {
    RawTrajectory trajectory = raw(std::move(points));
    trajectory.stamp = SimTime::from_seconds(stamp_s);
    const auto result = validate(model_->description, 0, trajectory);
    if (const auto* rejection = std::get_if<Rejection>(&result)) ADD_FAILURE() << rejection->message;
    return Command(std::get<TrajectoryCommand>(result));
  }
  double q() const { return snapshot_.robots[0].position[0]; }
  double qd() const { return snapshot_.robots[0].velocity[0]; }

  std::shared_ptr<CellModel> model_ = test::service_model();
  Simulation simulation_{model_};
  Snapshot snapshot_ = simulation_.make_snapshot();
  std::vector<MotionNotice> notices_;
};

TEST_F(Trajectory, EveryFaultHasItsCodeAndSentence) {
  const RawTrajectory fine = raw({{at(0.1), {}, {}, {}, 1.0}, {at(0.2), {}, {}, {}, 2.0}});
  ASSERT_TRUE(std::holds_alternative<TrajectoryCommand>(validate(model_->description, 0, fine)));
  RawTrajectory wrong = fine;
  wrong.names[2] = "knee";
  EXPECT_EQ(refused(wrong).code, RejectionCode::unknown_joint);
  EXPECT_EQ(refused(wrong).subject, "Robot1");
  EXPECT_THAT(refused(wrong).message, HasSubstr("no joint 'knee'"));
  wrong.names[2] = wrong.names[1];
  EXPECT_EQ(refused(wrong).code, RejectionCode::duplicate_joint);
  wrong = fine;
  wrong.names.pop_back();
  EXPECT_EQ(refused(wrong).code, RejectionCode::wrong_count);
  wrong = fine;
  wrong.points[1].positions.push_back(0.0);
  EXPECT_THAT(refused(wrong).message, HasSubstr("'positions' of point 2 has 7 entries"));
  wrong = fine;
  wrong.points[1].velocities = moving(0.0);  // in one point, but not in the other
  EXPECT_EQ(refused(wrong).code, RejectionCode::wrong_count);
  wrong = fine;
  wrong.points[1].time_from_start_s = 1.0;
  EXPECT_EQ(refused(wrong).code, RejectionCode::times_not_ascending);
  wrong = fine;
  wrong.points[1].positions[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused(wrong).code, RejectionCode::not_finite);
  wrong = fine;
  wrong.stamp = SimTime::from_seconds(1.79e9);  // of a wall clock
  EXPECT_EQ(refused(wrong).code, RejectionCode::out_of_range);
  EXPECT_THAT(refused(wrong).message, HasSubstr("wall clock"));
  wrong = fine;
  wrong.points[1].time_from_start_s = 2e9;
  EXPECT_EQ(refused(wrong).code, RejectionCode::out_of_range);
  EXPECT_THAT(refused(wrong).message, HasSubstr("the time of point 2"));
  wrong = fine;
  wrong.points[1].effort = moving(0.0);
  wrong.points[1].effort[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused(wrong).code, RejectionCode::not_finite);
  EXPECT_THAT(refused(wrong).message, HasSubstr("effort of joint"));
  wrong.points[1].effort[1] = 1e6;
  EXPECT_EQ(refused(wrong).code, RejectionCode::effort_out_of_range);
  wrong = fine;
  wrong.points[0].effort = moving(0.0);  // in one point, but not in the other
  EXPECT_EQ(refused(wrong).code, RejectionCode::wrong_count);
  EXPECT_THAT(refused(wrong).message, HasSubstr("'effort' of point 2 has 0 entries"));
  std::swap(wrong.points[0].effort, wrong.points[1].effort);
  EXPECT_EQ(refused(wrong).code, RejectionCode::wrong_count);
  wrong = fine;
  wrong.points[1].positions[0] = 7.0;
  EXPECT_EQ(refused(wrong).code, RejectionCode::out_of_range);
  EXPECT_THAT(refused(wrong).message, HasSubstr("between points 1 and 2"));
  wrong = fine;
  wrong.points[1].positions[0] = 3.0;  // 2.9 rad in a second: more than the joint can
  EXPECT_EQ(refused(wrong).code, RejectionCode::velocity_out_of_range);
  wrong = raw({{at(0.0), moving(0.0), {}, {}, 1.0}, {at(0.1), moving(0.5), {}, {}, 2.0}});
  EXPECT_EQ(refused(wrong).code, RejectionCode::not_at_rest);
  // Both ends within limits, the way between them is not: 1.5 rad in a second from rest to rest.
  wrong = raw({{at(0.0), moving(0.0), {}, {}, 1.0}, {at(1.5), moving(0.0), {}, {}, 2.0}});
  EXPECT_EQ(refused(wrong).code, RejectionCode::velocity_out_of_range);
}

TEST_F(Trajectory, ACubicPathIsFollowedExactlyAndItsEndIsReported) {
  step({good({{at(0.3), moving(0.5), {}, {}, 1.0}, {at(0.6), moving(0.0), {}, {}, 2.0}})});
  JointPathPoint start, middle, end;
  middle.t = 1.0, middle.q[0] = 0.3, middle.qd[0] = 0.5;
  end.t = 2.0, end.q[0] = 0.6;
  const PathPiece first = path_piece(PathOrder::cubic, start, middle, 0);
  const PathPiece second = path_piece(PathOrder::cubic, middle, end, 0);
  EXPECT_NEAR(simulation_.trajectory_end_s(0), 2.0, 1e-12);
  while (simulation_.step_index() < 2000) {
    step();
    const double t = simulation_.time_s();
    const PathPiece& piece = t < 1.0 ? first : second;
    const double u = t < 1.0 ? t : t - 1.0;
    ASSERT_NEAR(q(), piece.position(u), 1e-12) << t;
    ASSERT_NEAR(qd(), piece.velocity(u), 1e-10) << t;
  }
  ASSERT_EQ(notices_.size(), 1U);
  EXPECT_EQ(notices_[0].kind, MotionNotice::Kind::trajectory_done);
  EXPECT_NEAR(notices_[0].time_s, 2.0, 1e-9);
  EXPECT_EQ(notices_[0].step, 2000U);
  EXPECT_LT(simulation_.trajectory_end_s(0), 0.0);
  for (int i = 0; i < 50; ++i) step();
  EXPECT_EQ(q(), 0.6);
  EXPECT_EQ(qd(), 0.0);
}

TEST_F(Trajectory, LinearAndQuinticPathsAreFollowed) {
  step({good({{at(0.2), {}, {}, {}, 0.5}, {at(0.2), {}, {}, {}, 0.75}, {at(-0.1), {}, {}, {}, 1.0}})});
  while (simulation_.step_index() < 1100) {
    step();
    const double t = simulation_.time_s();
    const double wanted = t < 0.5 ? 0.4 * t : t < 0.75 ? 0.2 : t < 1.0 ? 0.2 - 1.2 * (t - 0.75) : -0.1;
    ASSERT_NEAR(q(), wanted, 1e-12) << t;
  }
  simulation_.reset();
  notices_.clear();
  step({good({{at(0.5), moving(0.0), moving(0.0), {}, 1.0}})});
  while (simulation_.step_index() < 1000) {
    step();
    const double u = simulation_.time_s();
    ASSERT_NEAR(q(), 0.5 * u * u * u * (10.0 + u * (-15.0 + u * 6.0)), 1e-12);
  }
  ASSERT_EQ(notices_.size(), 1U);
}

TEST_F(Trajectory, ALaterStartWaitsAndANewerCommandReplacesIt) {
  step({good({{at(0.5), {}, {}, {}, 1.0}})});
  while (simulation_.step_index() < 200) step();
  const double here = q();
  EXPECT_NEAR(here, 0.1, 1e-12);
  step({good({{at(0.0), {}, {}, {}, 1.0}}, 0.4)});  // until 0.4 s the first continues
  while (simulation_.step_index() < 400) step();
  EXPECT_NEAR(q(), 0.2, 1e-12);
  EXPECT_TRUE(notices_.empty());
  while (simulation_.step_index() < 900) step();
  EXPECT_NEAR(q(), 0.1, 1e-12);
  ASSERT_EQ(notices_.size(), 1U);
  EXPECT_EQ(notices_[0].kind, MotionNotice::Kind::trajectory_replaced);
  // A set-point takes over, at once.
  JointCommand command;
  command.robot = 0;
  command.position = {
      0.1, -test::kQuarterTurn_rad, test::kQuarterTurn_rad, -test::kQuarterTurn_rad, -test::kQuarterTurn_rad,
      0.0};
  step({command});
  EXPECT_LT(simulation_.trajectory_end_s(0), 0.0);
  ASSERT_EQ(notices_.size(), 2U);
  while (simulation_.step_index() < 1000) step();
  EXPECT_NEAR(q(), 0.1, 1e-12);
  EXPECT_EQ(qd(), 0.0);
}

TEST_F(Trajectory, UnreachablePathsAreRefusedAndNothingMoves) {
  step({good({{at(1.0), {}, {}, {}, 0.1}})});  // 10 rad/s on the way there
  ASSERT_EQ(notices_.size(), 1U);
  EXPECT_EQ(notices_[0].kind, MotionNotice::Kind::trajectory_refused);
  EXPECT_TRUE(notices_[0].velocity);
  EXPECT_EQ(notices_[0].joint, 0);
  EXPECT_NEAR(notices_[0].value, 10.0, 1e-9);
  step({good({{at(0.5), {}, {}, {}, 0.0}, {at(0.6), {}, {}, {}, 1.0}})});  // begins where the robot is not
  ASSERT_EQ(notices_.size(), 2U);
  EXPECT_EQ(notices_[1].kind, MotionNotice::Kind::trajectory_refused);
  for (int i = 0; i < 20; ++i) step();
  EXPECT_EQ(q(), 0.0);
  step({good({{at(0.1), {}, {}, {}, 0.005}}, 0.001)});  // long over
  ASSERT_EQ(notices_.size(), 3U);
  EXPECT_EQ(notices_[2].kind, MotionNotice::Kind::trajectory_past);
  step({good({{at(0.0), {}, {}, {}, 0.0}, {at(0.1), {}, {}, {}, 1.0}})});  // begins where it is
  while (simulation_.step_index() < 523) step();
  EXPECT_NEAR(q(), 0.05, 1e-9);
  step({good({})});  // stop
  for (int i = 0; i < 500; ++i) step();
  EXPECT_EQ(qd(), 0.0);
  EXPECT_LT(q(), 0.06);
}

TEST_F(Trajectory, ASavedStateContinuesWithTheSameBits) {
  step({good({{at(0.3), moving(0.5), {}, {}, 1.0}, {at(0.6), moving(0.0), {}, {}, 2.0}})});
  while (simulation_.step_index() < 700) step();
  std::vector<std::byte> saved;
  simulation_.save_state(saved);
  while (simulation_.step_index() < 2100) step();
  Simulation other(model_);
  ASSERT_EQ(other.restore_state(saved), "");
  while (other.step_index() < 2100) ASSERT_TRUE(other.step({}));
  EXPECT_EQ(other.state_hash(), simulation_.state_hash());
}

}  // namespace
}  // namespace takt
