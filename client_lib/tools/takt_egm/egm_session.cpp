#include "client_lib/tools/takt_egm/egm_session.h"

#include <chrono>
#include <cmath>
#include <functional>

#include "client_lib/gateway/egm/follower.h"
#include "client_lib/gateway/force_sensor.h"
#include "client_lib/gateway/robot_follower.h"
#include "client_lib/lockstep_controller.h"
#include "client_lib/tools/takt_egm/egm_mapping.h"
#include "idl/common/text.h"

namespace takt::tool {
namespace {

using namespace gateway;
using namespace std::chrono_literals;

constexpr double kTimeTolerance_s = 1e-9;
constexpr const char* kProtocol = "EGM";
constexpr std::size_t kRobotJoints = 6;
/// A message that no sensor has heard is sent again; also the wall time between two reports of waiting.
constexpr auto kAgain = 500ms;
constexpr auto kWaitingReported = 5s;

std::uint64_t microseconds_since_1970() {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(
                                        std::chrono::system_clock::now().time_since_epoch())
                                        .count());
}

egm::PoseKinematics kinematics_of(const VendorAxes& axes) {
  if (!axes.has_poses()) return {};
  return {[&axes](const std::vector<double>& joints) { return axes.pose_of(joints); },
          [&axes](const Pose& X, const std::vector<double>& near) { return axes.axes_at(X, near); }};
}

/// What both paces of the controller's side share.
class Controller {
 public:
  Controller(const GatewayOptions& options, const EgmMapping& mapping, const CellInfo& cell)
      : options_(options),
        m_(mapping),
        report_(options.name),
        axes_(cell, mapping.robot, mapping.tool),
        egm_(with_limits(mapping.control, axes_), axes_.count(), kinematics_of(axes_)),
        outputs_(mapping.outputs),
        force_sensor_(mapping.force_sensor.empty()
                          ? nullptr
                          : std::make_unique<ForceSensor>(cell, mapping.force_sensor)),
        socket_(loop_.udp(local_address_for(mapping.address), 0)),
        sensor_{mapping.address, static_cast<std::uint16_t>(mapping.port)} {
    loop_.stop_on_signals();
    socket_->start([this](std::string_view bytes, const Endpoint& from) { receive(bytes, from); });
  }
  virtual ~Controller() = default;

 protected:
  static egm::ControllerOptions with_limits(egm::ControllerOptions options, const VendorAxes& axes) {
    options.lower = axes.lower();
    options.upper = axes.upper();
    return options;
  }
  double period_s() const { return 1e-3 * m_.cycle_ms; }

  void begin(const State& state) {
    egm_.start(measured(state));
    outputs_.forget();
    report(options_.name, std::string(m_.control.guidance == egm::Guidance::joint  ? "EGMRunJoint"
                                      : m_.control.guidance == egm::Guidance::pose ? "EGMRunPose"
                                                                                   : "EGMMoveL") +
                              ": messages every " + std::to_string(m_.cycle_ms) + " ms to " +
                              sensor_.address + " port " + std::to_string(sensor_.port) + ".");
  }
  std::vector<double> measured(const State& state) const {
    return axes_.axes_of(state.robot(axes_.robot()).position);
  }

  std::string message(const State& state, std::uint64_t time_us, bool motors_on) {
    const std::vector<double> axes = measured(state);
    egm::Robot robot;
    const auto robot_axes = static_cast<std::ptrdiff_t>(std::min(axes.size(), kRobotJoints));
    robot.feed_back.joints.assign(axes.begin(), axes.begin() + robot_axes);
    robot.feed_back.external_joints.assign(axes.begin() + robot_axes, axes.end());
    if (axes_.has_poses()) {
      robot.feed_back.pose = egm::egm_pose_of(axes_.pose_of(axes));
      robot.planned.pose = egm::egm_pose_of(axes_.pose_of(egm_.planned()));
    }
    robot.feed_back.time_us = time_us;
    robot.utilization = 0.0;
    robot.rapid_data = rapid_data_of(m_.inputs, state);
    if (force_sensor_) {
      const auto values = force_sensor_->values(state);
      robot.force.assign(values.begin(), values.end());
      robot.robotware = m_.robotware;
    }
    return egm_.message(robot, static_cast<std::uint32_t>(time_us / 1000U & 0xffffffffU), motors_on);
  }

