#pragma once
// Sends the commands of a protocol to the cell from a thread of its own, so that the protocol's thread never waits for
// DDS. Of several commands for one target the newest is sent.
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/gateway/robot_cell.h"
#include "client_lib/gateway/set_point_filter.h"

namespace takt::gateway {

class CommandSender final : public CommandSink {
 public:
  struct Counters {
    std::uint64_t given = 0;     ///< commands that the protocol has given
    std::uint64_t sent = 0;      ///< commands that were sent
    std::uint64_t replaced = 0;  ///< by a newer one before they were sent: the sender was late
    std::uint64_t failed = 0;    ///< refused by the client or DDS
    std::string failure{};       ///< the sentence of the newest failure
  };

  /// `client` outlives this.
  explicit CommandSender(Client& client);
  ~CommandSender() override;
  CommandSender(const CommandSender&) = delete;
  CommandSender& operator=(const CommandSender&) = delete;

  /// Set-points of this robot go through a filter: instant() sends them. Before the first one.
  void filter(const std::string& robot, const SetPointFilterOptions& options);
  /// The cell has a new instant.
  void instant(double cell_time_s);

  /// Any thread, as all functions here.
  void move(const std::string& robot, std::vector<double> positions,
            std::vector<double> velocities = {}) override;
  void apply_torques(const std::string& robot, std::vector<double> torques) override;
  void stop(const std::string& robot) override;
  void grip(const std::string& gripper, GripperAction action, double width_m = 0.0,
            double max_force_N = 0.0) override;
  /// All signals that were set so far are sent: of two commands for one device within a step the server applies the newer one
  /// alone.
  void set_signals(const std::string& device, const std::map<std::string, double>& signals) override;

  Counters counters() const;

 private:
  struct Joints {
    std::vector<double> positions, velocities;
  };
  struct Torques {
    std::vector<double> values;
  };
  struct Stop {};
  struct Grip {
    GripperAction action = GripperAction::close;
    double width_m = 0.0, max_force_N = 0.0;
  };
  using Signals = std::map<std::string, double>;
  using Command = std::variant<Joints, Torques, Stop, Grip, Signals>;
  void give(const std::string& target, Command command);
  void keep(const std::string& target, Command command);
  void run();
  void send(const std::map<std::string, Command>& commands);

  Client& client_;
  mutable std::mutex mutex_;
  std::condition_variable given_;
  std::map<std::string, Command> pending_;
  std::map<std::string, SetPointFilter> filters_;
  std::map<std::string, Signals> standing_;  ///< by device
  Counters counters_;
  bool over_ = false;
  std::thread thread_;
};

}  // namespace takt::gateway
