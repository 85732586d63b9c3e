// Concurrent packets through the guard into Fast DDS, by two threads that receive as those of Fast DDS do.
#include "idl/transport/rtps_guard/guard_transport.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <thread>

#include "tests/support/rtps_packets.h"

namespace takt {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// In place of Fast DDS, behind the guard.
class Behind final : public transports::TransportReceiverInterface {
 public:
  std::function<void()> received;

 private:
  void OnDataReceived(const rtps::octet*, const std::uint32_t, const rtps::Locator_t&,
                      const rtps::Locator_t&) override {
    received();
  }
};

class GuardThreads : public testing::Test {
 protected:
  void SetUp() override {
    dds::DomainParticipantQos qos;
    guard_ = guard_transports(qos, 0, false);
    transport_.reset(dynamic_cast<transports::ChainingTransport*>(
        qos.transport().user_transports.back()->create_transport()));
    ASSERT_NE(transport_, nullptr);
  }
  void begin() { guard_->begin(); }
  void receive(const Bytes& packet) {
    transport_->receive(&behind_, packet.data(), static_cast<std::uint32_t>(packet.size()), local_, local_);
  }
  static Bytes discovery() {
    auto list = test::participant(false);
    return test::Packet().data(0, test::kSpdpWriter, 4, list.u16(1).u16(0).bytes).wire.bytes;
  }
  static Bytes sample() {
    return test::Packet().data(test::kReader, test::kWriter, 4, {0, 1, 0, 0, 1, 2, 3, 4}).wire.bytes;
  }

  std::shared_ptr<PacketGuard> guard_;
  std::unique_ptr<transports::ChainingTransport> transport_;
  Behind behind_;
  rtps::Locator_t local_{LOCATOR_KIND_UDPv4, 7410};
};

/// Answers to the first announcement come ahead of it.
TEST_F(GuardThreads, PacketsWaitUntilTheParticipantHasBeenMade) {
  bool made = false, came = false;
  behind_.received = [&] {
    EXPECT_TRUE(made);
    came = true;
  };
  std::promise<void> started;
  std::thread other([&] {
    started.set_value();
    receive(discovery());
  });
  started.get_future().wait();
  std::this_thread::yield();
  made = true;
  begin();
  other.join();
  EXPECT_TRUE(came);
}

TEST_F(GuardThreads, APacketDoesNotWaitForEver) {
  bool came = false;
  behind_.received = [&] { came = true; };
  receive(discovery());
  EXPECT_TRUE(came);
}

TEST_F(GuardThreads, PacketsOfDiscoveryPassOneAtATime) {
  begin();
  std::atomic<int> inside{0}, most{0}, count{0};
  behind_.received = [&] {
    const int now = ++inside;
    if (now > most) most = now;
    std::this_thread::yield();
    ++count;
    --inside;
  };
  const auto receive_many = [&] {
    for (int i = 0; i < 20'000; ++i) receive(discovery());
  };
  std::thread other(receive_many);
  receive_many();
  other.join();
  EXPECT_EQ(count, 40'000) << guard_->summary();
  EXPECT_EQ(most, 1);
}

TEST_F(GuardThreads, SamplesDoNotWaitForDiscovery) {
  begin();
  std::promise<void> sample_came, discovery_came;
  bool first = true;
  behind_.received = [&] {
    if (!std::exchange(first, false)) return sample_came.set_value();
    discovery_came.set_value();
    EXPECT_EQ(sample_came.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  };
  std::thread other([&] { receive(discovery()); });
  discovery_came.get_future().wait();
  receive(sample());
  other.join();
}

/// A deadlock in Fast DDS.
TEST(GuardStall, APacketThatFastDdsKeepsIsReported) {
  PacketGuard guard({}, std::chrono::milliseconds(20));
  std::promise<void> reported;
  std::atomic<int> count{0};
  guard.set_on_stalled([&] {
    if (++count == 1) reported.set_value();
  });
  const PacketGuard::Discovery kept(guard);
  EXPECT_EQ(reported.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  EXPECT_EQ(count, 1);
}

TEST(StallDetector, ReportsACallOnceThatOutlastsTheTicks) {
  StallDetector detector(3);
  const auto reports = [&](int ticks) {
    int count = 0;
    for (int i = 0; i < ticks; ++i) count += detector.tick() ? 1 : 0;
    return count;
  };
  EXPECT_EQ(reports(20), 0);  // nothing is called
  for (int call = 0; call < 10; ++call) {
    detector.begin();
    EXPECT_EQ(reports(4), 0);  // the first one meets the call at any time after its begin
    detector.end();
    EXPECT_EQ(reports(1), 0);
  }
  detector.begin();
  EXPECT_EQ(reports(5), 1);
  EXPECT_EQ(reports(20), 0);
  detector.end();
  detector.begin();  // the next one, without a tick between
  EXPECT_EQ(reports(4), 0);
  EXPECT_EQ(reports(1), 1);
}

}  // namespace
}  // namespace takt