  /// One cycle of the control law; the set-point for one cycle later.
  struct SetPoint {
    std::vector<double> positions, velocities;
  };
  SetPoint set_point(const State& state) {
    const egm::Session before = egm_.session();
    const std::uint64_t limited = egm_.limited();
    egm_.step(period_s(), measured(state));
    if (egm_.session() != before) report(options_.name, egm_.fault());
    if (egm_.limited() != limited)
      report_("limited", "max_speed_deviation_deg_per_s acts: the robot is slower than its references.");
    return {axes_.joints_of(egm_.planned()), axes_.limited(axes_.joint_rates_of(egm_.speed()))};
  }

  template <class Commands>
  void write_outputs(Commands& commands) {
    if (!egm_.rapid_data()) return;
    outputs_.write([this](const std::string& name) { return rapid_value(*egm_.rapid_data(), name); },
                   commands);
  }

  void receive(std::string_view bytes, const Endpoint& from) {
    if (from.address != sensor_.address) {
      report_("foreign",
              "A datagram from " + from.address + " is ignored; the sensor is " + sensor_.address + ".");
      return;
    }
    const bool lost = egm_.session() == egm::Session::lost;
    const egm::Taken taken = egm_.receive(bytes);
    if (taken == egm::Taken::invalid) report_("invalid", "A message is invalid: " + egm_.fault() + ".");
    if (taken == egm::Taken::old) report_("old", "A message was doubled or overtaken; it is not applied.");
    if (taken == egm::Taken::invalid) return;
    ++heard_;
    if (heard_ == 1) report(options_.name, "The sensor answers.");
    if (lost) report(options_.name, "The sensor is back; EGM begins again.");
  }
  bool due(const State& state) const {
    return options_.until_s && state.time >= *options_.until_s - kTimeTolerance_s;
  }
  PeerStatus peer() const { return {address_text(sensor_), egm_.hears(), egm_.applied(), egm_.old()}; }
  void report_figures() const {
    report(options_.name, std::to_string(egm_.applied()) + " messages applied, " +
                              std::to_string(egm_.old()) + " doubled or overtaken.");
  }

  const GatewayOptions& options_;
  const EgmMapping& m_;
  ThrottledReport report_;
  VendorAxes axes_;
  egm::Controller egm_;
  ChangedOutputs outputs_;
  std::unique_ptr<ForceSensor> force_sensor_;
  std::uint64_t heard_ = 0;
  EventLoop loop_;
  std::unique_ptr<UdpSocket> socket_;
  Endpoint sensor_;
};

/// Each message waits for its answer, and the cell for both. EGM does not promise answers; the public clients give them.
class LockstepEgm : public Controller {
 public:
  using Controller::Controller;

  int run(Client& client) {
    LockstepOptions lockstep;
    lockstep.targets = targets_of(axes_.robot(), m_.outputs);
    lockstep.period_s = period_s();
    lockstep.name = options_.name;
    lockstep.timeout = Seconds{86400.0};  // the longest that a server accepts
    lockstep.start = options_.start;
    if (!options_.start) client.set_pace(Pace::lockstep);
    LockstepController controller(client, lockstep);
    GatewayReporter reporter(client, options_.name, kProtocol, lockstep.targets);
    begin(controller.state());
    while (!loop_.stopped() && !due(controller.state())) {
      const State& state = controller.state();
      exchange(message(state, static_cast<std::uint64_t>(std::llround(1e6 * state.time)), true), reporter);
      if (loop_.stopped()) break;
      const SetPoint next = set_point(state);
      controller.move(axes_.robot(), next.positions, next.velocities);
      write_outputs(controller);
      controller.advance();
    }
    report_figures();
    report(options_.name, "Ends at " + number_text(controller.state().time) +
                              " s of simulated time, state hash " +
                              hexadecimal_text(controller.state().state_hash) + ".");
    return 0;
  }
  /// For ClientOptions::while_waiting: lets signals end a wait for the cell.
  void poll() {
    loop_.poll();
    if (loop_.stopped()) throw ClientError(ClientError::Kind::timeout, "Ended by a signal.");
  }

