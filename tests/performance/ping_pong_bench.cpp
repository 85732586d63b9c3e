// A state and its answer between two processes over plain Fast DDS, without takt: samples of the same types, sizes and QoS
// as in lockstep. Prints the median and the mean of a round in microseconds. The answer is written by a thread that the
// listener wakes, as any controller is.
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>
#include <vector>

#include "idl/common/cdr.h"
#include "idl/transport/fastdds/topic_qos.h"
#include "ros2_msgs.h"
#include "takt_msgs.h"
#include "takt_topics.h"

namespace takt {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  unsigned domain = 77;
  int rounds = 5000, components = 12, joints = 6, answers = 1;
  bool udp = false;
};

/// The number of the newest sample, for the thread that waits for it.
template <typename Message>
class Newest final : public dds::DataReaderListener {
 public:
  void on_data_available(dds::DataReader* reader) override {
    dds::SampleInfo info;
    while (is_ok(reader->take_next_sample(&message_, &info))) {
      if (!info.valid_data) continue;
      const std::lock_guard lock(mutex_);
      ++count_;
      arrived_.notify_all();
    }
  }
  /// False after this time of silence.
  bool wait_beyond(std::uint64_t count, std::chrono::milliseconds limit = std::chrono::seconds(1)) {
    std::unique_lock lock(mutex_);
    return arrived_.wait_for(lock, limit, [&] { return count_ > count; });
  }
  std::uint64_t count() {
    const std::lock_guard lock(mutex_);
    return count_;
  }

 private:
  Message message_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::uint64_t count_ = 0;
};

class Node {
 public:
  explicit Node(const Options& options) {
    dds::DomainParticipantQos qos;
    if (options.udp) {
      qos.transport().use_builtin_transports = false;
      qos.transport().user_transports.push_back(std::make_shared<transports::UDPv4TransportDescriptor>());
    }
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(options.domain, qos);
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  }
  template <typename Message>
  dds::DataWriter* writer(const char* name, TopicQos kind) {
    return publisher_->create_datawriter(topic<Message>(name),
                                         writer_qos(publisher_->get_default_datawriter_qos(), qos_of(kind)));
  }
  template <typename Message>
  dds::DataReader* reader(const char* name, TopicQos kind, dds::DataReaderListener* listener, int depth) {
    auto qos = reader_qos(subscriber_->get_default_datareader_qos(), qos_of(kind));
    qos.history().depth = depth;
    return subscriber_->create_datareader(topic<Message>(name), qos, listener);
  }

 private:
  template <typename Message>
  dds::Topic* topic(const char* name) {
    dds::TypeSupport type(new MessageType<Message>());
    (void)type.register_type(participant_);
    return participant_->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  }
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
};

takt_msgs::msg::CellState state_of(const Options& options) {
  takt_msgs::msg::CellState state;
  state.components.resize(static_cast<std::size_t>(options.components));
  state.robots.resize(2);
  for (auto& robot : state.robots)
    robot.position.resize(static_cast<std::size_t>(options.joints)),
        robot.velocity = robot.effort = robot.position;
  state.grippers.resize(2);
  state.applied.resize(4);
  for (auto& applied : state.applied) applied.target = "Gripper1";
  return state;
}

/// The other side: answers every state until none comes any more.
int answer(const Options& options) {
  Node node(options);
  Newest<takt_msgs::msg::CellState> states;
  node.reader<takt_msgs::msg::CellState>("states", TopicQos::instant, &states, 1);
  auto* writer = node.writer<sensor_msgs::msg::JointState>("answers", TopicQos::command);
  sensor_msgs::msg::JointState command;
  command.name.assign(static_cast<std::size_t>(options.joints), "shoulder_lift_joint");
  command.position.assign(static_cast<std::size_t>(options.joints), 0.5);
  command.velocity = command.position;
  for (std::uint64_t count = 0, silent = 0; silent < 3;) {
    if (!states.wait_beyond(count)) {
      silent += count > 0 ? 1U : 0U;
      continue;
    }
    count = states.count();
    for (int i = 0; i < options.answers; ++i) writer->write(&command, dds::HANDLE_NIL);
  }
  return 0;
}

int ask(const Options& options) {
  Node node(options);
  Newest<sensor_msgs::msg::JointState> answers;
  node.reader<sensor_msgs::msg::JointState>("answers", TopicQos::command, &answers, 100);
  auto* writer = node.writer<takt_msgs::msg::CellState>("states", TopicQos::instant);
  takt_msgs::msg::CellState state = state_of(options);
  const auto expected = static_cast<std::uint64_t>(options.answers);
  do {  // until both sides have found each other
    writer->write(&state, dds::HANDLE_NIL);
  } while (!answers.wait_beyond(expected - 1, std::chrono::milliseconds(100)));
  std::vector<double> rounds_us;
  for (int i = 0; i < options.rounds; ++i) {
    const std::uint64_t before = answers.count();
    const auto began = Clock::now();
    writer->write(&state, dds::HANDLE_NIL);
    if (!answers.wait_beyond(before + expected - 1)) continue;  // a lost sample
    rounds_us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - began).count());
  }
  if (rounds_us.empty()) return 1;
  double sum = 0.0;
  for (const double round : rounds_us) sum += round;
  std::sort(rounds_us.begin(), rounds_us.end());
  std::printf("%s: state of %zu bytes, %d answers: median %.1f us, mean %.1f us, %zu rounds\n",
              options.udp ? "UDP" : "shared memory and UDP", cdr::size(state), options.answers,
              rounds_us[rounds_us.size() / 2], sum / static_cast<double>(rounds_us.size()), rounds_us.size());
  return 0;
}

}  // namespace
}  // namespace takt

int main(int argc, char** argv) {
  takt::Options options;
  CLI::App app("Plain Fast DDS: a state there, an answer back");
  app.add_option("--domain", options.domain, "DDS domain");
  app.add_option("--rounds", options.rounds, "rounds");
  app.add_option("--components", options.components, "components of the state");
  app.add_option("--joints", options.joints, "joints of the answer");
  app.add_option("--answers", options.answers, "answers to each state");
  app.add_flag("--udp", options.udp, "UDP alone; without it the transports that Fast DDS has by default");
  CLI11_PARSE(app, argc, argv);
  const pid_t child = fork();
  if (child == 0) _exit(takt::answer(options));
  const int result = takt::ask(options);
  int status = 0;
  waitpid(child, &status, 0);
  return result;
}
