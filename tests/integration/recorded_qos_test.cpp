// The QoS of topics in recordings is that of the server's writers, according to discovery.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>

#include "client_lib/raw_topics.h"
#include "client_lib/recording/mcap_reader.h"
#include "client_lib/recording/mcap_writer.h"
#include "client_lib/recording/offered_qos.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/hosted_service.h"
#include "tests/support/hosting_client.h"
#include "tests/support/temporary_directory.h"

namespace {

using takt::recording::McapReader;
using takt::recording::OfferedQos;
using takt::test::ChildProcess;
using takt::test::HostedService;
using takt::test::kBin;
using takt::test::kGenerous;

/// The server's topics, without those named after robots, and without contact_pressures, which exists only if
/// bodies can press.
const std::vector<std::string> kTopics{"description", "status", "events", "state", "power", "contacts"};
const std::vector<std::string> kOfAllCells{"/clock", "/tf", "/tf_static"};

/// According to discovery, after all named topics have appeared.
std::map<std::string, OfferedQos> offered(const std::vector<std::string>& wanted) {
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::string, OfferedQos> found;
  const auto complete = [&] {
    return std::all_of(wanted.begin(), wanted.end(),
                       [&](const auto& topic) { return found.contains(topic); });
  };
  takt::client::RawTopics topics(
      takt::test::client_options(),
      [&](const takt::client::RawTopic& topic) {
        const std::lock_guard lock(mutex);
        found[topic.name] = {topic.reliable, topic.latched};
        changed.notify_all();
      },
      [](const takt::client::RawTopic&, std::string_view) {});
  std::unique_lock lock(mutex);
  EXPECT_TRUE(changed.wait_for(lock, kGenerous, complete)) << found.size() << " topics found";
  return found;
}

/// The profile as rosbag2 reads it: one, of numbers, with all keys that its reader needs.
OfferedQos profile_of(const takt::recording::McapChannel& channel) {
  const YAML::Node profiles = YAML::Load(channel.metadata.at("offered_qos_profiles"));
  EXPECT_TRUE(profiles.IsSequence() && profiles.size() == 1) << channel.topic;
  const YAML::Node profile = profiles[0];
  EXPECT_EQ(profile["history"].as<int>(), 3) << channel.topic;
  EXPECT_EQ(profile["depth"].as<int>(), 0) << channel.topic;
  EXPECT_EQ(profile["liveliness"].as<int>(), 1) << channel.topic;
  EXPECT_FALSE(profile["avoid_ros_namespace_conventions"].as<bool>()) << channel.topic;
  for (const char* duration : {"deadline", "lifespan", "liveliness_lease_duration"}) {
    EXPECT_EQ(profile[duration]["sec"].as<std::uint64_t>(), 9223372036U) << channel.topic;
    EXPECT_EQ(profile[duration]["nsec"].as<std::uint64_t>(), 854775807U) << channel.topic;
  }
  const int reliability = profile["reliability"].as<int>(), durability = profile["durability"].as<int>();
  EXPECT_TRUE(reliability == 1 || reliability == 2) << channel.topic;
  EXPECT_TRUE(durability == 1 || durability == 2) << channel.topic;
  return {reliability == 1, durability == 1};
}

/// The topic of the server that a channel stands for: takt-run's cell has the name "cell".
std::string topic_of_server(const takt::recording::McapChannel& channel) {
  constexpr std::string_view kRun = "/cell/";
  if (!channel.topic.starts_with(kRun)) return channel.topic;
  return "/" + takt::test::test_cell() + "/" + channel.topic.substr(kRun.size());
}

/// Compares all channels of a file; returns how many there are.
std::size_t compare(const McapReader& file, const std::map<std::string, OfferedQos>& writers) {
  for (const auto& [number, channel] : file.channels()) {
    const auto writer = writers.find(topic_of_server(channel));
    if (writer == writers.end()) {
      ADD_FAILURE() << channel.topic << " is recorded, but no server writes it";
    } else {
      EXPECT_EQ(profile_of(channel), writer->second) << channel.topic;
    }
  }
  return file.channels().size();
}

TEST(RecordedQos, RecordedQosEqualsThatOfTheServersWriters) {
  HostedService service;
  const std::string prefix = "/" + takt::test::test_cell() + "/";
  // takt record stores the QoS of discovery. After a second the file on the disk has the description.
  const auto recorded = service.directory / "recorded.mcap";
  ChildProcess record({kBin + "/takt", "--cell", takt::test::test_cell(), "--domain",
                       std::to_string(takt::test::test_domain()), "record", recorded.string(), "--until",
                       "0.05"});
  takt::Client client(takt::test::client_options());
  const auto described = [&] {
    try {
      const McapReader begun(recorded);
      return begun.channel(prefix + "description") != nullptr && begun.channel(prefix + "state") != nullptr;
    } catch (const takt::recording::RecordingError&) {
      return false;  // the file is still empty
    }
  };
  for (int i = 0; i < 100000 && !described(); ++i)
    (void)client.wait_for(
        takt::topics::status,
        [n = client.status().sample_number](const auto& s) { return s.sample_number > n; }, kGenerous);
  client.step(60);
  EXPECT_EQ(record.wait(), 0) << record.text;

  // takt-run, which has no writers, stores the QoS of the server's writers.
  const auto simulated = service.directory / "simulated.mcap";
  ChildProcess run({kBin + "/takt-run", "run", service.two_robots().string(), "--lod", "2", "--duration",
                    "0.05", "--quiet", "--mcap", simulated.string()});
  EXPECT_EQ(run.wait(), 0) << run.text;

  // Discovery reports a server's writers one by one: what a file holds is waited for too.
  const McapReader of_record(recorded), of_run(simulated);
  std::vector<std::string> wanted = kOfAllCells;
  for (const std::string& topic : kTopics) wanted.push_back(prefix + topic);
  for (const char* robot : {"Robot1", "Robot2"})
    for (const char* topic : {"/joint_states", "/robot_description"})
      wanted.push_back(prefix + robot + topic);
  for (const McapReader* file : {&of_record, &of_run})
    for (const auto& [number, channel] : file->channels()) wanted.push_back(topic_of_server(channel));
  const std::map<std::string, OfferedQos> writers = offered(wanted);
  for (const auto& [topic, qos] : writers) EXPECT_EQ(takt::recording::qos_of_server(topic), qos) << topic;
  EXPECT_EQ(takt::recording::qos_of_server(prefix + "contact_pressures"), writers.at(prefix + "contacts"));
  EXPECT_EQ(takt::recording::qos_of_server(prefix + "Robot1/joint_commands"), OfferedQos{});
  EXPECT_GT(compare(of_record, writers), 3U);
  EXPECT_GT(compare(of_run, writers), 6U);
}

TEST(RecordedQos, EveryFormOfQosIsRead) {
  using takt::recording::read_offered_qos;
  for (const bool reliable : {false, true})
    for (const bool latched : {false, true}) {
      const OfferedQos qos{reliable, latched};
      EXPECT_EQ(read_offered_qos(takt::recording::offered_qos_profiles(qos)), qos);
    }
  const auto profile = [](const std::string& reliability, const std::string& durability) {
    return "- history: keep_last\n  depth: 1\n  reliability: " + reliability +
           "\n  durability: " + durability + "\n";
  };
  EXPECT_EQ(read_offered_qos(profile("reliable", "transient_local")), (OfferedQos{true, true}));
  EXPECT_EQ(read_offered_qos(profile("best_effort", "volatile")), (OfferedQos{false, false}));
  // Two writers of one topic: readers of either get their QoS.
  EXPECT_EQ(read_offered_qos(profile("best_effort", "volatile") + profile("reliable", "volatile")),
            (OfferedQos{true, false}));
  EXPECT_EQ(read_offered_qos(profile("1", "2") + profile("2", "1")), (OfferedQos{true, true}));
  for (const char* wrong : {"", "[]", "- {}", "reliable", "- reliability: 1", "- [", "{: "})
    EXPECT_EQ(read_offered_qos(wrong), std::nullopt) << wrong;
  EXPECT_EQ(read_offered_qos(profile("sometimes", "volatile")), std::nullopt);
}

/// A file of another program: its names contain no QoS, or another one.
TEST(RecordedQos, AReplayOffersTheRecordedQos) {
  const takt::test::TemporaryDirectory directory;
  const auto file = directory / "foreign.mcap";
  const std::string prefix = "/" + takt::test::test_cell() + "/";
  const std::map<std::string, OfferedQos> written{{prefix + "latched", {true, true}},
                                                  {prefix + "state", {true, false}},
                                                  {prefix + "quick", {false, false}}};
  {
    takt::recording::McapWriter writer(file, "a program of its own");
    for (const auto& [topic, qos] : written) {
      const auto channel =
          writer.add_channel(topic, takt::recording::known_types(), "rosgraph_msgs/msg/Clock", qos);
      // Two samples a long time apart, so that the replay lasts long enough.
      for (const std::uint64_t time_ns : {1ULL, 600'000'000'000ULL})
        writer.write(channel, time_ns, time_ns, std::string("\0\1\0\0\5\0\0\0\6\0\0\0", 12));
    }
    writer.close();
  }
  ChildProcess replay(
      {kBin + "/takt", "--domain", std::to_string(takt::test::test_domain()), "replay", file.string()});
  std::vector<std::string> wanted;
  for (const auto& [topic, qos] : written) wanted.push_back(topic);
  const auto found = offered(wanted);
  for (const auto& [topic, qos] : written) {
    ASSERT_TRUE(found.contains(topic)) << topic;
    EXPECT_EQ(found.at(topic), qos) << topic;
  }
  replay.signal(SIGINT);
  EXPECT_EQ(replay.wait(), 0) << replay.text;
}

}  // namespace
