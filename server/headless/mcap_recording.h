#pragma once
// What takt-run --mcap writes: the samples that takt-server would publish of the same run, with simulated
// time as the time of the recording. Instants come as often as asked for, frames (/tf) and status as often in
// simulated time as a server in real time sends them.
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client_lib/recording/cdr.h"
#include "client_lib/recording/mcap_writer.h"
#include "server/simulation/model/cell_frames.h"
#include "server/simulation/model/pressed_elements.h"
#include "server/simulation/step/simulation.h"

namespace takt {

/// An event as people read it.
struct RecordedEvent {
  std::uint8_t severity = 0;  ///< 0 information, 1 warning, 2 error
  std::string code, subject, message;
  double time_s = 0.0;  ///< when it was, and the step that began then
  std::uint64_t step = 0;
};

struct McapRecordingOptions {
  double period_s = 0.01;  ///< between instants, simulated time
  std::string version;     ///< of the program
  std::string pace = "free";
  double factor = 1.0;  ///< of that pace
  recording::Compression compression = recording::Compression::zstd;
  /// Pairs of which elements with their pressures are recorded: names BASE-TARGET, * for any characters,
  /// separated by commas.
  std::string pressures;
};

class McapRecording {
 public:
  /// Writes the description. Throws RecordingError; std::invalid_argument for pairs that do not exist. The
  /// simulation must outlive it.
  McapRecording(const std::filesystem::path& file, const Simulation& simulation,
                McapRecordingOptions options);
  /// After every step, and before the first: writes the instants that are due. Throws RecordingError.
  void record(const Simulation& simulation);
  /// Before the instants that come after it.
  void record(const Simulation& simulation, const RecordedEvent& event);
  void close() { writer_.close(); }
  std::uint64_t message_count() const { return writer_.message_count(); }

 private:
  /// `name`: within the cell, or of the whole topic, with / at its begin.
  std::uint16_t add_channel(const std::string& name, const std::string& type);
  void write(std::uint16_t channel);
  /// Begins a sample as all begin that belong to an instant: stamp, time, step, epoch, and of most the world.
  void begin_sample(const CellDescription* of_world);
  void write_description(const CellDescription& cell, const std::string& version);
  void write_frames(std::uint16_t channel, const std::vector<CellFrame>& frames);
  void write_status(const Simulation& simulation);
  void write_pressures(const CellDescription& cell);
  void write_state(const CellDescription& cell);
  void write_joints(const CellDescription& cell, std::size_t robot);
  void write_power(const CellDescription& cell);
  void write_contacts(const CellDescription& cell);

  recording::McapWriter writer_;
  recording::CdrWriter sample_;
  std::string prefix_;
  std::uint16_t state_channel_ = 0, event_channel_ = 0, power_channel_ = 0, contacts_channel_ = 0,
                pressures_channel_ = 0, status_channel_ = 0, tf_channel_ = 0, tf_static_channel_ = 0;
  std::vector<std::uint16_t> joint_channels_;
  Snapshot snapshot_;
  const McapRecordingOptions options_;
  MovingFrames frames_;
  PressedElements elements_;
  std::vector<std::size_t> pressure_pairs_;
  const std::chrono::steady_clock::time_point began_;
  std::uint64_t next_ = 0, next_frames_ = 0, next_status_ = 0, events_ = 0, now_ns_ = 0;
};

}  // namespace takt
