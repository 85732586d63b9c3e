#pragma once
// The records of a recording (command_log.h) and their codec: one list of fields per record both writes and
// reads it.
//
// A new record is a LogKind, a struct with its LogCodec, a member of LogRecord, and its execution in
// replay.cpp. Fields are checked against the cell when they are read.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "plant_models/state_bytes.h"
#include "server/runtime/recording/session_store.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/command.h"

namespace takt {

/// The values are in files: only add to them.
enum class LogKind : std::uint8_t {
  begin = 1,     ///< first record
  scenario = 2,  ///< a scenario is loaded. Steps are counted by its simulation
  state = 3,     ///< a saved state, for records that follow and name it
  joint_command = 10,
  gripper_command = 11,
  trajectory_command = 12,
  device_command = 13,
  reset = 30,  ///< as all that follows: ahead of the step of the record
  request = 31,
  restored = 35,
  saved = 36,  ///< saving restarts some solvers
  deadlines = 37,
  checkpoint = 50,
  fault = 51,         ///< the step with the commands directly before could not be taken
  scenario_end = 52,  ///< the scenario is unloaded, or the recording ends
  lost = 53,          ///< from here on records are missing
  end = 54,           ///< the recording was ended in order
};

/// For each step since the previous checkpoint, the lowest bits of the state's hash after it: they show the
/// first step at which a replay differs.
using LogTrail = std::uint16_t;
inline constexpr std::size_t kMaxTrail = 1000;

/// A record that is its kind alone.
template <LogKind k>
struct LogMark {
  static constexpr LogKind kind = k;
  static void fields(auto&, auto&) {}
};
using LogReset = LogMark<LogKind::reset>;
using LogSaved = LogMark<LogKind::saved>;
using LogFault = LogMark<LogKind::fault>;
using LogScenarioEnd = LogMark<LogKind::scenario_end>;
using LogLost = LogMark<LogKind::lost>;
using LogEnd = LogMark<LogKind::end>;

struct LogBegin {
  std::string version, cell;  ///< of the server

  static constexpr LogKind kind = LogKind::begin;
  static void fields(auto& archive, auto& record) {
    archive.text(record.version, "letters of the version");
    archive.text(record.cell, "letters of the cell's name");
  }
};
/// The loaded scenario and the options of loading.
struct LogScenario {
  ScenarioSource source;               ///< file empty: the cell came from no file
  std::vector<requests::Any> changes;  ///< spawn_entity and delete_entity, in order
  std::string scenario;
  std::uint64_t model = 0;  ///< model_hash()
  std::uint64_t state = 0;  ///< number of the state it is in; 0: its initial one

  static constexpr LogKind kind = LogKind::scenario;
  static void fields(auto& archive, auto& record) {
    constexpr std::size_t kMaxItems = 100000;
    archive.file(record.source.file);
    archive.list(record.source.options.overrides, kMaxItems, "overrides",
                 [&](auto& text) { archive.text(text, "letters of an override"); });
    archive.optional(record.source.options.level_of_detail, 3, "the level of detail");
    archive.list(record.changes, kMaxItems, "changes", [&](auto& change) { archive.request(change, false); });
    archive.text(record.scenario, "letters of the scenario's name");
    archive.value(record.model);
    archive.value(record.state);
  }
};
struct LogState {
  std::uint64_t number = 0;
  std::vector<std::byte> bytes;  ///< of Simulation::save_state()

  static constexpr LogKind kind = LogKind::state;
  static void fields(auto& archive, auto& record) {
    archive.value(record.number);
    archive.rest(record.bytes);
  }
};
/// One that changes bits.
struct LogRequest {
  requests::Any request;

  static constexpr LogKind kind = LogKind::request;
  static void fields(auto& archive, auto& record) { archive.request(record.request, true); }
};
struct LogRestored {
  std::uint64_t state = 0;  ///< its number

  static constexpr LogKind kind = LogKind::restored;
  static void fields(auto& archive, auto& record) { archive.value(record.state); }
};
struct LogDeadlines {
  bool count = false;  ///< deadlines of set-points, from this step on

