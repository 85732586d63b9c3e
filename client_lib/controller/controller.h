#pragma once
// The emulated robot controller: runs a Lua program that moves robots and grippers. Once per period of simulated time
// it takes a state (the message of the server) and returns commands. It uses neither DDS nor the simulation, so that
// takt-controller (over DDS) and takt-run (in-process) run the same program with the same bits.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client_lib/controller/state_source.h"
#include "client_lib/controller/step_log.h"
#include "plant_models/robot/arm_kinematics.h"
#include "takt_msgs.h"

namespace takt::controller {

struct JointSetPoint {
  int robot = -1;
  JointArray position{}, velocity{};  ///< to be reached one period after the state
};

struct GripperSetPoint {
  int gripper = -1;
  GripperAction verb = GripperAction::open;
  double width_m = 0.0;
  double max_force_N = 0.0;
};

/// Signals of a device that the program has set so far, with their newest values. The receiver checks names
/// and limits.
struct DeviceSetPoint {
  int device = -1;
  std::vector<int> signals;
  std::vector<double> values;
};

struct Output {
  /// One for every robot the program drives (one with a routine), every period.
  std::vector<JointSetPoint> joints;
  /// The standing command of every gripper the program drives (one on a driven robot), every period.
  std::vector<GripperSetPoint> grippers;
  /// One for every device the program drives (one it asked for while it was loaded), every period.
  std::vector<DeviceSetPoint> devices;
  bool finished = false;  ///< all routines of the program have returned
};

/// Numbers handed to a program by name, in place of the defaults that it states: parameter("NAME", default).
using Parameters = std::map<std::string, double>;

class Controller {
 public:
  /// `cell` outlives the controller. Throws std::runtime_error with file, line and reason when the program cannot be
  /// loaded or names something the cell does not have.
  Controller(const std::string& program_file, const takt_msgs::msg::CellDescription& cell,
             const Parameters& parameters = {});
  ~Controller();
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  double period_s() const;
  /// Indices of the robots, grippers and devices that the program drives.
  const std::vector<int>& driven_robots() const;
  const std::vector<int>& driven_grippers() const;
  const std::vector<int>& driven_devices() const;

  /// One period: runs every routine up to its next wait. Throws std::runtime_error on an error in the program
  /// (with file and line), on an unreachable target, on a joint or speed limit, and where the state does not fit the
  /// description.
  const Output& update(const takt_msgs::msg::CellState& state);
  /// The same with a state that fits the description, of which only what the program reads is made.
  const Output& update(StateSource& source);

  /// Back to the start of the program (after a reset of the cell).
  void restart();

  /// Keeps the steps of the routines: the newest so many, or all of them (0). Off by default.
  void keep_steps(std::size_t newest = 0);
  const StepLog& steps() const;

  /// The program as it was read.
  const std::string& text() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace takt::controller
