#pragma once
// The block scenario's cell as a message, a plant that follows set-points ideally, and programs
// in files.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "client_lib/controller/controller.h"
#include "client_lib/kinematics/arm.h"
#include "server/messages/description_message.h"
#include "server/scenario/urdf_arm.h"

namespace takt::controller {

inline const ArmModel& ur10e() {
  static const ArmModel arm =
      read_urdf_arm(std::string(TAKT_CONFIG_DIR) + "/robots/ur10e.urdf", "base_link", "tool0").arm;
  return arm;
}

inline constexpr JointArray kHome1{0.6061, -1.1318, -2.1304, -1.4502, 1.5708, -0.9647};
inline constexpr JointArray kHome2{0.4115, -1.2986, -1.9381, -1.4757, 1.5708, 0.4115};

using takt_msgs::msg::CellDescription;
using takt_msgs::msg::CellState;

inline CellDescription block_cell() {
  takt::CellDescription cell;
  const auto add_robot = [&](const char* name, const Pose& X_WR) {
    auto& robot = cell.robots.emplace_back();
    robot.name = name;
    robot.arm = ur10e();
    robot.X_WR = X_WR;
  };
  add_robot("Robot1", {Mat3::Identity(), {-0.75, 0.0, 0.7}});
  add_robot("Robot2", {rotation_from_rpy({0.0, 0.0, M_PI / 2.0}), {0.60, -0.70, 0.7}});
  for (const char* name : {"Table1", "Table2", "Gripper1", "Gripper2", "B", "C", "O", "P"})
    cell.components.emplace_back().name = name;
  for (int i = 0; i < 2; ++i) {
    auto& gripper = cell.grippers.emplace_back();
    gripper.name = "Gripper" + std::to_string(i + 1);
    gripper.robot = i;
    gripper.component = 2 + i;
    gripper.X_GT.p = {0.0, 0.0, 0.2};
    gripper.max_width_m = 0.15;
    gripper.max_force_N = 150.0;
  }
  return to_message(cell, "");
}

/// Robots at home, jaws open, signals zero.
inline CellState initial_state(const CellDescription& cell) {
  CellState state;
  state.components.resize(cell.components.size());
  for (const auto& robot : cell.robots) {
    const JointArray& home = state.robots.empty() ? kHome1 : kHome2;
    const std::vector<double> position(home.begin(), home.begin() + std::ssize(robot.joints));
    const std::vector<double> zeros(robot.joints.size());
    state.robots.push_back({position, zeros, zeros, {}});
  }
  state.grippers.resize(cell.grippers.size());
  for (auto& gripper : state.grippers) gripper.width = 0.15;
  for (const auto& device : cell.devices)
    state.devices.push_back({std::vector<double>(device.signals.size())});
  return state;
}

inline JointArray joint_array(const std::vector<double>& values) {
  JointArray array{};
  std::ranges::copy(values, array.begin());
  return array;
}

/// The state of the robot at a set-point.
inline void place_at(const JointSetPoint& set_point, CellState& state) {
  auto& robot = state.robots[static_cast<size_t>(set_point.robot)];
  std::copy_n(set_point.position.begin(), robot.position.size(), robot.position.begin());
  std::copy_n(set_point.velocity.begin(), robot.velocity.size(), robot.velocity.begin());
}

inline Pose tcp_in_world(const CellDescription& cell, int robot, const JointArray& q) {
  const auto i = static_cast<size_t>(robot);
  return Arm(cell, cell.robots[i].name, cell.grippers[i].name)
      .forward_kinematics(std::span(q).first(cell.robots[i].joints.size()));
}

/// Robots are at the newest set-points of the previous period.
class IdealPlant {
 public:
  IdealPlant(Controller& controller, const CellDescription& cell)
      : controller_(&controller), state_(initial_state(cell)) {}

  CellState& state() { return state_; }
  double time_s() const { return state_.time; }

  const Output& update() {
    state_.time = static_cast<double>(k_++) * controller_->period_s();
    const Output& output = controller_->update(state_);
    next_ = output.joints;
    return output;
  }
  /// To the end of the period.
  void follow() {
    for (const JointSetPoint& joints : next_) place_at(joints, state_);
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
  CellState state_;
  std::vector<JointSetPoint> next_;
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
