// The requests force_signal and release_signal: what they change, the events they give, and what they refuse.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace takt
