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
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kTolerance_m = 1e-4;

/// Writes the cell and runs it: each part of a move is on the tray at one time, and all are in their places at the end.
void expect_round_trip(const Product& product, const Disassembly& plan, const RobotPlan& robot) {
  test::TemporaryDirectory directory;
  const CellFiles files = write_cell(product, plan, hierarchy(product, plan), directory / "cell", &robot);
  const Scenario scenario = read_scenario(files.robot_scenario);
  const auto cell = build_cell(scenario);
  for (const ImportNote& note : cell->import_notes)
    EXPECT_THAT(note.sentence, testing::Not(HasSubstr("collision check"))) << "shapes are exact";
  Simulation simulation(cell);
  HeadlessOptions options;
  options.duration_s = scenario.duration_s;
  options.program = directory / "cell" / "product_robot.lua";
  const auto tray = cell->description.find_component("Tray");
  ASSERT_GE(tray, 0);
  std::set<std::string> most;
  const HeadlessResult result = run_headless(simulation, scenario, options, [&](const Simulation& now) {
    const Snapshot snapshot = now.make_snapshot();
    std::set<std::string> there;
    for (std::size_t i = 0; i < snapshot.components.size(); ++i)
      if (snapshot.components[i].partner == tray) there.insert(cell->description.components[i].name);
    if (there.size() > most.size()) most = there;
  });
  EXPECT_EQ(result.fault, "");
  EXPECT_TRUE(result.weak_grips.empty()) << "friction of the jaws carries the parts";
  std::set<std::string> expected;
  for (const RobotMove& move : robot.moves)
    for (const std::size_t i : move.parts) expected.insert(product.instances[i].name);
  EXPECT_EQ(most, expected) << "on the tray at one time";
  for (const Instance& instance : product.instances) {
    const auto id = static_cast<std::size_t>(cell->description.find_component(instance.name));
    EXPECT_LT((result.final_state.components[id].p_WB - instance.X_WB.p).norm(), kTolerance_m)
        << instance.name;
    EXPECT_LT(result.final_state.components[id].q_WB.angularDistance(instance.X_WB.quaternion()), 1e-3)
        << instance.name;
  }
}

std::vector<std::string> names_of(const RobotPlan& robot) {
  std::vector<std::string> names;
  for (const RobotMove& move : robot.moves) names.push_back(move.name);
  return names;
}

/// A removal along +z for each of these groups, in this order.
Disassembly lifting(const Product& product, const std::vector<std::vector<std::size_t>>& groups) {
  Disassembly plan;
  for (const auto& parts : groups) {
    RemovalStep step;
    step.parts = parts;
    plan.steps.push_back(step);
    plan.order.insert(plan.order.end(), parts.begin(), parts.end());
  }
  for (std::size_t i = product.instances.size(); i-- > 0;)
    if (std::find(plan.order.begin(), plan.order.end(), i) == plan.order.end()) plan.order.push_back(i);
  return plan;
}

/// A base with four walls around a square of 50 mm; no finger fits between them and what fills it.
std::vector<std::pair<Body, Vec3>> pit() {
  return {{box_body("Base", {0.2, 0.2, 0.05}), {0, 0, 0.025}},
          {box_body("West", {0.06, 0.2, 0.04}), {-0.055, 0, 0.07}},
          {box_body("East", {0.06, 0.2, 0.04}), {0.055, 0, 0.07}},
          {box_body("North", {0.05, 0.06, 0.04}), {0, 0.055, 0.07}},
          {box_body("South", {0.05, 0.06, 0.04}), {0, -0.055, 0.07}}};
}