 private:
  void exchange(const std::string& bytes, GatewayReporter& reporter) {
    const std::uint64_t before = heard_;
    socket_->send(bytes, sensor_);
    reporter.set(peer());
    auto reported = Clock::now();
    while (!loop_.run_until([&] { return heard_ > before; }, Clock::now() + kAgain) && !loop_.stopped()) {
      if (before == 0) socket_->send(bytes, sensor_);  // the sensor was not there yet
      reporter.set({address_text(sensor_), false, egm_.applied(), egm_.old()});
      if (Clock::now() - reported < kWaitingReported) continue;
      reported = Clock::now();
      report(options_.name, "Waits for an answer to message " + std::to_string(egm_.seqno() - 1) +
                                "; the cell stands still.");
    }
  }
};

class RealtimeEgm : public Controller {
 public:
  using Controller::Controller;

  int run(Client& client) {
    if (options_.start) set_realtime(client);
    CellLink link(client,
                  {.name = options_.name,
                   .protocol = kProtocol,
                   .period_s = period_s(),
                   .most_interval_s = 2.0 * period_s() + 0.01,
                   .robot = axes_.robot(),
                   .filter_rad_per_s = m_.filter_rad_per_s},
                  targets_of(axes_.robot(), m_.outputs));
    link_ = &link;
    if (options_.start) client.play();
    link.supervise();
    begin(*link.state());
    epoch_ = link.state()->epoch;
    bool failed = false;
    loop_.every(std::chrono::milliseconds(m_.cycle_ms), [this] { cycle(); });
    supervise_each_second(loop_, client, link, options_.name, failed);
    loop_.run();
    link_ = nullptr;
    report_figures();
    report(options_.name, link.figures());
    return failed ? 1 : 0;
  }

 private:
  void cycle() {
    const auto state = link_->state();
    link_->show(peer());
    if (due(*state)) {
      loop_.stop();
      return;
    }
    if (state->epoch != epoch_) {
      report(options_.name, "The cell was reset; EGM begins again.");
      epoch_ = state->epoch;
      begin(*state);
    }
    const bool plays = link_->plays();
    // A real controller says motors off while nothing can move.
    socket_->send(message(*state, microseconds_since_1970(), plays), sensor_);
    if (!plays) return;
    SetPoint next = set_point(*state);
    link_->sender().move(axes_.robot(), std::move(next.positions), std::move(next.velocities));
    write_outputs(link_->sender());
  }

  CellLink* link_ = nullptr;
  std::uint32_t epoch_ = 0;
};

/// Follows a controller or RobotStudio.
class SensorSide {
 public:
  SensorSide(const GatewayOptions& options, const EgmMapping& mapping, const CellInfo& cell)
      : options_(options),
        m_(mapping),
        report_(options.name),
        axes_(cell, mapping.robot, mapping.tool),
        egm_({.silent_s = mapping.silence.deadline_s, .planned = mapping.planned}),
        follower_(options.name, axes_, mapping.first_command, mapping.silence.action,
                  1e-3 * mapping.cycle_ms),
        outputs_(mapping.outputs),
        socket_(loop_.udp(mapping.address, static_cast<std::uint16_t>(mapping.port))) {
    loop_.stop_on_signals();
  }

