#include "client_lib/tools/takt_rsi/rsi_session.h"

#include <chrono>
#include <functional>

#include "client_lib/gateway/robot_follower.h"
#include "client_lib/gateway/rsi/sensor_pc.h"
#include "client_lib/lockstep_controller.h"
#include "client_lib/tools/takt_rsi/rsi_mapping.h"
#include "idl/common/text.h"

namespace takt::tool {
namespace {

using namespace gateway;
using namespace std::chrono_literals;

constexpr const char* kProtocol = "RSI";
constexpr double kTimeTolerance_s = 1e-9;
/// A packet that no sensor PC has heard is sent again; also the wall time between two reports of waiting.
constexpr auto kAgain = 500ms;
constexpr auto kWaitingReported = 5s;

rsi::PoseKinematics kinematics_of(const VendorAxes& axes) {
  if (!axes.has_poses()) return {};
  const auto all = [&axes](const Six& six) {
    std::vector<double> values(axes.count(), 0.0);
    std::copy_n(six.begin(), std::min<std::size_t>(6, values.size()), values.begin());
    return values;
  };
  return {[&axes, all](const Six& six) { return axes.pose_of(all(six)); },
          [&axes, all](const Pose& X, const Six& near) -> std::optional<Six> {
            const auto found = axes.axes_at(X, all(near));
            return found ? std::optional<Six>(six_of(*found)) : std::nullopt;
          }};
}

double value_of(const InputMapping& input, const rsi::Channel& channel, const State& state) {
  if (channel.type == rsi::ValueType::boolean) return digital(input, state) ? 1.0 : 0.0;
  return number_of(input, state);
}

/// What both paces of the controller's side share: packets from states, set-points from targets.
class Controller {
 public:
  Controller(const GatewayOptions& options, const RsiMapping& mapping, const CellInfo& cell)
      : options_(options),
        m_(mapping),
        report_(options.name),
        axes_(cell, mapping.robot, mapping.tool),
        krc_(mapping.configuration, with_switches(mapping.krc, axes_), kinematics_of(axes_)),
        outputs_(mapping.outputs),
        socket_(loop_.udp(local_address_for(mapping.address), 0)),
        pc_{mapping.address, static_cast<std::uint16_t>(mapping.port)} {
    loop_.stop_on_signals();
    socket_->start([this](std::string_view bytes, const Endpoint& from) { receive(bytes, from); });
  }

 protected:
  static rsi::KrcOptions with_switches(rsi::KrcOptions krc, const VendorAxes& axes) {
    for (std::size_t i = 0; i < 6 && i < axes.count(); ++i) {
      krc.axis_lower[i] = axes.lower()[i];
      krc.axis_upper[i] = axes.upper()[i];
    }
    return krc;
  }

  double period_s() const { return 1e-3 * m_.krc.cycle_ms; }

  void rsi_on(const State& state) {
    const std::vector<double> axes = axes_.axes_of(state.robot(axes_.robot()).position);
    krc_.start(six_of(axes), six_of(axes, 6));
    before_.clear();
    outputs_.forget();
    report(options_.name, "RSI is on: packets every " + std::to_string(m_.krc.cycle_ms) + " ms to " +
                              pc_.address + " port " + std::to_string(pc_.port) + ", corrections are " +
                              (m_.krc.relative ? "relative" : "absolute") + ".");
  }

  std::string packet(const State& state) {
    const std::vector<double> axes = axes_.axes_of(state.robot(axes_.robot()).position);
    rsi::Rob rob;
    rob.actual_axes = six_of(axes);
    rob.actual_external_axes = six_of(axes, 6);
    rob.planned_axes = krc_.start_axes();
    rob.planned_external_axes = krc_.start_external_axes();
    if (axes_.has_poses()) {
      std::vector<double> planned(axes.size());
      for (std::size_t i = 0; i < planned.size(); ++i)
        planned[i] = i < 6 ? rob.planned_axes[i] : rob.planned_external_axes[i - 6];
      rob.actual_pose = xyzabc_of(axes_.pose_of(axes));
      rob.planned_pose = xyzabc_of(axes_.pose_of(planned));
    }
    const auto& channels = m_.configuration.send;
    rob.values.assign(channels.size(), 0.0);
    for (const InputMapping& input : m_.inputs) {
      const auto place = static_cast<std::size_t>(rsi::Configuration::find(channels, input.name));
      rob.values[place] = value_of(input, channels[place], state);
    }
    return krc_.begin_cycle(rob);
  }

