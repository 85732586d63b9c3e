// The block scenario explained: the holders of P, O and C and their sequences (thesis 3.5.2, (3.32) to
// (3.37)), at the times of its figures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct ExplainedRun {
  std::shared_ptr<const CellModel> cell;
  std::map<std::pair<double, std::string>, Explanation> at;
  std::map<double, Snapshot> snapshots;

  const Explanation& explain(double t, const std::string& part) const { return at.at({t, part}); }
  const std::string& name(int id) const {
    static const std::string none = "-";
    return id < 0 ? none : cell->components[static_cast<std::size_t>(id)].name;
  }
  std::vector<std::string> sequences(const Explanation& e) const {
    std::vector<std::string> result;
    for (const std::vector<int>& sequence : e.sequences.sequences) {
      std::string text;
      for (const int id : sequence) text += (text.empty() ? "" : ",") + name(id);
      result.push_back(text);
    }
    return result;
  }
};

/// `hulls`: plain convex hulls as in the thesis, where P overlaps that of B.
ExplainedRun run_explained(bool hulls) {
  ExplainedRun result;
  ScenarioOptions options;
  if (hulls) options.overrides = {"parts.O.convex=hull", "parts.B.convex=hull"};
  const Scenario scenario =
      read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "block_assembly.yaml", options);
  result.cell = build_cell(scenario);
  Simulation simulation(result.cell);
  HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  const HeadlessResult end = run_headless(simulation, scenario, headless, [&](const Simulation& s) {
    for (const double t : {0.0, 9.8, 20.5, 25.0, 38.0, 41.0}) {
      if (s.step_index() != static_cast<std::uint64_t>(std::llround(t / 0.001))) continue;
      result.snapshots[t] = s.make_snapshot();
      for (const char* part : {"P", "O", "C", "B"}) {
        result.at[{t, part}] = s.explain(result.cell->description.find_component(part));
      }
    }
  });
  EXPECT_EQ(end.fault, "");
  return result;
}

const ExplainedRun& with_hulls() {
  static const ExplainedRun r = run_explained(true);
  return r;
}
const ExplainedRun& with_decomposition() {
  static const ExplainedRun r = run_explained(false);
  return r;
}

void expect(const ExplainedRun& r, const Explanation& e, const std::string& partner, PartnerRule rule,
            const std::string& rival) {
  EXPECT_EQ(r.name(e.decision.partner), partner);
  EXPECT_EQ(to_string(e.decision.rule), to_string(rule));
  EXPECT_EQ(r.name(e.decision.rival), rival);
}

TEST(BlockExplanation, PartsStandOnTheirTablesAtTheStart) {
  const ExplainedRun& r = with_decomposition();
  for (const char* part : {"P", "O", "C", "B"}) {
    const Explanation& e = r.explain(0.0, part);
    EXPECT_EQ(e.state, PartState::placed);
    expect(r, e, "Table1", PartnerRule::only_end, "-");
    EXPECT_EQ(e.since.time_s, 0.0);
    EXPECT_EQ(e.since.before, -1);
    EXPECT_THAT(r.sequences(e), ElementsAre(std::string(part) + ",Table1"));
  }
}

TEST(BlockExplanation, PIsInOAndHeldByItsGripperWhileOStands) {
  const ExplainedRun& r = with_decomposition();
  const Explanation& p = r.explain(9.8, "P");
  EXPECT_EQ(p.state, PartState::grasped);
  expect(r, p, "Gripper1", PartnerRule::end_type, "Table1");
  EXPECT_THAT(r.sequences(p), ElementsAre("P,Gripper1", "P,O,Table1"));
  EXPECT_NEAR(p.since.time_s, 3.8, 0.05);
  EXPECT_EQ(r.name(p.since.before), "Table1");
  const Explanation& o = r.explain(9.8, "O");
  EXPECT_EQ(o.state, PartState::assembled);
  EXPECT_EQ(r.name(o.state_because), "P");
  expect(r, o, "Table1", PartnerRule::only_end, "-");
  EXPECT_EQ(o.since.time_s, 0.0);
  const Explanation& c = r.explain(9.8, "C");
  EXPECT_EQ(c.state, PartState::grasped);
  expect(r, c, "Gripper2", PartnerRule::only_end, "-");
  EXPECT_THAT(r.sequences(c), ElementsAre("C,Gripper2"));
  EXPECT_NEAR(c.since.time_s, 4.9, 0.05);
  // The arm stands: the force is C's weight. (5.21) without the gripper's own mass.
  ASSERT_EQ(c.connections.size(), 1U);
  EXPECT_NEAR(c.connections[0].on_base_W.f.z(), 0.5 * test::kGravity_m_s2, 1e-6);
}