  int run(Client& client) {
    if (options_.start) set_realtime(client);
    CellLink link(client,
                  {.name = options_.name,
                   .protocol = kProtocol,
                   .period_s = 1e-3 * m_.cycle_ms,
                   .robot = axes_.robot(),
                   .filter_rad_per_s = m_.filter_rad_per_s},
                  targets_of(axes_.robot(), m_.outputs));
    link_ = &link;
    if (options_.start) client.play();
    report(options_.name, "Listens at " + m_.address + " port " + std::to_string(socket_->port()) +
                              " for the robot controller.");
    socket_->start([this](std::string_view bytes, const Endpoint& from) { receive(bytes, from); });
    loop_.every(20ms, [this] { watch(); });
    bool failed = false;
    supervise_each_second(loop_, client, link, options_.name, failed);
    loop_.run();
    link_ = nullptr;
    report(options_.name, std::to_string(egm_.messages()) + " messages, " + std::to_string(egm_.invalid()) +
                              " invalid, " + std::to_string(egm_.restarts()) + " starts of the controller. " +
                              link.figures());
    return failed ? 1 : 0;
  }

 private:
  void receive(std::string_view bytes, const Endpoint& from) {
    if (!follower_.accepts(from)) return;
    const egm::Reception message = egm_.receive(bytes, wall_s());
    if (!message.fault.empty()) report_("invalid", "A message is invalid: " + message.fault + ".");
    if (message.old) ++old_;
    if (!message.state) return;
    if (m_.answers) {
      if (const auto data = rapid_data_of(m_.inputs, *link_->state()))
        socket_->send(egm_.answer(*data, message.state->header.tm_ms.value_or(0)), from);
    }
    const std::vector<double> joints = egm::Follower::joints_of(*message.state, m_.planned);
    if (joints.size() != axes_.count()) {
      report_("count", "A message has " + std::to_string(joints.size()) + " joints; the robot " +
                           axes_.robot() + " has " + std::to_string(axes_.count()) + ". It is not followed.");
      return;
    }
    if (message.restarted) follower_.begin(from);
    if (message.drives != drives_)
      report(options_.name, message.drives ? "The motors are on."
                                           : "The motors are off or the MCI has an error; the robot holds.");
    if (message.drives && !drives_) follower_.resynchronise();
    drives_ = message.drives;
    call_at(loop_, message.time_s, m_.delay_s,
            [this, joints, rapid = message.state->rapid_data, time_s = message.time_s] {
              follow(joints, rapid, time_s);
            });
  }

  void follow(const std::vector<double>& joints, const std::optional<egm::RapidData>& rapid, double time_s) {
    if (rapid)
      outputs_.write([&](const std::string& name) { return rapid_value(*rapid, name); }, link_->sender());
    if (drives_)
      follower_.follow(joints, time_s, *link_->state(), link_->sender());
    else
      follower_.hold(link_->sender());
  }

  void watch() {
    if (options_.until_s && link_->state()->time >= *options_.until_s - kTimeTolerance_s) loop_.stop();
    const bool silent = egm_.silent(wall_s());
    if (silent) follower_.silence(link_->sender());
    link_->show({follower_.peer(), egm_.messages() > 0 && !silent, egm_.messages(), old_});
  }

  const GatewayOptions& options_;
  const EgmMapping& m_;
  ThrottledReport report_;
  VendorAxes axes_;
  egm::Follower egm_;
  RobotFollower follower_;
  ChangedOutputs outputs_;
  bool drives_ = true;
  std::uint64_t old_ = 0;
  EventLoop loop_;
  std::unique_ptr<UdpSocket> socket_;
  CellLink* link_ = nullptr;
};

}  // namespace

int run_egm(const GatewayOptions& options) {
  std::function<void()> while_waiting;
  Client client(polled_by_this_thread(options.client, while_waiting));
  const auto cell = client.cell();
  const EgmMapping mapping = read_egm_mapping(options.mapping, *cell);
  if (mapping.role == EgmRole::sensor) {
    if (options.lockstep)
      throw std::invalid_argument(
          "--lockstep: a real controller does not wait for the cell; allowed: with 'role: controller'");
    return SensorSide(options, mapping, *cell).run(client);
  }
  if (!options.lockstep) return RealtimeEgm(options, mapping, *cell).run(client);
  LockstepEgm session(options, mapping, *cell);
  while_waiting = [&session] { session.poll(); };
  try {
    return session.run(client);
  } catch (...) {
    while_waiting = nullptr;
    throw;
  }
}

}  // namespace takt::tool
