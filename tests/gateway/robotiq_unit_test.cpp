// Robotiq's URCap server. Expectations come from the instruction manual of the 2F-85 for UR (registers).
#include <gtest/gtest.h>

#include "client_lib/gateway/ur/robotiq.h"

namespace {

using namespace takt::ur;

struct Robotiq : testing::Test {
  std::string ask(const char* line) { return gripper.answer(line, measured, time_s).bytes; }
  RobotiqGripper gripper;
  MeasuredGripper measured{0.1, 0.1, 120.0};
  double time_s = 10.0;
};

TEST_F(Robotiq, VariablesAreReadByTheirNames) {
  EXPECT_EQ(ask("GET ACT"), "ACT 1\n");
  EXPECT_EQ(ask("GET STA"), "STA 3\n");
  EXPECT_EQ(ask("get FLT\r"), "FLT 0\n");
  EXPECT_EQ(ask("GET POS"), "POS 0\n");
  EXPECT_EQ(ask("GET OBJ"), "OBJ 3\n");
  measured.width_m = 0.04;
  EXPECT_EQ(ask("GET POS"), "POS 153\n");  // 255 * 0.6
  measured.width_m = 0.0;
  EXPECT_EQ(ask("GET POS"), "POS 255\n");
  for (const char* bad : {"GET", "GET XYZ", "", "POS", "SET POS", "SET POS x", "SET POS 256", "SET POS -1",
                          "SET POS 5x", "SET XYZ 1", "SET FOR 3 OBJ 1"})
    EXPECT_EQ(ask(bad), "?\n") << bad;
  EXPECT_EQ(ask("GET FOR"), "FOR 0\n");
}

TEST_F(Robotiq, PositionAndForceBecomeWidthAndForce) {
  const auto closes = gripper.answer("SET POS 255 SPE 10 FOR 255 GTO 1", measured, time_s);
  EXPECT_EQ(closes.bytes, "ack");
  ASSERT_TRUE(closes.command);
  EXPECT_DOUBLE_EQ(closes.command->width_m, 0.0);
  EXPECT_DOUBLE_EQ(closes.command->force_N, 120.0);
  EXPECT_EQ(ask("GET PRE"), "PRE 255\n");
  const auto half = gripper.answer("set POS 51", measured, time_s);
  EXPECT_NEAR(half.command->width_m, 0.08, 1e-12);
  EXPECT_DOUBLE_EQ(gripper.answer("SET FOR 0", measured, time_s).command->force_N, 10.0);
  EXPECT_FALSE(gripper.answer("SET SPE 255", measured, time_s).command);
}

TEST_F(Robotiq, ItMovesWithActAndGtoAlone) {
  EXPECT_EQ(ask("SET ACT 0"), "ack");
  EXPECT_EQ(ask("GET STA"), "STA 0\n");
  EXPECT_FALSE(gripper.answer("SET POS 100", measured, time_s).command);
  EXPECT_FALSE(gripper.answer("SET ACT 1", measured, time_s).command);
  EXPECT_EQ(ask("GET STA"), "STA 3\n");
  measured.width_m = 0.03;
  const auto stops = gripper.answer("SET GTO 0", measured, time_s);
  ASSERT_TRUE(stops.command);
  EXPECT_DOUBLE_EQ(stops.command->width_m, 0.03);
  EXPECT_FALSE(gripper.answer("SET POS 200", measured, time_s).command);
  EXPECT_NEAR(gripper.answer("SET GTO 1", measured, time_s).command->width_m, 0.1 * 55.0 / 255.0, 1e-12);
}

TEST_F(Robotiq, AnObjectIsWhatStopsTheJaws) {
  ask("SET POS 255");
  EXPECT_EQ(ask("GET OBJ"), "OBJ 0\n");  // before the gripper has begun
  time_s += 0.1;
  measured.moves = true;
  measured.width_m = 0.06;
  EXPECT_EQ(ask("GET OBJ"), "OBJ 0\n");
  time_s += 1.0;
  measured.moves = false;
  measured.holds = true;
  EXPECT_EQ(ask("GET OBJ"), "OBJ 2\n");
  ask("SET POS 0");
  time_s += 1.0;
  measured.holds = false;
  measured.width_m = 0.08;
  EXPECT_EQ(ask("GET OBJ"), "OBJ 1\n");
  measured.width_m = 0.1;
  EXPECT_EQ(ask("GET OBJ"), "OBJ 3\n");
}

}  // namespace
