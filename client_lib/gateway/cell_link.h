#pragma once
// A gateway's link to the cell: client, newest state, command sender, registration as a controller, and the supervision
// of the cell's speed. A gateway in lockstep uses LockstepController in place of this class.
//
// Registered, the gateway stands in the events of the cell, its commands are in the command log, and the set-points
// last for its period. At the pace lockstep the cell waits for registered controllers; this class does not answer, so that this
// pace is refused with a sentence.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/gateway/command_sender.h"
#include "client_lib/gateway/gateway_reporter.h"
#include "client_lib/gateway/latest_state.h"

namespace takt::gateway {

/// A line for the operator, with the gateway's name: standard output, flushed.
void report(const std::string& gateway, const std::string& sentence);

/// Sets the pace realtime, at the factor that the cell has.
void set_realtime(Client& client);

struct CellLinkOptions {
  std::string name;         ///< of the controller in events and status
  std::string protocol;     ///< in the status
  double period_s = 0.002;  ///< of the protocol's cycle
  /// Largest wall time between two instants (99 %) at which the protocol works.
  double most_interval_s = 0.02;
  bool needs_wall_time = true;  ///< the protocol's clock is wall time
  /// Of this robot; set-points pass a filter of this bandwidth (SetPointFilter). 0: each is sent as it comes.
  std::string robot{};
  double filter_rad_per_s = 0.0;
};

class CellLink final : public RobotCell {
 public:
  /// `client` outlives this. Throws ClientError.
  CellLink(Client& client, CellLinkOptions options, const std::vector<std::string>& targets);
  /// Unregisters.
  ~CellLink() override;
  CellLink(const CellLink&) = delete;
  CellLink& operator=(const CellLink&) = delete;

  std::shared_ptr<const CellInfo> cell() const override { return info_; }
  std::shared_ptr<const State> state() const override { return states_.get(); }
  CommandSender& sender() override { return sender_; }
  /// For the status of the cell; at any rate.
  void show(PeerStatus peer) { reporter_.set(std::move(peer)); }
  /// Of the set-points: at least one step of the cell.
  double period_s() const { return options_.period_s; }

  /// Called about once a second from any thread, which it holds for the time of a status at most: compares the cell's
  /// speed with the protocol's limits and reports changes. True while the robot can follow: the cell plays.
  bool supervise();
  /// The newest result of supervise().
  bool plays() const override { return plays_; }
  /// Why the cell cannot keep the protocol's limits; empty if it does.
  const std::string& shortfall() const { return shortfall_; }
  /// "1234 commands sent, 2 replaced by newer ones; instants every 1.0 ms (99 %: 1.4 ms)."
  std::string figures() const;

 private:
  Client& client_;
  CellLinkOptions options_;
  std::shared_ptr<const CellInfo> info_;
  CommandSender sender_;
  GatewayReporter reporter_;
  LatestState states_;
  std::vector<std::string> targets_;
  std::atomic<bool> plays_ = false;
  std::string shortfall_;
  std::uint64_t failures_ = 0;
  int playing_calls_ = 0;  ///< of supervise(), in a row
};

}  // namespace takt::gateway
