// Validation of commands at the boundary: whole, precise, never clamped.
#include "server/simulation/model/command.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/simulation/model/cell_description.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

CellDescription cell() {
  CellDescription c;
  RobotDescription robot;
  robot.name = "R";
  for (const char* name : {"a", "b"}) {
    JointModel joint;
    joint.name = name;
    joint.lower = -1.0, joint.upper = 2.0, joint.max_velocity = 3.0, joint.max_effort = 4.0;
    robot.arm.joints.push_back(joint);
  }
  c.robots.push_back(robot);
  GripperDescription gripper;
  gripper.name = "G";
  gripper.max_width_m = 0.1;
  gripper.max_force_N = 50.0;
  c.grippers.push_back(gripper);
  return c;
}

RawJointCommand good() {
  return {SimTime{1'500'000'000}, {"b", "a"}, {0.5, -0.5}, {}, {}};
}

Rejection rejection(const RawJointCommand& raw) {
  const auto result = validate(cell(), 0, raw);
  EXPECT_TRUE(std::holds_alternative<Rejection>(result));
  return std::holds_alternative<Rejection>(result) ? std::get<Rejection>(result) : Rejection{};
}

TEST(JointCommandValidation, NamesSelectJointsInAnyOrder) {
  RawJointCommand raw = good();
  raw.velocity = {1.0, 2.0};
  const auto result = validate(cell(), 0, raw);
  ASSERT_TRUE(std::holds_alternative<JointCommand>(result));
  const auto& command = std::get<JointCommand>(result);
  EXPECT_EQ(command.robot, 0);
  EXPECT_EQ(command.stamp.seconds(), 1.5);
  EXPECT_EQ(command.position[0], -0.5);
  EXPECT_EQ(command.position[1], 0.5);
  EXPECT_EQ(command.velocity[0], 2.0);
  EXPECT_EQ(command.velocity[1], 1.0);
  EXPECT_FALSE(command.has_effort);
  raw.effort = {-4.0, 3.0};
  const auto pushing = std::get<JointCommand>(validate(cell(), 0, raw));
  EXPECT_TRUE(pushing.has_effort);
  EXPECT_EQ(pushing.effort[0], 3.0);
  EXPECT_EQ(pushing.effort[1], -4.0);
}

TEST(JointCommandValidation, EffortsAloneAreTorques) {
  RawJointCommand raw = good();
  EXPECT_FALSE(std::get<JointCommand>(validate(cell(), 0, raw)).torque_mode);
  raw.position.clear();
  raw.effort = {-4.0, 3.0};
  const auto command = std::get<JointCommand>(validate(cell(), 0, raw));
  EXPECT_TRUE(command.torque_mode);
  EXPECT_TRUE(command.has_effort);
  EXPECT_FALSE(command.has_velocity);
  EXPECT_EQ(command.effort[0], 3.0);
  EXPECT_EQ(command.effort[1], -4.0);
  raw.effort = {0.0, 4.1};
  EXPECT_EQ(rejection(raw).code, RejectionCode::effort_out_of_range);
  raw.effort = {0.0};
  EXPECT_EQ(rejection(raw).code, RejectionCode::wrong_count);
  raw.effort = {0.0, 1.0};
  raw.velocity = {0.0, 0.0};
  EXPECT_EQ(rejection(raw).code, RejectionCode::wrong_count);
  EXPECT_THAT(rejection(raw).message, HasSubstr("field 'position' has 0 entries"));
}

TEST(JointCommandValidation, EveryFaultHasItsCodeAndSentence) {
  RawJointCommand raw = good();
  raw.names = {"a", "c"};
  EXPECT_EQ(rejection(raw).subject, "R");
  EXPECT_EQ(rejection(raw).code, RejectionCode::unknown_joint);
  EXPECT_THAT(rejection(raw).message, HasSubstr("a, b"));

  raw = good();
  raw.names = {"a", "a"};
  EXPECT_EQ(rejection(raw).code, RejectionCode::duplicate_joint);

  raw = good();
  raw.position = {0.0};
  EXPECT_EQ(rejection(raw).code, RejectionCode::wrong_count);
  EXPECT_THAT(rejection(raw).message, HasSubstr("1 entries; R needs 2"));
  raw = good();
  raw.names.clear();
  EXPECT_EQ(rejection(raw).code, RejectionCode::wrong_count);
  raw = good();
  raw.velocity = {1.0};
  EXPECT_EQ(rejection(raw).code, RejectionCode::wrong_count);

  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    raw = good();
    raw.position[1] = bad;
    EXPECT_EQ(rejection(raw).code, RejectionCode::not_finite);
    raw = good();
    raw.velocity = {0.0, bad};
    EXPECT_EQ(rejection(raw).code, RejectionCode::not_finite);
    raw = good();
    raw.effort = {bad, 0.0};
    EXPECT_EQ(rejection(raw).code, RejectionCode::not_finite);
  }

  raw = good();
  raw.position[0] = 2.0000001;
  EXPECT_EQ(rejection(raw).code, RejectionCode::out_of_range);
  EXPECT_THAT(rejection(raw).message, AllOf(HasSubstr("2.0000001 rad of joint 'b'"), HasSubstr("[-1, 2]")));
  raw = good();
  raw.velocity = {-3.1, 0.0};
  EXPECT_EQ(rejection(raw).code, RejectionCode::velocity_out_of_range);
  raw = good();
  raw.effort = {0.0, 4.1};
  EXPECT_EQ(rejection(raw).code, RejectionCode::effort_out_of_range);
}

TEST(SimTime, KeepsTheNanosecond) {
  EXPECT_EQ(SimTime::from_seconds(0.008).ns, 8'000'000);
  EXPECT_EQ(SimTime::from_seconds(12345.000000001).ns, 12'345'000'000'001);
  EXPECT_EQ(SimTime::from_seconds(SimTime{12'345'000'000'001}.seconds()).ns, 12'345'000'000'001);
  EXPECT_FALSE(SimTime::from_seconds(-1.0).given());
  EXPECT_EQ(SimTime{}.seconds(), -1.0);
}

TEST(GripperCommandValidation, EveryFaultHasItsCode) {
  const auto code = [](const RawGripperCommand& raw) {
    const auto result = validate(cell(), find_target(cell(), "G"), raw);
    return std::holds_alternative<Rejection>(result)
               ? std::string(to_string(std::get<Rejection>(result).code))
               : "";
  };
  EXPECT_EQ(code({{}, GripperAction::width, 0.05, 10.0}), "");
  EXPECT_EQ(code({{}, static_cast<GripperAction>(3), 0.0, 0.0}), "malformed");
  EXPECT_EQ(code({{}, GripperAction::width, 0.2, 0.0}), "out_of_range");
  EXPECT_EQ(code({{}, GripperAction::width, 0.05, -1.0}), "out_of_range");
  EXPECT_EQ(code({{}, GripperAction::width, std::nan(""), 0.0}), "not_finite");
}

}  // namespace
}  // namespace takt