  static constexpr LogKind kind = LogKind::deadlines;
  static void fields(auto& archive, auto& record) { archive.flag(record.count, "whether deadlines count"); }
};
struct LogCheckpoint {
  std::uint64_t hash = 0;  ///< of the state
  std::vector<LogTrail> trail;

  static constexpr LogKind kind = LogKind::checkpoint;
  static void fields(auto& archive, auto& record) {
    archive.value(record.hash);
    archive.rest(record.trail);
  }
};

/// A request in the form of its message (takt_msgs::msg::ControlRequest); and back: empty, or the fault.
/// `cell`: the cell of its names, or nullptr.
std::string encoded(const requests::Any& request);
std::string decode_request(std::string_view bytes, const CellDescription* cell, requests::Any& request);

/// `kind`, and fields(archive, record): the archive is a LogWriter with a constant record, or a LogFields.
template <typename Record>
struct LogCodec : Record {};

/// `Sink` has append(bytes, size).
template <typename Sink>
class LogWriter {
 public:
  explicit LogWriter(Sink& out) : out_(out) {}

  template <typename T>
  requires std::is_arithmetic_v<T>
  void value(T value) { out_.append(&value, sizeof(value)); }
  void flag(bool value, const char*) { this->value(static_cast<std::uint8_t>(value ? 1 : 0)); }
  void integer(auto value, int, int, const char*) { this->value(static_cast<std::int32_t>(value)); }
  void optional(const std::optional<int>& value, int, const char*) {
    integer(value.value_or(0), 0, 0, nullptr);
  }
  void numbers(const auto& values) {
    out_.append(values.data(), static_cast<std::size_t>(values.size()) * sizeof(double));
  }
  void text(std::string_view text, const char*) { bytes(text); }
  void file(const std::filesystem::path& file) { bytes(file.native()); }
  void list(const auto& items, std::size_t, const char*, const auto& body) {
    value(static_cast<std::uint64_t>(items.size()));
    for (const auto& item : items) body(item);
  }
  void request(const requests::Any& request, bool) { bytes(encoded(request)); }
  void rest(const auto& items) { out_.append(items.data(), items.size() * sizeof(items[0])); }
  void shared(const auto& object, const auto& body) { body(*object); }
  int last(auto) const { return 0; }
  int last_signal(int) const { return 0; }

 private:
  void bytes(std::string_view text) {
    value(static_cast<std::uint64_t>(text.size()));
    out_.append(text.data(), text.size());
  }
  Sink& out_;
};

/// Reads the same; throws StateError. `cell`: the cell of the indices.
class LogFields {
 public:
  LogFields(StateReader& in, const CellDescription& cell) : in_(in), cell_(cell) {}

  template <typename T>
  void value(T& value) {
    value = in_.get<T>();
  }
  void flag(bool& value, const char* what) { value = in_.flag(what); }
  void integer(auto& value, int lower, int upper, const char* what) {
    value = static_cast<std::decay_t<decltype(value)>>(in_.integer<std::int32_t>(lower, upper, what));
  }
  /// From 1; 0: std::nullopt.
  void optional(std::optional<int>& value, int upper, const char* what) {
    int number = 0;
    integer(number, 0, upper, what);
    if (number > 0) value = number;
  }
  void numbers(auto& values) {
    for (double& number : std::span(values.data(), static_cast<std::size_t>(values.size())))
      number = in_.get<double>();
  }
  void text(std::string& text, const char* what) { text = in_.text(kMaxText, what); }
  void file(std::filesystem::path& file) { file = in_.text(kMaxText, "letters of a file's name"); }
  void list(auto& items, std::size_t most, const char* what, const auto& body) {
    items.resize(in_.size(most, what));
    for (auto& item : items) body(item);
  }
  /// `of_cell`: its names are those of the cell.
  void request(requests::Any& request, bool of_cell) {
    const std::string why =
        decode_request(in_.text(kMaxText, "bytes of a request"), of_cell ? &cell_ : nullptr, request);
    if (!why.empty()) in_.fail(why);
  }
  template <typename T>
  void rest(std::vector<T>& items) {
    const auto bytes = in_.rest();
    if (bytes.size() % sizeof(T) != 0) in_.fail("it ends within a value");
    items.resize(bytes.size() / sizeof(T));
    if (!bytes.empty()) std::memcpy(items.data(), bytes.data(), bytes.size());
  }
  template <typename T>
  void shared(std::shared_ptr<const T>& object, const auto& body) {
    auto made = std::make_shared<T>();
    body(*made);
    object = std::move(made);
  }
  /// Greatest index among these of the cell.
  int last(auto items) const { return static_cast<int>((cell_.*items).size()) - 1; }
  int last_signal(int device) const {
    return static_cast<int>(cell_.devices[static_cast<std::size_t>(device)].signals.size()) - 1;
  }

