#pragma once
// The file of a recording: everything from outside that changed what was simulated, with the step at which it
// took effect, so that replay (replay.h) comes to the same bits.
//
//   magic, format; then records: | size | checksum | check of these two | content |
//
// The content of a record is a kind (LogKind), the step it belongs to, and what the kind has (log_records.h), in the
// machine's own bits (little-endian). Each checksum (CRC-32 of zlib) goes on from
// that of the record before, so that records can neither be altered nor left out nor exchanged unnoticed. A
// file that ends within a record was cut off there, as by a crash, and is good up to the record before;
// anything else that does not fit is damage, and refused.
//
// A kind that a program does not know is refused by the replay, never passed over: it would have changed the
// simulation.
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
