// The block scenario in reverse at LoD 1: the assembly is carried to Table1 and taken apart. Final places
// against those from which the assembly starts, the holders at every step, times of contacts, clearance
// between the robots, and the loads that follow from statics.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <set>
#include <tuple>

#include "server/contact/collision/collision_world.h"
#include "tests/support/arm_capsules.h"
#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

using test::BlockRun;
using test::kC_in_B;
using test::kGravity_m_s2;
using test::kO_in_B;
using test::kP_in_O;

// Close and open commands of the program.
constexpr double kCloseB_s = 4.0, kOpenB_s = 11.0;
constexpr double kCloseO_s = 17.5, kOpenO_s = 24.5;
constexpr double kCloseC_s = 26.0, kOpenC_s = 34.5;
constexpr double kCloseP_s = 28.5, kOpenP_s = 34.0;
// The controller acts in the first of its periods not before the time given.
constexpr double kPeriod_s = 0.008;
constexpr double kJawTime_s = 0.4;  // between a gripper's command and the robot's next motion

/// When two components touched, as sampled.
struct Touch {
  double first_s, last_s;
  int samples;
};

constexpr std::uint64_t kTouchEvery = 5, kArmsEvery = 40;  // steps

/// Records quantities that a run itself does not: contacts of parts with each other, tables, pads and gripper
/// bodies, the distance of the robots, and their rest.
class Watch {
 public:
  void operator()(const CellModel& cell, const Snapshot& snapshot) {
    std::array<bool, 2> rests{};
    for (std::size_t i = 0; i < 2; ++i) {
      const JointArray& speed = snapshot.robots[i].velocity;
      rests[i] = std::all_of(speed.begin(), speed.end(), [](double v) { return v == 0.0; });
    }
    rests_.push_back(rests);
    if (snapshot.step % kTouchEvery == 0) look_for_touches(cell, snapshot);
    if (snapshot.step % kArmsEvery == 0) look_at_arms(cell, snapshot);
  }

  const std::map<std::string, Touch>& touches() const { return touches_; }
  double nearest_m() const { return nearest_; }
  double lowest_m() const { return lowest_; }
  /// Whether a robot stands still in all steps of [from, to).
  bool rests(std::size_t robot, std::size_t from, std::size_t to) const {
    for (std::size_t k = from; k < to; ++k) {
      if (!rests_.at(k - 1)[robot]) return false;
    }
    return true;
  }

 private:
  void look_for_touches(const CellModel& cell, const Snapshot& snapshot) {
    const std::vector<Component>& components = cell.components;
    if (!collision_world_) {
      collision_world_ = std::make_unique<CollisionWorld>(components, cell.interaction.contact_margin_m);
      for (std::size_t i = 0; i < components.size(); ++i) {
        if (components[i].role != GripperRole::palm) continue;
        // The gripper's body, where the simulation has the space between the jaws.
        collision_world_->set_shape(static_cast<int>(i),
                                    ConvexShape::from_points(std::vector<Vec3>(8, Vec3::Zero())));
        collision_world_->set_box(static_cast<int>(i), {-0.040, -0.085, 0.0}, {0.040, 0.085, 0.080});
      }
    }
    for (std::size_t i = 0; i < components.size(); ++i) {
      const ComponentSample& s = snapshot.components[i];
      collision_world_->set_pose(static_cast<int>(i), Pose::from_quaternion(s.p_WB, s.q_WB));
    }
    for (std::size_t a = 0; a < components.size(); ++a) {
      for (std::size_t b = a + 1; b < components.size(); ++b) {
        const Component &A = components[a], &B = components[b];
        if (A.type == ComponentType::ground && B.type == ComponentType::ground) continue;
        if (A.gripper != -1 && A.gripper == B.gripper) continue;
        DetectionCounts calls;
        const int first = static_cast<int>(a), second = static_cast<int>(b);
        if (!collision_world_->boxes_overlap(first, second) ||
            !collision_world_->shapes_overlap(first, second, calls))
          continue;
        const std::string pair = std::min(A.name, B.name) + " " + std::max(A.name, B.name);
        Touch& touch = touches_.try_emplace(pair, Touch{snapshot.time_s, 0.0, 0}).first->second;
        touch.last_s = snapshot.time_s;
        ++touch.samples;
      }
    }
  }

