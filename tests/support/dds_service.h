#pragma once
// The service in this process, on a domain and under a cell name of its own, with raw endpoints to talk to
// it.
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/dds/dds_adapter.h"
#include "server/runtime/host/cell_host.h"
#include "tests/support/raw_dds_client.h"
#include "tests/support/service_cell.h"
#include "tests/support/test_domain.h"

namespace takt::test {

namespace msg = takt_msgs::msg;

class DdsService {
 public:
  explicit DdsService(RunLoopOptions options, std::shared_ptr<CellModel> given = nullptr)
      : model(given ? std::move(given) : service_model(test_cell())), host(host_options(std::move(options))) {
    adapter = std::make_unique<DdsAdapter>(host, ParticipantOptions{"test server", test_domain(), "", ""});
    host.open(model);
    loop = host.loop();
  }
  ~DdsService() { stop(); }
  void stop() {
    host.stop();
    adapter->stop();
  }

  /// After its end.
  const Simulation& simulation() const { return *host.simulation(); }

  std::shared_ptr<CellModel> model;
  CellHost host;
  RunLoop* loop = nullptr;  ///< that of `model`, as long as no other scenario is loaded
  std::unique_ptr<DdsAdapter> adapter;

 private:
  static HostOptions host_options(RunLoopOptions loop_options) {
    HostOptions options;
    options.cell = test_cell();
    options.loop = std::move(loop_options);
    return options;
  }
};

/// Reads the samples of a cell and requests control, by raw endpoints.
class RawCellClient {
 public:
  using Arguments = std::vector<std::pair<std::string, std::string>>;

  RawCellClient()
      : dds(test_domain()),
        status(dds.read<msg::Status>(topic("status"), true, true, 1)),
        state(dds.read<msg::CellState>(topic("state"), false, false, 100)),
        events(dds.read<msg::Event>(topic("events"), true, false, 1000)),
        replies_(dds.read<msg::ControlReply>(topic("control/reply"), true, false, 100)),
        requests_(dds.write<msg::ControlRequest>(topic("control/request"))) {
    requests_.matches->wait_for(1);
    // A reply needs a matched reply reader too: repeat until one arrives.
    for (int attempt = 0; attempt < 600 && !send("get_state", {}, 1); ++attempt) {
    }
    sequence_ = 1;
    status->wait_until([](const auto& messages) { return !messages.empty(); });
    state->wait_until([](const auto& messages) { return !messages.empty(); });
    events_at_start();
  }

  static std::string topic(const std::string& name) { return "rt/" + test_cell() + "/" + name; }

  msg::ControlReply request(const std::string& name, const Arguments& arguments = {}) {
    ++sequence_;
    write(name, arguments, sequence_);
    msg::ControlReply reply;
    reply.result = -1;
    replies_->wait_for([&](const auto& m) { return m.sequence_number == sequence_; }, &reply);
    return reply;
  }
  /// Waits for tenths of a second; the result is -1 if no reply has come.
  msg::ControlReply request_within(int tenths, const std::string& name) {
    write(name, {}, ++sequence_);
    msg::ControlReply reply;
    reply.result = -1;
    const auto mine = [&](const std::vector<msg::ControlReply>& all) {
      for (const auto& m : all)
        if (m.sequence_number == sequence_) reply = m;
      return reply.result >= 0;
    };
    for (int i = 0; i < tenths && !replies_->wait_briefly(mine); ++i) {
    }
    return reply;
  }
  void write(const std::string& name, const Arguments& arguments, std::uint64_t sequence,
             const std::string& client_id = "raw") {
    msg::ControlRequest message;
    message.client_id = client_id;
    message.sequence_number = sequence;
    message.request = name;
    message.arguments = arguments_of_text(name, arguments);
    requests_.writer->write(&message);
  }
  std::vector<msg::ControlReply> replies() { return replies_->messages(); }
  std::size_t replies_with(std::uint64_t sequence) {
    std::size_t count = 0;
    for (const auto& reply : replies_->messages()) count += reply.sequence_number == sequence ? 1U : 0U;
    return count;
  }
  bool wait_for_replies(std::uint64_t sequence, std::size_t wanted) {
    return replies_->wait_until([&](const auto& messages) {
      std::size_t count = 0;
      for (const auto& reply : messages) count += reply.sequence_number == sequence ? 1U : 0U;
      return count >= wanted;
    });
  }
  static std::string value(const msg::ControlReply& reply, const std::string& name) {
    for (const auto& argument : reply.values) {
      if (argument.name == name) return text_of(argument.value);
    }
    return "(none)";
  }
  /// The first event with this code, subject and these words in its message.
  bool wait_for_event(const std::string& code, const std::string& subject, const std::string& words,
                      msg::Event* found = nullptr) {
    return events->wait_for(
        [&](const msg::Event& event) {
          return event.code == code.c_str() && event.subject == subject.c_str() &&
                 event.message.find(words) != std::string::npos;
        },
        found);
  }
  std::size_t count_events(const std::string& code) {
    std::size_t count = 0;
    for (const auto& event : events->messages()) count += event.code == code.c_str() ? 1U : 0U;
    return count;
  }

  void forget() {
    status->forget();
    state->forget();
    events->forget();
    replies_->forget();
  }

  RawDdsClient dds;
  std::shared_ptr<Inbox<msg::Status>> status;
  std::shared_ptr<Inbox<msg::CellState>> state;
  std::shared_ptr<Inbox<msg::Event>> events;

 private:
  bool send(const std::string& name, const Arguments& arguments, std::uint64_t sequence) {
    write(name, arguments, sequence);
    return replies_->wait_briefly([&](const auto& messages) { return !messages.empty(); });
  }
  /// Late joiners get no old events: provokes one until it arrives, so that no event of the test is missed.
  void events_at_start() {
    for (int attempt = 0; attempt < 600; ++attempt) {
      request("set_pace", {{"pace", value(request("get_state"), "pace")}});
      if (events->wait_briefly([](const auto& messages) { return !messages.empty(); })) return;
    }
  }

  std::shared_ptr<Inbox<msg::ControlReply>> replies_;
  RawWriter requests_;
  std::uint64_t sequence_ = 0;
};

inline sensor_msgs::msg::JointState to_message(const ArmModel& arm, const JointCommand& command,
                                               double time_s) {
  sensor_msgs::msg::JointState message;
  const auto ns = static_cast<std::int64_t>(std::llround(time_s * 1e9));
  message.header.stamp.sec = static_cast<std::int32_t>(ns / 1'000'000'000);
  message.header.stamp.nanosec = static_cast<std::uint32_t>(ns % 1'000'000'000);
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    message.name.push_back(arm.joints[i].name);
    message.position.push_back(command.position[i]);
    if (command.has_velocity) message.velocity.push_back(command.velocity[i]);
    if (command.has_effort) message.effort.push_back(command.effort[i]);
  }
  return message;
}

}  // namespace takt::test
