// The 16 bytes that rmw_cyclonedds writes ahead of each message of a service.
#include "server/dds/ros_endpoint.h"

#include <gtest/gtest.h>

#include <vector>

#include "idl/common/cdr.h"
#include "ros2_service_msgs.h"

namespace takt {
namespace {

/// guid 0x1122334455667788, number 3, then the uint64 5, in either byte order.
const std::vector<std::uint8_t> kLittle{0, 1, 0, 0, 0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11, 3, 0,
                                        0, 0, 0, 0, 0,    0,    5,    0,    0,    0,    0,    0,    0, 0};
const std::vector<std::uint8_t> kBig{0, 0, 0, 0, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88, 0, 0,
                                     0, 0, 0, 0, 0,    3,    0,    0,    0,    0,    0,    0,    0, 5};

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(RosEndpoint, TheHeaderIsReadInEitherByteOrderAndTheRestIsTheMessage) {
  for (const auto& sample : {kLittle, kBig}) {
    RosEndpoint::PayloadHeader header;
    const auto rest = without_header(sample, header);
    ASSERT_TRUE(rest);
    EXPECT_EQ(header.guid, 0x1122334455667788U);
    EXPECT_EQ(header.number, 3);
    simulation_interfaces::srv::StepSimulation_Request request;
    ASSERT_TRUE(cdr::read(bytes_of(*rest), request));
    EXPECT_EQ(request.steps, 5U);
  }
}

TEST(RosEndpoint, AReplyRepeatsTheHeader) {
  std::string plain;
  ASSERT_TRUE(cdr::write(simulation_interfaces::srv::StepSimulation_Request{5}, plain));
  const std::string sample = with_header({0x1122334455667788U, 3}, plain);
  EXPECT_EQ(std::vector<std::uint8_t>(sample.begin(), sample.end()), kLittle);
}

TEST(RosEndpoint, ASampleThatIsCutIsNoRequest) {
  for (std::size_t size = 0; size < 20; ++size) {
    RosEndpoint::PayloadHeader header;
    EXPECT_FALSE(without_header(std::span(kLittle).first(size), header)) << size;
  }
  RosEndpoint::PayloadHeader header;
  const auto empty = without_header(std::span(kLittle).first(20), header);
  ASSERT_TRUE(empty);
  EXPECT_EQ(empty->size(), 4U);
}

}  // namespace
}  // namespace takt