  void look_at_arms(const CellModel& cell, const Snapshot& snapshot) {
    std::array<std::vector<test::Capsule>, 2> arms;
    for (std::size_t i = 0; i < 2; ++i) {
      const RobotDescription& robot = cell.description.robots[i];
      arms[i] = test::arm_capsules(robot.arm, robot.X_WR, snapshot.robots[i].position);
      for (std::size_t k = 0; k < test::kCapsulesBeforePads; ++k) {
        lowest_ = std::min({lowest_, arms[i][k].a.z(), arms[i][k].b.z()});
      }
    }
    nearest_ = std::min(nearest_, test::distance(arms[0], arms[1]));
  }

  std::unique_ptr<CollisionWorld> collision_world_;
  std::map<std::string, Touch> touches_;
  std::vector<std::array<bool, 2>> rests_;
  double nearest_ = 1e9, lowest_ = 1e9;
};

struct WatchedRun {
  BlockRun run;
  Watch watch;
};

WatchedRun watched_run(const std::vector<std::string>& overrides = {}) {
  WatchedRun r;
  r.run = test::run_block_scenario("block_disassembly", overrides,
                                   [&](const CellModel& cell, const Snapshot& s) { r.watch(cell, s); });
  return r;
}

const WatchedRun& watched() {
  static const WatchedRun r = watched_run();
  return r;
}
const BlockRun& whole_disassembly() {
  return watched().run;
}

void expect_ends_where_the_assembly_starts(const BlockRun& r) {
  ASSERT_EQ(r.result.fault, "");
  EXPECT_NEAR(r.result.final_state.time_s, 42.0, 1e-9);
  EXPECT_EQ(r.lost_part_steps, 0U);
  ASSERT_EQ(r.scenario.expected.size(), 4U);
  for (const ExpectedPose& expected : r.scenario.expected) {
    const ComponentSample& sample = r.sample(r.result.final_state, expected.part);
    EXPECT_LE(pose_error(sample, expected.X_WB).position_m, 1e-6) << expected.part;
    EXPECT_LE(pose_error(sample, expected.X_WB).angle_rad, 1e-6) << expected.part;
    EXPECT_EQ(sample.partner, r.id("Table1")) << expected.part;
  }
}

/// The part, its previous holder, its holder, and the time.
using Change = std::tuple<std::string, std::string, std::string, double>;

std::vector<Change> changes(const BlockRun& r) {
  std::vector<Change> all;
  const auto name = [&](int id) {
    return id < 0 ? "" : r.cell->components[static_cast<std::size_t>(id)].name;
  };
  for (const ConnectionChange& c : r.result.changes) {
    all.emplace_back(name(c.part), name(c.from), name(c.to), c.time_s);
  }
  return all;
}

TEST(BlockDisassembly, ItIsTheReverseOfTheAssembly) {
  const std::filesystem::path scenarios = std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios";
  const Scenario assembly = read_scenario(scenarios / "block_assembly.yaml");
  const Scenario disassembly = read_scenario(scenarios / "block_disassembly.yaml");
  const auto match = [](const Scenario& start, const Scenario& end) {
    ASSERT_EQ(start.parts.size(), 4U);
    ASSERT_EQ(end.expected.size(), 4U);
    for (const ExpectedPose& expected : end.expected) {
      const auto part = std::find_if(start.parts.begin(), start.parts.end(),
                                     [&](const auto& p) { return p.name == expected.part; });
      ASSERT_NE(part, start.parts.end()) << expected.part;
      EXPECT_LE((part->X_WB.p - expected.X_WB.p).norm(), 1e-12) << expected.part;
      EXPECT_LE((part->X_WB.R - expected.X_WB.R).norm(), 1e-12) << expected.part;
    }
  };
  match(disassembly, assembly);
  match(assembly, disassembly);
}