  struct SetPoint {
    std::vector<double> positions, velocities;
  };
  /// For one cycle later; the velocity is that of the way since the set-point before.
  SetPoint set_point() {
    std::vector<double> target(axes_.count());
    for (std::size_t i = 0; i < target.size(); ++i)
      target[i] = i < 6 ? krc_.target()[i] : krc_.external_target()[i - 6];
    std::vector<double> rates(target.size(), 0.0);
    if (!before_.empty())
      for (std::size_t i = 0; i < rates.size(); ++i) rates[i] = (target[i] - before_[i]) / period_s();
    SetPoint made{axes_.joints_of(target), axes_.limited(axes_.joint_rates_of(rates))};
    before_ = std::move(target);
    return made;
  }

  template <class Commands>
  void write_outputs(Commands& commands) {
    outputs_.write(
        [this](const std::string& tag) -> std::optional<double> {
          return krc_
              .values()[static_cast<std::size_t>(rsi::Configuration::find(m_.configuration.receive, tag))];
        },
        commands);
  }

  void receive(std::string_view bytes, const Endpoint& from) {
    if (from.address != pc_.address) {
      report_("foreign",
              "A datagram from " + from.address + " is ignored; the sensor PC is " + pc_.address + ".");
      return;
    }
    const std::string told = krc_.message();
    const rsi::Taken taken = krc_.answer(bytes);
    for (const std::string& name : krc_.new_unknown())
      report(options_.name,
             "The answers have " + name +
                 ", which the list RECEIVE of the configuration does not have; it is ignored.");
    if (krc_.message() != told) report(options_.name, "The sensor PC says: " + krc_.message());
    if (taken == rsi::Taken::invalid) report_("invalid", "An answer is invalid: " + krc_.fault() + ".");
    if (taken == rsi::Taken::other_ipoc)
      report_("ipoc", "An answer has the IPOC of another packet; it is not applied.");
    if (taken != rsi::Taken::applied) return;
    if (!heard_) report(options_.name, "The sensor PC answers.");
    heard_ = true;
    on_applied();
  }
  virtual void on_applied() {}

  PeerStatus peer() const {
    return {address_text(pc_), heard_ && krc_.running(), krc_.packets() - krc_.late(), krc_.late()};
  }
  /// Reports the end of RSI. True if it is switched on again.
  bool ended() {
    report(options_.name, krc_.reason());
    report(options_.name, std::to_string(krc_.packets()) + " packets, " + std::to_string(krc_.late()) +
                              " without an answer in time.");
    failed_ = krc_.state() != rsi::KrcState::stopped_by_sensor;
    heard_ = false;
    return m_.repeat;
  }
  bool due(const State& state) const {
    return options_.until_s && state.time >= *options_.until_s - kTimeTolerance_s;
  }

 public:
  virtual ~Controller() = default;

 protected:
  const GatewayOptions& options_;
  const RsiMapping& m_;
  ThrottledReport report_;
  VendorAxes axes_;
  rsi::Krc krc_;
  std::vector<double> before_;
  ChangedOutputs outputs_;
  bool heard_ = false, failed_ = false;
  EventLoop loop_;
  std::unique_ptr<UdpSocket> socket_;
  Endpoint pc_;
};

/// The next packet goes out after the answer alone, and the cell waits for it: each run has the same bits.
class LockstepRsi : public Controller {
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
    rsi_on(controller.state());
    while (!loop_.stopped() && !due(controller.state())) {
      const std::string bytes = packet(controller.state());
      exchange(bytes, reporter);
      if (loop_.stopped()) break;
      if (!krc_.running()) {
        if (!ended()) break;
        rsi_on(controller.state());
        continue;
      }
      const SetPoint next = set_point();
      controller.move(axes_.robot(), next.positions, next.velocities);
      write_outputs(controller);
      controller.advance();
    }
    report(options_.name, "Ends at " + number_text(controller.state().time) +
                              " s of simulated time, state hash " +
                              hexadecimal_text(controller.state().state_hash) + ".");
    return failed_ ? 1 : 0;
  }
  /// For ClientOptions::while_waiting: lets signals end a wait for the cell.
  void poll() {
    loop_.poll();
    if (loop_.stopped()) throw ClientError(ClientError::Kind::timeout, "Ended by a signal.");
  }

