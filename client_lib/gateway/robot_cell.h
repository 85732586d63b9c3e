#pragma once
// The cell as the code of a protocol sees it: its newest instant, and where commands go. CellLink is one in real time; a gateway
// in lockstep has its own.
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client_lib/client.h"

namespace takt::gateway {

/// Takes commands; none of the functions waits.
class CommandSink {
 public:
  virtual ~CommandSink() = default;
  /// As Client::send_joint_command.
  virtual void move(const std::string& robot, std::vector<double> positions,
                    std::vector<double> velocities) = 0;
  /// As Client::send_joint_torques.
  virtual void apply_torques(const std::string& robot, std::vector<double> torques) = 0;
  /// The robot stops and stays, by its own braking.
  virtual void stop(const std::string& robot) = 0;
  /// As Client::set_gripper.
  virtual void grip(const std::string& gripper, GripperAction action, double width_m = 0.0,
                    double max_force_N = 0.0) = 0;
  /// As Client::set_signals. Signals that were set before keep their values.
  virtual void set_signals(const std::string& device, const std::map<std::string, double>& signals) = 0;
};

class RobotCell {
 public:
  virtual ~RobotCell() = default;
  virtual std::shared_ptr<const CellInfo> cell() const = 0;
  virtual std::shared_ptr<const State> state() const = 0;
  /// The robot can follow: the cell plays.
  virtual bool plays() const = 0;
  virtual CommandSink& sender() = 0;
};

}  // namespace takt::gateway
