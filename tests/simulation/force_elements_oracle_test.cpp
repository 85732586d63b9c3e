// Forces between components that a device brings along: a spring between two bodies against its closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "plant_models/device_model.h"
#include "plant_models/force_element.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"

namespace takt {
namespace {

constexpr double kStiffness = 40.0, kLength = 1.0;

/// A spring between the centres of two bodies; its signal is its stiffness.
class Spring final : public DeviceModel, public ForceElement {
 public:
  Spring(int a, int b, double stiffness) : a_(a), b_(b), stiffness_(stiffness) {}
  void write_motion(double, const double*, CellMotion&) const override {}
  void set_signal(double, int, double value) override { stiffness_ = value; }
  void read_signals(double, const double*, const CellMotion&, std::span<double> signals) const override {
    signals[0] = stiffness_;
  }
  void add_wrenches(const CellMotion& motion, std::span<Wrench> wrenches) const override {
    const auto a = static_cast<std::size_t>(a_), b = static_cast<std::size_t>(b_);
    const Vec3 between = motion.bodies[b].p_WBcm - motion.bodies[a].p_WBcm;
    const Vec3 pull = stiffness_ * (between.norm() - kLength) * between.normalized();
    wrenches[a].f += pull;
    wrenches[b].f -= pull;
  }

 private:
  int a_, b_;
  double stiffness_;
};

class SpringCell {
 public:
  /// `unknown_m_per_s2`: pulls A without the cell's knowledge.
  explicit SpringCell(double stiffness, double distance = kLength + 0.2, double unknown_m_per_s2 = 0.0) {
    cell_.gravity(Vec3::Zero()).step(0.001);
    cell_.model().solver = {"rk4", 1e-6, 0.001, SystemMatrix::automatic};
    a_ = cell_.part("A", 1.0, 1, {0.1, 0.1, 0.1}, test::at(0.0, 0.0, 0.0));
    b_ = cell_.part("B", 3.0, 2, {0.1, 0.1, 0.1}, test::at(distance, 0.0, 0.0));
    cell_.model().auxiliary_models.push_back(
        {"Spring", [a = a_, b = b_, stiffness] { return std::make_unique<Spring>(a, b, stiffness); }, 0});
    cell_.model().description.devices.push_back({"Spring", {{"stiffness", "N/m", true, 0.0, 100.0}}});
    cell_.model().parts.front().gravity_W.x() = -unknown_m_per_s2;
    simulation_ = std::make_unique<Simulation>(cell_.build());
  }
  Simulation& simulation() { return *simulation_; }
  Vec3 p(int body) { return simulation_->make_snapshot().components[static_cast<std::size_t>(body)].p_WB; }
  int a() const { return a_; }
  int b() const { return b_; }

 private:
  test::BoxCell cell_;
  int a_ = -1, b_ = -1;
  std::unique_ptr<Simulation> simulation_;
};

TEST(ForceElements, ASpringBetweenTwoBodiesOscillatesWithTheReducedMass) {
  SpringCell cell(kStiffness);
  const double w = std::sqrt(kStiffness * (1.0 / 1.0 + 1.0 / 3.0));
  for (int i = 1; i <= 2000; ++i) {
    ASSERT_TRUE(cell.simulation().step({})) << cell.simulation().fault();
    if (i % 100 != 0) continue;
    const double distance = cell.p(cell.b()).x() - cell.p(cell.a()).x();
    EXPECT_NEAR(distance, kLength + 0.2 * std::cos(w * 0.001 * i), 1e-8) << i;
    const double centre = (cell.p(cell.a()).x() + 3.0 * cell.p(cell.b()).x()) / 4.0;
    EXPECT_NEAR(centre, 3.0 * (kLength + 0.2) / 4.0, 1e-12) << i;
  }
}

TEST(ForceElements, TheEnergyThatAnElementGivesHasACause) {
  SpringCell cell(kStiffness, kLength + 5.0);  // 500 J: A moves at up to 27 m/s
  double fastest = 0.0;
  for (int i = 1; i <= 230; ++i) {  // a quarter of the period is 0.215 s
    ASSERT_TRUE(cell.simulation().step({})) << cell.simulation().fault();
    fastest = std::max(
        fastest,
        cell.simulation().make_snapshot().components[static_cast<std::size_t>(cell.a())].V_WB.v.norm());
  }
  EXPECT_NEAR(fastest, std::sqrt(2.0 * 500.0 / (1.0 + 1.0 / 3.0)), 0.01);
}

TEST(ForceElements, EnergyWithoutACauseIsAFaultBesideAnElement) {
  SpringCell cell(kStiffness, kLength + 0.2, 1e3);
  int steps = 0;
  while (cell.simulation().step({}) && steps < 2000) ++steps;
  EXPECT_NE(cell.simulation().fault().find("gains energy without a cause"), std::string::npos)
      << cell.simulation().fault();
  EXPECT_LT(steps, 100);  // 0.8 J move A at 1.1 m/s, ten of which are passed after 0.01 s
}

TEST(ForceElements, WakeNothingBecauseNothingSleeps) {
  SpringCell cell(0.0);
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(cell.simulation().step({}));
  EXPECT_EQ(cell.p(cell.a()).x(), 0.0);
  DeviceCommand command;
  command.device = 0;
  command.count = 1;
  command.signals[0] = 0;
  command.values[0] = kStiffness;
  ASSERT_TRUE(cell.simulation().step(std::array<Command, 1>{command}));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(cell.simulation().step({}));
  EXPECT_GT(cell.p(cell.a()).x(), 0.01);
}

}  // namespace
}  // namespace takt
