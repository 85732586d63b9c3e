// The Fast DDS entities of a client.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "client_lib/client.h"
#include "client_lib/dds_link.h"
#include "idl/transport/fastdds/server_participant.h"
#include "takt_topics.h"
#include "tests/support/dds_service.h"

namespace takt {
namespace {

using takt_msgs::msg::Event;

/// Delivery in the thread that writes holds locks of one participant and takes those of another: two of them at a time
/// wait for each other for ever. `takt view` has four participants.
TEST(ClientLink, NoParticipantCallsAnotherOneOfItsProcess) {
  const int domain = static_cast<int>(test::test_domain());
  std::mutex mutex;
  std::condition_variable changed;
  int readers = 0;
  std::optional<std::thread::id> arrived_in;
  client::ReaderListener<Event> on_sample([&](Event&&, const client::GuidPrefix&) {
    const std::lock_guard lock(mutex);
    arrived_in = std::this_thread::get_id();
    changed.notify_all();
  });
  client::WriterListener on_match(
      [&](const dds::PublicationMatchedStatus& status) {
        const std::lock_guard lock(mutex);
        readers = status.current_count;
        changed.notify_all();
      },
      [](int) {});
  client::Link receiving(domain, "receiving", {}), sending(domain, "sending", {});
  receiving.create_reader(topics::event, "cell/event", &on_sample);
  dds::DataWriter* writer =
      sending.create_writer("rt/cell/event", dds::TypeSupport(new MessageType<Event>()),
                            writer_qos(sending.default_writer_qos(), qos_of(topics::event)), &on_match);
  std::unique_lock lock(mutex);
  changed.wait(lock, [&] { return readers > 0; });
  // The writer may know the reader before the reader knows the writer.
  while (!arrived_in) {
    lock.unlock();
    Event event;
    ASSERT_TRUE(written(*writer, event));
    lock.lock();
    changed.wait_for(lock, std::chrono::milliseconds{50});
  }
  EXPECT_NE(*arrived_in, std::this_thread::get_id());
}

/// Participants of clients that have come.
class Comings final : public DiscoveryListener {
 public:
  void on_participant(const DdsGuid& guid, const std::string& name) override {
    const std::lock_guard lock(mutex_);
    if (name.starts_with("rediscovery")) seen_.insert(guid);
  }
  std::size_t count() {
    const std::lock_guard lock(mutex_);
    return seen_.size();
  }

 private:
  std::mutex mutex_;
  std::set<DdsGuid> seen_;
};

/// As when DDS has lost the announcements of the server's endpoints: its participant is there, and they are not.
TEST(ClientRediscovery, TheParticipantIsReplacedWhereAServerIsAnnouncedButDoesNotAnswer) {
  deliver_through_transports();
  Comings comings;
  dds::DomainParticipantQos qos;
  qos.name(std::string(kServerParticipant) + test::test_cell());
  auto* factory = dds::DomainParticipantFactory::get_instance();
  dds::DomainParticipant* server =
      factory->create_participant(test::test_domain(), qos, &comings, dds::StatusMask::none());
  ASSERT_NE(server, nullptr);
  ClientOptions options;
  options.name = "rediscovery";
  options.cell = test::test_cell();
  options.domain = static_cast<int>(test::test_domain());
  options.timeout = Seconds(20.0);
  try {
    const Client client(options);
    ADD_FAILURE() << "there is no server";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.kind(), ClientError::Kind::not_found);
    EXPECT_THAT(error.what(), testing::HasSubstr("does not answer"));
  }
  EXPECT_EQ(comings.count(), 2U);  // after 8 s, and not after 16 s more
  factory->delete_participant(server);
}

}  // namespace
}  // namespace takt
