// What Prometheus reads of a cell.
#include "client_lib/view/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

#include "idl/common/cdr.h"
#include "takt_msgs.h"

namespace takt::view {
namespace {

using testing::HasSubstr;
using testing::Not;

std::uint64_t wall_ns() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                        std::chrono::system_clock::now().time_since_epoch())
                                        .count());
}

class MetricsTest : public testing::Test {
 protected:
  MetricsTest() {
    Channel channel;
    channel.type = message_info<takt_msgs::msg::Status>().name;
    channel_ = stream_.add_channel(channel);
  }
  void push(const takt_msgs::msg::Status& status, std::uint64_t age_ns = 0) {
    std::string bytes;
    ASSERT_TRUE(cdr::write(status, bytes));
    stream_.push(channel_, wall_ns() - age_ns, bytes);
  }
  Stream stream_;
  std::uint32_t channel_ = 0;
  Metrics metrics_{stream_, "demo"};
};

TEST_F(MetricsTest, NumbersOfTheStatusAndOfItsGateways) {
  takt_msgs::msg::Status status;
  status.time = 1.5;
  takt_msgs::msg::GatewayStatus gateway;
  gateway.name = "ur";
  gateway.protocol = "RTDE";
  gateway.connected = true;
  gateway.messages = 42;
  gateway.late = 3;
  status.gateways.push_back(gateway);
  push(status);
  const std::string text = metrics_.text();
  EXPECT_THAT(text, HasSubstr("takt_up{cell=\"demo\"} 1"));
  EXPECT_THAT(text, HasSubstr("takt_time_seconds{cell=\"demo\"} 1.5"));
  const std::string labels = "{cell=\"demo\",gateway=\"ur\",protocol=\"RTDE\"} ";
  EXPECT_THAT(text, HasSubstr("takt_gateway_connected" + labels + "1"));
  EXPECT_THAT(text, HasSubstr("takt_gateway_messages" + labels + "42"));
  EXPECT_THAT(text, HasSubstr("takt_gateway_late" + labels + "3"));

  status.gateways.clear();
  push(status);
  EXPECT_THAT(metrics_.text(), Not(HasSubstr("takt_gateway_")));
}

TEST_F(MetricsTest, AnOldStatusHasNoNumbers) {
  constexpr std::uint64_t minute_ns = 60'000'000'000;
  EXPECT_THAT(metrics_.text(), HasSubstr("takt_up{cell=\"demo\"} 0"));
  push({}, minute_ns);
  const std::string text = metrics_.text();
  EXPECT_THAT(text, HasSubstr("takt_up{cell=\"demo\"} 0"));
  EXPECT_THAT(text, Not(HasSubstr("takt_time_seconds")));
}

}  // namespace
}  // namespace takt::view