 private:
  void exchange(const std::string& bytes, GatewayReporter& reporter) {
    socket_->send(bytes, pc_);
    reporter.set(peer());
    if (m_.configuration.only_send) return;
    const auto begin = Clock::now();
    auto reported = begin;
    const auto settled = [this] { return krc_.answered() || !krc_.running(); };
    while (!loop_.run_until(settled, Clock::now() + kAgain) && !loop_.stopped()) {
      if (!heard_) socket_->send(bytes, pc_);  // the sensor PC was not there yet
      reporter.set({address_text(pc_), false, peer().messages, krc_.late()});
      if (Clock::now() - reported < kWaitingReported) continue;
      reported = Clock::now();
      report(options_.name,
             "Waits for the answer to IPOC " + std::to_string(krc_.ipoc()) + "; the cell stands still.");
    }
  }
};

class RealtimeRsi : public Controller {
 public:
  using Controller::Controller;

  int run(Client& client) {
    if (options_.start) set_realtime(client);
    CellLink link(client,
                  {.name = options_.name,
                   .protocol = kProtocol,
                   .period_s = period_s(),
                   .most_interval_s = 2.0 * period_s() + 0.01,
                   .needs_wall_time = m_.time == TimeReference::wall,
                   .robot = axes_.robot(),
                   .filter_rad_per_s = m_.filter_rad_per_s},
                  targets_of(axes_.robot(), m_.outputs));
    link_ = &link;
    if (options_.start) client.play();
    link.supervise();
    rsi_on(*link.state());
    epoch_ = link.state()->epoch;
    next_s_ = link.state()->time;
    loop_.every(m_.time == TimeReference::wall ? std::chrono::milliseconds(m_.krc.cycle_ms) : 1ms,
                [this] { cycle(); });
    supervise_each_second(loop_, client, link, options_.name, failed_);
    loop_.run();
    link_ = nullptr;
    report(options_.name, link.figures());
    return failed_ ? 1 : 0;
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
      report(options_.name, "The cell was reset; RSI begins again.");
      epoch_ = state->epoch;
      next_s_ = state->time;
      rsi_on(*state);
    }
    if (!link_->plays()) return;  // no simulated time passes
    if (m_.time == TimeReference::simulated) {
      if (state->time < next_s_ - kTimeTolerance_s) return;
      next_s_ += period_s();
    }
    // After a delay of this machine the next tick may follow at once; an answer has half a cycle at least.
    const auto now = std::chrono::steady_clock::now();
    if (m_.time == TimeReference::wall && now - sent_at_ < std::chrono::milliseconds(m_.krc.cycle_ms) / 2)
      return;
    sent_at_ = now;
    const std::uint64_t late = krc_.late();
    krc_.end_cycle();
    if (krc_.late() != late) {
      report_("late", "An answer is late: D " + std::to_string(krc_.late()) + ".");
      if (krc_.running()) move();
    }
    if (!krc_.running()) {
      if (krc_.state() != rsi::KrcState::stopped_by_sensor) link_->sender().stop(axes_.robot());
      if (!ended()) {
        loop_.stop();
        return;
      }
      rsi_on(*state);
    }
    socket_->send(packet(*state), pc_);
  }
  void move() {
    SetPoint next = set_point();
    link_->sender().move(axes_.robot(), std::move(next.positions), std::move(next.velocities));
    write_outputs(link_->sender());
  }
  void on_applied() override {
    if (krc_.running()) move();
  }

  CellLink* link_ = nullptr;
  std::uint32_t epoch_ = 0;
  double next_s_ = 0.0;  ///< simulated time of the next cycle
  std::chrono::steady_clock::time_point sent_at_;
};

/// Follows a KRC or VRC.
class SensorSide {
 public:
  SensorSide(const GatewayOptions& options, const RsiMapping& mapping, const CellInfo& cell)
      : options_(options),
        m_(mapping),
        report_(options.name),
        axes_(cell, mapping.robot, mapping.tool),
        pc_(mapping.configuration, {.silent_s = mapping.silence.deadline_s}),
        follower_(options.name, axes_, mapping.first_command, mapping.silence.action,
                  1e-3 * mapping.krc.cycle_ms),
        outputs_(mapping.outputs),
        socket_(loop_.udp(mapping.address, static_cast<std::uint16_t>(mapping.port))) {
    loop_.stop_on_signals();
  }

