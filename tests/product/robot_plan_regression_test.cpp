// A robot takes products apart and puts them together again, at level of detail 1, by the written cell and program.
#include "server/product/robot_plan.h"

#include <gmock/gmock.h>

#include <set>

#include "server/headless/headless_run.h"
#include "server/product/cell_writer.h"
#include "server/product/contacts.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/product_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::product {
namespace {

using test::box_body;
using test::plate_with_hole;
using test::product_of;
using test::turned_body;

/// Base plate with a hole, a lid on it, a bolt through both.
Product bolted_lid() {
  return product_of({{plate_with_hole("Base", 0.10, 0.02, 0.00505), {0, 0, 0.03}},
                     {plate_with_hole("Lid", 0.06, 0.01, 0.00505), {0, 0, 0.045}},
                     {turned_body("Bolt", {-0.028, 0.0, 0.006}, {0.005, 0.0085}), {0, 0, 0.05}}});
}

TEST(RobotPlan, TheProductIsTakenApartAndPutTogether) {
  test::TemporaryDirectory directory;
  Product product = bolted_lid();
  product.contacts = find_contacts(product);
  const Disassembly plan = take_apart(product);
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_THAT(robot.notes, testing::IsEmpty());
  ASSERT_EQ(robot.moves.size(), 2U);
  const CellFiles files =
      write_robot_cell(product, plan, hierarchy(product, plan), robot, directory / "cell");
  const Scenario scenario = read_scenario(files.scenario);
  const auto cell = build_cell(scenario);
  for (const ImportNote& note : cell->import_notes)
    EXPECT_THAT(note.sentence, testing::Not(testing::HasSubstr("collision check"))) << "shapes are exact";
  Simulation simulation(cell);
  HeadlessOptions options;
  options.duration_s = scenario.duration_s;
  options.program = directory / "cell" / "product_robot.lua";
  const auto tray = cell->description.find_component("Tray");
  ASSERT_GE(tray, 0);
  std::size_t most = 0;
  const HeadlessResult result = run_headless(simulation, scenario, options, [&](const Simulation& now) {
    const Snapshot snapshot = now.make_snapshot();
    std::size_t count = 0;
    for (const auto& component : snapshot.components) count += component.partner == tray ? 1U : 0U;
    most = std::max(most, count);
  });
  EXPECT_EQ(result.fault, "");
  EXPECT_FALSE(result.grips.empty());
  EXPECT_TRUE(result.weak_grips.empty()) << "friction of the jaws carries the parts";
  EXPECT_EQ(most, 2U) << "bolt and lid are on the tray at one time";
  for (const Instance& instance : product.instances) {
    const auto id = static_cast<std::size_t>(cell->description.find_component(instance.name));
    EXPECT_LT((result.final_state.components[id].p_WB - instance.X_WB.p).norm(), 5e-4) << instance.name;
  }
}

TEST(RobotPlan, APartWithoutAGraspEndsTheProgram) {
  // The lower plate is as wide as the opening of a box around it: no finger fits beside it, and it has no side walls free.
  Product product = product_of({{box_body("Base", {0.2, 0.2, 0.05}), {0, 0, 0.025}},
                                {box_body("Sheet", {0.05, 0.05, 0.02}), {0, 0, 0.06}},
                                {box_body("West", {0.06, 0.2, 0.04}), {-0.055, 0, 0.07}},
                                {box_body("East", {0.06, 0.2, 0.04}), {0.055, 0, 0.07}},
                                {box_body("North", {0.05, 0.06, 0.04}), {0, 0.055, 0.07}},
                                {box_body("South", {0.05, 0.06, 0.04}), {0, -0.055, 0.07}}});
  product.contacts = find_contacts(product);
  Disassembly plan;
  plan.base = 0;
  RemovalStep step;
  step.parts = {1};
  plan.steps = {step};
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_TRUE(robot.moves.empty());
  ASSERT_EQ(robot.notes.size(), 1U);
  EXPECT_THAT(robot.notes[0], testing::HasSubstr("lift Sheet"));
}

}  // namespace
}  // namespace takt::product
