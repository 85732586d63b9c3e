// The section `collision_checking` of a scenario: checked pairs, their limits, and errors for mistakes.
#include "server/scenario/cell_builders.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/service_cell.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class CollisionChecking : public testing::Test {
 protected:
  std::shared_ptr<const CellModel> load(const std::string& section) {
    directory_.write("s.yaml", test::service_scenario_text() + section);
    return load_cell(directory_ / "s.yaml");
  }
  std::string error(const std::string& section) {
    try {
      load(section);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "no error";
  }
  /// Its limit, or -1 where the pair is not checked.
  static double limit(const CellModel& cell, const std::string& a, const std::string& b) {
    for (const CheckedPair& pair : cell.clearance.pairs) {
      const std::string& x = cell.description.checked_bodies[static_cast<std::size_t>(pair.a)];
      const std::string& y = cell.description.checked_bodies[static_cast<std::size_t>(pair.b)];
      if ((x == a && y == b) || (x == b && y == a)) return pair.limit_m;
    }
    return -1.0;
  }
  test::TemporaryDirectory directory_;
};

TEST_F(CollisionChecking, WithoutTheSectionNothingIsChecked) {
  const auto cell = load("");
  EXPECT_FALSE(cell->clearance.enabled);
  EXPECT_TRUE(cell->clearance.bodies.empty());
  EXPECT_TRUE(cell->description.checked_bodies.empty());
  EXPECT_TRUE(load("collision_checking: {enabled: false}\n")->clearance.bodies.empty());
}

TEST_F(CollisionChecking, PairsThatAreCheckedAndPairsThatAreNot) {
  const auto cell = load("collision_checking: {min_clearance_m: 0.01}\n");
  const auto of = [&](const char* a, const char* b) { return limit(*cell, a, b); };
  // The report pairs of the 3 x 3 table, and links, which the table lacks.
  EXPECT_EQ(of("Gripper1", "Table1"), 0.01);
  EXPECT_EQ(of("Gripper1/left_jaw", "Table1"), 0.01);
  EXPECT_EQ(of("Robot1/forearm_link", "Table1"), 0.01);
  EXPECT_EQ(of("Robot1/forearm_link", "P"), 0.01);
  EXPECT_EQ(of("Robot1/forearm_link", "Robot2/wrist_1_link"), 0.01);
  EXPECT_EQ(of("Robot1/forearm_link", "Gripper2"), 0.01);
  EXPECT_EQ(of("Gripper1/left_jaw", "Gripper2/right_jaw"), 0.01);
  EXPECT_EQ(of("Robot1/base_link", "P"), 0.01);
  // A gripper comes close to Parts by trade.
  EXPECT_EQ(of("Gripper1/left_jaw", "P"), 0.0);
  // One robot: neighbours touch, others do not.
  EXPECT_EQ(of("Robot1/base_link", "Robot1/shoulder_link"), -1.0);
  EXPECT_EQ(of("Robot1/base_link", "Robot1/upper_arm_link"), 0.01);
  EXPECT_EQ(of("Robot1/wrist_3_link", "Gripper1"), -1.0);
  EXPECT_EQ(of("Robot1/wrist_2_link", "Gripper1"), -1.0);
  EXPECT_EQ(of("Robot1/wrist_1_link", "Gripper1"), 0.01);
  EXPECT_EQ(of("Gripper1/left_jaw", "Gripper1/right_jaw"), -1.0);
  // Pairs without relative motion.
  EXPECT_EQ(of("Robot1/base_link", "Table1"), -1.0);
  EXPECT_EQ(of("Robot1/base_link", "Robot2/base_link"), -1.0);
  // Parts touch Parts and Grounds by trade, but do not go through them.
  EXPECT_EQ(of("P", "Table1"), 0.0);
  EXPECT_EQ(of("P", "C"), 0.0);
}

