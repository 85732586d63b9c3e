#pragma once
// The counterpart of takt::Client for tests: serves the topics of a cell and sends exactly the samples of a
// test, including those that a server never sends on purpose (old samples, gaps, silence, no reply).
// Communicates through sockets and shared memory as a server in another process does.
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "client_lib/dds_link.h"
#include "ros2_msgs.h"
#include "takt_msgs.h"
#include "tests/support/test_domain.h"

namespace takt::test {

/// A name no other test process uses at the same time.
inline std::string unique_cell_name(const std::string& stem) {
  static int count = 0;
  return stem + "_" + std::to_string(getpid()) + "_" + std::to_string(++count);
}

/// Two robots with two joints, one gripper, three components.
inline takt_msgs::msg::CellDescription small_description(const std::string& cell) {
  takt_msgs::msg::CellDescription description;
  description.cell = cell;
  description.scenario = "scripted";
  description.step_size = 0.001;
  for (const char* name : {"Table", "B", "Jaw"}) {
    auto& component = description.components.emplace_back();
    component.name = name;
    component.type = name[0] == 'T'   ? ComponentType::ground
                     : name[0] == 'B' ? ComponentType::part
                                      : ComponentType::gripper;
  }
  for (const char* name : {"Robot1", "Robot2"}) {
    auto& robot = description.robots.emplace_back();
    robot.name = name;
    for (const char* joint_name : {"shoulder", "elbow"}) {
      auto& joint = robot.joints.emplace_back();
      joint.name = joint_name;
    }
  }
  auto& gripper = description.grippers.emplace_back();
  gripper.name = "Gripper1";
  gripper.robot = 0;
  return description;
}

inline takt_msgs::msg::CellState small_state(std::uint32_t epoch, std::uint64_t step) {
  takt_msgs::msg::CellState state;
  state.epoch = epoch;
  state.step = step;
  state.time = 0.001 * static_cast<double>(step);
  state.components.resize(3);
  for (auto& component : state.components) component.partner = -1;
  state.robots.resize(2);
  for (auto& robot : state.robots) robot.position = robot.velocity = robot.effort = {0.0, 0.0};
  state.grippers.resize(1);
  return state;
}

class ScriptedCell {
 public:
  using Handler = std::function<void(ScriptedCell&, const takt_msgs::msg::ControlRequest&)>;

  /// Announces the cell, with a description and one status. `handler` answers requests; without it only
  /// get_state is answered.
  ScriptedCell(const std::string& name, const takt_msgs::msg::CellDescription& description,
               Handler handler = {})
      : prefix_("rt/" + name + "/"),
        handler_(std::move(handler)),
        requests_([this](const auto& request, const auto&) { on_request(request); }),
        joints_([this](const auto& command, const auto&) { keep(joint_commands_, command); }),
        grippers_([this](const auto& command, const auto&) { keep(gripper_commands_, command); }),
        commands_listener_([this](const auto& command, const auto&) { keep(commands_, command); }),
        link_(static_cast<int>(test_domain()), "scripted", {}) {
    make_writer<takt_msgs::msg::CellState>("state", false, false);
    make_writer<takt_msgs::msg::Event>("events", true, false);
    make_writer<takt_msgs::msg::Status>("status", true, true);
    make_writer<takt_msgs::msg::ControlReply>("control/reply", true, false);
    make_writer<takt_msgs::msg::CellDescription>("description", true, true);
    link_.create_reader(prefix_ + "control/request",
                        client::dds::TypeSupport(new MessageType<takt_msgs::msg::ControlRequest>()),
                        reader_qos(link_.default_reader_qos(), qos_of(TopicQos::control)), &requests_);
    publish("description", description);
    publish("status", takt_msgs::msg::Status());
  }

  /// Sockets and shared memory also between participants of this process. Call it ahead of the first
  /// participant.
  static bool use_real_transports() {
    deliver_through_transports();
    return true;
  }

  template <typename Sample>
  void publish(const std::string& topic, Sample sample) {
    if (!written(*writers_.at(topic), sample)) throw std::runtime_error("cannot write " + topic);
  }
  void publish_event(std::uint64_t number, const std::string& code) {
    takt_msgs::msg::Event event;
    event.sequence_number = number;
    event.code = code;
    publish("events", event);
  }
  void reply(const takt_msgs::msg::ControlRequest& request, int result, const std::string& message,
             const std::map<std::string, std::string>& values = {}) {
    takt_msgs::msg::ControlReply answer;
    answer.client_id = request.client_id;
    answer.sequence_number = request.sequence_number;
    answer.result = result;
    answer.message = message;
    for (const auto& [name, text] : values) {
      const bool whole = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
      auto& value = answer.values.emplace_back(takt_msgs::msg::Argument{name, {}}).value;
      value.kind = whole ? ValueKind::integer : ValueKind::text;
      if (whole)
        value.integer = std::stoll(text);
      else
        value.text = text;
    }
    publish("control/reply", answer);
  }