TEST(BlockDisassembly, PartsEndAtTheAnalyticPlacesAndNoPartIsLost) {
  expect_ends_where_the_assembly_starts(whole_disassembly());
  for (const ExpectedPose& expected : whole_disassembly().scenario.expected) {
    EXPECT_EQ(whole_disassembly().sample(whole_disassembly().result.final_state, expected.part).state,
              PartState::placed)
        << expected.part;
  }
}

TEST(BlockDisassembly, PartsChangeHandsAtTheIntendedTimesOnly) {
  using testing::DoubleNear;
  using testing::FieldsAre;
  std::vector<testing::Matcher<Change>> expected;
  const auto expect = [&](const char* part, const char* from, const char* to, double time_s) {
    expected.push_back(FieldsAre(part, from, to, DoubleNear(time_s, kPeriod_s)));
  };
  for (const char* part : {"P", "C", "O", "B"}) {
    expect(part, "", "Table2", 0.0);
    expect(part, "Table2", "Gripper2", kCloseB_s);
    expect(part, "Gripper2", "Table1", kOpenB_s);
  }
  // P rides with O: both are held by Gripper1, directly.
  for (const char* part : {"P", "O"}) {
    expect(part, "Table1", "Gripper1", kCloseO_s);
    expect(part, "Gripper1", "Table1", kOpenO_s);
  }
  expect("C", "Table1", "Gripper2", kCloseC_s);
  expect("C", "Gripper2", "Table1", kOpenC_s);
  expect("P", "Table1", "Gripper1", kCloseP_s);
  expect("P", "Gripper1", "Table1", kOpenP_s);
  EXPECT_THAT(changes(whole_disassembly()), testing::UnorderedElementsAreArray(expected));
}

TEST(BlockDisassembly, RobotsRestWhenPartsChangeHands) {
  const BlockRun& r = whole_disassembly();
  int looked_at = 0;
  for (const ConnectionChange& c : r.result.changes) {
    for (const int holder : {c.from, c.to}) {
      const int gripper = holder < 0 ? -1 : r.cell->components[static_cast<std::size_t>(holder)].gripper;
      if (gripper < 0) continue;
      const int robot = r.cell->description.grippers[static_cast<std::size_t>(gripper)].robot;
      EXPECT_TRUE(watched().watch.rests(static_cast<std::size_t>(robot), c.step - 100, c.step + 300))
          << "Robot" << robot + 1 << " at " << c.time_s << " s";
      ++looked_at;
    }
  }
  EXPECT_EQ(looked_at, 16);
}

TEST(BlockDisassembly, PartsPassTheirMarks) {
  const BlockRun& r = whole_disassembly();
  const auto is_in = [&](double t, const char* part, const char* base, const Vec3& seat) {
    EXPECT_LE((r.relative(r.mark(t), part, base) - seat).norm(), 1e-6)
        << part << " in " << base << " at " << t;
  };
  const auto is_above = [&](double t, const char* part, const char* base, const Vec3& seat, double rim) {
    const Vec3 p = r.relative(r.mark(t), part, base);
    EXPECT_LE((p - seat).head<2>().norm(), 1e-6) << part << " above " << base << " at " << t;
    EXPECT_GT(p.z(), rim) << part << " above " << base << " at " << t;
  };
  is_in(10.9, "C", "B", kC_in_B);
  is_in(10.9, "O", "B", kO_in_B);
  is_in(10.9, "P", "O", kP_in_O);
  is_in(20.4, "C", "B", kC_in_B);
  is_above(20.4, "O", "B", kO_in_B, 0.060);
  is_in(20.4, "P", "O", kP_in_O);
  is_in(24.4, "C", "B", kC_in_B);
  is_in(24.4, "P", "O", kP_in_O);
  is_above(30.5, "C", "B", kC_in_B, 0.060);
  is_above(30.5, "P", "O", kP_in_O, 0.080);
}

