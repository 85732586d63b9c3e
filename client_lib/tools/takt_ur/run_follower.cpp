#include <cmath>
#include <optional>

#include "client_lib/gateway/cell_link.h"
#include "client_lib/gateway/event_loop.h"
#include "client_lib/gateway/rtde/client_session.h"
#include "client_lib/tools/takt_ur/gateway_options.h"
#include "client_lib/tools/takt_ur/ur_mapping.h"

namespace takt::ur {
namespace {

constexpr int kRunning = 7;
constexpr std::chrono::seconds kReconnect{1};
/// A controller whose newest package is older counts as not connected.
constexpr std::chrono::seconds kHeard{1};

/// One robot that follows one controller.
class Follower {
 public:
  Follower(gateway::EventLoop& loop, gateway::CellLink& link, const UrMapping& mapping, std::string host)
      : loop_(loop),
        link_(link),
        mapping_(mapping),
        host_(std::move(host)),
        resynchronisation_(mapping.follow.first_command) {
    connect();
  }

  void supervise() {
    if (following_ && gateway::Clock::now() > silent_after_) {
      report("The controller is silent.");
      ++silences_;
      interrupt();
    }
    const bool hears = connection_ != nullptr && gateway::Clock::now() - heard_at_ < kHeard;
    link_.show({host_ + " port " + std::to_string(mapping_.rtde_port), hears, packages_, silences_});
  }
  std::uint64_t packages() const { return packages_; }

 private:
  void report(const std::string& sentence) const {
    gateway::report("takt-ur " + mapping_.robot.robot, sentence);
  }

  void connect() {
    loop_.connect(host_, static_cast<std::uint16_t>(mapping_.rtde_port), 1, kReconnect,
                  [this](auto connection) {
                    if (!connection) {
                      if (!reported_)
                        report("The controller at " + host_ + " port " + std::to_string(mapping_.rtde_port) +
                               " does not answer; takt-ur tries again each second.");
                      reported_ = true;
                      loop_.after(kReconnect, [this] { connect(); });
                      return;
                    }
                    reported_ = false;
                    connection_ = std::move(connection);
                    start();
                  });
  }

  void start() {
    std::vector<std::string> outputs{"timestamp",
                                     mapping_.follow.uses_target ? "target_q" : "actual_q",
                                     "actual_qd",
                                     "actual_digital_output_bits",
                                     "runtime_state",
                                     "robot_mode",
                                     "safety_status_bits",
                                     "standard_analog_output0",
                                     "standard_analog_output1"};
    if (mapping_.follow.uses_target) outputs[2] = "target_qd";
    for (const auto& output : mapping_.outputs)
      if (output.name.find("put_") != std::string::npos &&
          output.name.find("_register_") != std::string::npos)
        outputs.push_back(output.name);
    std::vector<std::string> inputs;
    for (const auto& input : mapping_.inputs)
      if (input.name.substr(0, 6) == "input_") inputs.push_back(input.name);
    session_.emplace(outputs, inputs, mapping_.follow.frequency_Hz);
    resynchronisation_.restart();
    refused_ = false;
    connection_->start({[this](std::string_view bytes) { receive(bytes); },
                        [this] { lost("The controller has closed the connection."); }});
    connection_->send(session_->begin());
  }

  void lost(const std::string& why) {
    report(why);
    interrupt();
    connection_.reset();
    loop_.after(kReconnect, [this] { connect(); });
  }

  void interrupt() {
    if (following_ && mapping_.follow.silence.action == SafeAction::stop)
      link_.sender().stop(mapping_.robot.robot);
    following_ = false;
    resynchronisation_.restart();
  }

  void receive(std::string_view bytes) {
    connection_->send(session_->receive(bytes, [this] { take(); }));
    for (const std::string& message : session_->take_messages()) report(message);
    if (!session_->failure().empty()) {
      connection_->close();
      lost(session_->failure());
    }
  }

  void take() {
    ++packages_;
    heard_at_ = gateway::Clock::now();
    const auto real = [this](const char* name) -> const rtde::Value& { return session_->value(name); };
    const std::int64_t mode = real("robot_mode").whole[0], safety = real("safety_status_bits").whole[0];
    const bool usable = mode == kRunning && (safety & 1) != 0;
    if (usable != usable_) {
      report(usable ? "The controller's robot is running."
                    : "The controller's robot is not running; takt's stays where it is.");
      if (!usable) interrupt();
    }
    usable_ = usable;
    write_outputs();
    if (!usable || !link_.plays()) return;
    const auto& q = real(mapping_.follow.uses_target ? "target_q" : "actual_q").real;
    const auto& qd = real(mapping_.follow.uses_target ? "target_qd" : "actual_qd").real;
    const auto command = mapping_.robot.to_cell(q);
    for (const double value : command)
      if (!std::isfinite(value)) return;
    const auto present = link_.state()->robot(mapping_.robot.robot).position;
    const bool engaged = resynchronisation_.engaged();
    const auto set_point = resynchronisation_.next(command, present, 1.0 / mapping_.follow.frequency_Hz);
    if (!set_point) {
      if (!refused_)
        report(
            "The controller's robot is far from takt's; its positions are refused until it is near "
            "(first_command.on_jump).");
      refused_ = true;
      return;
    }
    if (!engaged && resynchronisation_.engaged()) report("takt's robot follows the controller.");
    refused_ = false;
    following_ = true;
    silent_after_ =
        gateway::Clock::now() + std::chrono::duration_cast<gateway::Clock::duration>(
                                    std::chrono::duration<double>(mapping_.follow.silence.deadline_s));
    link_.sender().move(
        mapping_.robot.robot, *set_point,
        resynchronisation_.engaged() ? mapping_.robot.rates_to_cell(qd) : std::vector<double>{});
    feed_back();
  }

