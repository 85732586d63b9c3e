#pragma once
// The block scenario's cell in the controller's form, a plant that follows set-points ideally, and programs
// in files.
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "client_lib/controller/controller.h"
#include "server/scenario/urdf_arm.h"

namespace takt::controller {

inline const ArmModel& ur10e() {
  static const ArmModel arm =
      read_urdf_arm(std::string(TAKT_CONFIG_DIR) + "/robots/ur10e.urdf", "base_link", "tool0").arm;
  return arm;
}

inline constexpr JointArray kHome1{0.6061, -1.1318, -2.1304, -1.4502, 1.5708, -0.9647};
inline constexpr JointArray kHome2{0.4115, -1.2986, -1.9381, -1.4757, 1.5708, 0.4115};

inline CellInfo block_cell() {
  CellInfo cell;
  cell.robots.push_back({"Robot1", ur10e(), {Mat3::Identity(), {-0.75, 0.0, 0.7}}});
  cell.robots.push_back({"Robot2", ur10e(), {rotation_from_rpy({0.0, 0.0, M_PI / 2.0}), {0.60, -0.70, 0.7}}});
  const Pose X_FT{Mat3::Identity(), {0.0, 0.0, 0.2}};
  cell.grippers.push_back({"Gripper1", 0, X_FT, 0.15, 150.0});
  cell.grippers.push_back({"Gripper2", 1, X_FT, 0.15, 150.0});
  cell.components = {"Table1", "Table2", "Gripper1", "Gripper2", "B", "C", "O", "P"};
  return cell;
}

inline Input initial_input(const CellInfo& cell) {
  Input input;
  input.robots.resize(cell.robots.size());
  input.robots[0].position = kHome1;
  if (cell.robots.size() > 1) input.robots[1].position = kHome2;
  input.grippers.assign(cell.grippers.size(), {0.15, false});
  input.components.resize(cell.components.size());
  return input;
}

inline Pose tcp_in_world(const CellInfo& cell, int robot, const JointArray& q) {
  ArmPoses poses;
  const RobotInfo& info = cell.robots[static_cast<size_t>(robot)];
  forward_kinematics(info.arm, q.data(), poses);
  return info.X_WR * poses.X_RF * cell.grippers[static_cast<size_t>(robot)].X_FT;
}

/// Robots are at the newest set-points of the previous period.
class IdealPlant {
 public:
  IdealPlant(Controller& controller, const CellInfo& cell)
      : controller_(&controller), input_(initial_input(cell)) {}

  Input& input() { return input_; }
  double time_s() const { return input_.time_s; }

  const Output& update() {
    input_.time_s = static_cast<double>(k_++) * controller_->period_s();
    const Output& output = controller_->update(input_);
    for (const JointSetPoint& joints : output.joints) {
      next_[static_cast<size_t>(joints.robot)] = {joints.position, joints.velocity};
    }
    return output;
  }
  /// To the end of the period.
  void follow() {
    for (size_t i = 0; i < input_.robots.size(); ++i) {
      if (static_cast<size_t>(i) < next_.size()) input_.robots[i] = next_[i];
    }
  }
  /// Whole periods until `stop` returns true after an update, or the time is over.
  void run(double until_s, const std::function<bool(const Output&)>& stop = {}) {
    while (static_cast<double>(k_) * controller_->period_s() <= until_s + 1e-9) {
      if (k_ > 0) follow();
      const Output& output = update();
      if (stop && stop(output)) return;
    }
  }

 private:
  Controller* controller_;
  Input input_;
  std::array<Input::Robot, 2> next_{};
  long k_ = 0;
};

/// A program in a file of its own, removed with the object.
class ProgramFile {
 public:
  explicit ProgramFile(const std::string& text) {
    static int count = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("takt_" + std::to_string(getpid()) + "_" + std::to_string(count++) + ".lua");
    std::ofstream(path_) << text;
  }
  ~ProgramFile() { std::filesystem::remove(path_); }
  ProgramFile(const ProgramFile&) = delete;
  ProgramFile& operator=(const ProgramFile&) = delete;
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace takt::controller
