#pragma once
// The directory of a cell's snapshots (--snapshots DIR, then the cell's name), on the disk:
//   NAME.snapshot              saved by request; previous-run.snapshot: see SessionStore::begin()
//   periodic/NUMBER.snapshot   the newest periodic ones; the higher the number, the newer
//   periodic/session.json      their session: how to load the cell again, and its play state
// Files are replaced atomically: a crash leaves either the old or the new version.
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

/// State from which a restarted server resumes.
struct Session {
  std::optional<ScenarioSource> source;  ///< std::nullopt: no scenario is loaded
  std::vector<requests::Any> changes;    ///< spawn_entity and delete_entity after loading
  SimulationState state = SimulationState::playing;
  Pace pace = Pace::realtime;
  double factor = 1.0;
};

class SessionStore {
 public:
  static constexpr std::size_t kKeptPeriodic = 3, kKeptEarlier = 3, kMostListed = 1000;

  /// Makes the directories. Throws std::runtime_error with a sentence on failure.
  SessionStore(const std::filesystem::path& directory, const std::string& cell);

  /// Why no snapshot can have this name, in a sentence; empty: it can. A name is no path.
  static std::string refused_name(const std::string& name, const std::string& what = "snapshot");
  std::filesystem::path file_of(const std::string& name) const;
  /// The snapshots with a name, the newest first, at most kMostListed.
  std::vector<requests::SnapshotInfo> named() const;

  /// Newest first.
  std::vector<std::filesystem::path> periodic() const;
  /// Writes the next periodic snapshot and removes those beyond the newest three.
  SnapshotResult write_periodic(const SnapshotIdentity& identity, std::span<const std::byte> state);

  /// Skips a session equal to the last written one. Returns the reason of a failure; empty on success.
  std::string write(const Session& session);
  /// std::nullopt without a readable session.
  std::optional<Session> read() const;
  /// Start of a server that does not resume. The newest periodic snapshot of the previous run can be restored
  /// by the name previous-run, those of the two runs ahead of it as previous-run-2 and previous-run-3.
  void begin();

 private:
  static std::string previous_run_name(std::size_t i);

  std::filesystem::path directory_, periodic_directory_;
  mutable std::mutex mutex_;
  std::string written_;            // guarded by mutex_; the session's text
  std::uint64_t next_number_ = 1;  // guarded by mutex_
};

}  // namespace takt