  int run(Client& client) {
    if (options_.start) set_realtime(client);
    CellLink link(client,
                  {.name = options_.name,
                   .protocol = kProtocol,
                   .period_s = 1e-3 * m_.krc.cycle_ms,
                   .robot = axes_.robot(),
                   .filter_rad_per_s = m_.filter_rad_per_s},
                  targets_of(axes_.robot(), m_.outputs));
    link_ = &link;
    if (options_.start) client.play();
    report(options_.name, "Listens at " + m_.address + " port " + std::to_string(socket_->port()) +
                              " for the robot controller.");
    socket_->start([this](std::string_view bytes, const Endpoint& from) { receive(bytes, from); });
    loop_.every(std::chrono::milliseconds(5 * m_.krc.cycle_ms), [this] { watch(); });
    bool failed = false;
    supervise_each_second(loop_, client, link, options_.name, failed);
    loop_.run();
    link_ = nullptr;
    report(options_.name, std::to_string(pc_.packets()) + " packets, " + std::to_string(pc_.invalid()) +
                              " invalid, " + std::to_string(pc_.restarts()) +
                              " starts of the controller, D " + std::to_string(pc_.delay()) + ". " +
                              link.figures());
    return failed ? 1 : 0;
  }

 private:
  void receive(std::string_view bytes, const Endpoint& from) {
    if (!follower_.accepts(from)) return;
    const auto state = link_->state();
    const auto& channels = m_.configuration.receive;
    for (const InputMapping& input : m_.inputs) {
      const auto place = static_cast<std::size_t>(rsi::Configuration::find(channels, input.name));
      pc_.set(place, value_of(input, channels[place], *state));
    }
    const rsi::Reception packet = pc_.receive(bytes, wall_s());
    if (!packet.answer.empty()) socket_->send(packet.answer, from);
    for (const std::string& name : pc_.new_unknown())
      report(options_.name, "The packets have " + name +
                                ", which the list SEND of the configuration does not have; it is ignored.");
    if (!packet.fault.empty()) report_("invalid", "A packet is invalid: " + packet.fault + ".");
    if (!packet.state) return;
    if (packet.restarted) follower_.begin(from);
    call_at(loop_, packet.time_s, m_.delay_s,
            [this, rob = *packet.state, time_s = packet.time_s] { follow(rob, time_s); });
  }

  void follow(const rsi::Rob& rob, double time_s) {
    std::vector<double> axes(axes_.count());
    for (std::size_t i = 0; i < axes.size(); ++i)
      axes[i] = i < 6 ? rob.actual_axes[i] : rob.actual_external_axes[i - 6];
    follower_.follow(axes, time_s, *link_->state(), link_->sender());
    outputs_.write(
        [&](const std::string& tag) -> std::optional<double> {
          return rob.values[static_cast<std::size_t>(rsi::Configuration::find(m_.configuration.send, tag))];
        },
        link_->sender());
  }

  void watch() {
    if (options_.until_s && link_->state()->time >= *options_.until_s - kTimeTolerance_s) loop_.stop();
    const bool silent = pc_.silent(wall_s());
    if (silent) follower_.silence(link_->sender());
    link_->show({follower_.peer(), pc_.packets() > 0 && !silent, pc_.packets(), pc_.delay()});
  }

  const GatewayOptions& options_;
  const RsiMapping& m_;
  ThrottledReport report_;
  VendorAxes axes_;
  rsi::SensorPc pc_;
  RobotFollower follower_;
  ChangedOutputs outputs_;
  EventLoop loop_;
  std::unique_ptr<UdpSocket> socket_;
  CellLink* link_ = nullptr;
};

void say_what_is_not_computed(const GatewayOptions& options, const RsiMapping& m) {
  if (m.role != RsiRole::controller) return;
  for (const rsi::Channel& channel : m.configuration.send)
    if (channel.internal == rsi::Internal::axis_currents ||
        channel.internal == rsi::Internal::external_axis_currents ||
        channel.internal == rsi::Internal::technology)
      report(options.name, channel.tag + " is sent as 0: takt does not compute it.");
}

}  // namespace

int run_rsi(const GatewayOptions& options) {
  std::function<void()> while_waiting;
  Client client(polled_by_this_thread(options.client, while_waiting));
  const auto cell = client.cell();
  const RsiMapping mapping = read_rsi_mapping(options.mapping, *cell);
  say_what_is_not_computed(options, mapping);
  if (mapping.role == RsiRole::sensor_pc) {
    if (options.lockstep)
      throw std::invalid_argument(
          "--lockstep: a real controller does not wait for the cell; allowed: with 'role: controller'");
    return SensorSide(options, mapping, *cell).run(client);
  }
  if (!options.lockstep) return RealtimeRsi(options, mapping, *cell).run(client);
  LockstepRsi session(options, mapping, *cell);
  while_waiting = [&session] { session.poll(); };
  try {
    return session.run(client);
  } catch (...) {
    while_waiting = nullptr;
    throw;
  }
}

}  // namespace takt::tool
