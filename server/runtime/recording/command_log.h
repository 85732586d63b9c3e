#pragma once
// The file of a recording: everything from outside that changed what was simulated, with the step at which it
// took effect, so that replay (replay.h) comes to the same bits.
//
//   magic, format; then records: | size | checksum | check of these two | content |
//
// The content of a record is a kind (LogKind), the step it belongs to, and what the kind has, in the
// machine's own bits (little-endian, plant_models/state_bytes.h). Each checksum (CRC-32 of zlib) goes on from
// that of the record before, so that records can neither be altered nor left out nor exchanged unnoticed. A
// file that ends within a record was cut off there, as by a crash, and is good up to the record before;
// anything else that does not fit is damage, and refused.
//
// A new kind of command is a new LogKind, an encode() and a case in replay.cpp. A kind that a program does
// not know is refused there, never passed over: it would have changed the simulation.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/runtime/recording/session_store.h"
#include "server/simulation/model/command.h"

namespace takt {

/// The values are in files: only add to them.
enum class LogKind : std::uint8_t {
  begin = 1,     ///< first record: version of the server, name of the cell
  scenario = 2,  ///< a scenario is loaded: LogScenario. Steps are counted by its simulation
  state = 3,     ///< number, and bytes of Simulation::save_state(), for records that follow and name it
  joint_command = 10,
  gripper_command = 11,
  trajectory_command = 12,
  device_command = 13,
  reset = 30,            ///< as all that follows: before the step of the record
  level_of_detail = 31,  ///< process, level
  attach = 32,           ///< part, to
  detach = 33,           ///< part
  entity_state = 34,     ///< component, pose, twist
  restored = 35,         ///< number of the state
  saved = 36,            ///< saving starts some solvers anew
  deadlines = 37,        ///< whether deadlines of set-points count from here on
  checkpoint = 50,       ///< hash of the state, and the trail to it: see LogTrail
  fault = 51,            ///< the step with the commands directly before could not be taken
  scenario_end = 52,     ///< the scenario is unloaded, or the recording ends
  lost = 53,             ///< from here on records are missing
  end = 54,              ///< the recording was ended in order
};

/// What was loaded, and how.
struct LogScenario {
  ScenarioSource source;                ///< file empty: the cell came from no file
  std::vector<ControlRequest> changes;  ///< spawn_entity and delete_entity since then
  std::string scenario;
  std::uint64_t model = 0;  ///< model_hash()
  std::uint64_t state = 0;  ///< number of the state it is in; 0: its initial one
};

/// Of each step since the checkpoint before, the lowest bits of the state's hash after it: they tell the step
/// at which a replay differs first.
using LogTrail = std::uint16_t;
inline constexpr std::size_t kMaxTrail = 1000;

/// `Sink` has put(T) for numbers, as StateWriter.
template <typename Sink>
void encode(Sink& out, const JointCommand& command) {
  out.put(static_cast<std::int32_t>(command.robot));
  out.put(command.stamp_s);
  out.put(command.period_s);
  out.put(static_cast<std::uint8_t>(command.has_velocity ? 1 : 0));
  out.put(static_cast<std::uint8_t>(command.has_effort ? 1 : 0));
  out.put(static_cast<std::uint8_t>(command.position.size()));
  for (const double q : command.position) out.put(q);
  for (const double v : command.velocity) out.put(v);
  if (!command.has_effort) return;
  for (const double tau : command.effort) out.put(tau);
}
template <typename Sink>
void encode(Sink& out, const GripperCommand& command) {
  out.put(static_cast<std::int32_t>(command.gripper));
  out.put(command.stamp_s);
  out.put(static_cast<std::uint8_t>(command.action));
  out.put(command.width_m);
  out.put(command.max_force_N);
}
template <typename Sink>
void encode(Sink& out, const TrajectoryCommand& command) {
  out.put(static_cast<std::int32_t>(command.robot));
  out.put(command.stamp_s);
  out.put(static_cast<std::uint8_t>(command.path->order));
  out.put(static_cast<std::uint8_t>(command.path->has_feed_forward ? 1 : 0));
  out.put(static_cast<std::uint32_t>(command.path->points.size()));
  for (const JointPathPoint& point : command.path->points) {
    out.put(point.t);
    for (const JointArray* values : {&point.q, &point.qd, &point.qdd})
      for (const double value : *values) out.put(value);
    if (!command.path->has_feed_forward) continue;
    for (const double tau : point.feed_forward) out.put(tau);
  }
}
template <typename Sink>
void encode(Sink& out, const DeviceCommand& command) {
  out.put(static_cast<std::int32_t>(command.device));
  out.put(command.stamp_s);
  out.put(static_cast<std::uint8_t>(command.count));
  for (std::size_t i = 0; i < static_cast<std::size_t>(command.count); ++i) {
    out.put(command.signals[i]);
    out.put(command.values[i]);
  }
}
inline LogKind kind_of(const TrajectoryCommand&) {
  return LogKind::trajectory_command;
}
inline LogKind kind_of(const DeviceCommand&) {
  return LogKind::device_command;
}
inline LogKind kind_of(const JointCommand&) {
  return LogKind::joint_command;
}
inline LogKind kind_of(const GripperCommand&) {
  return LogKind::gripper_command;
}

/// Content of a record `scenario`, behind kind and step; and back (throws StateError).
void encode(std::vector<std::byte>& out, const LogScenario& logged);
LogScenario decode_scenario(std::span<const std::byte> content);

/// A log cannot be read, or not be replayed: a sentence with the file.
class LogError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes what stands around the contents.
class LogFraming {
 public:
  static constexpr std::size_t kHeadSize = 12;
  /// What a file begins with.
  static std::vector<std::byte> file_head();
  /// Appends the record, head and content, to `out`.
  void append(std::vector<std::byte>& out, std::span<const std::byte> content);

 private:
  friend class LogReader;
  std::uint32_t checksum_ = 0;  ///< of the record before
};

struct LogEntry {
  LogKind kind{};
  std::uint64_t step = 0;
  std::vector<std::byte> content;  ///< behind kind and step
};

/// Reads one record after the other. Throws LogError for what is no log, of another format, or damaged.
class LogReader {
 public:
  explicit LogReader(const std::filesystem::path& file);
  /// False at the end.
  bool next(LogEntry& entry);
  /// At the end: it lies within a record, the whole records before are good.
  bool torn() const { return torn_; }
  /// Bytes of whole records, and of the file's head.
  std::uint64_t read_bytes() const { return at_; }

 private:
  [[noreturn]] void damaged(const std::string& what) const;

  std::string name_;
  std::ifstream in_;
  std::uint64_t length_ = 0, at_ = 0;
  LogFraming framing_;
  bool torn_ = false;
};

}  // namespace takt