TEST(BlockExplanation, ThePartnerNeedNotTouchThePart) {
  const ExplainedRun& r = with_decomposition();
  // P stands between the jaws that grip O, and neither of them touches it.
  const Explanation& carried = r.explain(20.5, "P");
  EXPECT_EQ(carried.state, PartState::grasped);
  expect(r, carried, "Gripper1", PartnerRule::only_end, "-");
  EXPECT_THAT(r.sequences(carried), ElementsAre("P,O,Gripper1"));
  // The jaws grip B, in which O is; B stands on Table2 already.
  const Explanation& p = r.explain(38.0, "P");
  EXPECT_EQ(p.state, PartState::grasped);
  expect(r, p, "Gripper2", PartnerRule::end_type, "Table2");
  EXPECT_THAT(r.sequences(p), ElementsAre("P,O,B,Gripper2", "P,O,B,Table2"));
  std::vector<std::string> pairs;
  for (const ExplainedContact& c : p.contacts) pairs.push_back(r.name(c.a) + "-" + r.name(c.b));
  EXPECT_THAT(pairs, ElementsAre("P-O", "O-B", "B-Gripper2")) << "the contacts along the sequence";
}

TEST(BlockExplanation, TheAssemblyOnTable1IsExplained) {
  const ExplainedRun& r = with_decomposition();
  EXPECT_THAT(r.sequences(r.explain(25.0, "P")), ElementsAre("P,O,B,Table1"));
  EXPECT_THAT(r.sequences(r.explain(25.0, "O")), ElementsAre("O,B,Table1"));
  EXPECT_THAT(r.sequences(r.explain(25.0, "C")), ElementsAre("C,B,Table1"));
  for (const char* part : {"P", "O", "C"}) {
    const Explanation& e = r.explain(25.0, part);
    EXPECT_EQ(e.state, PartState::assembled);
    expect(r, e, "Table1", PartnerRule::only_end, "-");
  }
  EXPECT_NEAR(r.explain(25.0, "P").since.time_s, 22.8, 0.05);
  EXPECT_EQ(r.name(r.explain(25.0, "P").since.before), "Gripper1");
  EXPECT_NEAR(r.explain(25.0, "C").since.time_s, 11.0, 0.05);
}

TEST(BlockExplanation, PlainHullsGiveTwoSequencesToTheTable) {
  const ExplainedRun& r = with_hulls();
  for (const double t : {25.0, 41.0}) {
    const std::string table = t < 30.0 ? "Table1" : "Table2";
    const Explanation& p = r.explain(t, "P");
    expect(r, p, table, PartnerRule::only_end, "-");
    EXPECT_THAT(r.sequences(p), ElementsAre("P,B," + table, "P,O,B," + table)) << "the shorter one first";
    EXPECT_EQ(p.decision.contacts, 2);
    // P stands 10 mm deep in the convex hull of B.
    ASSERT_EQ(p.contacts.front().b, r.cell->description.find_component("B"));
    EXPECT_NEAR(p.contacts.front().depth.distance_m, -0.010, 2e-4);
  }
}

TEST(BlockExplanation, TheAssemblyIsHeldAtBAndThenStandsOnTable2) {
  const ExplainedRun& r = with_decomposition();
  for (const char* part : {"P", "O", "C", "B"}) {
    const Explanation& e = r.explain(41.0, part);
    EXPECT_EQ(e.state, PartState::assembled);
    expect(r, e, "Table2", PartnerRule::only_end, "-");
    EXPECT_NEAR(e.since.time_s, 38.2, 0.05);
    EXPECT_EQ(r.name(e.since.before), "Gripper2");
    EXPECT_EQ(r.explain(38.0, part).state, PartState::grasped);
    EXPECT_EQ(r.name(r.explain(38.0, part).decision.partner), "Gripper2");
  }
  EXPECT_THAT(describe(r.explain(41.0, "P"), r.cell->description), HasSubstr("before: Gripper2"));
}

TEST(BlockExplanation, ExplainedForcesEqualThoseOfTheSnapshot) {
  const ExplainedRun& r = with_decomposition();
  for (const auto& [key, e] : r.at) {
    if (e.connections.empty() || e.held_count > 0) continue;
    const auto& sample = r.snapshots.at(key.first).components[static_cast<std::size_t>(e.component)];
    EXPECT_LE((e.connections[0].on_base_W.f - sample.F_Bo_W.f).norm(), 1e-12) << key.second;
  }
}

}  // namespace
}  // namespace takt
