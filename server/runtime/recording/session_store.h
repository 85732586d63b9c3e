#pragma once
// The directory of a cell's snapshots (--snapshots DIR, then the cell's name), on the disk:
//   NAME.snapshot              what was saved by request; previous-run.snapshot: see SessionStore::begin()
//   periodic/NUMBER.snapshot   the newest periodic ones; the higher the number, the newer
//   periodic/session.json      what they belong to: how to load the cell again, and whether it played
// Files are replaced atomically, so that whenever the server dies there is the one of before or the new one.
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/runtime/recording/snapshot_file.h"
#include "server/runtime/requests/control.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

/// A scenario file and how it was read.
struct ScenarioSource {
  std::filesystem::path file;
  ScenarioOptions options{};
};

/// What a server that starts again goes on with.
struct Session {
  std::optional<ScenarioSource> source;  ///< nothing: no scenario is loaded
  std::vector<requests::Any> changes;    ///< spawn_entity and delete_entity since it was loaded
  SimulationState state = SimulationState::playing;
  Pace pace = Pace::realtime;
  double factor = 1.0;
};

class SessionStore {
 public:
  static constexpr std::size_t kKeptPeriodic = 3, kKeptEarlier = 3;

  /// Makes the directories. Throws std::runtime_error with a sentence when that is not possible.
  SessionStore(const std::filesystem::path& directory, const std::string& cell);

  /// Why no snapshot can have this name, in a sentence; empty: it can. A name is no path.
  static std::string refused_name(const std::string& name, const std::string& what = "snapshot");
  std::filesystem::path file_of(const std::string& name) const;

  /// Newest first.
  std::vector<std::filesystem::path> periodic() const;
  /// Writes the next periodic one and removes those beyond the newest three.
  SnapshotResult write_periodic(const SnapshotIdentity& identity, std::span<const std::byte> state);

  /// Writes nothing when it is what was written last. Returns why it could not be written; empty: done.
  std::string write(const Session& session);
  /// Nothing when there is none that can be read.
  std::optional<Session> read() const;
  /// A server begins that does not go on from before. The newest periodic snapshot of the one before can be
  /// restored by the name earlier, those of the ones before that as earlier_2 and earlier_3.
  void begin();

 private:
  static std::string earlier_name(std::size_t i);

  std::filesystem::path directory_, periodic_directory_;
  mutable std::mutex mutex_;
  std::string written_;            // guarded by mutex_; the session's text
  std::uint64_t next_number_ = 1;  // guarded by mutex_
};

}  // namespace takt
