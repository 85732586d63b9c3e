// Packets are delivered by the receiver's own thread, or by the one that waits.
#include "idl/transport/fastdds/udp_receiver.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>
#include <vector>

namespace takt::test {
namespace {

using Clock = UdpReceiver::Clock;
constexpr UdpReceiver::Address kHere{127, 0, 0, 1};

class Sender {
 public:
  Sender() : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {}
  ~Sender() { ::close(socket_); }
  void send(std::uint16_t port, int value) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    std::memcpy(&to.sin_addr, kHere.data(), kHere.size());
    ASSERT_EQ(sendto(socket_, &value, sizeof(value), 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to)),
              static_cast<ssize_t>(sizeof(value)));
  }

 private:
  int socket_;
};

/// A receiver on a free port, and what it has delivered.
struct Received {
  Received() {
    for (std::uint16_t candidate = 20000; port == 0 && candidate < 30000; candidate += 7)
      if (receiver.open(candidate, {kHere}, 1U << 20U, [this](auto packet, const auto& from, auto) {
            EXPECT_EQ(from, kHere);
            int value = 0;
            std::memcpy(&value, packet.data(), sizeof(value));
            const std::lock_guard lock(mutex);
            values.push_back(value);
            threads.push_back(std::this_thread::get_id());
            ++count;
            came.notify_all();
          }))
        port = candidate;
  }
  void wait_for(std::size_t wanted) {
    std::unique_lock lock(mutex);
    came.wait(lock, [&] { return values.size() >= wanted; });
  }

  std::mutex mutex;
  std::condition_variable came;
  std::vector<int> values;
  std::vector<std::thread::id> threads;
  std::atomic<std::size_t> count{0};
  std::uint16_t port = 0;
  UdpReceiver receiver;
};

TEST(UdpReceiver, DeliversInItsOwnThreadWithoutAWaitingOne) {
  Received received;
  ASSERT_NE(received.port, 0);
  Sender().send(received.port, 7);
  received.wait_for(1);
  EXPECT_EQ(received.values, std::vector{7});
  EXPECT_NE(received.threads.front(), std::this_thread::get_id());
}

TEST(UdpReceiver, DeliversInTheThreadThatWaitsAndThenInItsOwnAgain) {
  Received received;
  const Sender sender;
  for (std::size_t i = 1; i <= 100; ++i) {
    std::atomic<bool> leads{false};
    std::thread other([&] {
      while (!leads) std::this_thread::yield();
      sender.send(received.port, static_cast<int>(i));
    });
    ASSERT_TRUE(received.receiver.lead(Clock::time_point::max(), [&] {
      leads = true;
      return received.count >= i;
    }));
    other.join();
    EXPECT_EQ(received.threads.back(), std::this_thread::get_id());
  }
  sender.send(received.port, 0);
  received.wait_for(101);
  EXPECT_NE(received.threads.back(), std::this_thread::get_id());
}

TEST(UdpReceiver, ReturnsAtTheDeadlineAndAfterAnInterrupt) {
  Received received;
  EXPECT_TRUE(received.receiver.lead(Clock::now() + std::chrono::milliseconds{2}, [] { return false; }));
  std::atomic<int> asked{0};
  std::atomic<bool> over{false};
  std::thread other([&] {
    while (asked < 1) std::this_thread::yield();
    over = true;
    received.receiver.interrupt();
  });
  EXPECT_TRUE(received.receiver.lead(Clock::time_point::max(), [&] {
    ++asked;
    return over.load();
  }));
  other.join();
}

TEST(UdpReceiver, SendsTheSecondOneAwayAndServesItAfterTheFirst) {
  Received received;
  std::atomic<bool> leads{false}, leave{false};
  std::thread first([&] {
    EXPECT_TRUE(received.receiver.lead(Clock::time_point::max(), [&] {
      leads = true;
      return leave.load();
    }));
  });
  while (!leads) std::this_thread::yield();
  EXPECT_FALSE(received.receiver.lead(Clock::time_point::max(), [] { return false; }));
  const UdpReceiver::Follower follower(received.receiver);
  leave = true;
  received.receiver.interrupt();
  first.join();
  Sender().send(received.port, 3);
  received.wait_for(1);
}

TEST(UdpReceiver, ClosesBelowTheThreadThatWaits) {
  Received received;
  std::atomic<bool> leads{false};
  std::thread waiting([&] {
    EXPECT_FALSE(received.receiver.lead(Clock::time_point::max(), [&] {
      leads = true;
      return false;
    }));
  });
  while (!leads) std::this_thread::yield();
  received.receiver.close(received.port);
  waiting.join();
  EXPECT_FALSE(received.receiver.lead(Clock::time_point::max(), [] { return false; }));
  EXPECT_FALSE(received.receiver.is_open(received.port));
}

TEST(UdpReceiver, RefusesATakenPortAndOpensAgain) {
  Received received;
  UdpReceiver second;
  EXPECT_FALSE(second.open(received.port, {kHere}, 0, [](auto, const auto&, auto) {}));
  received.receiver.close(received.port);
  EXPECT_TRUE(second.open(received.port, {kHere}, 0, [](auto, const auto&, auto) {}));
  EXPECT_TRUE(second.is_open(received.port));
}

TEST(UdpReceiver, HasSeveralPortsAndClosesEachByItself) {
  Received received;
  std::atomic<int> of_second{0};
  std::uint16_t second = received.port;
  while (!received.receiver.open(++second, {kHere}, 0, [&](auto, const auto&, auto) { ++of_second; })) {
  }
  const Sender sender;
  sender.send(second, 1);
  sender.send(received.port, 2);
  ASSERT_TRUE(received.receiver.lead(Clock::time_point::max(),
                                     [&] { return received.count == 1 && of_second == 1; }));
  received.receiver.close(second);
  EXPECT_FALSE(received.receiver.is_open(second));
  EXPECT_TRUE(received.receiver.is_open(received.port));
  sender.send(received.port, 3);
  received.wait_for(2);
}

TEST(UdpReceiver, DeliversEachPacketOnceToChangingThreads) {
  constexpr int kPackets = 3000;
  Received received;
  std::atomic<bool> ended{false};
  std::condition_variable pause;
  const auto wait = [&](int pause_us) {
    while (!ended) {
      const std::size_t seen = received.count;
      const auto deadline = Clock::now() + std::chrono::milliseconds{1};
      if (!received.receiver.lead(deadline, [&] { return received.count != seen; })) {
        const UdpReceiver::Follower follower(received.receiver);
        std::unique_lock lock(received.mutex);
        received.came.wait_until(lock, deadline);
      }
      const auto back = Clock::now() + std::chrono::microseconds(pause_us);
      std::unique_lock lock(received.mutex);
      pause.wait_until(lock, back, [&] { return ended.load(); });
    }
  };
  std::thread eager(wait, 0), lazy(wait, 200), absent(wait, 7000);
  const Sender sender;
  for (int i = 0; i < kPackets; ++i) {
    sender.send(received.port, i);
    if (i % 50 == 49) received.wait_for(static_cast<std::size_t>(i + 1));  // below the kernel's buffer
  }
  received.wait_for(kPackets);
  ended = true;
  for (std::thread* thread : {&eager, &lazy, &absent}) thread->join();
  ASSERT_EQ(received.values.size(), static_cast<std::size_t>(kPackets));
  for (int i = 0; i < kPackets; ++i) EXPECT_EQ(received.values[static_cast<std::size_t>(i)], i);
}

}  // namespace
}  // namespace takt::test
