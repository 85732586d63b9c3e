#pragma once
// Saved states of a simulation in files.
//
// A file is written under another name and renamed when it is complete and on the disk: a crash of the
// program or the machine leaves either the old or the new file. It begins with a magic, the format's version,
// the scenario's name, the hash of its model (simulation/model/model_hash.h), step and time for users, the
// length of the state and a checksum (CRC-32 of zlib) over all other bytes. An unsuitable file is refused
// with a sentence that has the file's name, the value found and the value expected.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace takt {

class Simulation;

/// Identity of the state in a file.
struct SnapshotIdentity {
  std::string scenario;
  std::uint64_t model = 0;  ///< model_hash()
  std::uint64_t step = 0;
  double time_s = 0.0;
};
/// Identity of the present state of `simulation`.
SnapshotIdentity identity_of(const Simulation& simulation);

enum class SnapshotError : std::uint8_t {
  none,
  not_found,       ///< no such file
  not_readable,    ///< it cannot be read, or written
  not_a_snapshot,  ///< another kind of file
  other_version,   ///< of a format this program does not read
  damaged,         ///< cut off, lengthened or altered
  refused,         ///< the state has diverged: the file could not be restored
  other_scenario,  ///< another name, or another model under the same name
};

struct SnapshotResult {
  SnapshotError error = SnapshotError::none;
  std::string message;  ///< a sentence for people; empty: done
  bool good() const { return error == SnapshotError::none; }
};

/// Writes atomically (idl/common/atomic_file.h).
/// Directories must exist.
SnapshotResult write_snapshot_file(const std::filesystem::path& file, const SnapshotIdentity& identity,
                                   std::span<const std::byte> state);

struct SnapshotFile {
  SnapshotIdentity identity;
  std::vector<std::byte> state;  ///< for Simulation::restore_state()
};
/// `content` is complete or untouched.
SnapshotResult read_snapshot_file(const std::filesystem::path& file, SnapshotFile& content);
/// Whether a file of this identity fits to this simulation.
SnapshotResult check_identity(const std::filesystem::path& file, const SnapshotIdentity& found,
                              const Simulation& simulation);

/// Save and restore in one call each. restore_snapshot_file() has no effect on failure.
SnapshotResult save_snapshot_file(const std::filesystem::path& file, Simulation& simulation);
SnapshotResult restore_snapshot_file(const std::filesystem::path& file, Simulation& simulation);

}  // namespace takt
