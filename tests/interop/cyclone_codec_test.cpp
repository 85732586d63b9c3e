// The bytes of every message against an independent peer: Cyclone DDS, with types that idlc makes from the
// same IDL. It reads takt's bytes as a value, and writes the same bytes for that value; its bytes in the
// other byte order are read here as the original message.
#include <gtest/gtest.h>

#include "idl/common/cdr.h"
#include "ros2_names_ros2_msgs.h"
#include "ros2_names_ros2_service_msgs.h"
#include "ros2_names_takt_msgs.h"
#include "ros2_service_msgs.h"
#include "takt_msgs.h"
#include "tests/interop/cyclone_codec.h"
#include "tests/support/random_message.h"

namespace takt {
namespace {

template <Message Type>
void expect_agreement(const dds_topic_descriptor_t& peer) {
  std::string type(message_info<Type>().dds_type);
  EXPECT_EQ(type, peer.m_typename);
  for (unsigned seed = 0; seed < 30; ++seed) {
    const Type sent = test::RandomMessage(seed).make<Type>();
    std::vector<std::uint8_t> ours(cdr::size(sent));
    ASSERT_EQ(cdr::write(sent, ours), ours.size());
    std::vector<std::uint8_t> little(ours), big(ours);
    constexpr std::size_t head = cdr::kEncapsulation_bytes;
    ASSERT_TRUE(cyclone_round_trip(&peer, ours.data() + head, static_cast<std::uint32_t>(ours.size() - head),
                                   little.data() + head, big.data() + head))
        << type << ", seed " << seed;
    EXPECT_EQ(little, ours) << type << ", seed " << seed;
    big[1] = 0;
    Type received;
    ASSERT_TRUE(cdr::read(big, received)) << type << ", seed " << seed;
    EXPECT_TRUE(received == sent) << type << ", seed " << seed;
  }
}

TEST(CycloneCodec, TakesAndWritesTheSameBytesOfEveryMessage) {
#define PEER(Type, descriptor) expect_agreement<Type>(descriptor);
#include "peers.h"
#undef PEER
}

TEST(CycloneCodec, KnowsEveryMessage) {
  std::size_t peers = 0;
#define PEER(Type, descriptor) ++peers;
#include "peers.h"
#undef PEER
  EXPECT_EQ(peers,
            std::size(TaktMsgs::infos) + std::size(Ros2Msgs::infos) + std::size(Ros2ServiceMsgs::infos));
}

}  // namespace
}  // namespace takt
