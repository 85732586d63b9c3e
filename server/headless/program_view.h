#pragma once
// The state of the cell for a program in this process: of each instant, only what the program looks at is read from the
// simulation.
#include <cstdint>
#include <vector>

#include "client_lib/controller/state_source.h"
#include "server/simulation/step/simulation.h"

namespace takt {

class ProgramView final : public controller::StateSource {
 public:
  explicit ProgramView(const Simulation& simulation);

  /// The instant that the simulation is at, until the next call; the simulation stays until then.
  void look_at(const Simulation& simulation);
  const takt_msgs::msg::CellState& read(controller::StatePart part, std::size_t component) override;

  /// Instants of which everything was read.
  std::uint64_t whole_reads() const { return whole_reads_; }

 private:
  const Simulation* simulation_ = nullptr;
  Snapshot snapshot_;
  takt_msgs::msg::CellState state_;
  // What has been read of the present instant:
  bool all_ = false, machines_ = false;
  std::vector<std::uint64_t> read_at_;  ///< by component: the number of the instant
  std::uint64_t instant_ = 0, whole_reads_ = 0;
};

}  // namespace takt
