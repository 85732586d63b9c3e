// Devices: named signals in, signals out, with a small device of the tests.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "server/simulation/step/simulation.h"
#include "tests/support/service_cell.h"
#include "tests/support/test_device.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

class Device : public ::testing::Test {
 protected:
  Device() { test::add_chamber(*model_); }
  Rejection refused(const RawDeviceCommand& raw) const {
    const auto result = validate(model_->description, chamber(), raw);
    EXPECT_TRUE(std::holds_alternative<Rejection>(result));
    return std::holds_alternative<Rejection>(result) ? std::get<Rejection>(result) : Rejection{};
  }
  Command good(std::vector<std::string> signals, std::vector<double> values) const {
    const RawDeviceCommand raw{SimTime{250'000'000}, std::move(signals), std::move(values)};
    return std::get<DeviceCommand>(validate(model_->description, chamber(), raw));
  }
  int chamber() const { return find_target(model_->description, "Chamber"); }
  std::shared_ptr<CellModel> model_ = test::service_model();
};

TEST_F(Device, EveryFaultHasItsCodeAndSentence) {
  EXPECT_EQ(refused({{}, {"lamp"}, {}}).code, RejectionCode::wrong_count);
  EXPECT_EQ(refused({{}, {"lamp"}, {}}).subject, "Chamber");
  EXPECT_EQ(refused({{}, {"door"}, {1.0}}).code, RejectionCode::unknown_signal);
  EXPECT_EQ(refused({{}, {"temperature"}, {30.0}}).code, RejectionCode::read_only_signal);
  EXPECT_EQ(refused({{}, {"lamp", "lamp"}, {1.0, 0.0}}).code, RejectionCode::malformed);
  EXPECT_EQ(refused({{}, {"lamp"}, {std::nan("")}}).code, RejectionCode::not_finite);
  model_->description.devices[0].signals[1].type = SignalType::boolean;
  EXPECT_EQ(refused({{}, {"lamp"}, {0.5}}).code, RejectionCode::wrong_type);
  const Rejection range = refused({{}, {"lamp", "set_point"}, {1.0, 301.0}});
  EXPECT_EQ(range.code, RejectionCode::out_of_range);
  EXPECT_THAT(range.message, HasSubstr("'set_point' of Chamber is 301 C, outside [20, 300] C"));
}

TEST_F(Device, ALaterCommandKeepsTheSignalsThatItDoesNotName) {
  const auto earlier = std::get<DeviceCommand>(good({"lamp", "set_point"}, {1.0, 120.0}));
  auto newer = std::get<DeviceCommand>(good({"set_point"}, {80.0}));
  add_other_signals(earlier, newer);
  ASSERT_EQ(newer.count, 2);
  EXPECT_EQ(newer.signals[0], 0U);
  EXPECT_EQ(newer.values[0], 80.0);
  EXPECT_EQ(newer.signals[1], 1U);
  EXPECT_EQ(newer.values[1], 1.0);
}

TEST_F(Device, CommandsReachTheModelAndSignalsTheSnapshot) {
  for (const char* solver : {"rk2", "implicit", "cvode"}) {
    model_->solver.name = solver;
    model_->solver.tolerance = 1e-8;
    Simulation simulation(model_);
    Snapshot snapshot = simulation.make_snapshot();
    ASSERT_EQ(snapshot.devices.size(), 1U);
    EXPECT_EQ(snapshot.devices[0].signals[2], 20.0);
    ASSERT_TRUE(simulation.step(std::vector<Command>{good({"set_point", "lamp"}, {120.0, 1.0})}));
    while (simulation.step_index() < 500) ASSERT_TRUE(simulation.step({}));
    simulation.read_snapshot(snapshot);
    EXPECT_EQ(snapshot.devices[0].signals[0], 120.0);
    EXPECT_EQ(snapshot.devices[0].signals[1], 1.0);
    EXPECT_NEAR(snapshot.devices[0].signals[2], 120.0 - 100.0 * std::exp(-1.0), 2e-3) << solver;
    EXPECT_EQ(snapshot.devices[0].commands_applied, 1U);
    EXPECT_EQ(snapshot.devices[0].newest_stamp.seconds(), 0.25);
    // Other signals stay.
    ASSERT_TRUE(simulation.step(std::vector<Command>{good({"lamp"}, {0.0})}));
    simulation.read_snapshot(snapshot);
    EXPECT_EQ(snapshot.devices[0].signals[0], 120.0);
    EXPECT_EQ(snapshot.devices[0].signals[1], 0.0);
  }
}

TEST_F(Device, ASavedStateContinuesWithTheSameBits) {
  Simulation simulation(model_);
  ASSERT_TRUE(simulation.step(std::vector<Command>{good({"set_point"}, {120.0})}));
  while (simulation.step_index() < 100) ASSERT_TRUE(simulation.step({}));
  std::vector<std::byte> saved;
  simulation.save_state(saved);
  Simulation other(model_);
  ASSERT_EQ(other.restore_state(saved), "");
  while (simulation.step_index() < 300) ASSERT_TRUE(simulation.step({}) && other.step({}));
  EXPECT_EQ(other.state_hash(), simulation.state_hash());
  Snapshot snapshot = other.make_snapshot();
  EXPECT_EQ(snapshot.devices[0].commands_applied, 1U);
  EXPECT_NEAR(snapshot.devices[0].signals[2], 120.0 - 100.0 * std::exp(-0.6), 1e-3);
}

TEST_F(Device, ADescriptionWithoutAModelIsRefused) {
  model_->auxiliary_models.clear();
  EXPECT_THROW(Simulation{model_}, std::invalid_argument);
}

}  // namespace
}  // namespace takt
