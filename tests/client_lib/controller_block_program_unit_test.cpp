// The block scenario's program run open-loop on an ideal plant: the published times and the analytic poses.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <map>

#include "tests/support/arm_capsules.h"
#include "tests/support/controller_test_cell.h"

namespace takt::controller {
namespace {

struct Record {
  double time_s;
  std::array<JointArray, 2> q, qd;    ///< the robots at this time
  std::array<GripperAction, 2> verb;  ///< sent at this time
  std::array<double, 2> width_m;
};

const std::string kProgram = std::string(TAKT_CONFIG_DIR) + "/programs/block_assembly.lua";

/// One record per period, up to the end of the program or 60 s.
const std::vector<Record>& block_run() {
  static const std::vector<Record> run = [] {
    const CellDescription cell = block_cell();
    Controller controller(kProgram, cell);
    IdealPlant plant(controller, cell);
    std::vector<Record> records;
    plant.run(60.0, [&](const Output& output) {
      Record record;
      record.time_s = plant.time_s();
      for (size_t i = 0; i < 2; ++i) {
        record.q[i] = joint_array(plant.state().robots[i].position);
        record.qd[i] = joint_array(plant.state().robots[i].velocity);
        record.verb[i] = output.grippers[i].verb;
        record.width_m[i] = output.grippers[i].width_m;
      }
      records.push_back(record);
      return output.finished;
    });
    return records;
  }();
  return run;
}

const Record& at(double time_s) {
  for (const Record& record : block_run()) {
    if (record.time_s >= time_s - 1e-9) return record;
  }
  throw std::runtime_error("the program is over before");
}

/// Tool centre point when gripping a part: at the given height above the bottom face of the part, tool down,
/// the gripper turned with the part. Worked out here by hand, apart from the program's own products of poses.
Pose tcp_at_part(double x, double y, double bottom_z, double grip_height, double yaw) {
  const Mat3 R =
      (Mat3() << std::cos(yaw), std::sin(yaw), 0.0, std::sin(yaw), -std::cos(yaw), 0.0, 0.0, 0.0, -1.0)
          .finished();
  return {R, {x, y, bottom_z + grip_height}};
}

void expect_tcp(double time_s, int robot, const Pose& expected) {
  static const CellDescription cell = block_cell();
  const Record& record = at(time_s);
  const auto i = static_cast<size_t>(robot);
  const Pose X_WT = tcp_in_world(cell, robot, record.q[i]);
  EXPECT_LT((X_WT.p - expected.p).norm(), 1e-9) << "Robot" << robot + 1 << " at " << time_s << " s";
  EXPECT_LT((X_WT.R - expected.R).norm(), 1e-9) << "Robot" << robot + 1 << " at " << time_s << " s";
  for (const double velocity : record.qd[i])
    EXPECT_EQ(velocity, 0.0) << "Robot" << robot + 1 << " at " << time_s;
}

TEST(BlockProgram, RobotsReachTheAnalyticPosesAtThePublishedTimes) {
  constexpr double kTable = 0.7;
  expect_tcp(3.8, 0, tcp_at_part(-0.22, 0.20, kTable, 0.054, 0.0));  // P
  expect_tcp(4.9, 1, tcp_at_part(0.30, -0.20, kTable, 0.045, 0.0));  // C
  for (double t = 9.0; t < 9.9; t += 0.1)
    expect_tcp(t, 0, tcp_at_part(-0.205, -0.05, kTable + 0.030, 0.054, 0.0));
  for (double t = 8.7; t < 9.9; t += 0.1)
    expect_tcp(t, 1, tcp_at_part(0.04, -0.05, kTable + 0.080, 0.045, 0.0));
  expect_tcp(10.9, 1, tcp_at_part(0.04, -0.05, kTable + 0.020, 0.045, 0.0));          // C in B
  expect_tcp(16.0, 0, tcp_at_part(-0.22, -0.05, kTable, 0.045, 0.0));                 // O
  expect_tcp(20.5, 0, tcp_at_part(0.14, -0.05, kTable + 0.020 + 0.140, 0.045, 0.0));  // P+O above B
  expect_tcp(22.7, 0, tcp_at_part(0.14, -0.05, kTable + 0.020, 0.045, 0.0));          // O in B
  expect_tcp(31.1, 1, tcp_at_part(0.10, -0.05, kTable, 0.015, 0.0));                  // B
  expect_tcp(38.0, 1, tcp_at_part(1.15, 0.0, kTable, 0.015, M_PI / 2.0));             // B on Table2
}

TEST(BlockProgram, GrippersCloseAndOpenAtThePublishedTimes) {
  // A close is one from any other verb; an opening one that ends a close.
  std::array<std::vector<double>, 2> closes, opens;
  for (size_t k = 1; k < block_run().size(); ++k) {
    for (size_t i = 0; i < 2; ++i) {
      const bool before = block_run()[k - 1].verb[i] == GripperAction::close;
      const bool now = block_run()[k].verb[i] == GripperAction::close;
      if (now && !before) closes[i].push_back(block_run()[k].time_s);
      if (before && !now) opens[i].push_back(block_run()[k].time_s);
    }
  }
  const auto near = [](double time_s) { return testing::DoubleNear(time_s, 0.05); };
  EXPECT_THAT(closes[0], testing::ElementsAre(near(3.8), near(16.0)));
  EXPECT_THAT(opens[0], testing::ElementsAre(near(9.9), near(22.8)));
  EXPECT_THAT(closes[1], testing::ElementsAre(near(4.9), near(31.2)));
  EXPECT_THAT(opens[1], testing::ElementsAre(near(11.0), near(38.2)));
  EXPECT_LT(block_run().back().time_s, 42.0);
}

TEST(BlockProgram, RobotsRestAroundEveryChangeOfAGrip) {
  for (size_t k = 1; k < block_run().size(); ++k) {
    for (size_t i = 0; i < 2; ++i) {
      const bool before = block_run()[k - 1].verb[i] == GripperAction::close;
      if ((block_run()[k].verb[i] == GripperAction::close) == before) continue;
      const size_t from = k - 13, to = k + 25;  // 0.104 s before to 0.2 s after
      ASSERT_LT(to, block_run().size());
      for (size_t n = from; n < to; ++n) {
        EXPECT_EQ(block_run()[n].q[i], block_run()[k].q[i])
            << "Robot" << i + 1 << " at " << block_run()[n].time_s;
        EXPECT_EQ(block_run()[n].qd[i], JointArray{});
      }
      // Before closing the jaws were sent to a width of their own, 30 mm wider than the part.
      if (before) continue;
      ASSERT_EQ(block_run()[k - 1].verb[i], GripperAction::width);
      const bool first = block_run()[k].time_s < 10.0;
      const double part_width_m = i == 0 ? (first ? 0.030 : 0.080) : (first ? 0.080 : 0.120);
      EXPECT_NEAR(block_run()[k - 1].width_m[i], part_width_m + 0.030, 1e-12);
    }
  }
}

TEST(BlockProgram, MotionsKeepSpeedLimitsAndAreContinuous) {
  const ArmModel& arm = ur10e();
  for (size_t k = 1; k < block_run().size(); ++k) {
    for (size_t i = 0; i < 2; ++i) {
      for (size_t j = 0; j < 6; ++j) {
        const double mean = (block_run()[k].q[i][j] - block_run()[k - 1].q[i][j]) / 0.008;
        ASSERT_LE(std::abs(block_run()[k].qd[i][j]), arm.joints[j].max_velocity);
        ASSERT_LE(std::abs(mean), arm.joints[j].max_velocity);
        // The sent velocities are those of the sent positions: the mean speed lies within the change of
        // acceleration.
        const double middle = 0.5 * (block_run()[k].qd[i][j] + block_run()[k - 1].qd[i][j]);
        ASSERT_NEAR(mean, middle, 1e-3)
            << "Robot" << i + 1 << " joint " << j << " at " << block_run()[k].time_s;
      }
    }
  }
}

TEST(BlockProgram, RobotsKeepClearOfEachOtherAndOfTheTables) {
  const CellDescription cell = block_cell();
  double nearest = 1e9, lowest = 1e9;
  double nearest_time = 0.0;
  const auto capsules = [&](size_t robot, size_t k) {
    const auto& described = cell.robots[robot];
    return test::arm_capsules(arm_model(described), pose_of(described.base), block_run()[k].q[robot]);
  };
  for (size_t k = 0; k < block_run().size(); k += 5) {
    const std::vector<test::Capsule> first = capsules(0, k), second = capsules(1, k);
    if (const double d = test::distance(first, second); d < nearest) {
      nearest = d;
      nearest_time = block_run()[k].time_s;
    }
    // Everything but the pads, which reach down to the parts.
    for (const std::vector<test::Capsule>* arm : {&first, &second}) {
      for (size_t i = 0; i < arm->size(); ++i) {
        const double low = std::min((*arm)[i].a.z(), (*arm)[i].b.z());
        if (i < test::kCapsulesBeforePads) {
          lowest = std::min(lowest, low);
        } else {
          EXPECT_GT(low, 0.7 + 0.015 - 1e-9);
        }
      }
    }
  }
  RecordProperty("nearest_mm", static_cast<int>(1000.0 * nearest));
  EXPECT_GT(nearest, 0.05) << "at " << nearest_time << " s";
  EXPECT_GT(lowest, 0.7 + 0.1);
}

TEST(BlockProgram, CarriedPartsKeepClearOfPartsBelow) {
  const CellDescription cell = block_cell();
  const auto tcp = [&](const Record& record, int robot) {
    return tcp_in_world(cell, robot, record.q[static_cast<size_t>(robot)]);
  };
  for (const Record& record : block_run()) {
    // O with P is over B or C only above their tops, but for the last descent straight down onto its seat.
    const Pose one = tcp(record, 0);
    if (record.time_s > 16.0 && record.time_s < 22.8 && one.p.x() - 0.04 > -0.22 + 0.1 &&
        one.p.x() < 0.14 - 1e-9) {
      ASSERT_GT(one.p.z() - 0.045, 0.7 + 0.100 + 0.01) << record.time_s;
    }
    // The assembly never comes lower than its seat on the way to Table2, and stays level.
    const Pose two = tcp(record, 1);
    if (record.time_s > 31.2 && record.time_s < 38.2) {
      ASSERT_GT(two.p.z() - 0.015, 0.7 - 1e-9) << record.time_s;
      ASSERT_LT((two.R * Vec3::UnitZ() + Vec3::UnitZ()).norm(), 1e-2) << record.time_s;
    }
  }
}

TEST(BlockProgram, RepeatedRunsGiveTheSameBits) {
  const CellDescription cell = block_cell();
  Controller controller(kProgram, cell);
  for (int run = 0; run < 2; ++run) {
    IdealPlant plant(controller, cell);
    size_t k = 0;
    plant.run(60.0, [&](const Output& output) {
      EXPECT_EQ(joint_array(plant.state().robots[0].position), block_run()[k].q[0]);
      EXPECT_EQ(joint_array(plant.state().robots[1].position), block_run()[k].q[1]);
      EXPECT_EQ(joint_array(plant.state().robots[1].velocity), block_run()[k].qd[1]);
      ++k;
      return output.finished || testing::Test::HasFailure();
    });
    EXPECT_EQ(k, block_run().size());
    controller.restart();
  }
}

TEST(BlockProgram, TheProgramDoesNotDependOnTheLastBitsOfTime) {
  const CellDescription cell = block_cell();
  Controller controller(kProgram, cell);
  CellState state = initial_state(cell);
  for (size_t k = 0; k < block_run().size(); ++k) {
    if (k > 0) {
      ASSERT_EQ(joint_array(state.robots[0].position), block_run()[k].q[0]);
      ASSERT_EQ(joint_array(state.robots[1].position), block_run()[k].q[1]);
    }
    state.time = std::round(block_run()[k].time_s * 1e9 + (k % 3 == 0 ? 0.4 : -0.4)) * 1e-9;
    const Output& output = controller.update(state);
    for (const JointSetPoint& joints : output.joints) place_at(joints, state);
  }
}

}  // namespace
}  // namespace takt::controller