TEST(RobotPlan, AScrewedLidIsTakenApartAndPutTogether) {
  // The nut leaves downwards, between the posts of the support.
  Product product = product_of({{plate_with_hole("Base", 0.10, 0.02, 0.00505), {0, 0, 0.03}},
                                {plate_with_hole("Lid", 0.06, 0.01, 0.00505), {0, 0, 0.045}},
                                {turned_body("Bolt", {-0.05, 0.0, 0.006}, {0.005, 0.0085}), {0, 0, 0.05}},
                                {plate_with_hole("Nut", 0.017, 0.008, 0.005), {0, 0, 0.016}}});
  product.contacts = find_contacts(product);
  const Disassembly plan = take_apart(product);
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_THAT(robot.notes, testing::IsEmpty());
  ASSERT_THAT(names_of(robot), ElementsAre("unscrew Nut", "lift Bolt", "lift Lid"));
  EXPECT_TRUE(robot.moves[0].aside.has_value());
  EXPECT_LT(robot.moves[0].out.p.z(), robot.moves[0].grasp.p.z());
  expect_round_trip(product, plan, robot);
}

TEST(RobotPlan, ASuctionCupLiftsWhatTheFingersCannotReach) {
  auto bodies = pit();
  bodies.emplace_back(box_body("Sheet", {0.05, 0.05, 0.02}), Vec3(0, 0, 0.06));
  bodies.emplace_back(box_body("Block", {0.02, 0.03, 0.02}), Vec3(0.005, 0, 0.08));
  Product product = product_of(std::move(bodies));
  product.contacts = find_contacts(product);
  const Disassembly plan = lifting(product, {{6}, {5}});
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_THAT(robot.notes, testing::IsEmpty());
  ASSERT_THAT(names_of(robot), ElementsAre("lift Block", "lift Sheet"));
  EXPECT_FALSE(robot.moves[0].cup.has_value());
  EXPECT_TRUE(robot.moves[1].cup.has_value());
  // Three times the weight of 0.3925 kg of steel at 60 kPa: 15.7 mm.
  EXPECT_THAT(robot.gripper.cups_m, ElementsAre(0.016));
  expect_round_trip(product, plan, robot);
}

TEST(RobotPlan, WhatIsTriedAgainLeavesPastWhatThePlanLetItPass) {
  // The block covers the sheet until it has left. The lip lets the sheet pass as a snap does; the plan has accepted that.
  auto bodies = pit();
  bodies.emplace_back(box_body("Sheet", {0.05, 0.05, 0.02}), Vec3(0, 0, 0.06));
  bodies.emplace_back(box_body("Block", {0.024, 0.03, 0.02}), Vec3(0, 0, 0.08));
  bodies.emplace_back(box_body("Lip", {0.004, 0.004, 0.004}), Vec3(0.023, 0.023, 0.072));
  Product product = product_of(std::move(bodies));
  product.contacts = find_contacts(product);
  const Disassembly plan = lifting(product, {{5}, {6}});
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_THAT(robot.notes, testing::IsEmpty());
  ASSERT_THAT(names_of(robot), ElementsAre("lift Block", "lift Sheet"));
  // By the order of the moves the sheet has a larger number than the block, and does not follow it.
  EXPECT_EQ(robot.order[0], 6U);
  EXPECT_EQ(robot.order[1], 5U);
  expect_round_trip(product, plan, robot);
}

TEST(RobotPlan, TheHeldPartOfAGroupStandsOnPostsOfTheTray) {
  // The beam lies on the edge of the base; the foot hangs below what overhangs, and is lowest on the tray.
  Product product = product_of({{box_body("Base", {0.2, 0.2, 0.05}), {0, 0, 0.025}},
                                {box_body("Foot", {0.03, 0.03, 0.02}), {0.14, 0, 0.04}},
                                {box_body("Beam", {0.08, 0.04, 0.03}), {0.12, 0, 0.065}}});
  product.contacts = find_contacts(product);
  const Disassembly plan = lifting(product, {{1, 2}});
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_THAT(robot.notes, testing::IsEmpty());
  ASSERT_THAT(names_of(robot), ElementsAre("lift Beam"));
  EXPECT_THAT(robot.tray_posts, testing::Not(testing::IsEmpty()));
  expect_round_trip(product, plan, robot);
}