TEST_F(CollisionChecking, TheLastMatchingLimitCountsAndIgnoredPairsAreLeftOut) {
  const auto cell = load(
      "collision_checking:\n"
      "  limits:\n"
      "    - {pair: ['Robot1/*', 'Table*'], min_clearance_m: 0.02}\n"
      "    - {pair: [Table1, Robot1/forearm_link], min_clearance_m: 0.05}\n"
      "    - {pair: [Gripper1/*, P], min_clearance_m: 0.003}\n"
      "  ignore:\n"
      "    - [Robot1/base_link, Table1]\n"
      "    - ['*', C]\n");
  EXPECT_EQ(limit(*cell, "Robot1/upper_arm_link", "Table1"), 0.02);
  EXPECT_EQ(limit(*cell, "Robot1/forearm_link", "Table1"), 0.05);
  EXPECT_EQ(limit(*cell, "Robot2/forearm_link", "Table1"), 0.0);
  EXPECT_EQ(limit(*cell, "Gripper1/left_jaw", "P"), 0.003);
  EXPECT_EQ(limit(*cell, "Gripper1", "P"), 0.0);
  EXPECT_EQ(limit(*cell, "Robot1/forearm_link", "C"), -1.0);
}

TEST_F(CollisionChecking, MistakesAreReportedWithPlaceKeyAndAllowedValues) {
  const std::string lines = test::service_scenario_text();
  const auto line = std::to_string(std::count(lines.begin(), lines.end(), '\n') + 3);
  const std::string limits = "collision_checking:\n  limits:\n    - ";
  EXPECT_THAT(error(limits + "{pair: [Robot1/forarm_link, Table1], min_clearance_m: 0.02}\n"),
              AllOf(HasSubstr("s.yaml:" + line + ":14: collision_checking.limits.pair"),
                    HasSubstr("'Robot1/forarm_link', which fits no body"), HasSubstr("Robot1/forearm_link")));
  EXPECT_THAT(error(limits + "{pair: [Robot1/base_link, Table1], min_clearance_m: 0.02}\n"),
              AllOf(HasSubstr("s.yaml:" + line + ":"),
                    HasSubstr("[Robot1/base_link, Table1], which fits no checked pair"),
                    HasSubstr("a robot link or gripper with a ground")));
  EXPECT_THAT(error(limits + "{pair: [Table1], min_clearance_m: 0.02}\n"),
              AllOf(HasSubstr("collision_checking.limits.pair"), HasSubstr("a list of 1 values"),
                    HasSubstr("two names")));
  EXPECT_THAT(error(limits + "{pair: [Robot1/*, Table1], min_clearance_m: 20}\n"),
              AllOf(HasSubstr("collision_checking.limits.min_clearance_m"), HasSubstr("[0, 10]")));
  EXPECT_THAT(error(limits + "{pair: [Robot1/*, Table1]}\n"), HasSubstr("min_clearance_m"));
  EXPECT_THAT(error(limits + "{pair: [Robot1/*, Table1], min_clearance_m: 0.1, depth: 1}\n"),
              HasSubstr("collision_checking.limits.depth"));
  EXPECT_THAT(error("collision_checking: {limits: 3}\n"), HasSubstr("a list of {pair"));
  EXPECT_THAT(error("collision_checking: {ignore: [Table1]}\n"),
              AllOf(HasSubstr("collision_checking.ignore"), HasSubstr("'Table1'"), HasSubstr("two names")));
  EXPECT_THAT(error("collision_checking: {ignore: [[Table9, P]]}\n"),
              HasSubstr("'Table9', which fits no body"));
  EXPECT_THAT(error("collision_checking: {min_clearance_m: -1}\n"),
              HasSubstr("collision_checking.min_clearance_m"));
  EXPECT_THAT(error("collision_checking: {limit: 1}\n"), HasSubstr("collision_checking.limit"));
}

TEST_F(CollisionChecking, AnOverlapAtTheStartIsReportedInTheFirstStepAndAfterAReset) {
  const auto cell =
      load("collision_checking: {limits: [{pair: [Gripper1/left_jaw, Table1], min_clearance_m: 2}]}\n");
  Simulation simulation(cell);
  for (int run = 0; run < 2; ++run) {
    ASSERT_TRUE(simulation.step({}));
    ASSERT_EQ(simulation.events().collision_events.size(), 1U);
    const CollisionEvent event = simulation.events().collision_events[0];
    EXPECT_EQ(event.kind, CollisionEvent::Kind::clearance);
    EXPECT_EQ(event.time_s, 0.0);
    ASSERT_TRUE(simulation.step({}));
    EXPECT_TRUE(simulation.events().collision_events.empty());
    simulation.reset();
  }
}

}  // namespace
}  // namespace takt
