#pragma once
// Runs a controller program beside the simulation, in one process: the same program, the same instants and
// the same numbers as takt-controller over DDS in lockstep, so the state hashes are equal.
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "client_lib/controller/controller.h"
#include "server/headless/program_view.h"
#include "server/simulation/step/simulation.h"

namespace takt {

class InProcessController {
 public:
  /// Throws std::runtime_error if the program cannot be loaded for this cell, or the cell does not fit its messages.
  InProcessController(const std::string& program_file, const Simulation& simulation,
                      const controller::Parameters& parameters = {});

  /// Commands for the next step: empty between the boundaries of the program's period. Throws
  /// std::runtime_error when the program fails.
  std::span<const Command> commands(const Simulation& simulation);
  bool finished() const { return finished_; }
  double period_s() const { return controller_.period_s(); }
  /// Instants of which the program read everything, forces included.
  std::uint64_t whole_reads() const { return view_.whole_reads(); }
  /// Steps of the program's routines, after keep_steps().
  void keep_steps() { controller_.keep_steps(); }
  const std::deque<controller::ProgramStep>& steps() const { return controller_.steps().steps(); }

 private:
  /// Throws std::runtime_error for a signal that cannot be set, or not to this value.
  DeviceCommand validated(const controller::DeviceSetPoint& set_point, const CellDescription& cell) const;

  takt_msgs::msg::CellDescription description_;
  controller::Controller controller_;
  ProgramView view_;
  double step_s_;
  std::vector<Command> commands_;
  /// Of each driven device: the last checked set-point, and its command.
  std::vector<std::pair<controller::DeviceSetPoint, DeviceCommand>> device_commands_;
  std::uint64_t boundary_ = 0;
  bool finished_ = false;
};

}  // namespace takt
