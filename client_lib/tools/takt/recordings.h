#pragma once
// Commands about recordings (MCAP): record, replay, export, plot.
#include <optional>
#include <string>
#include <vector>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {

/// takt record FILE.mcap: every topic of the cell, as it is sent. `period_s`: of states, contacts, power and
/// joint states in simulated time; without: each sample.
int record_mcap(const Common& common, const RecordOptions& options, std::optional<double> period_s);

struct ReplayOptions {
  std::string file;
  double rate = 1.0;      ///< times as fast as recorded
  bool commands = false;  ///< commands too
};
int replay(const Common& common, const ReplayOptions& options);

struct ExportOptions {
  std::string file, csv;
  std::vector<std::string> signals;
  bool list = false;
};
int export_recording(const Common& common, const ExportOptions& options);

struct PlotOptions {
  std::string file, output;
  std::vector<std::string> signals;
  std::string size = "1200,700";
};
int plot(const Common& common, const PlotOptions& options);

/// Adds replay, export and plot.
void declare_recordings(CLI::App& app, const Common& common, int& result);

}  // namespace takt::tool
