#pragma once
// The file of a recording: every external change of the simulation, with the step at which it took effect, so
// that replay (replay.h) reproduces the same bits.
//
//   magic, format; then records: | size | checksum | check of these two | content |
//
// The content of a record is a kind (LogKind), its step, and the fields of the kind (log_records.h), in the
// machine's own bits (little-endian). Each checksum (CRC-32 of zlib) continues that of the previous record,
// so that altered, missing or exchanged records are detected. A file that ends within a record was cut off
// there, as by a crash, and is valid up to the previous record; any other mismatch is damage and is refused.
//
// The replay refuses records of an unknown kind, because they would have changed the simulation.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/runtime/recording/log_records.h"

namespace takt {

/// A log cannot be read, or not be replayed: a sentence with the file.
class LogError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Writes the frames around the contents.
class LogFraming {
 public:
  static constexpr std::size_t kHeadSize = 12;
  /// The first bytes of a file.
  static std::vector<std::byte> file_head();
  /// Appends the record, head and content, to `out`.
  void append(std::vector<std::byte>& out, std::span<const std::byte> content);

 private:
  friend class LogReader;
  std::uint32_t checksum_ = 0;  ///< of the previous record
};

struct LogEntry {
  LogKind kind{};
  std::uint64_t step = 0;
  std::vector<std::byte> content;  ///< behind kind and step
};

/// Reads records in sequence. Throws LogError for a file that is no log, has another format, or is damaged.
class LogReader {
 public:
  explicit LogReader(const std::filesystem::path& file);
  /// False at the end.
  bool next(LogEntry& entry);
  /// At the end: the file ends within a record, and all previous records are valid.
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
