#pragma once
// The sensor's side of EGM: follows a robot controller that a RAPID program moves (EGMStreamStart). Pure: no clock, no
// socket. Sources: ros-industrial/abb_libegm and FLo-ABB/ABB-EGM-Python (GitHub); ABB 3HAC073318-001.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "client_lib/gateway/egm/messages.h"
#include "client_lib/gateway/peer_clock.h"

namespace takt::gateway::egm {

struct FollowerOptions {
  double silent_s = 0.2;     ///< so long without a message: the controller is silent
  bool planned = false;      ///< follow `planned` in place of `feedBack`
  PeerClockOptions clock{};  ///< of header.tm
};

/// What one datagram was.
struct Reception {
  std::optional<Robot> state{};
  double time_s = 0.0;     ///< of the state, on the clock of the arrivals
  bool restarted = false;  ///< first message, or the controller has restarted: the robot must not jump
  bool drives = false;     ///< motors on and no error of the MCI: the robot follows
  bool old = false;        ///< doubled or overtaken
  std::string fault{};
};

class Follower {
 public:
  explicit Follower(const FollowerOptions& options) : options_(options), clock_(options.clock) {}

  Reception receive(std::string_view bytes, double arrival_s);
  /// The joints to follow: six and external ones, degrees. Empty for a message without them.
  static std::vector<double> joints_of(const Robot& robot, bool planned);
  /// An answer with signals for RAPID (RobotWare 7).
  std::string answer(const RapidData& data, std::uint32_t tm_ms);

  bool silent(double now_s) const { return messages_ > 0 && now_s - last_arrival_s_ > options_.silent_s; }
  std::uint64_t messages() const { return messages_; }
  std::uint64_t restarts() const { return restarts_; }
  std::uint64_t invalid() const { return invalid_; }

 private:
  const FollowerOptions options_;
  PeerClock clock_;
  std::uint64_t messages_ = 0, restarts_ = 0, invalid_ = 0;
  std::uint32_t last_seqno_ = 0, answer_seqno_ = 0;
  double last_arrival_s_ = 0.0;
};

}  // namespace takt::gateway::egm