TEST(RobotPlan, AGroupWithAPartThatWouldStayBehindIsNotTaken) {
  // Foot and beam do not touch.
  Product product = product_of({{box_body("Base", {0.2, 0.2, 0.05}), {0, 0, 0.025}},
                                {box_body("Foot", {0.03, 0.03, 0.02}), {0.05, 0, 0.06}},
                                {box_body("Beam", {0.06, 0.04, 0.03}), {-0.03, 0, 0.065}}});
  product.contacts = find_contacts(product);
  const RobotPlan robot = plan_robot(product, lifting(product, {{1, 2}}));
  EXPECT_THAT(robot.moves, testing::IsEmpty());
  EXPECT_THAT(robot.notes, ElementsAre(HasSubstr("does not lift Foot, Beam: Foot would stay behind")));
}

TEST(RobotPlan, TwoCupsServeSmallAndLargeParts) {
  // Tiles of 2 mm need a cup of 1 mm: 0.06 g; the sheet one of 16 mm. No finger fits between the tiles.
  auto bodies = pit();
  bodies.emplace_back(box_body("Sheet", {0.05, 0.05, 0.02}), Vec3(0, 0, 0.06));
  const double first = static_cast<double>(bodies.size());
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      bodies.emplace_back(box_body("Tile" + std::to_string(3 * i + j + 5), {0.002, 0.002, 0.002}),
                          Vec3(0.002 * i, 0.002 * j, 0.071));
  Product product = product_of(std::move(bodies));
  product.contacts = find_contacts(product);
  std::vector<std::vector<std::size_t>> steps;
  const auto middle = static_cast<std::size_t>(first) + 4;
  steps.push_back({middle});
  for (std::size_t k = static_cast<std::size_t>(first); k < product.instances.size(); ++k)
    if (k != middle) steps.push_back({k});
  steps.push_back({5});
  const Disassembly plan = lifting(product, steps);
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_THAT(robot.notes, testing::IsEmpty());
  EXPECT_THAT(robot.gripper.cups_m, ElementsAre(0.001, 0.016));
  EXPECT_EQ(robot.moves.front().cup, 0U);
  EXPECT_EQ(robot.moves.back().cup, 1U);
  expect_round_trip(product, plan, robot);
}

TEST(RobotPlan, TheProgramHasTheTimeOfItsRunAndLargeProductsTakeAsLong) {
  RobotPlan plan;
  plan.cycle_s = 12.2;
  EXPECT_EQ(program_duration_s(plan), 13.0);
  const auto estimate = [](double scale) {
    Product product =
        product_of({{box_body("Base", scale * Vec3(0.4, 0.2, 0.1)), scale * Vec3(0, 0, 0.05)},
                    {box_body("Block", scale * Vec3(0.1, 0.1, 0.1)), scale * Vec3(0, 0, 0.15)}});
    product.contacts = find_contacts(product);
    const RobotPlan robot = plan_robot(product, take_apart(product));
    EXPECT_EQ(robot.moves.size(), 1U);
    return program_duration_s(robot);
  };
  EXPECT_LT(estimate(10.0), 1.2 * estimate(1.0));
}

TEST(RobotPlan, PartsThatTouchNothingStandOnPosts) {
  // A shelf beside the base, and a bar on its edge, whose lowest place is a line.
  Product product = product_of({{box_body("Base", {0.1, 0.1, 0.02}), {0, 0, 0.01}},
                                {box_body("Shelf", {0.06, 0.03, 0.01}), {0.07, 0, 0.05}},
                                {box_body("Bar", {0.02, 0.04, 0.02}), {-0.08, 0, 0.06}}});
  product.instances[2].X_WB.R = Eigen::AngleAxisd(M_PI / 4, Vec3::UnitY()).toRotationMatrix();
  product.contacts = find_contacts(product);
  EXPECT_THAT(product.contacts, testing::IsEmpty());
  const Disassembly plan = take_apart(product);
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_THAT(robot.notes, testing::IsEmpty());
  EXPECT_THAT(names_of(robot), testing::UnorderedElementsAre("lift Shelf", "lift Bar"));
  expect_round_trip(product, plan, robot);
}

