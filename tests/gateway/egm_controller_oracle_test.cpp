// The control law of EGM against closed forms, and the sessions of the controller. No sockets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "client_lib/gateway/egm/controller.h"
#include "client_lib/gateway/egm/follower.h"
#include "tests/support/egm_examples.h"

namespace takt::test::egm_controller {
namespace {

using namespace gateway::egm;
using testing::HasSubstr;

constexpr double kDt = 0.004;
const std::vector<double> kHome{0, -10, 20, 0, 30, 1.5};

std::string reference(std::uint32_t seqno, std::vector<double> joints, std::vector<double> speeds = {}) {
  Sensor sensor;
  sensor.header.seqno = seqno;
  if (!joints.empty()) sensor.planned = Motion{std::move(joints), {}, {}, {}};
  sensor.has_speeds = !speeds.empty();
  sensor.joint_speeds = std::move(speeds);
  return encode(sensor);
}

std::vector<double> home_and(double a1) {
  std::vector<double> joints = kHome;
  joints[0] = a1;
  return joints;
}

struct Cell {
  explicit Cell(const ControllerOptions& options = {}) : controller(options, 6) { controller.start(kHome); }
  void steps(int count) {
    for (int i = 0; i < count; ++i) controller.step(kDt, controller.planned());
  }
  Controller controller;
};

TEST(EgmController, AStepOfTheReferenceDecaysExponentially) {
  Cell cell;
  ASSERT_EQ(cell.controller.receive(reference(1, home_and(10.0))), Taken::applied);
  for (int i = 1; i <= 100; ++i) {
    cell.steps(1);
    EXPECT_NEAR(cell.controller.planned()[0], 10.0 * (1.0 - std::exp(-20.0 * kDt * i)), 1e-9);
  }
  EXPECT_EQ(cell.controller.planned()[1], -10.0);
}

TEST(EgmController, TheLagBehindARampIsItsSpeedOverTheGainAndTheSpeedReferenceRemovesIt) {
  for (const bool feed_forward : {false, true}) {
    Cell cell;
    const double speed = 5.0;
    double at = 0.0;
    for (std::uint32_t i = 1; i <= 500; ++i) {
      at = speed * kDt * i;
      cell.controller.receive(feed_forward ? reference(i, home_and(at), {speed, 0, 0, 0, 0, 0})
                                           : reference(i, home_and(at)));
      cell.steps(1);
    }
    // The reference is sampled: within one cycle's way.
    EXPECT_NEAR(at - cell.controller.planned()[0], feed_forward ? 0.0 : speed / 20.0, speed * kDt);
  }
}

TEST(EgmController, WithoutGainTheSpeedReferenceAloneMoves) {
  Cell cell({.position_gain_per_s = 0.0});
  cell.controller.receive(reference(1, {}, {10, -5, 0, 0, 0, 0}));
  cell.steps(100);
  EXPECT_NEAR(cell.controller.planned()[0], 4.0, 1e-9);
  EXPECT_NEAR(cell.controller.planned()[1], -12.0, 1e-9);
}

TEST(EgmController, TheLargestSpeedIsLimitedAndAllAxesAreScaledByOneFactor) {
  Cell cell({.max_speed_deviation_deg_per_s = 1.0});
  std::vector<double> joints = kHome;
  joints[0] += 10.0;
  joints[1] += 5.0;
  cell.controller.receive(reference(1, joints));
  cell.steps(25);
  EXPECT_NEAR(cell.controller.planned()[0], 0.1, 1e-9);
  EXPECT_NEAR(cell.controller.planned()[1], -9.95, 1e-9);
  EXPECT_EQ(cell.controller.limited(), 25U);
}

TEST(EgmController, TheLowPassDelaysTheSpeedByItsTimeConstant) {
  Cell cell({.position_gain_per_s = 0.0, .low_pass_Hz = 5.0});
  cell.controller.receive(reference(1, {}, {10, 0, 0, 0, 0, 0}));
  cell.steps(25);
  EXPECT_NEAR(cell.controller.speed()[0], 10.0 * (1.0 - std::exp(-2.0 * std::numbers::pi * 5.0 * 0.1)), 1e-9);
}

TEST(EgmController, MaxPosDeviationAndJointLimitsBoundThePosition) {
  Cell near({.max_position_deviation_deg = 2.0});
  near.controller.receive(reference(1, home_and(50.0)));
  near.steps(200);
  EXPECT_EQ(near.controller.planned()[0], 2.0);
  Cell limited({.lower = {-5, -90, -90, -90, -90, -90}, .upper = {5, 90, 90, 90, 90, 90}});
  limited.controller.receive(reference(1, home_and(-50.0)));
  limited.steps(200);
  EXPECT_EQ(limited.controller.planned()[0], -5.0);
}

TEST(EgmController, SilenceKeepsTheLastReferenceAndAfterCommTimeoutRapidStops) {
  Cell cell({.comm_timeout_s = 1.0});
  cell.steps(1000);  // before the first message there is no time limit
  EXPECT_EQ(cell.controller.session(), Session::running);
  cell.controller.receive(reference(1, home_and(10.0)));
  cell.steps(249);
  EXPECT_EQ(cell.controller.session(), Session::running);
  EXPECT_NEAR(cell.controller.planned()[0], 10.0, 1e-6);
  const double held = cell.controller.planned()[0];
  cell.steps(2);
  EXPECT_EQ(cell.controller.session(), Session::lost);
  EXPECT_THAT(cell.controller.fault(), HasSubstr("41822"));
  cell.steps(50);
  EXPECT_NEAR(cell.controller.planned()[0], held, 1e-6);
  const auto stopped = decode_robot(cell.controller.message({}, 0, true));
  EXPECT_EQ(stopped.message->mci, MciState::stopped);
  EXPECT_EQ(stopped.message->rapid, RapidState::stopped);
  // A sensor that comes back begins a session: seqno from 0, and no jump.
  EXPECT_EQ(cell.controller.receive(reference(1, home_and(0.0))), Taken::applied);
  EXPECT_EQ(cell.controller.seqno(), 0U);
  EXPECT_NEAR(cell.controller.planned()[0], held, 1e-6);
  EXPECT_EQ(cell.controller.session(), Session::running);
}

TEST(EgmController, ConvergenceIsReportedAfterTheConditionTime) {
  Cell cell({.condition_time_s = 0.1});
  cell.controller.receive(reference(1, home_and(0.4)));
  cell.steps(24);
  EXPECT_FALSE(cell.controller.converged());
  cell.steps(2);
  EXPECT_TRUE(cell.controller.converged());
  cell.controller.receive(reference(2, home_and(5.0)));
  cell.steps(1);
  EXPECT_FALSE(cell.controller.converged());
}

TEST(EgmController, DoubledAndOvertakenMessagesAreNotAppliedAndARestartedSensorIs) {
  Cell cell;
  const auto take = [&](std::uint32_t seqno) {
    return cell.controller.receive(reference(seqno, home_and(seqno)));
  };
  for (const std::uint32_t seqno : {1U, 3U, 5U, 40U})
    EXPECT_EQ(take(seqno), Taken::applied);  // gaps are usual
  EXPECT_EQ(take(40), Taken::old);
  EXPECT_EQ(take(39), Taken::old);
  EXPECT_EQ(take(41), Taken::applied);
  EXPECT_EQ(take(0), Taken::applied);  // 0: a new session
  EXPECT_EQ(take(0), Taken::old);
  EXPECT_EQ(take(500), Taken::applied);
  EXPECT_EQ(take(7), Taken::applied);  // far back
  EXPECT_EQ(take(90), Taken::applied);
  for (std::uint32_t seqno = 1; seqno <= 4; ++seqno) EXPECT_EQ(take(seqno), Taken::old);
  EXPECT_EQ(take(5), Taken::applied);  // numbers that rise steadily
  EXPECT_EQ(take(6), Taken::applied);
}

/// What rparak/ABB_EGM_Python sends: a header with mtype alone, and planned joints.
std::string without_seqno(std::uint8_t a1_high_byte) {
  std::string bytes("\x0a\x02\x18\x03\x12\x38\x0a\x36", 8);
  for (std::size_t joint = 0; joint < 6; ++joint) {
    std::string value(8, '\0');  // little-endian double; 0x40 0x10 0 .. is 4.0
    if (joint == 0) value[6] = static_cast<char>(a1_high_byte), value[7] = '\x40';
    bytes += '\x09' + value;
  }
  return bytes;
}

TEST(EgmController, EachMessageOfASensorThatDoesNotNumberThemIsApplied) {
  Cell cell;
  const double reference_deg[] = {4.0, 8.0, 4.0, 4.0};
  const std::uint8_t byte[] = {0x10, 0x20, 0x10, 0x10};
  for (std::size_t i = 0; i < 4; ++i) {
    const double before = cell.controller.planned()[0];
    ASSERT_EQ(cell.controller.receive(without_seqno(byte[i])), Taken::applied) << cell.controller.fault();
    cell.steps(1);
    EXPECT_NEAR(cell.controller.planned()[0],
                reference_deg[i] + (before - reference_deg[i]) * std::exp(-20.0 * kDt), 1e-9);
  }
  EXPECT_EQ(cell.controller.receive(reference(7, home_and(1.0))), Taken::applied);
  EXPECT_EQ(cell.controller.receive(without_seqno(0x10)), Taken::applied);
  EXPECT_EQ(cell.controller.receive(reference(7, home_and(1.0))), Taken::old);
}

TEST(EgmController, MessagesOfAnotherModeAreRefused) {
  Cell cell;
  Sensor pose;
  pose.planned = Motion{{}, EgmPose{}, {}, {}};
  EXPECT_EQ(cell.controller.receive(encode(pose)), Taken::invalid);
  EXPECT_THAT(cell.controller.fault(), HasSubstr("41826"));
  // Joints beside a pose and Cartesian speeds, as abb_libegm sends them: the joints count.
  Cell both;
  pose.planned->joints = home_and(1.0);
  pose.has_speeds = true;
  pose.joint_speeds = pose.cartesian_speeds = {0, 0, 0, 0, 0, 0};
  EXPECT_EQ(both.controller.receive(encode(pose)), Taken::applied);
  both.steps(1000);
  EXPECT_NEAR(both.controller.planned()[0], 1.0, 1e-6);
  EXPECT_EQ(cell.controller.receive(reference(1, {1, 2, 3})), Taken::invalid);
  EXPECT_THAT(cell.controller.fault(), HasSubstr("planned.joints: found 3 numbers; allowed: 6"));
  for (std::size_t length = 0; length < kGoldenEgmSensor.size(); ++length)
    (void)cell.controller.receive(std::string_view(kGoldenEgmSensor).substr(0, length));
  cell.steps(10);
  EXPECT_EQ(cell.controller.planned(), kHome);
}

TEST(EgmController, TheMessageHasWhatClientsDemand) {
  Cell cell;
  for (std::uint32_t i = 0; i < 3; ++i) {
    Robot robot;
    robot.feed_back.joints = kHome;
    robot.feed_back.time_us = 5;
    const auto read = decode_robot(cell.controller.message(robot, 8 + i, true));
    ASSERT_TRUE(read.message) << read.fault;
    EXPECT_EQ(read.message->header.seqno, i);
    EXPECT_EQ(read.message->header.tm_ms, 8 + i);
    EXPECT_EQ(read.message->planned.joints, kHome);
    EXPECT_EQ(read.message->planned.time_us, 5U);
    EXPECT_EQ(read.message->motors, MotorState::on);
    EXPECT_EQ(read.message->mci, MciState::running);
    EXPECT_EQ(read.message->rapid, RapidState::running);
  }
}

TEST(EgmController, ASeventhAxisIsAnExternalJoint) {
  Controller controller({}, 7);
  controller.start({0, 0, 0, 0, 0, 0, 0});
  Sensor sensor;
  sensor.planned = Motion{{1, 1, 1, 1, 1, 1}, {}, {7}, {}};
  EXPECT_EQ(controller.receive(encode(sensor)), Taken::applied);
  for (int i = 0; i < 1000; ++i) controller.step(kDt, controller.planned());
  EXPECT_NEAR(controller.planned()[6], 7.0, 1e-6);
  const auto read = decode_robot(controller.message({}, 0, true));
  EXPECT_EQ(read.message->planned.joints.size(), 6U);
  ASSERT_EQ(read.message->planned.external_joints.size(), 1U);
  EXPECT_NEAR(read.message->planned.external_joints[0], 7.0, 1e-6);
}

/// A robot whose joints are the pose: X Y Z in mm, A B C in degrees.
PoseKinematics gantry() {
  return {[](const std::vector<double>& q) {
            return gateway::pose_of_xyzabc({q[0], q[1], q[2], q[3], q[4], q[5]});
          },
          [](const Pose& X, const std::vector<double>&) -> std::optional<std::vector<double>> {
            const auto six = gateway::xyzabc_of(X);
            return std::vector<double>(six.begin(), six.end());
          }};
}

std::string correction(std::uint32_t seqno, double x_mm, double y_mm, double z_mm) {
  Sensor sensor;
  sensor.header = {seqno, {}, MessageType::path_correction};
  sensor.path_correction_mm = {x_mm, y_mm, z_mm};
  return encode(sensor);
}

/// From (100, 0, 0) along x, then along -y; the tool's z axis points down, so that y of the path points to its left.
ControllerOptions with_path() {
  ControllerOptions options;
  options.guidance = Guidance::path;
  options.max_speed_deviation_deg_per_s = 1e6;
  options.path = {{gateway::pose_of_xyzabc({300, 0, 0, 0, 0, 180})},
                  {gateway::pose_of_xyzabc({300, -100, 0, 0, 0, 180})}};
  options.path_speed_mm_per_s = 50.0;
  return options;
}

TEST(EgmController, APathIsCorrectedAcrossItByTheAxesOfTheManual) {
  Controller controller(with_path(), 6, gantry());
  controller.start({100, 0, 0, 0, 0, 180});
  for (int i = 0; i < 10; ++i) controller.step(kDt, controller.planned());
  EXPECT_NEAR(controller.planned()[0], 100.0, 1e-9) << "it waits for the sensor";
  // x of a correction has no effect. On the first line y of the path is x cross tool z = (1,0,0) x (0,0,-1) = (0,1,0), and z is
  // (1,0,0) x (0,1,0) = (0,0,1).
  ASSERT_EQ(controller.receive(correction(1, 7.0, 5.0, -2.0)), Taken::applied);
  for (std::uint32_t i = 1; i <= 500; ++i) {
    controller.receive(correction(i + 1, 7.0, 5.0, -2.0));
    controller.step(kDt, controller.planned());
    const double led = 1.0 - std::exp(-20.0 * kDt * i);
    EXPECT_NEAR(controller.planned()[0], 100.0 + 50.0 * kDt * i, 1e-6) << i;
    EXPECT_NEAR(controller.planned()[1], 5.0 * led, 1e-6) << i;
    EXPECT_NEAR(controller.planned()[2], -2.0 * led, 1e-6) << i;
  }
  // On the second line, along -y, y of the path is (0,-1,0) x (0,0,-1) = (1,0,0).
  EXPECT_FALSE(controller.converged());
  for (std::uint32_t i = 1; i <= 1300; ++i) {
    controller.receive(correction(501 + i, 0.0, 3.0, 0.0));
    controller.step(kDt, controller.planned());
  }
  EXPECT_NEAR(controller.planned()[0], 303.0, 1e-6);
  EXPECT_NEAR(controller.planned()[1], -100.0, 1e-6);
  EXPECT_NEAR(controller.planned()[2], 0.0, 1e-6);
  EXPECT_TRUE(controller.converged()) << "the fine point at the end";
}

TEST(EgmController, APathTakesPathCorrectionsAloneAndNeedsATransverseTool) {
  Controller controller(with_path(), 6, gantry());
  controller.start({100, 0, 0, 0, 0, 180});
  EXPECT_EQ(controller.receive(reference(1, kHome)), Taken::invalid);
  EXPECT_THAT(controller.fault(), HasSubstr("41826"));
  EXPECT_THAT(controller.fault(), HasSubstr("runs EGMActMove"));
  Cell joints;
  EXPECT_EQ(joints.controller.receive(correction(1, 0, 1, 0)), Taken::invalid);
  EXPECT_THAT(joints.controller.fault(), HasSubstr("a path correction; this controller runs EGMActJoint"));
  // B = 90: z of the tool along x.
  EXPECT_THROW(controller.start({100, 0, 0, 0, 90, 0}), std::invalid_argument);
  EXPECT_THROW(controller.start({300, 0, 0, 0, 0, 180}), std::invalid_argument);
}

TEST(EgmController, PoseGuidanceLeadsPositionAndRotationByTheSameLaw) {
  Controller controller({.guidance = Guidance::pose, .max_speed_deviation_deg_per_s = 1e6}, 6, gantry());
  controller.start({100, 0, 0, 0, 0, 0});
  Sensor sensor;
  sensor.planned = Motion{{}, EgmPose{{110, 0, 0}, {1, 0, 0, 0}, std::array<double, 3>{0, 0, 30}}, {}, {}};
  ASSERT_EQ(controller.receive(encode(sensor)), Taken::applied);
  for (int i = 1; i <= 50; ++i) {
    controller.step(kDt, controller.planned());
    const double done = 1.0 - std::exp(-20.0 * kDt * i);
    EXPECT_NEAR(controller.planned()[0], 100.0 + 10.0 * done, 1e-9);
    EXPECT_NEAR(controller.planned()[3], 30.0 * done, 1e-9);
  }
}

TEST(EgmPoses, QuaternionsAndEulerAnglesAreOneRotation) {
  const Pose X = gateway::pose_of_xyzabc({1, 2, 3, 40, 50, 60});
  EgmPose pose = egm_pose_of(X);
  EXPECT_LT((pose_of(pose).R - X.R).norm(), 1e-12);
  pose.euler_deg.reset();
  EXPECT_LT((pose_of(pose).R - X.R).norm(), 1e-12);
  const Pose straight_up = gateway::pose_of_xyzabc({0, 0, 0, 30, 90, 20});
  EXPECT_LT((gateway::pose_of_xyzabc(gateway::xyzabc_of(straight_up)).R - straight_up.R).norm(), 1e-9);
}

TEST(EgmFollower, JointsStatesAndTimesAreFollowed) {
  Follower follower({});
  Reception r = follower.receive(kGoldenEgmRobot, 3.0);
  ASSERT_TRUE(r.state) << r.fault;
  EXPECT_TRUE(r.restarted);
  EXPECT_TRUE(r.drives);
  EXPECT_EQ(Follower::joints_of(*r.state, false), kHome);
  Robot robot = *r.state;
  robot.header.seqno = 1;
  robot.header.tm_ms = *robot.header.tm_ms + 4;
  r = follower.receive(encode(robot), 3.011);
  EXPECT_FALSE(r.restarted);
  EXPECT_NEAR(r.time_s, 3.004, 1e-9);
  EXPECT_TRUE(follower.receive(encode(robot), 3.012).old);
  robot.header.seqno = 2;
  robot.header.tm_ms = *robot.header.tm_ms + 4;
  robot.motors = MotorState::off;
  EXPECT_FALSE(follower.receive(encode(robot), 3.013).drives);
  EXPECT_FALSE(follower.silent(3.2));
  EXPECT_TRUE(follower.silent(3.22));
  robot.header.seqno = 0;
  robot.header.tm_ms = *robot.header.tm_ms + 4;
  EXPECT_TRUE(follower.receive(encode(robot), 3.1).restarted);
}

TEST(EgmFollower, AMessageWithoutTheFollowedJointsIsRefused) {
  Robot robot = *decode_robot(kGoldenEgmRobot).message;
  robot.planned.joints.clear();
  Follower planned({.planned = true});
  EXPECT_THAT(planned.receive(encode(robot), 0.0).fault, HasSubstr("planned has no joints"));
  Follower measured({});
  EXPECT_TRUE(measured.receive(encode(robot), 0.0).state);
  EXPECT_THAT(measured.receive(kGoldenEgmRobot.substr(0, 100), 0.1).fault, HasSubstr("protocol buffer"));
}

}  // namespace
}  // namespace takt::test::egm_controller
