#pragma once
// Recording of takt-run run --mcap: the samples that takt-server would publish of the same run, with simulated
// time as the time of the recording. Instants are recorded at the requested rate, frames (/tf) and status in
// simulated time at the rate of a server in real time. The rates of a status are those of the whole run up to there.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client_lib/recording/mcap_writer.h"
#include "server/headless/headless_run.h"
#include "server/messages/instant_messages.h"
#include "server/simulation/model/pressed_elements.h"
#include "server/simulation/step/simulation.h"
#include "takt_topics.h"

namespace takt {

struct McapRecordingOptions {
  double period_s = 0.01;  ///< between instants, simulated time
  std::string version;     ///< of the program
  Pace pace = Pace::free;
  double factor = 1.0;  ///< of that pace
  recording::Compression compression = recording::Compression::zstd;
  /// Pairs of which elements with their pressures are recorded: names BASE-TARGET, * for any characters.
  std::vector<std::string> pressures;
};

class McapRecording {
 public:
  /// Writes the description. Throws RecordingError; std::invalid_argument for pairs that do not exist. The
  /// simulation must outlive it.
  McapRecording(const std::filesystem::path& file, const Simulation& simulation,
                McapRecordingOptions options);
  /// Call it with the initial state and after every step: writes the instants that are due. Throws
  /// RecordingError.
  void record(const Simulation& simulation);
  /// Ahead of the following instants.
  void record(takt_msgs::msg::Event event);
  /// Ends with a status of the end of the run, of these times. Throws RecordingError.
  void close(const Simulation& simulation, const RunTimes& times);

 private:
  template <typename Type>
  std::uint16_t add_channel(const Topic<Type>& topic, std::string_view element = {});
  template <typename Type>
  void write(std::uint16_t channel, const Type& message);
  void write_status(const Simulation& simulation, const RunTimes& times);

  recording::McapWriter writer_;
  std::string sample_;
  std::string cell_;
  std::uint16_t event_channel_ = 0, pressures_channel_ = 0, status_channel_ = 0, tf_channel_ = 0,
                tf_static_channel_ = 0;
  std::vector<std::uint16_t> instant_channels_, joint_channels_;
  Snapshot snapshot_;
  const McapRecordingOptions options_;
  InstantMessages instant_;
  takt_msgs::msg::ContactPressures pressures_;
  std::vector<sensor_msgs::msg::JointState> joints_;
  struct WrenchChannel {
    std::size_t device;
    std::uint16_t channel;
    geometry_msgs::msg::WrenchStamped message;
  };
  std::vector<WrenchChannel> wrenches_;  ///< of force-torque sensors
  MovingFramesMessage frames_;
  PressedElements elements_;
  std::vector<std::size_t> pressure_pairs_;
  const RunTimer times_;
  std::uint64_t next_ = 0, next_frames_ = 0, next_status_ = 0, events_ = 0, now_ns_ = 0;
};

}  // namespace takt