TEST(RobotPlan, WhatNeitherPartNorPostHoldsIsOnAPad) {
  Product product = product_of({{box_body("Base", {0.1, 0.1, 0.02}), {0, 0, 0.01}},
                                {box_body("Above", {0.02, 0.03, 0.01}), {0, 0, 0.05}},
                                {box_body("Sheet", {0.02, 0.03, 0.0004}), {0.03, 0, 0.05}},
                                {box_body("Beside", {0.02, 0.03, 0.01}), {0.03, 0, 0.025}}});
  product.contacts = find_contacts(product);
  const Disassembly plan = take_apart(product);
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_THAT(names_of(robot), testing::UnorderedElementsAre("lift Above", "lift Sheet", "lift Beside"));
  test::TemporaryDirectory directory;
  const CellFiles files = write_cell(product, plan, hierarchy(product, plan), directory / "cell", &robot);
  for (const char* name : {"Above", "Sheet"})
    EXPECT_THAT(files.notes,
                testing::Contains(HasSubstr("no part or post holds " + std::string(name) + " at level 1")));
  EXPECT_THAT(files.notes, testing::Not(testing::Contains(HasSubstr("holds Beside"))));
  EXPECT_EQ(read_scenario(files.scenario).expected.size(), 4U);
  expect_round_trip(product, plan, robot);
}

TEST(RobotPlan, WhatFindsNoGraspStaysAndOthersLeave) {
  auto bodies = pit();
  Body ring = plate_with_hole("Ring", 0.05, 0.02, 0.022);
  ring.material.density_kg_m3 = 19300.0;  // too heavy for a cup that finds place beside the hole
  bodies.emplace_back(std::move(ring), Vec3(0, 0, 0.07));
  bodies.emplace_back(box_body("Below", {0.05, 0.05, 0.005}), Vec3(0, 0, 0.0575));
  bodies.emplace_back(box_body("Lowest", {0.05, 0.05, 0.005}), Vec3(0, 0, 0.0525));
  bodies.emplace_back(box_body("Free", {0.02, 0.03, 0.02}), Vec3(0.08, 0.02, 0.10));
  Product product = product_of(std::move(bodies));
  product.contacts = find_contacts(product);
  const Disassembly plan = lifting(product, {{5}, {6}, {7}, {8}});
  const RobotPlan robot = plan_robot(product, plan);
  EXPECT_THAT(names_of(robot), ElementsAre("lift Free"));
  EXPECT_THAT(robot.notes,
              ElementsAre(testing::AllOf(HasSubstr("does not lift Ring: at its faces the gripper meets "),
                                         HasSubstr("; the cup meets ")),
                          HasSubstr("does not lift Below: Ring is in the way; nor Lowest")));
  expect_round_trip(product, plan, robot);
}

TEST(RobotPlan, WhatWouldFallKeepsWhatHoldsIt) {
  // The wide plate is held by the block below alone; nothing can hold the plate.
  auto bodies = pit();
  bodies.resize(1);
  bodies.emplace_back(box_body("Block", {0.03, 0.03, 0.03}), Vec3(0, 0, 0.065));
  bodies.emplace_back(turned_body("Cone", {0.0, 0.001}, {0.012}), Vec3(0, 0, 0.08));
  bodies.emplace_back(box_body("Beside", {0.03, 0.03, 0.03}), Vec3(0.06, 0, 0.065));
  Product product = product_of(std::move(bodies));
  product.contacts = find_contacts(product);
  Contact contact;
  contact.first = 1, contact.second = 2, contact.kind = ContactKind::plane;
  contact.normals_W = {Vec3::UnitZ()};
  product.contacts.push_back(contact);
  Disassembly plan = lifting(product, {{2}, {1}, {3}});
  plan.steps[1].direction_W = Vec3::UnitX();
  const RobotPlan robot = plan_robot(product, plan, {{2, "it is refused"}});
  EXPECT_THAT(names_of(robot), ElementsAre("lift Beside"));
  EXPECT_THAT(robot.notes, ElementsAre(HasSubstr("does not lift Cone: it is refused"),
                                       HasSubstr("does not lift Block: Cone would fall")));
}

}  // namespace
}  // namespace takt::product
