#pragma once
// Instants of a run as a table (CSV).
#include <filesystem>
#include <fstream>

#include "client_lib/recording/signal_table.h"
#include "server/headless/instant_json.h"
#include "server/simulation/step/simulation.h"

namespace takt {

/// One row per recorded instant, with the columns of client_lib/recording/signal_table.h and the values of
/// instant_json.h. With surface contact at the beginning, each pair that may act has columns, as
/// contacts.contacts.BASE-TARGET.normal_force; zero while it does not press.
class CsvWriter {
 public:
  /// Throws std::runtime_error if the file cannot be written.
  CsvWriter(const std::filesystem::path& file, const Simulation& simulation, double period_s);
  void record(const Simulation& simulation);
  void close();

 private:
  nlohmann::json pairs_json(const Simulation& simulation) const;

  std::filesystem::path file_;
  std::ofstream out_;
  Snapshot snapshot_;
  InstantJson instants_;
  recording::SignalTable table_;
  double period_s_;
  std::uint64_t next_ = 0;
};

}  // namespace takt
