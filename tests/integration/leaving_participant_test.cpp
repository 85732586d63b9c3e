// A participant leaves while announcements of removed endpoints are repeated for it. Stock Fast DDS 2.9.1 deadlocks here
// (Fast-DDS #3468).
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "client_lib/dds_link.h"
#include "takt_topics.h"
#include "tests/support/foreign_sender.h"
#include "tests/support/test_domain.h"

namespace {

using takt::test::ForeignSender;
using takt::test::Forgery;
using takt::test::invented_prefix;

/// How often a participant has been discovered or lost.
class Changes final : public takt::DiscoveryListener {
 public:
  void on_participant(const takt::DdsGuid&, const std::string&) override {
    const std::lock_guard lock(mutex_);
    ++count_;
    changed_.notify_all();
  }
  int count() {
    const std::lock_guard lock(mutex_);
    return count_;
  }
  bool wait_beyond(int count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [&] { return count_ > count; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int count_ = 0;
};

TEST(LeavingParticipant, DoesNotStallDiscovery) {
  constexpr int rounds = 300, endpoints = 120;
  constexpr std::uint32_t announced = 2 * endpoints;  // each reader twice: it is there, it is gone
  constexpr std::chrono::microseconds step{10};
  takt::deliver_through_transports();
  auto changes = std::make_unique<Changes>();
  auto link = std::make_unique<takt::client::Link>(takt::test::test_domain(), "leaving",
                                                   takt::client::LinkProfile{}, changes.get());
  const ForeignSender sender(takt::test::test_domain());
  for (std::uint32_t round = 0; round < rounds; ++round) {
    const Forgery guest(invented_prefix(round));
    int before = changes->count();
    sender.announce(guest.announcement(3600));
    ASSERT_TRUE(changes->wait_beyond(before)) << "round " << round;
    for (int i = 0; i < endpoints; ++i)
      link->remove(link->create_reader(takt::topics::event, "leaving/events", nullptr));
    before = changes->count();
    sender.announce(guest.request(0x000004c7, 0x000004c2, 1 + round * announced, announced));
    const auto leaves = std::chrono::steady_clock::now() + step * (round % 60);
    while (std::chrono::steady_clock::now() < leaves) continue;
    sender.announce(guest.participant_ends());  // while the removals are repeated for it
    if (!changes->wait_beyond(before)) {
      // Neither can be destroyed.
      static_cast<void>(link.release());
      static_cast<void>(changes.release());
      FAIL() << "discovery stalled in round " << round;
    }
  }
}

}  // namespace
