#pragma once
// What takt-run --mcap writes: the samples that takt-server would publish of the same run, with simulated
// time as the time of the recording.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client_lib/recording/cdr.h"
#include "client_lib/recording/mcap_writer.h"
#include "server/simulation/simulation.h"

namespace takt {

/// An event as people read it.
struct RecordedEvent {
  std::uint8_t severity = 0;  ///< 0 information, 1 warning, 2 error
  std::string code, subject, message;
};

class McapRecording {
 public:
  /// An instant every `period_s` of simulated time. Writes the description. Throws RecordingError.
  McapRecording(const std::filesystem::path& file, const Simulation& simulation, double period_s,
                const std::string& version);
  /// After every step, and before the first: writes the instants that are due. Throws RecordingError.
  void record(const Simulation& simulation);
  void record(const Simulation& simulation, const RecordedEvent& event);
  void close() { writer_.close(); }
  std::uint64_t message_count() const { return writer_.message_count(); }

 private:
  std::uint16_t add_channel(const std::string& name, const std::string& type);
  void write(std::uint16_t channel);
  void write_description(const CellDescription& cell, const std::string& version);
  void write_state(const CellDescription& cell);
  void write_joints(const CellDescription& cell, std::size_t robot);
  void write_power(const CellDescription& cell);
  void write_contacts(const CellDescription& cell);

  recording::McapWriter writer_;
  recording::CdrWriter sample_;
  std::string prefix_;
  std::uint16_t state_channel_ = 0, event_channel_ = 0, power_channel_ = 0, contacts_channel_ = 0;
  std::vector<std::uint16_t> joint_channels_;
  Snapshot snapshot_;
  double period_s_;
  std::uint64_t next_ = 0, events_ = 0, now_ns_ = 0;
};

}  // namespace takt
