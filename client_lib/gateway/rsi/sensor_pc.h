#pragma once
// The sensor PC's side of RSI: follows a robot controller that a program or an operator moves. Pure: no clock, no socket.
//
// Each packet is answered at once with its own IPOC and the newest values, never after a step of the simulation. The
// positions get the time that the controller means by its IPOC, so that jitter of the network does not reach the motion.
// Sources: kroshu/kuka-external-control-sdk and kroshu/kuka_drivers (GitHub).
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/gateway/peer_clock.h"
#include "client_lib/gateway/rsi/messages.h"

namespace takt::gateway::rsi {

struct SensorPcOptions {
  double silent_s = 0.2;     ///< so long without a packet: the controller is silent
  PeerClockOptions clock{};  ///< of IPOC
};

/// What one datagram was.
struct Reception {
  std::string answer{};        ///< to send at once; empty: none
  std::optional<Rob> state{};  ///< of the robot controller
  double time_s = 0.0;         ///< of the state, on the clock of the arrivals
  bool restarted = false;      ///< first packet, or IPOC has jumped: the robot must not
  bool old = false;     ///< doubled, or overtaken by a newer packet: it is answered, and is no new state
  std::string fault{};  ///< why it is no packet; it has no answer
};

class SensorPc {
 public:
  SensorPc(Configuration configuration, const SensorPcOptions& options);

  /// A value of the answers, by its place in Configuration::receive. They are 0 before.
  void set(std::size_t place, double value) { answer_.values.at(place) = value; }
  void set_message(std::string text) { answer_.message = std::move(text); }

  /// `arrival_s`: wall time.
  Reception receive(std::string_view bytes, double arrival_s);
  /// True if packets have come, and none for `silent_s`.
  bool silent(double now_s) const { return packets_ > 0 && now_s - last_arrival_s_ > options_.silent_s; }
  std::uint64_t packets() const { return packets_; }
  std::uint64_t restarts() const { return restarts_; }
  std::uint64_t invalid() const { return invalid_; }
  std::uint64_t delay() const { return delay_; }  ///< D: packets that the controller calls late
  std::vector<std::string> new_unknown();
  const Configuration& configuration() const { return configuration_; }

 private:
  const Configuration configuration_;
  const SensorPcOptions options_;
  Sen answer_;
  std::uint64_t packets_ = 0, restarts_ = 0, invalid_ = 0, delay_ = 0;
  PeerClock clock_;
  double last_arrival_s_ = 0.0;
  std::set<std::string> unknown_;
  std::vector<std::string> new_unknown_;
};

}  // namespace takt::gateway::rsi