 private:
  static constexpr std::size_t kMaxText = 1U << 20U;
  StateReader& in_;
  const CellDescription& cell_;
};

template <>
struct LogCodec<JointCommand> {
  static constexpr LogKind kind = LogKind::joint_command;
  static void fields(auto& archive, auto& command) {
    archive.integer(command.robot, 0, archive.last(&CellDescription::robots), "the robot");
    archive.value(command.stamp.ns);
    archive.value(command.period_s);
    archive.flag(command.has_velocity, "whether there are velocities");
    archive.flag(command.has_effort, "whether there are efforts");
    archive.flag(command.torque_mode, "whether there are efforts alone");
    archive.numbers(command.position);
    archive.numbers(command.velocity);
    if (command.has_effort) archive.numbers(command.effort);
  }
};

template <>
struct LogCodec<GripperCommand> {
  static constexpr LogKind kind = LogKind::gripper_command;
  static void fields(auto& archive, auto& command) {
    archive.integer(command.gripper, 0, archive.last(&CellDescription::grippers), "the gripper");
    archive.value(command.stamp.ns);
    archive.integer(command.action, 0, 2, "the gripper's action");
    archive.value(command.width_m);
    archive.value(command.max_force_N);
  }
};

template <>
struct LogCodec<TrajectoryCommand> {
  static constexpr LogKind kind = LogKind::trajectory_command;
  static void fields(auto& archive, auto& command) {
    archive.integer(command.robot, 0, archive.last(&CellDescription::robots), "the robot");
    archive.value(command.stamp.ns);
    archive.shared(command.path, [&](auto& path) {
      archive.integer(path.order, 1, 5, "the order of the trajectory");
      archive.flag(path.has_feed_forward, "whether the trajectory has efforts");
      archive.list(path.points, kMaxTrajectoryPoints, "points", [&](auto& point) {
        archive.value(point.t);
        archive.numbers(point.q);
        archive.numbers(point.qd);
        archive.numbers(point.qdd);
        if (path.has_feed_forward) archive.numbers(point.feed_forward);
      });
    });
  }
};

template <>
struct LogCodec<DeviceCommand> {
  static constexpr LogKind kind = LogKind::device_command;
  static void fields(auto& archive, auto& command) {
    archive.integer(command.device, 0, archive.last(&CellDescription::devices), "the device");
    archive.value(command.stamp.ns);
    archive.integer(command.count, 0, kMaxSignals, "the number of signals");
    const int last_signal = archive.last_signal(command.device);
    for (std::size_t i = 0; i < static_cast<std::size_t>(command.count); ++i) {
      archive.integer(command.signals[i], 0, last_signal, "a signal");
      archive.value(command.values[i]);
    }
  }
};

using LogRecord = std::variant<LogBegin, LogScenario, LogState, JointCommand, GripperCommand,
                               TrajectoryCommand, DeviceCommand, LogReset, LogRequest, LogRestored, LogSaved,
                               LogDeadlines, LogCheckpoint, LogFault, LogScenarioEnd, LogLost, LogEnd>;

/// Kind, step and fields. `Sink` has append(bytes, size).
template <typename Sink, typename Record>
void encode(Sink& out, std::uint64_t step, const Record& record) {
  LogWriter<Sink> writer(out);
  writer.value(static_cast<std::uint8_t>(LogCodec<Record>::kind));
  writer.value(step);
  LogCodec<Record>::fields(writer, record);
}

/// The fields of a record of this kind, from all of `in`; std::nullopt for an unknown kind. Throws
/// StateError.
std::optional<LogRecord> decode(LogKind kind, StateReader& in, const CellDescription& cell);

}  // namespace takt