  void write_outputs() {
    const auto bits = static_cast<std::uint64_t>(session_->value("actual_digital_output_bits").whole[0]);
    for (std::size_t i = 0; i < mapping_.outputs.size(); ++i) {
      const gateway::OutputMapping& output = mapping_.outputs[i];
      const auto number = [&](std::string_view stem) {
        return static_cast<unsigned>(std::stoi(output.name.substr(stem.size())));
      };
      const auto starts = [&](std::string_view stem) { return output.name.substr(0, stem.size()) == stem; };
      const auto bit = [&](unsigned n) { return static_cast<double>((bits >> n) & 1U); };
      double value = 0.0;
      if (starts("standard_digital_output_"))
        value = bit(number("standard_digital_output_"));
      else if (starts("configurable_digital_output_"))
        value = bit(8 + number("configurable_digital_output_"));
      else if (starts("tool_digital_output_"))
        value = bit(16 + number("tool_digital_output_"));
      else if (starts("standard_analog_output_"))
        value = session_
                    ->value(number("standard_analog_output_") == 0 ? "standard_analog_output0"
                                                                   : "standard_analog_output1")
                    .real[0];
      else if (output.name.find("_double_") != std::string::npos)
        value = session_->value(output.name).real[0];
      else
        value = static_cast<double>(session_->value(output.name).whole[0]);
      if (written_.size() <= i) written_.resize(i + 1);
      if (written_[i] == value) continue;
      // The first package has the present value; a gripper that is 0 there is not opened.
      const bool first = !written_[i].has_value();
      written_[i] = value;
      if (!first || value != 0.0) gateway::write_output(output, value, link_.sender());
    }
  }

  void feed_back() {
    const auto state = link_.state();
    std::vector<rtde::Value> values;
    for (const auto& input : mapping_.inputs) {
      if (input.name.substr(0, 6) != "input_") continue;
      rtde::Value& value = values.emplace_back();
      value.real[0] = gateway::number_of(input, *state);
      value.whole[0] = input.name.find("_bit_") != std::string::npos
                           ? std::int64_t{gateway::digital(input, *state)}
                           : std::llround(std::clamp(value.real[0], -2147483648.0, 2147483647.0));
    }
    connection_->send(session_->inputs(values));
  }

  gateway::EventLoop& loop_;
  gateway::CellLink& link_;
  const UrMapping& mapping_;
  const std::string host_;
  gateway::Resynchronisation resynchronisation_;
  std::shared_ptr<gateway::Connection> connection_;
  std::optional<rtde::ClientSession> session_;
  bool reported_ = false, usable_ = false, following_ = false, refused_ = false;
  std::uint64_t packages_ = 0, silences_ = 0;
  gateway::Clock::time_point silent_after_, heard_at_;
  std::vector<std::optional<double>> written_;
};

}  // namespace

int run_follower(const GatewayRun& options) {
  Client client(options.client);
  const auto cell = client.cell();
  const UrMapping mapping = options.mapping_file.empty() ? default_ur_mapping(*cell, options.robot)
                                                         : read_ur_mapping(options.mapping_file, *cell);
  if (options.start) {
    gateway::set_realtime(client);
    client.play();
  }
  const std::string name = "takt-ur " + mapping.robot.robot;
  gateway::CellLink link(client,
                         {.name = name,
                          .protocol = "RTDE",
                          .period_s = 1.0 / mapping.follow.frequency_Hz,
                          .robot = mapping.robot.robot,
                          .filter_rad_per_s = mapping.filter_rad_per_s},
                         gateway::targets_of(mapping.robot.robot, mapping.outputs));
  gateway::EventLoop loop;
  Follower follower(loop, link, mapping, options.address);
  loop.stop_on_signals();
  loop.every(std::chrono::milliseconds(10), [&] { follower.supervise(); });
  loop.every(std::chrono::seconds(1), [&] {
    if (client.cell() != link.cell() || !client.connected())
      throw ClientError(ClientError::Kind::lost, "The cell has gone away or has another scenario.");
    link.supervise();
  });
  loop.run();
  gateway::report(name, std::to_string(follower.packages()) + " data packages received; " + link.figures());
  return 0;
}

}  // namespace takt::ur
