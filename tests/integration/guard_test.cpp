// Packets that the guard keeps out of a service, which continues.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/dds_service.h"
#include "tests/support/effort.h"
#include "tests/support/raw_dds_client.h"

namespace takt {
namespace {

using takt::test::kBin;
using test::ChildProcess;

TEST(Guard, TheServiceContinuesUnderMutatedPackets) {
  const std::string packets = std::to_string(20'000 * test::effort());
  ChildProcess fuzz({kBin + "/takt-guard-fuzz", "--packets", packets, "--seed", "2", "--udp-every", "8"});
  EXPECT_EQ(fuzz.wait(), 0) << fuzz.text;
  EXPECT_NE(fuzz.text.find("the service went on serving"), std::string::npos) << fuzz.text;
}

/// Shows that the test above can fail. Of this seed stock Fast DDS aborts within the first packets.
TEST(Guard, StockFastDdsDiesOfTheSamePacketsWithoutTheGuard) {
  ChildProcess fuzz({kBin + "/takt-guard-fuzz", "--packets", "20000", "--seed", "1", "--no-guard"});
  EXPECT_EQ(fuzz.wait(), 0) << fuzz.text;
  EXPECT_NE(fuzz.text.find("without the guard the service "), std::string::npos) << fuzz.text;
}

TEST(Guard, DroppedPacketsAreCountedAndReported) {
  test::DdsService service(RunLoopOptions{});
  test::RawCellClient client;
  ASSERT_NE(service.adapter->guard(), nullptr);
  EXPECT_GT(service.adapter->guard()->counted(RtpsError::none), 0U);
  const auto before = service.adapter->guard()->dropped();
  const int sender = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const std::string packet = "RTPS\2\2\1\17............\25\5\377\377";
  for (unsigned participant = 0; participant < 4; ++participant) {
    address.sin_port = htons(static_cast<std::uint16_t>(7410 + 250 * test::test_domain() + 2 * participant));
    (void)sendto(sender, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                 sizeof(address));
  }
  close(sender);
  EXPECT_TRUE(client.wait_for_event("packets_dropped", test::test_cell(), "submessage"));
  EXPECT_GT(service.adapter->guard()->dropped(), before);
  EXPECT_EQ(client.request("get_state").result, 1);
}

}  // namespace
}  // namespace takt
