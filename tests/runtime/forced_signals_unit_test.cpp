// The requests force_signal, release_signal and set_inputs: what they change, the events they give, and what they refuse.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "server/runtime/requests/bit_changes.h"
#include "server/simulation/model/signals.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/service_cell.h"
#include "tests/support/test_device.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

class ForcedByRequest : public ::testing::Test {
 protected:
  ForcedByRequest() {
    test::add_chamber(*model_);
    simulation_ = std::make_unique<Simulation>(model_);
  }
  std::string refused(const BitChange& change) const {
    EXPECT_TRUE(std::holds_alternative<std::string>(change));
    return std::holds_alternative<std::string>(change) ? std::get<std::string>(change) : "";
  }
  double value(const std::string& name) const {
    return simulation_->signal(find_signal(simulation_->description(), name).value());
  }
  std::shared_ptr<CellModel> model_ = test::service_model();
  std::unique_ptr<Simulation> simulation_;
};

TEST_F(ForcedByRequest, ASignalIsForcedAndReleasedByItsName) {
  const BitChange forced = apply(requests::ForceSignal{"Chamber.temperature", 150.0}, *simulation_);
  const auto* event = std::get_if<events::SignalForced>(&std::get<events::OfLoop>(forced));
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->value, 150.0);
  EXPECT_EQ(value("Chamber.temperature"), 150.0);
  const BitChange released = apply(requests::ReleaseSignal{"Chamber.temperature"}, *simulation_);
  EXPECT_NE(std::get_if<events::SignalReleased>(&std::get<events::OfLoop>(released)), nullptr);
  EXPECT_EQ(value("Chamber.temperature"), 20.0);
}

TEST_F(ForcedByRequest, AllAreReleasedTogether) {
  for (const char* name : {"Chamber.lamp", "Gripper1.part_present", "Robot1.elbow_joint"})
    EXPECT_TRUE(
        std::holds_alternative<events::OfLoop>(apply(requests::ForceSignal{name, 1.0}, *simulation_)));
  EXPECT_EQ(simulation_->forced_signals().size(), 3U);
  apply(requests::ReleaseSignal{"all"}, *simulation_);
  EXPECT_TRUE(simulation_->forced_signals().empty());
}

TEST_F(ForcedByRequest, MistakesAreRefusedWithASentence) {
  EXPECT_THAT(
      refused(apply(requests::ForceSignal{"Chamber.door", 1.0}, *simulation_)),
      HasSubstr("no signal 'Chamber.door'; allowed: signals of Chamber: set_point, lamp, temperature"));
  EXPECT_THAT(refused(apply(requests::ForceSignal{"Chamber.set_point", 1000.0}, *simulation_)),
              HasSubstr("the value of Chamber.set_point is 1000 C, outside [20, 300] C"));
  EXPECT_THAT(refused(apply(requests::ForceSignal{"Gripper1.closed", 0.5}, *simulation_)),
              HasSubstr("boolean: 0 or 1"));
  EXPECT_THAT(refused(apply(requests::ReleaseSignal{"Chamber.lamp"}, *simulation_)),
              HasSubstr("Chamber.lamp is not forced"));
  EXPECT_TRUE(simulation_->forced_signals().empty());
}

TEST_F(ForcedByRequest, InputsAreSetTogetherAndWithoutAnEvent) {
  const BitChange set =
      apply(requests::SetInputs{{"Chamber.set_point", "Chamber.lamp", "Gripper1.close"}, {120.0, 1.0, 1.0}},
            *simulation_);
  ASSERT_TRUE(std::holds_alternative<QuietChange>(set));
  EXPECT_EQ(std::get<QuietChange>(set).sentence, "3 inputs are set.");
  EXPECT_EQ(value("Chamber.set_point"), 120.0);
  EXPECT_EQ(value("Chamber.lamp"), 1.0);
  EXPECT_EQ(value("Gripper1.close"), 1.0);
  // The chamber follows its new set point: theta = s + (theta_0 - s) exp(-t / tau).
  while (simulation_->time_s() < 0.5) ASSERT_TRUE(simulation_->step({}));
  const double expected = 120.0 + (test::WarmChamber::kAmbient_C - 120.0) *
                                      std::exp(-simulation_->time_s() / test::WarmChamber::kTau_s);
  EXPECT_NEAR(value("Chamber.temperature"), expected, 1e-3);
}

TEST_F(ForcedByRequest, OneInvalidInputKeepsAllAsTheyAre) {
  const auto of = [&](const std::string& input, double number) {
    const std::string why =
        refused(apply(requests::SetInputs{{"Chamber.set_point", input}, {120.0, number}}, *simulation_));
    EXPECT_EQ(value("Chamber.set_point"), 20.0) << input;
    return why;
  };
  EXPECT_THAT(of("Chamber.door", 1.0), HasSubstr("signals of Chamber: set_point, lamp, temperature"));
  EXPECT_THAT(of("Chamber.temperature", 30.0), HasSubstr("Chamber.temperature is an output"));
  EXPECT_THAT(of("Chamber.lamp", 2.0), HasSubstr("outside [0, 1]"));
  EXPECT_THAT(of("Gripper1.close", 0.5), HasSubstr("boolean: 0 or 1"));
  EXPECT_THAT(of("Robot1.elbow_joint", 0.5), HasSubstr("is an output"));
  EXPECT_THAT(refused(apply(requests::SetInputs{{"Chamber.lamp"}, {}}, *simulation_)),
              HasSubstr("1 inputs and 0 values"));
}

TEST_F(ForcedByRequest, AWiredGripperTakesNoInput) {
  const SignalRef from = find_signal(model_->description, "Chamber.lamp").value();
  const SignalRef to = find_signal(model_->description, "Gripper1.close").value();
  model_->description.wires.push_back({.to = to, .from = from, .text = "Chamber.lamp"});
  simulation_ = std::make_unique<Simulation>(model_);
  EXPECT_THAT(refused(apply(requests::SetInputs{{"Gripper1.set_width"}, {0.01}}, *simulation_)),
              HasSubstr("Gripper1.close is wired to 'Chamber.lamp'"));
}

TEST_F(ForcedByRequest, AForcedInputTakesItsValueAtTheRelease) {
  apply(requests::ForceSignal{"Chamber.set_point", 50.0}, *simulation_);
  apply(requests::SetInputs{{"Chamber.set_point"}, {120.0}}, *simulation_);
  EXPECT_EQ(value("Chamber.set_point"), 50.0);
  apply(requests::ReleaseSignal{"Chamber.set_point"}, *simulation_);
  EXPECT_EQ(value("Chamber.set_point"), 120.0);
}

}  // namespace
}  // namespace takt
