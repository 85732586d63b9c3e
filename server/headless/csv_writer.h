#pragma once
// Instants of a run as a table (CSV).
#include <filesystem>
#include <fstream>
#include <vector>

#include "server/simulation/step/simulation.h"

namespace takt {

/// One row per recorded instant: time; per component position, orientation (x, y, z, w), force, torque and
/// partner; per robot the positions of its joints, their velocities, and at level of detail 2, by joint too,
/// motor current (A), gear deflection (rad, motor side) and friction mode (-1 and 1 sliding, 0 sticking;
/// these three if a drive has a motor), torque (N m), then power (W) and energy (J) of the robot; per gripper
/// width; per device its signals; with surface contact at the beginning, the wrench of each pair
/// (contact_report.h).
class CsvWriter {
 public:
  /// Throws std::runtime_error if the file cannot be written.
  CsvWriter(const std::filesystem::path& file, const Simulation& simulation, double period_s);
  void record(const Simulation& simulation);
  void close();

 private:
  struct RobotColumns {
    bool dynamic = false, motors = false;
  };
  void robot_header(const RobotDescription& robot, const RobotSample& sample);
  void write_robot(const RobotSample& sample, std::size_t joints, const RobotColumns& columns);

  std::filesystem::path file_;
  std::ofstream out_;
  Snapshot snapshot_;
  std::vector<RobotColumns> robot_columns_;
  bool contact_columns_ = false;
  double period_s_;
  std::uint64_t next_ = 0;
};

}  // namespace takt
