// Where the joints of a robot start.
#include <gmock/gmock.h>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class RobotStart : public testing::Test {
 protected:
  RobotStart() {
    const auto joint = [](const char* name, const char* from, const char* to, const char* limit) {
      return "<joint name='" + std::string(name) + "' type='revolute'><parent link='" + from +
             "'/><child link='" + to + "'/><axis xyz='0 0 1'/><limit effort='9' velocity='1' " + limit +
             "/></joint>\n<link name='" + to + "'/>\n";
    };
    directory_.write("r.urdf", "<robot name='r'><link name='base_link'/>\n" +
                                   joint("free", "base_link", "l1", "lower='-3' upper='1'") +
                                   joint("below", "l1", "l2", "lower='-3.0718' upper='-0.0698'") +
                                   joint("above", "l2", "tool0", "lower='0.5' upper='1.5'") + "</robot>\n");
  }
  std::shared_ptr<const CellModel> load(const std::string& keys) {
    directory_.write("cell.yaml",
                     "takt_scenario: 1\nname: start\nrobots:\n  R: {urdf: r.urdf" + keys + "}\n");
    return load_cell(directory_ / "cell.yaml");
  }
  std::string error_of(const std::string& keys) {
    try {
      load(keys);
    } catch (const ScenarioError& error) {
      return error.what();
    }
    return "no error";
  }
  static std::string notes(const CellModel& cell) {
    std::string all;
    for (const ImportNote& note : cell.import_notes) all += note.sentence + "\n";
    return all;
  }

  test::TemporaryDirectory directory_;
};

// As joint_state_publisher of ROS: zero, or the middle of a range without zero.
TEST_F(RobotStart, IsZeroOrTheMiddleOfTheRangeWhereNoPositionIsGiven) {
  const auto cell = load("");
  const Snapshot snapshot = Simulation(cell).make_snapshot();
  EXPECT_EQ(snapshot.robots[0].position[0], 0.0);
  EXPECT_NEAR(snapshot.robots[0].position[1], -1.5708, 1e-12);
  EXPECT_NEAR(snapshot.robots[0].position[2], 1.0, 1e-12);
  EXPECT_THAT(notes(*cell),
              HasSubstr("R: the joints start at [0, -1.571, 1]; `initial_joints_rad` says where else."));
}

TEST_F(RobotStart, IsWhatIsGiven) {
  const auto cell = load(", initial_joints_rad: [0.1, -0.2, 0.6]");
  EXPECT_EQ(Simulation(cell).make_snapshot().robots[0].position[1], -0.2);
  EXPECT_THAT(notes(*cell), testing::Not(HasSubstr("joints start")));
  EXPECT_THAT(
      error_of(", initial_joints_rad: [0, -1]"),
      AllOf(HasSubstr("robots.R.initial_joints_rad"), HasSubstr("found 2 values"), HasSubstr("allowed: 3")));
  EXPECT_THAT(error_of(", initial_joints_rad: [0, 0, 1]"), HasSubstr("for joint 'below'"));
}

TEST_F(RobotStart, MustBeGivenWhereOtherKeysFollowItsJoints) {
  EXPECT_THAT(
      error_of(", trajectory: {end_rad: [0, -1, 1], max_velocity_rad_per_s: [1, 1, 1], "
               "max_acceleration_rad_per_s2: [1, 1, 1]}"),
      AllOf(HasSubstr("robots.R.trajectory.end_rad"), HasSubstr("initial_joints_rad, which must be given")));
  EXPECT_THAT(error_of(", safe_action: stop, max_acceleration_rad_per_s2: [1, 2, 3]"),
              AllOf(HasSubstr("max_acceleration_rad_per_s2: found 3 values"),
                    HasSubstr("as many as initial_joints_rad, which must then be given")));
  EXPECT_EQ(error_of(", safe_action: stop, max_acceleration_rad_per_s2: 2"), "no error");
}

}  // namespace
}  // namespace takt
