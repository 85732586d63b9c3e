#pragma once
// Results of a headless run: a JSON report, a table for users, a CSV file.
#include <fstream>
#include <ostream>
#include <string>
#include <string_view>

#include "server/headless/headless_run.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

struct RunInfo {
  std::string solver;
  int level_of_detail = 1;
  std::string pace;
  std::vector<ConvexImport> convex_imports;
  std::vector<ImportNote> import_notes;
};

/// fault: the run ended early; failed: it does not meet a demand of the scenario; passed.
std::string_view verdict(const HeadlessResult& result);

/// JSON text of the report.
std::string report_json(const Scenario& scenario, const CellDescription& cell, const RunInfo& info,
                        const HeadlessResult& result);

/// The same as a page for a browser, with plots. For a run with metrics (HeadlessOptions::run_metrics).
void write_html(std::ostream& out, const Scenario& scenario, const CellDescription& cell, const RunInfo& info,
                const HeadlessResult& result);

/// Largest distance of a Part from its expected place (m); 0 without expected places.
double max_position_error_m(const Scenario& scenario, const CellDescription& cell, const Snapshot& state);

/// A table of final positions against the expected ones.
void print_summary(std::ostream& out, const Scenario& scenario, const CellDescription& cell,
                   const HeadlessResult& result);

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