TEST(BlockDisassembly, PartsTouchOnlyWhatTheProgramIntends) {
  const std::map<std::string, Touch>& touches = watched().watch.touches();
  std::set<std::string> pairs;
  for (const auto& [pair, touch] : touches) {
    pairs.insert(pair);
    // Without a gap: separated parts stay separated.
    EXPECT_NEAR(touch.last_s - touch.first_s, 0.001 * kTouchEvery * (touch.samples - 1), 1e-6) << pair;
  }
  std::set<std::string> expected{"B Table2", "B C",      "B O",      "O P",
                                 "B Table1", "O Table1", "C Table1", "P Table1"};
  const auto& grippers = whole_disassembly().cell->description.grippers;
  const auto jaw = [&](std::size_t gripper, bool left) {
    const auto& g = grippers[gripper];
    return whole_disassembly()
        .cell->components[static_cast<std::size_t>(left ? g.left_jaw : g.right_jaw)]
        .name;
  };
  struct Grip {
    std::size_t gripper;
    std::string part;
    double close_s, open_s;
  };
  const std::vector<Grip> grips{{1, "B", kCloseB_s, kOpenB_s},
                                {0, "O", kCloseO_s, kOpenO_s},
                                {1, "C", kCloseC_s, kOpenC_s},
                                {0, "P", kCloseP_s, kOpenP_s}};
  const auto touch_of = [&](const std::string& a, const std::string& b) {
    const auto found = touches.find(std::min(a, b) + " " + std::max(a, b));
    return found == touches.end() ? Touch{-1.0, -1.0, 0} : found->second;
  };
  for (const Grip& grip : grips) {
    for (const bool left : {true, false}) {
      const std::string name = jaw(grip.gripper, left);
      expected.insert(std::min(name, grip.part) + " " + std::max(name, grip.part));
      // The jaws stood 15 mm off on each side and travel 75 mm/s (chamfered parts are up to 1 mm narrower).
      EXPECT_NEAR(touch_of(name, grip.part).first_s, grip.close_s + 0.2, 0.03) << name << " " << grip.part;
      EXPECT_NEAR(touch_of(name, grip.part).last_s, grip.open_s, 0.03) << name << " " << grip.part;
    }
  }
  EXPECT_EQ(pairs, expected);

  // A part leaves its seat when it is lifted, and stands on the table before it is let go.
  const auto leaves = [&](const char* part, const char* seat, double close_s) {
    EXPECT_GT(touch_of(part, seat).last_s, close_s + kJawTime_s) << part << " " << seat;
    EXPECT_LT(touch_of(part, seat).last_s, close_s + kJawTime_s + 0.2) << part << " " << seat;
  };
  const auto arrives = [&](const char* part, double close_s, double open_s) {
    EXPECT_GT(touch_of(part, "Table1").first_s, close_s + kJawTime_s) << part;
    EXPECT_LT(touch_of(part, "Table1").first_s, open_s) << part;
    EXPECT_NEAR(touch_of(part, "Table1").last_s, 42.0, 1e-9) << part;
  };
  leaves("B", "Table2", kCloseB_s);
  leaves("O", "B", kCloseO_s);
  leaves("C", "B", kCloseC_s);
  leaves("P", "O", kCloseP_s);
  arrives("B", kCloseB_s, kOpenB_s);
  arrives("O", kCloseO_s, kOpenO_s);
  arrives("C", kCloseC_s, kOpenC_s);
  arrives("P", kCloseP_s, kOpenP_s);
}

TEST(BlockDisassembly, RobotsKeepClearOfEachOtherAndOfTheTables) {
  RecordProperty("nearest_mm", static_cast<int>(1000.0 * watched().watch.nearest_m()));
  EXPECT_GT(watched().watch.nearest_m(), 0.05);
  EXPECT_GT(watched().watch.lowest_m(), 0.7 + 0.1);
}

