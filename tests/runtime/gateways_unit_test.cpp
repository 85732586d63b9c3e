// Gateways as they report themselves: the newest report counts, for a while.
#include "server/runtime/host/gateways.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt {
namespace {

using ::testing::ElementsAre;

requests::ReportGateway status(const std::string& name, bool connected = false) {
  requests::ReportGateway made;
  made.name = name;
  made.protocol = "EGM";
  made.peer = "10.0.0.2 port 6510";
  made.connected = connected;
  return made;
}

class GatewaysTest : public ::testing::Test {
 protected:
  std::vector<std::string> names(std::int64_t now_ns) {
    std::vector<std::string> result;
    for (const auto& one : gateways.present(now_ns)) result.push_back(one.name);
    return result;
  }
  std::vector<std::string> news() {
    std::vector<std::string> codes;
    for (const DiagnosticEvent& event : outbound.events.take().events)
      codes.push_back(event.subject + " " + event.code);
    return codes;
  }
  OutboundQueue outbound;
  Gateways gateways{outbound.events};
};

TEST_F(GatewaysTest, AGatewayIsPresentUntilItHasBeenSilent) {
  EXPECT_TRUE(gateways.report(status("b"), 0));
  EXPECT_TRUE(gateways.report(status("a"), 2'000'000'000));
  EXPECT_THAT(names(3'000'000'000), ElementsAre("a", "b"));
  EXPECT_THAT(names(3'000'000'001), ElementsAre("a"));
  EXPECT_THAT(names(5'000'000'001), ElementsAre());
  EXPECT_THAT(news(), ElementsAre("b gateway_ended", "a gateway_ended"));
}

TEST_F(GatewaysTest, ChangesOfTheConnectionBecomeEvents) {
  gateways.report(status("g"), 0);
  gateways.report(status("g", true), 1);
  gateways.report(status("g", true), 2);
  gateways.report(status("g"), 3);
  gateways.report(status("g"), 4);
  EXPECT_THAT(news(), ElementsAre("g gateway_connected", "g gateway_disconnected"));
  gateways.report(status("h", true), 5);
  EXPECT_THAT(news(), ElementsAre("h gateway_connected"));
  EXPECT_TRUE(gateways.present(5)[1].connected);
}

TEST_F(GatewaysTest, MoreThanAStatusHoldsAreRefused) {
  for (std::size_t i = 0; i < Gateways::kMost; ++i)
    EXPECT_TRUE(gateways.report(status(std::to_string(i)), 0));
  EXPECT_FALSE(gateways.report(status("one more"), 0));
  EXPECT_TRUE(gateways.report(status("0", true), 0));
  EXPECT_EQ(gateways.present(0).size(), Gateways::kMost);
}

}  // namespace
}  // namespace takt
