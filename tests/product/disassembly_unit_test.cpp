// Orders of disassembly, hierarchies, convex pieces, and the cell that is written from them.
#include "server/product/disassembly.h"

#include <gmock/gmock.h>

#include <set>

#include "server/product/cell_writer.h"
#include "server/product/contacts.h"
#include "server/product/convex_pieces.h"
#include "server/product/overlaps.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/product_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::product {
namespace {

using test::box_body;
using test::plate_with_hole;
using test::product_of;
using test::turned_body;
using testing::ElementsAre;

std::vector<std::string> names(const Product& product, const std::vector<std::size_t>& parts) {
  std::vector<std::string> result;
  for (const std::size_t i : parts) result.push_back(product.instances[i].name);
  return result;
}

Disassembly plan_of(Product& product) {
  product.contacts = find_contacts(product);
  return take_apart(product);
}

/// Base plate with a hole, a lid on it, a bolt through both with a nut below.
Product bolted() {
  return product_of({{plate_with_hole("Base", 0.10, 0.02, 0.00505), {0, 0, 0.03}},
                     {plate_with_hole("Lid", 0.06, 0.01, 0.00505), {0, 0, 0.045}},
                     {turned_body("Bolt", {-0.05, 0.0, 0.006}, {0.005, 0.0085}), {0, 0, 0.05}},
                     {plate_with_hole("Nut", 0.017, 0.008, 0.005), {0, 0, 0.016}}});
}

TEST(DisassemblyOrder, WhatNoMotionPartsIsHeldByItsNeighboursToo) {
  // Boxes within each other from the base to the end, which the file names second.
  Product product = product_of({{box_body("Middle", {0.06, 0.02, 0.02}), {0.07, 0, 0.05}},
                                {box_body("End", {0.06, 0.03, 0.03}), {0.11, 0, 0.05}},
                                {box_body("Base", {0.1, 0.1, 0.1}), {0, 0, 0.05}}});
  const auto touch = [](std::size_t first, std::size_t second) {
    Contact contact;
    contact.first = first, contact.second = second;
    contact.area_m2 = 1e-4;
    contact.normals_W = {Vec3::UnitX()};
    return contact;
  };
  product.contacts = {touch(0, 1), touch(0, 2)};
  const Disassembly plan = take_apart(product);
  ASSERT_EQ(plan.stuck.size(), 1U);
  EXPECT_EQ(plan.stuck[0].size(), 3U);
  EXPECT_THAT(names(product, plan.order), ElementsAre("End", "Middle", "Base"));
  const Hierarchy numbers = hierarchy(product, plan);
  EXPECT_THAT(numbers.numbers, ElementsAre(2, 1, 3));
  EXPECT_TRUE(numbers.floating.empty());
}

TEST(DisassemblyOrder, TheBaseIsOneThatThePlateOrAPostCanCarry) {
  // The block has 1.9 times the mass of the plate below it, which hides it from below.
  Product product = product_of({{box_body("Block", {0.08, 0.08, 0.06}), {0, 0, 0.05}},
                                {box_body("Plate", {0.1, 0.1, 0.02}), {0, 0, 0.01}}});
  product.contacts = find_contacts(product);
  const Disassembly plan = take_apart(product);
  EXPECT_EQ(plan.base, 1U);
  ASSERT_EQ(plan.steps.size(), 1U);
  EXPECT_GT(plan.steps[0].direction_W.z(), 0.999);
  // Feet that are too light for a base leave the block where it is.
  product = product_of({{box_body("Block", {0.08, 0.08, 0.06}), {0, 0, 0.05}},
                        {box_body("Foot", {0.08, 0.08, 0.01}), {0, 0, 0.015}}});
  product.contacts = find_contacts(product);
  EXPECT_EQ(take_apart(product).base, 0U);
}

TEST(DisassemblyOrder, FastenersLeaveFirst) {
  Product product = bolted();
  const Disassembly plan = plan_of(product);
  EXPECT_EQ(product.instances[plan.base].name, "Base");
  EXPECT_THAT(names(product, plan.order), ElementsAre("Nut", "Bolt", "Lid", "Base"));
  EXPECT_EQ(plan.steps.at(0).loosening, Loosening::unscrew);
  EXPECT_LT((plan.steps[0].direction_W + Vec3::UnitZ()).norm(), 1e-9);
  EXPECT_LT((plan.steps.at(1).direction_W - Vec3::UnitZ()).norm(), 1e-9);
  EXPECT_LT((plan.steps.at(2).direction_W - Vec3::UnitZ()).norm(), 1e-9);
  EXPECT_TRUE(plan.stuck.empty());
}

TEST(DisassemblyOrder, EachPartTouchesOneOfALargerNumberThatLeavesLater) {
  Product product = bolted();
  const Hierarchy numbers = hierarchy(product, plan_of(product));
  EXPECT_THAT(numbers.numbers, ElementsAre(4, 3, 2, 1));
  EXPECT_TRUE(numbers.floating.empty());
}

TEST(DisassemblyOrder, AnInterferenceFitIsPulledAlongItsAxis) {
  Product product = product_of({{plate_with_hole("Hub", 0.06, 0.02, 0.008 - 12e-6), {0, 0, 0}},
                                {turned_body("Pin", {-0.01, 0.02}, {0.008}), {0, 0, 0}}});
  const Disassembly plan = plan_of(product);
  ASSERT_EQ(plan.steps.size(), 1U);
  EXPECT_EQ(plan.steps[0].loosening, Loosening::pull);
  EXPECT_THAT(plan.steps[0].reason, testing::HasSubstr("interference of 12 um"));
  EXPECT_GT(std::abs(plan.steps[0].direction_W.z()), 0.999);
}

/// A ring on a spool: both heads are wider than the hole.
Product spool(double head_m) {
  return product_of({{turned_body("Spool", {0.0, 0.01, 0.03, 0.04}, {head_m, 0.0099, head_m}), {0, 0, 0}},
                     {plate_with_hole("Ring", 0.026, 0.0198, 0.010), {0, 0, 0.02}}});
}

TEST(DisassemblyOrder, WhatNoStraightMotionPartsIsSaid) {
  Product product = spool(0.02);
  const Disassembly plan = plan_of(product);
  ASSERT_EQ(plan.stuck.size(), 1U);
  EXPECT_THAT(names(product, plan.stuck[0]), ElementsAre("Spool", "Ring"));
  EXPECT_TRUE(plan.steps.empty());
}

TEST(DisassemblyOrder, SmallUndercutsAreSnaps) {
  Product product = spool(0.0103);
  const Disassembly plan = plan_of(product);
  ASSERT_EQ(plan.steps.size(), 1U);
  EXPECT_EQ(plan.steps[0].loosening, Loosening::unsnap);
  EXPECT_GT(std::abs(plan.steps[0].direction_W.z()), 0.999);
  EXPECT_TRUE(plan.stuck.empty());
}

TEST(DisassemblyOrder, PartsThatHoldEachOtherLeaveTogether) {
  // A pin through two cheeks: the cheeks stand on the base between two stops, the pin lies across them.
  Product product = product_of({{box_body("Base", {0.2, 0.2, 0.02}), {0, 0, 0.01}},
                                {box_body("Lower", {0.05, 0.05, 0.02}), {0, 0, 0.03}},
                                {box_body("Left", {0.01, 0.05, 0.04}), {-0.03, 0, 0.04}},
                                {box_body("Right", {0.01, 0.05, 0.04}), {0.03, 0, 0.04}},
                                {box_body("Roof", {0.07, 0.05, 0.01}), {0, 0, 0.065}}});
  const Disassembly plan = plan_of(product);
  EXPECT_TRUE(plan.stuck.empty());
  EXPECT_EQ(plan.order.size(), 5U);
  EXPECT_EQ(plan.order.back(), 0U);
  EXPECT_THAT(names(product, plan.steps.at(0).parts), ElementsAre("Roof"));
}

TEST(ConvexPieces, AreExactWhereTheyCanBe) {
  EXPECT_EQ(choose_convex(box_body("b", {0.1, 0.2, 0.3})).method, ConvexMethod::hull);
  const ConvexChoice plate = choose_convex(plate_with_hole("p", 0.06, 0.01, 0.02));
  EXPECT_EQ(plate.method, ConvexMethod::pieces);
  EXPECT_LT(plate.error, 1e-6);
  EXPECT_LT(plate.pieces.size(), 2U * test::kRoundSides);
  const ConvexChoice bolt = choose_convex(turned_body("t", {0.0, 0.006, 0.04}, {0.0085, 0.005}));
  EXPECT_EQ(bolt.method, ConvexMethod::pieces);
  EXPECT_EQ(bolt.pieces.size(), 2U);
  EXPECT_LT(bolt.error, 1e-6);
}

TEST(Disassembly, NothingStaysBehindWithoutContactToTheBase) {
  // A gusset in the corner of a frame, off the ground: it leaves upwards along its walls, which leave more easily.
  Product product = product_of({{box_body("Base", {0.2, 0.2, 0.02}), {0, 0, 0}},
                                {box_body("West", {0.01, 0.2, 0.1}), {-0.095, 0, 0.06}},
                                {box_body("East", {0.01, 0.2, 0.1}), {0.095, 0, 0.06}},
                                {box_body("South", {0.18, 0.01, 0.1}), {0, -0.095, 0.06}},
                                {box_body("North", {0.18, 0.01, 0.1}), {0, 0.095, 0.06}},
                                {box_body("Gusset", {0.02, 0.02, 0.01}), {-0.08, -0.08, 0.06}}});
  const Disassembly plan = plan_of(product);
  ASSERT_EQ(plan.steps.size(), 5U);
  std::set<std::size_t> rest{0, 1, 2, 3, 4, 5};
  for (const RemovalStep& step : plan.steps) {
    for (const std::size_t part : step.parts) rest.erase(part);
    std::set<std::size_t> joined{plan.base};
    for (std::size_t before = 0; before != joined.size();) {
      before = joined.size();
      for (const Contact& contact : product.contacts)
        if (rest.contains(contact.first) && rest.contains(contact.second) &&
            (joined.contains(contact.first) || joined.contains(contact.second)))
          joined.insert({contact.first, contact.second});
    }
    EXPECT_EQ(joined, rest) << product.instances[step.parts[0]].name;
  }
  const Hierarchy numbers = hierarchy(product, plan);
  EXPECT_THAT(numbers.floating, testing::IsEmpty());
  EXPECT_LT(numbers.numbers[5], std::max(numbers.numbers[1], numbers.numbers[3])) << "a wall holds it";
}

TEST(WrittenCell, LoadsAndStandsStill) {
  test::TemporaryDirectory directory;
  Product product = bolted();
  const Disassembly plan = plan_of(product);
  const CellFiles files = write_cell(product, plan, hierarchy(product, plan), directory / "cell");
  const Scenario scenario = read_scenario(files.scenario);
  const auto cell = build_cell(scenario);
  for (const ImportNote& note : cell->import_notes) EXPECT_FALSE(note.shapes.has_value()) << note.sentence;
  Simulation simulation(cell);
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(simulation.step({}));
  const Snapshot snapshot = simulation.make_snapshot();
  for (const Instance& instance : product.instances) {
    const auto id = static_cast<std::size_t>(cell->description.find_component(instance.name));
    EXPECT_LT((snapshot.components[id].p_WB - instance.X_WB.p).norm(), 2e-4) << instance.name;
    EXPECT_GE(snapshot.components[id].partner, 0) << instance.name;
  }
}

TEST(WrittenCell, LoadsWithNutsThatAreBoredToTheCore) {
  // The nut's hole is 1.2 mm narrower than the bolt, more than the load allows for two Parts that no joint joins.
  Product product = product_of({{plate_with_hole("Base", 0.10, 0.02, 0.00505), {0, 0, 0.03}},
                                {turned_body("Bolt", {-0.04, 0.0, 0.006}, {0.005, 0.0085}), {0, 0, 0.04}},
                                {plate_with_hole("Nut", 0.017, 0.008, 0.0044), {0, 0, 0.016}}});
  test::TemporaryDirectory directory;
  const Disassembly plan = plan_of(product);
  const CellFiles files = write_cell(product, plan, hierarchy(product, plan), directory / "cell");
  Scenario scenario = read_scenario(files.scenario);
  EXPECT_EQ(scenario.allow_overlap.size(), 1U);
  EXPECT_TRUE(build_cell(scenario)->start_overlaps.empty());
  scenario.allow_overlap.clear();
  EXPECT_EQ(build_cell(scenario)->start_overlaps.size(), 1U);
}

TEST(WrittenCell, AllowsPartsThatTheFileHasInsideEachOther) {
  // By hand: a block 3 mm deep in the base, a bead 10 mm below the face of that block, a lid that touches it.
  Product product = product_of({{box_body("Base", {0.2, 0.2, 0.05}), {0, 0, 0.0}},
                                {box_body("Block", {0.05, 0.05, 0.05}), {0, 0, 0.047}},
                                {box_body("Bead", {0.01, 0.01, 0.01}), {0, 0, 0.057}},
                                {box_body("Lid", {0.05, 0.05, 0.01}), {0, 0, 0.077}}});
  product.contacts = find_contacts(product);
  const std::vector<PartOverlap> overlaps = find_overlaps(product);
  ASSERT_EQ(overlaps.size(), 2U);
  EXPECT_EQ(overlaps[0].first, 0U);
  EXPECT_EQ(overlaps[0].second, 1U);
  EXPECT_NEAR(overlaps[0].depth_m, 0.003, 1e-9);
  EXPECT_EQ(overlaps[1].first, 1U);
  EXPECT_EQ(overlaps[1].second, 2U);
  EXPECT_NEAR(overlaps[1].depth_m, 0.02, 1e-9) << "from the bead's lower corners to the sides of the block";
  const Disassembly plan = take_apart(product);
  test::TemporaryDirectory directory;
  const CellFiles files = write_cell(product, plan, hierarchy(product, plan), directory / "cell");
  EXPECT_THAT(files.notes,
              testing::Contains(testing::HasSubstr("Base stands inside Block in the file, 3 mm deep")));
  Scenario scenario = read_scenario(files.scenario);
  EXPECT_EQ(scenario.allow_overlap.size(), overlaps.size());
  Simulation simulation(build_cell(scenario));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(simulation.step({})) << "the cell runs";
  scenario.allow_overlap.clear();
  EXPECT_EQ(build_cell(scenario)->start_overlaps.size(), overlaps.size());
}

TEST(WrittenCell, PartsWithinOthersAreHeldByThem) {
  // A magnet within a block, which the file has without a pocket for it, and another one that stands out of its upper face.
  Product product = product_of({{box_body("Block", {0.1, 0.1, 0.05}), {0, 0, 0.1}},
                                {box_body("Within", {0.01, 0.02, 0.01}), {0.02, 0, 0.1}},
                                {box_body("Above", {0.01, 0.02, 0.01}), {-0.02, 0, 0.127}}});
  product.contacts = find_contacts(product);
  ASSERT_EQ(product.contacts.size(), 2U);
  for (const Contact& contact : product.contacts) {
    EXPECT_EQ(contact.first, 0U);
    EXPECT_EQ(contact.kind, ContactKind::other);
    EXPECT_FALSE(carries(contact, true)) << "the block holds the magnet";
    EXPECT_TRUE(carries(contact, false));
  }
  EXPECT_NEAR(product.contacts[0].clearance_m, -0.025, 1e-9) << "from half its height to a face of the block";
  EXPECT_NEAR(product.contacts[1].clearance_m, -0.003, 1e-9);
  const Disassembly plan = take_apart(product);
  const Hierarchy numbers = hierarchy(product, plan);
  EXPECT_EQ(numbers.numbers, (std::vector<int>{2, 1, 1}));
  EXPECT_THAT(numbers.floating, testing::IsEmpty());
  test::TemporaryDirectory directory;
  const CellFiles files = write_cell(product, plan, numbers, directory / "cell");
  const auto cell = build_cell(read_scenario(files.scenario));
  Simulation simulation(cell);
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(simulation.step({}));
  const Snapshot snapshot = simulation.make_snapshot();
  for (const Instance& instance : product.instances) {
    const auto id = static_cast<std::size_t>(cell->description.find_component(instance.name));
    EXPECT_LT((snapshot.components[id].p_WB - instance.X_WB.p).norm(), 2e-4) << instance.name;
  }
}

}  // namespace
}  // namespace takt::product
