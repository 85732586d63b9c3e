// The topics that ROS 2 tools read, /clock, /tf and joint states: a tool that joins a standing cell gets them
// too, with the last instant.
#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>

#include "idl/common/stamp.h"
#include "takt_topics.h"
#include "tests/support/dds_service.h"

namespace takt {
namespace {

using test::DdsService;
using test::RawCellClient;
using test::RawDdsClient;

using JointStates = sensor_msgs::msg::JointState;
using Clocks = rosgraph_msgs::msg::Clock;
using Frames = tf2_msgs::msg::TFMessage;

RunLoopOptions free_and_paused() {
  RunLoopOptions options;
  options.pace = Pace::free;
  options.state = SimulationState::paused;
  return options;
}

/// As a node of ROS 2 reads.
struct RosNode {
  explicit RosNode(const std::string& own = "rt/")
      : clock(dds.read<Clocks>(own + "clock", false, false, 1)),
        frames(dds.read<Frames>(own + "tf", true, false, 100)),
        fixed_frames(dds.read<Frames>(own + "tf_static", true, true, 1)),
        joints(dds.read<JointStates>(RawCellClient::topic("Robot2/joint_states"), true, false, 10)) {}

  bool has_come_to(double time_s) {
    const auto wanted = to_time(time_s);
    return clock->wait_for([&](const auto& m) { return m.clock == wanted; }) &&
           joints->wait_for([&](const auto& m) { return m.header.stamp == wanted; }) &&
           frames->wait_for([&](const auto& m) {
             return std::all_of(m.transforms.begin(), m.transforms.end(),
                                [&](const auto& frame) { return frame.header.stamp == wanted; });
           });
  }

  RawDdsClient dds{test::test_domain()};
  std::shared_ptr<test::Inbox<rosgraph_msgs::msg::Clock>> clock;
  std::shared_ptr<test::Inbox<tf2_msgs::msg::TFMessage>> frames, fixed_frames;
  std::shared_ptr<test::Inbox<sensor_msgs::msg::JointState>> joints;
};

TEST(RosTopics, TopicsOfAStoppedCellReachLateJoiners) {
  const DdsService service(free_and_paused());
  RawCellClient client;
  ASSERT_EQ(client.request("step", {{"steps", "30"}}).result, 1);
  RosNode node;
  EXPECT_TRUE(node.has_come_to(0.03));
  // It continues: a node that lost one gets the next.
  node.clock->forget();
  node.frames->forget();
  node.joints->forget();
  EXPECT_TRUE(node.has_come_to(0.03));
}

TEST(RosTopics, TopicsEndWithTheLastInstant) {
  const DdsService service(free_and_paused());
  RawCellClient client;
  RosNode node;
  ASSERT_TRUE(node.has_come_to(0.0));
  // Many instants within the 20 ms between two messages of frames, and a pause after them.
  for (int hundreds = 1; hundreds <= 3; ++hundreds) {
    ASSERT_EQ(client.request("step", {{"steps", "100"}}).result, 1);
    EXPECT_TRUE(node.has_come_to(0.1 * hundreds));
  }
  // So too when time goes back.
  node.clock->forget();
  node.frames->forget();
  node.joints->forget();
  ASSERT_EQ(client.request("step", {{"steps", "1"}}).result, 1);
  ASSERT_EQ(client.request("reset").result, 1);
  EXPECT_TRUE(node.has_come_to(0.0));
}

/// Announcements of remote writers to a participant.
class WriterAnnouncements final : public DiscoveryListener {
 public:
  void on_writer(const DiscoveredWriter& writer) override {
    const std::lock_guard lock(mutex_);
    writers_[writer.topic] = {writer.type, writer.user_data};
    changed_.notify_all();
  }
  /// Type and user data of the writer of a topic.
  std::pair<std::string, std::string> of(const std::string& topic) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(60), [&] { return writers_.contains(topic); });
    return writers_[topic];
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, std::pair<std::string, std::string>> writers_;
};

TEST(RosTopics, EachWriterAnnouncesTheHashOfItsType) {
  const DdsService service(free_and_paused());
  WriterAnnouncements announcements;
  auto* factory = dds::DomainParticipantFactory::get_instance();
  auto* participant = factory->create_participant(test::test_domain(), dds::PARTICIPANT_QOS_DEFAULT,
                                                  &announcements, dds::StatusMask::none());
  ASSERT_NE(participant, nullptr);
  for (const TopicInfo* topic : std::initializer_list<const TopicInfo*>{
           &topics::state, &topics::status, &topics::event, &topics::description, &topics::control_reply,
           &topics::clock, &topics::tf, &topics::tf_static}) {
    const std::string name = topic->name(test::test_cell());
    const auto [type, user_data] = announcements.of("rt/" + name);
    EXPECT_EQ(type, topic->type->dds_type) << name;
    // idl.ros_package compares this annotation with the hash that ROS 2 computes of the definition.
    EXPECT_EQ(user_data, "typehash=" + std::string(annotation(topic->type->annotations, "type_hash")) + ";")
        << name;
    EXPECT_NE(user_data.find("RIHS01_"), std::string::npos) << name;
  }
  factory->delete_participant(participant);
}

}  // namespace
}  // namespace takt
