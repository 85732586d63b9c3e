// Islands of bodies with steps of their own. The oracles: a cell that has one of the groups alone, and a cell that is one
// island because a force element acts in it.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "plant_models/device_model.h"
#include "plant_models/force_element.h"
#include "tests/support/state_runs.h"
#include "tests/support/thrown_bricks.h"

namespace takt::test {
namespace {

using Model = std::shared_ptr<const CellModel>;

/// Exerts no force. The cell is one island, since a solver cannot know that.
class NoForce final : public DeviceModel, public ForceElement {
 public:
  void write_motion(double, const double*, CellMotion&) const override {}
  void set_signal(double, int, double) override {}
  void read_signals(double, const double*, const CellMotion&, std::span<double>) const override {}
  void add_wrenches(const CellMotion&, std::span<Wrench>) const override {}
};

Model as_one_island(const Model& cell) {
  auto one = std::make_shared<CellModel>(*cell);
  one->auxiliary_models.push_back({"NoForce", [] { return std::make_unique<NoForce>(); }, 0});
  one->description.devices.push_back({"NoForce", {}});
  return one;
}

void expect_same_motion(const ComponentSample& a, const ComponentSample& b, const std::string& what) {
  ASSERT_EQ(a.p_WB, b.p_WB) << what;
  ASSERT_EQ(a.q_WB.coeffs(), b.q_WB.coeffs()) << what;
  ASSERT_TRUE(a.V_WB == b.V_WB) << what;
}

const SolverStatistics& work_of(SceneRun& run) {
  return run.simulation().statistics().solver;
}

class ThrownBricks : public testing::Test {
 protected:
  Bricks bricks_;
};

// In steps of 1 ms, which no pair divides (ContactInteraction::seeing_step_s): those of all groups end together.
TEST_F(ThrownBricks, EachGroupMovesAsInACellOfItsOwnBitForBit) {
  const std::string solver = "method: rosenbrock, step_s: 0.001";
  SceneRun together(bricks_.cell(Bricks::all(), solver));
  SceneRun one(as_one_island(bricks_.cell(Bricks::all(), solver)));
  const std::vector<std::vector<Bricks::Brick>> groups{Bricks::pair(), Bricks::falling(), Bricks::above()};
  std::vector<std::unique_ptr<SceneRun>> alone;
  for (const auto& group : groups) alone.push_back(std::make_unique<SceneRun>(bricks_.cell(group, solver)));
  std::uint64_t expected_steps = 0;
  bool differs = false;
  for (int step = 0; step < 160; ++step) {
    ASSERT_TRUE(together.step() && one.step());
    std::uint64_t most = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const std::uint64_t before = work_of(*alone[g]).steps;
      ASSERT_TRUE(alone[g]->step());
      most = std::max(most, work_of(*alone[g]).steps - before);
      for (const Bricks::Brick& brick : groups[g]) {
        expect_same_motion(together.sample(brick.name), alone[g]->sample(brick.name),
                           brick.name + " in step " + std::to_string(step));
        if (HasFatalFailure()) return;
        differs = differs || together.sample(brick.name).p_WB != one.sample(brick.name).p_WB;
      }
    }
    expected_steps += most;
  }
  // The work is that of the groups, step by step that of the group with most steps.
  std::uint64_t calls = 0;
  for (const auto& run : alone) calls += run->simulation().contact_counts().made;
  EXPECT_EQ(together.simulation().contact_counts().made, calls);
  EXPECT_EQ(work_of(together).steps, expected_steps);
  // All have hit something, and one island has other steps, and more calls.
  for (const Bricks::Brick& brick : Bricks::all())
    EXPECT_GT(together.sample(brick.name).V_WB.w.norm(), 0.1) << brick.name;
  EXPECT_TRUE(differs);
  EXPECT_GT(one.simulation().contact_counts().made, calls);
}

/// Two bricks in one communication step, in which they hit each other.
struct Meeting {
  const char* name;
  std::vector<Bricks::Brick> bricks;
  bool foreseen;  ///< from their velocities at the beginning
};
Meeting meeting(double gap_m, bool foreseen) {
  if (foreseen)
    return {"towards each other",
            {{"A", 0, 0.0, 0.2, {0.5, 0, 0}, "[0, 0, 0]"},
             {"B", 0, 0.05 + gap_m, 0.201, {-0.3, 0, 0}, "[0, 0, 0]"}},
            true};
  // The lower one bounces from the floor against the upper one, which is as fast.
  return {"after a bounce",
          {{"A", 0, 0.0, 0.0127, {0, 0, -0.4}, "[0, 0, 0]"},
           {"B", 0, 0.001, 0.0377 + gap_m, {0, 0, -0.4}, "[0, 0, 0]"}},
          false};
}

TEST_F(ThrownBricks, IslandsThatMeetMoveAsACellThatIsOneIslandBitForBit) {
  for (const char* method : {"rosenbrock", "automatic"}) {
    for (const bool foreseen : {true, false}) {
      for (const double gap_m : {1e-4, 2.5e-4, 5e-4}) {
        const Meeting m = meeting(gap_m, foreseen);
        SCOPED_TRACE(std::string(method) + ", " + m.name + ", " + std::to_string(gap_m));
        const Model cell = bricks_.cell(m.bricks, std::string("step_s: 0.004, method: ") + method);
        SceneRun islands(cell), one(as_one_island(cell));
        ASSERT_TRUE(islands.step() && one.step());
        for (const Bricks::Brick& brick : m.bricks) {
          expect_same_motion(islands.sample(brick.name), one.sample(brick.name), brick.name);
          if (HasFatalFailure()) return;
        }
        const Vec3 change = one.sample("B").V_WB.v - m.bricks[1].v;
        EXPECT_GT(std::max(change.x(), change.z()), 0.1) << "they have not met";
        if (foreseen)
          EXPECT_EQ(work_of(islands).evaluations, work_of(one).evaluations);
        else
          EXPECT_GT(work_of(islands).evaluations, work_of(one).evaluations)
              << "they were not integrated apart";
      }
    }
  }
}

// The upper brick is hit after others have been integrated as if it were not, to a harder impact with the floor.
TEST_F(ThrownBricks, ForcesOfAnIntegrationThatIsGivenUpAreNoPeaks) {
  for (const char* method : {"rosenbrock", "automatic"}) {
    for (const double gap_m : {1e-4, 2.5e-4, 5e-4}) {
      SCOPED_TRACE(std::string(method) + ", " + std::to_string(gap_m));
      const Model cell =
          bricks_.cell(meeting(gap_m, false).bricks, std::string("step_s: 0.004, method: ") + method);
      SceneRun islands(cell), one(as_one_island(cell));
      std::vector<ContactPeak> peaks[2];
      for (SceneRun* run : {&islands, &one}) run->simulation().watch_contact_peaks(true);
      ASSERT_TRUE(islands.step() && one.step());
      islands.simulation().read_contact_peaks(peaks[0]);
      one.simulation().read_contact_peaks(peaks[1]);
      EXPECT_GT(work_of(islands).evaluations, work_of(one).evaluations) << "they were not integrated apart";
      ASSERT_EQ(peaks[0].size(), peaks[1].size());
      ASSERT_GT(peaks[0].size(), 0U);
      for (std::size_t i = 0; i < peaks[0].size(); ++i) {
        EXPECT_EQ(peaks[0][i].time_s, peaks[1][i].time_s);
        EXPECT_EQ(peaks[0][i].sample.result.normal_force_N, peaks[1][i].sample.result.normal_force_N);
      }
    }
  }
}

// Curved bodies hold patches (PolygonalContact::hold), which those of an integration that is given up must not replace.
TEST_F(ThrownBricks, CurvedIslandsThatMeetMoveAsACellThatIsOneIslandBitForBit) {
  const TemporaryDirectory directory;
  const std::string ball = "{mesh: " + library_mesh("sphere");
  for (const char* gap : {"0.0501", "0.0503", "0.0506"}) {
    SCOPED_TRACE(gap);
    const auto part = [&](const char* name, const char* z) {
      return std::string("  ") + name + ": " + ball +
             ", mass_kg: 0.02, hierarchy: 1, pose: {position_m: [0, 0, " + z +
             "]}, twist: {velocity_m_per_s: [0, 0, -0.4]}}\n";
    };
    const Model cell = load_scene(
        directory, {"{method: rosenbrock, step_s: 0.008}", "{defaults: {friction: 0.3}}",
                    part("A", "0.0502") + part("B", std::to_string(0.0502 + std::stod(gap)).c_str()),
                    "  Below: " + ball + "}"});
    SceneRun islands(cell), one(as_one_island(cell));
    ASSERT_TRUE(islands.step() && one.step());
    for (const char* name : {"A", "B"}) expect_same_motion(islands.sample(name), one.sample(name), name);
    EXPECT_GT(one.sample("B").V_WB.v.z(), -0.3) << "they have not met";
    EXPECT_GT(work_of(islands).evaluations, work_of(one).evaluations) << "they were not integrated apart";
  }
}

// Whether a communication step is tried by two stages is decided for the cell: copies of a group decide as the group alone.
TEST_F(ThrownBricks, AGroupMovesBesideItsCopyAsAloneBitForBit) {
  const std::string solver = "method: automatic, step_s: 0.002";
  std::vector<Bricks::Brick> copied = Bricks::pair();
  for (Bricks::Brick copy : Bricks::pair()) {
    copy.name += "Copy", copy.row = 2;
    copied.push_back(copy);
  }
  SceneRun copies(bricks_.cell(copied, solver)), alone(bricks_.cell(Bricks::pair(), solver));
  for (int step = 0; step < 80; ++step) {
    ASSERT_TRUE(copies.step() && alone.step());
    for (const char* name : {"Left", "Right"}) {
      expect_same_motion(copies.sample(name), alone.sample(name),
                         std::string(name) + " in step " + std::to_string(step));
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(alone.sample("Left").V_WB.w.norm(), 0.1) << "they have not met";
}

/// Five bricks lie on a plate, and one falls on it: one island, of which the impact shortens the steps of few.
class BricksOnAPlate : public testing::Test {
 protected:
  BricksOnAPlate() {
    bench::write_box(directory_ / "brick.obj", {-0.025, -0.0175, -0.0125}, {0.025, 0.0175, 0.0125});
    bench::write_box(directory_ / "plate.obj", {-0.12, -0.09, -0.01}, {0.12, 0.09, 0.01});
    bench::write_box(directory_ / "floor.obj", {-0.3, -0.3, -0.05}, {0.3, 0.3, 0.0});
  }
  Model cell(const std::string& solver) const {
    std::string parts =
        "  Plate: {mesh: plate.obj, mass_kg: 3, hierarchy: 1, pose: {position_m: [0, 0, 0.01]}}\n"
        "  Falling: {mesh: brick.obj, mass_kg: 0.1, hierarchy: 2, pose: {position_m: [0, 0.045, 0.05], "
        "rpy_deg: [9, 14, "
        "5]}, twist: {velocity_m_per_s: [0.1, 0, -0.4]}}\n";
    for (int i = 0; i < 5; ++i)
      parts += "  P" + std::to_string(i) +
               ": {mesh: brick.obj, mass_kg: 0.1, hierarchy: 2, pose: {position_m: [" +
               std::to_string(i < 3 ? -0.07 + 0.07 * i : -0.07 + 0.14 * (i - 3)) + ", " +
               (i < 3 ? "-0.045" : "0.045") + ", 0.0325]}}\n";
    return load_scene(directory_, {"{" + solver + "}", "{defaults: {friction: 0.3}, element_edge_m: 0.01}",
                                   parts, "  Floor: {mesh: floor.obj}"});
  }
  TemporaryDirectory directory_;
};

TEST_F(BricksOnAPlate, MoveWithStepsOfTheirOwnAsByCvodeWithATightTolerance) {
  constexpr int kRunSteps = 8;
  // What lies, and what has rebounded in the meantime: five tolerances of its velocity for 0.1 s.
  constexpr double kMostOffLying_m = 1e-6, kMostOffFalling_m = 5e-5;
  SceneRun reference(cell("method: cvode, tolerance: 1.0e-9, step_s: 0.008"));
  for (int step = 0; step < kRunSteps; ++step) ASSERT_TRUE(reference.step());
  EXPECT_GT(reference.sample("Falling").V_WB.w.norm(), 0.5) << "it has not hit the plate";
  for (const char* method : {"rosenbrock", "automatic"}) {
    const std::string solver = std::string("step_s: 0.008, method: ") + method;
    SceneRun parts(cell(solver)), one(as_one_island(cell(solver)));
    for (int step = 0; step < kRunSteps; ++step) ASSERT_TRUE(parts.step() && one.step());
    for (const char* name : {"Plate", "Falling", "P0", "P1", "P2", "P3", "P4"}) {
      const Vec3 p = reference.sample(name).p_WB;
      const double most_off_m = std::string(name) == "Falling" ? kMostOffFalling_m : kMostOffLying_m;
      EXPECT_LT((parts.sample(name).p_WB - p).norm(), most_off_m) << name << ", " << method;
      EXPECT_LT((one.sample(name).p_WB - p).norm(), most_off_m)
          << name << ", " << method << ", one step size";
    }
    // Contacts are computed less often than with one step size for all.
    EXPECT_LT(static_cast<double>(parts.simulation().contact_counts().made),
              0.95 * static_cast<double>(one.simulation().contact_counts().made))
        << method;
  }
}

TEST_F(BricksOnAPlate, ContinueAfterARestoreWithTheSameBits) {
  for (const char* solver : {"method: automatic, step_s: 0.008", "method: rosenbrock, step_s: 0.008"})
    check_restored_runs(cell(solver), StepCommands(14), {1, 5, 8, 11}, 3);
}

TEST_F(ThrownBricks, ContinueAfterARestoreWithTheSameBits) {
  for (const char* solver : {"method: automatic, step_s: 0.008", "method: rosenbrock, step_s: 0.008",
                             "method: rosenbrock, step_s: 0.002"})
    check_restored_runs(bricks_.cell(Bricks::all(), solver), StepCommands(40), {3, 9, 17, 19, 28}, 12);
}

}  // namespace
}  // namespace takt::test
