#pragma once
// Parts that the gateways of RSI and EGM share: a robot that follows an outside controller, outputs that are sent when
// they change, and small helpers of sessions with datagrams.
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_lib/gateway/cell_link.h"
#include "client_lib/gateway/event_loop.h"
#include "client_lib/gateway/throttle.h"
#include "client_lib/gateway/vendor_axes.h"

namespace takt::gateway {

/// Wall time, s, of an arbitrary origin.
inline double wall_s() {
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

/// Where a socket is bound that talks to this address.
inline std::string local_address_for(const std::string& peer) {
  return peer.starts_with("127.") ? "127.0.0.1" : peer.find(':') != std::string::npos ? "::" : "0.0.0.0";
}

/// Compares the cell with the protocol's limits each second. When the cell has another scenario, it stops the loop with a
/// report and sets `failed`.
inline void supervise_each_second(EventLoop& loop, const Client& client, CellLink& link,
                                  const std::string& gateway, bool& failed) {
  loop.every(std::chrono::seconds(1), [&loop, &client, &link, gateway, &failed] {
    link.supervise();
    if (client.cell() == link.cell()) return;
    report(gateway, "The cell has another scenario; start " + gateway + " again.");
    failed = true;
    loop.stop();
  });
}

/// Outputs of a mapping; each value is sent when it differs from the one before.
class ChangedOutputs {
 public:
  explicit ChangedOutputs(const std::vector<OutputMapping>& outputs)
      : outputs_(outputs), sent_(outputs.size()) {}
  /// The next values are sent in any case.
  void forget() { sent_.assign(outputs_.size(), std::nullopt); }
  /// `value_of` gives the value of an element, or nothing while the controller has not sent it.
  template <class Commands>
  void write(const std::function<std::optional<double>(const std::string&)>& value_of, Commands& commands) {
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      const auto value = value_of(outputs_[i].name);
      if (!value || sent_[i] == value) continue;
      sent_[i] = value;
      write_output(outputs_[i], *value, commands);
    }
  }

 private:
  const std::vector<OutputMapping>& outputs_;
  std::vector<std::optional<double>> sent_;
};

/// A robot that follows the positions of an outside controller: without a jump at the start, with velocities from the
/// controller's own time stamps, and with a safe action when the controller is silent.
class RobotFollower {
 public:
  RobotFollower(std::string gateway, const VendorAxes& axes, const ResynchronisationOptions& first_command,
                SafeAction on_silence, double cycle_s)
      : gateway_(std::move(gateway)),
        report_(gateway_),
        axes_(axes),
        resynchronisation_(first_command),
        on_silence_(on_silence),
        cycle_s_(cycle_s) {}

  /// Only one controller is followed until it is silent.
  bool accepts(const Endpoint& from) {
    if (!peer_ || from == *peer_ || silent_) return true;
    report_("foreign", "A datagram from " + address_text(from) + " is ignored; this robot follows " +
                           address_text(*peer_) + ".");
    return false;
  }
  /// A controller begins, or begins again.
  void begin(const Endpoint& from) {
    report(gateway_, "The robot controller at " + from.address + " sends.");
    peer_ = from;
    silent_ = false;
    resynchronise();
  }
  /// Address of the controller that is followed; empty: none has come so far.
  std::string peer() const { return peer_ ? address_text(*peer_) : std::string(); }
  /// The controller's next positions may be anywhere.
  void resynchronise() {
    resynchronisation_.restart();
    at_.clear();
  }
  /// `axes` of the controller at `time_s` (PeerClock).
  void follow(std::span<const double> axes, double time_s, const State& state, CommandSender& sender) {
    const double passed_s = at_.empty() || time_s <= at_s_ ? cycle_s_ : time_s - at_s_;
    const bool was_engaged = resynchronisation_.engaged();
    auto next = resynchronisation_.next(axes_.joints_of(axes), state.robot(axes_.robot()).position, passed_s);
    if (!next) {
      report_("refused",
              "The controller's positions are far from the robot's; they are refused (first_command).");
      return;
    }
    if (!was_engaged && resynchronisation_.engaged()) report(gateway_, "The robot follows its controller.");
    std::vector<double> velocities(next->size(), 0.0);
    if (!at_.empty())
      for (std::size_t i = 0; i < velocities.size(); ++i) velocities[i] = ((*next)[i] - at_[i]) / passed_s;
    at_ = *next;
    at_s_ = time_s;
    sender.move(axes_.robot(), std::move(*next), axes_.limited(std::move(velocities)));
  }
  void hold(CommandSender& sender) {
    if (!at_.empty()) sender.move(axes_.robot(), at_, std::vector<double>(at_.size(), 0.0));
  }
  /// To be called while the controller is silent; acts once.
  void silence(CommandSender& sender) {
    if (silent_) return;
    silent_ = true;
    const bool stops = on_silence_ == SafeAction::stop;
    report(gateway_,
           std::string("The robot controller is silent; the robot ") + (stops ? "brakes." : "holds."));
    if (stops)
      sender.stop(axes_.robot());
    else
      hold(sender);
  }

 private:
  const std::string gateway_;
  ThrottledReport report_;
  const VendorAxes& axes_;
  Resynchronisation resynchronisation_;
  const SafeAction on_silence_;
  const double cycle_s_;
  std::optional<Endpoint> peer_;
  bool silent_ = false;
  std::vector<double> at_;  ///< the newest set-point
  double at_s_ = 0.0;
};

/// Calls at the wall time `time_s` + `delay_s`; at once if that has passed, or without a delay.
inline void call_at(EventLoop& loop, double time_s, double delay_s, std::function<void()> call) {
  const double left_s = time_s + delay_s - wall_s();
  if (delay_s <= 0.0 || left_s <= 0.0)
    call();
  else
    loop.after(std::chrono::nanoseconds(std::llround(1e9 * left_s)), std::move(call));
}

}  // namespace takt::gateway