TEST(BlockDisassembly, LoadsAtRestAreThoseOfStatics) {
  const BlockRun& r = whole_disassembly();
  struct Load {
    double time_s;
    const char* gripper;
    std::vector<std::string> parts;
    double mass_kg;
  };
  for (const Load& load :
       {Load{10.9, "Gripper2", {"P", "C", "O", "B"}, 2.6}, Load{20.4, "Gripper1", {"P", "O"}, 1.1},
        Load{30.5, "Gripper2", {"C"}, 0.5}, Load{30.5, "Gripper1", {"P"}, 0.3}}) {
    const Snapshot& s = r.mark(load.time_s);
    const Wrench& F = r.sample(s, load.gripper).F_Bo_W;
    EXPECT_NEAR(F.f.z(), -load.mass_kg * kGravity_m_s2, 1e-6) << load.gripper << " at " << load.time_s;
    EXPECT_LE(F.f.head<2>().norm(), 1e-6) << load.gripper << " at " << load.time_s;
    const Vec3 moment = r.moment_of_weights(s, load.parts, load.gripper);
    EXPECT_LE((F.t - moment).norm(), 1e-6) << load.gripper << " at " << load.time_s;
  }
  EXPECT_GT(r.moment_of_weights(r.mark(20.4), {"P", "O"}, "Gripper1").norm(), 0.01);
}

TEST(BlockDisassembly, PartsAreTakenApartWithPlainHulls) {
  // P stands in the hull of O and reaches into that of B; O and C stand in that of B, and stay in it longer
  // than they touch B itself. A gripper is preferred to a table, and no Part rests on one of higher
  // hierarchy.
  const WatchedRun hulls = watched_run({"parts.O.convex=hull", "parts.B.convex=hull"});
  expect_ends_where_the_assembly_starts(hulls.run);
  EXPECT_EQ(changes(hulls.run), changes(whole_disassembly()));
  EXPECT_EQ(watched().watch.touches().count("B P"), 0U);
  ASSERT_EQ(hulls.watch.touches().count("B P"), 1U);
  for (const char* pair : {"B P", "B O"}) {
    EXPECT_GT(hulls.watch.touches().at(pair).last_s, kCloseO_s + kJawTime_s) << pair;
  }
  EXPECT_GT(hulls.watch.touches().at("B O").last_s, watched().watch.touches().at("B O").last_s + 0.1);
  EXPECT_GT(hulls.watch.touches().at("B C").last_s, watched().watch.touches().at("B C").last_s + 0.1);
  EXPECT_GT(hulls.watch.touches().at("O P").last_s, watched().watch.touches().at("O P").last_s + 0.1);
}

TEST(BlockDisassembly, TheLawOfTheThesisSagsATenthOfAMillimetrePerRegrasp) {
  const BlockRun r = test::run_block_scenario("block_disassembly", {"interaction.weight_feed_forward=false"});
  ASSERT_EQ(r.result.fault, "");
  EXPECT_EQ(r.lost_part_steps, 0U);
  // Each connection sags by m g / k = 0.1 mm. All hang on Table2, Gripper2, Table1 in turn; C and O on a
  // gripper and Table1 once more, P twice more.
  const std::map<std::string, int> connections{{"B", 3}, {"C", 5}, {"O", 5}, {"P", 7}};
  for (const ExpectedPose& expected : r.scenario.expected) {
    const Vec3 error = r.sample(r.result.final_state, expected.part).p_WB - expected.X_WB.p;
    EXPECT_NEAR(error.z(), -1e-4 * connections.at(expected.part), 2e-6) << expected.part;
    EXPECT_LE(error.norm(), 1e-3) << expected.part << ": the thesis' criterion (5.19)";
  }
}

TEST(BlockDisassembly, PartsAreHeldUpToTheLargestStepOfTheThesis) {
  expect_ends_where_the_assembly_starts(
      test::run_block_scenario("block_disassembly", {"solver.step_s=0.005"}));
}

TEST(BlockDisassembly, RepeatedRunsGiveTheSameBits) {
  const BlockRun second = test::run_block_scenario("block_disassembly");
  EXPECT_EQ(second.result.final_state.state_hash, whole_disassembly().result.final_state.state_hash);
}

}  // namespace
}  // namespace takt
