#pragma once
// The emulated robot controller: runs a Lua program that moves robots and grippers. Once per period of simulated time
// it takes a state and returns commands. It uses neither DDS nor the simulation, so that takt-controller (over DDS) and
// takt-run (in-process) run the same program with the same bits.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"

namespace takt::controller {

struct RobotInfo {
  std::string name;
  ArmModel arm;
  Pose X_WR;  ///< base in the world
};

struct GripperInfo {
  std::string name;
  int robot = -1;  ///< index into CellInfo::robots
  Pose X_FT;       ///< tool centre point in the flange frame
  double max_width_m = 0.0;
  double max_force_N = 0.0;
};

struct DeviceInfo {
  std::string name;
  std::vector<std::string> signals;
};

struct CellInfo {
  std::vector<RobotInfo> robots;
  std::vector<GripperInfo> grippers;
  std::vector<std::string> components;  ///< names, in the order of Input::components
  std::vector<DeviceInfo> devices{};
};

struct Input {
  struct Robot {
    JointArray position{}, velocity{};
  };
  struct Gripper {
    double width_m = 0.0;
    bool closed = false;  ///< commanded; the rest is measured
    bool moving = false, in_position = false;
    int part = -1;  ///< index into CellInfo::components, or -1
    double force_N = 0.0;
  };
  struct Component {
    Vec3 p_WB = Vec3::Zero();
    Quat q_WB = Quat::Identity();
    int partner = -1;  ///< index into CellInfo::components, or -1
  };
  double time_s = 0.0;
  std::vector<Robot> robots;
  std::vector<Gripper> grippers;
  std::vector<Component> components;
  std::vector<std::vector<double>> devices;  ///< signals of each
};

struct JointSetPoint {
  int robot = -1;
  JointArray position{}, velocity{};  ///< to be reached one period after Input::time_s
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

/// Begin and end of one step of a routine: a section that the program names by r:step("NAME"), or one call
/// that moves or waits.
struct ProgramStep {
  int robot = -1;
  std::string name;    ///< given by the program, or the call: "move_line"
  int line = 0;        ///< of the program
  bool named = false;  ///< by the program
  double begin_s = 0.0;
  double end_s = -1.0;  ///< negative: it goes on
};

/// Numbers handed to a program by name, in place of the defaults that it states: parameter("NAME", default).
using Parameters = std::map<std::string, double>;

class Controller {
 public:
  /// Throws std::runtime_error with file, line and reason when the program cannot be loaded or names
  /// something the cell does not have.
  Controller(const std::string& program_file, const CellInfo& cell, const Parameters& parameters = {});
  ~Controller();
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  double period_s() const;
  /// Indices of the robots, grippers and devices that the program drives.
  const std::vector<int>& driven_robots() const;
  const std::vector<int>& driven_grippers() const;
  const std::vector<int>& driven_devices() const;

  /// One period: runs every routine up to its next wait. Throws std::runtime_error on an error in the program
  /// (with file and line), on an unreachable target, on a joint or speed limit.
  const Output& update(const Input& input);

  /// Back to the start of the program (after a reset of the cell).
  void restart();

  /// Keeps the steps of the routines. The list grows with the program's course. Off by default.
  void keep_steps();
  /// In the order of their beginnings.
  const std::vector<ProgramStep>& steps() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace takt::controller