  /// Returns when this many readers listen to the topic.
  bool wait_for_readers(const std::string& topic, int count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kGenerous, [&] { return readers_[topic] >= count; });
  }

  void listen_to_joints(const std::string& robot) {
    listen(robot + "/joint_commands", new MessageType<sensor_msgs::msg::JointState>(), &joints_);
  }
  void listen_to_gripper(const std::string& gripper) {
    listen(gripper + "/command", new MessageType<takt_msgs::msg::GripperCommand>(), &grippers_);
  }
  void listen_to_commands() {
    link_.create_reader(
        prefix_ + "commands", client::dds::TypeSupport(new MessageType<takt_msgs::msg::Commands>()),
        reader_qos(link_.default_reader_qos(), qos_of(TopicQos::commands)), &commands_listener_);
  }
  std::vector<takt_msgs::msg::Commands> wait_for_commands(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kGenerous, [&] { return commands_.size() >= count; });
    return commands_;
  }
  std::vector<sensor_msgs::msg::JointState> wait_for_joint_commands(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kGenerous, [&] { return joint_commands_.size() >= count; });
    return joint_commands_;
  }
  std::vector<takt_msgs::msg::GripperCommand> wait_for_gripper_commands(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kGenerous, [&] { return gripper_commands_.size() >= count; });
    return gripper_commands_;
  }

 private:
  static constexpr std::chrono::seconds kGenerous{60};

  template <typename Sample>
  void make_writer(const std::string& topic, bool reliable, bool latched) {
    auto qos = link_.default_writer_qos();
    qos.reliability().kind =
        reliable ? client::dds::RELIABLE_RELIABILITY_QOS : client::dds::BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind =
        latched ? client::dds::TRANSIENT_LOCAL_DURABILITY_QOS : client::dds::VOLATILE_DURABILITY_QOS;
    qos.history().depth = reliable && !latched ? 1000 : 1;
    qos.endpoint().history_memory_policy = kGrowingMemory;
    if (latched) qos.publish_mode().kind = client::dds::ASYNCHRONOUS_PUBLISH_MODE;
    listeners_.push_back(std::make_unique<client::WriterListener>(
        [this, topic](const client::dds::PublicationMatchedStatus& status) {
          const std::lock_guard lock(mutex_);
          readers_[topic] = status.current_count;
          changed_.notify_all();
        },
        [](int) {}));
    writers_[topic] = link_.create_writer(
        prefix_ + topic, client::dds::TypeSupport(new MessageType<Sample>()), qos, listeners_.back().get());
  }

  void listen(const std::string& topic, client::dds::TopicDataType* type,
              client::dds::DataReaderListener* listener) {
    auto qos = reader_qos(link_.default_reader_qos(), qos_of(TopicQos::event));
    qos.ownership().kind = client::dds::EXCLUSIVE_OWNERSHIP_QOS;
    qos.liveliness().lease_duration = DdsDuration(3, 0);
    link_.create_reader(prefix_ + topic, client::dds::TypeSupport(type), qos, listener);
  }

  template <typename Sample>
  void keep(std::vector<Sample>& list, const Sample& sample) {
    const std::lock_guard lock(mutex_);
    list.push_back(sample);
    changed_.notify_all();
  }

  void on_request(const takt_msgs::msg::ControlRequest& request) {
    if (handler_)
      handler_(*this, request);
    else if (request.request == "get_state")
      reply(request, 1, "The simulation is paused.", {{"state", "2"}});
  }

  const std::string prefix_;
  Handler handler_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, int> readers_;
  std::vector<sensor_msgs::msg::JointState> joint_commands_;
  std::vector<takt_msgs::msg::GripperCommand> gripper_commands_;
  std::vector<takt_msgs::msg::Commands> commands_;
  client::ReaderListener<takt_msgs::msg::ControlRequest> requests_;
  client::ReaderListener<sensor_msgs::msg::JointState> joints_;
  client::ReaderListener<takt_msgs::msg::GripperCommand> grippers_;
  client::ReaderListener<takt_msgs::msg::Commands> commands_listener_;
  std::vector<std::unique_ptr<client::WriterListener>> listeners_;
  std::map<std::string, client::dds::DataWriter*> writers_;
  client::Link link_;
};

}  // namespace takt::test
