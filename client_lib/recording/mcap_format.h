#pragma once
// Records of an MCAP file (version 0, https://mcap.dev/spec): one byte with the kind, eight with the length, the
// content. Integers are little endian and not aligned.
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "client_lib/recording/message_types.h"

namespace takt::recording::mcap {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHead_bytes = 9;

using Opcode = std::uint8_t;
inline constexpr Opcode kHeader = 0x01, kFooter = 0x02, kSchema = 0x03, kChannel = 0x04, kMessage = 0x05,
                        kChunk = 0x06, kMessageIndex = 0x07, kChunkIndex = 0x08, kStatistics = 0x0b,
                        kMetadata = 0x0c, kMetadataIndex = 0x0d, kSummaryOffset = 0x0e, kDataEnd = 0x0f;

/// A record being made.
class Record {
 public:
  explicit Record(Opcode opcode) : bytes_(kRecordHead_bytes, '\0') { bytes_[0] = static_cast<char>(opcode); }
  template <typename Integer>
  Record& put(Integer value) {
    static_assert(std::is_integral_v<Integer>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
    return *this;
  }
  /// With its length in four bytes.
  Record& text(std::string_view value) {
    put(static_cast<std::uint32_t>(value.size()));
    bytes_.append(value);
    return *this;
  }
  Record& raw(std::string_view value) {
    bytes_.append(value);
    return *this;
  }
  /// The whole record, its length filled in.
  const std::string& finished() {
    const std::uint64_t length = bytes_.size() - kRecordHead_bytes;
    std::memcpy(bytes_.data() + 1, &length, sizeof(length));
    return bytes_;
  }

 private:
  std::string bytes_;
};

/// Takes integers and texts from the content of a record. Throws RecordingError where it ends too early.
class Content {
 public:
  explicit Content(std::string_view bytes) : bytes_(bytes) {}
  template <typename Integer>
  Integer take() {
    Integer value{};
    std::memcpy(&value, raw(sizeof(value)).data(), sizeof(value));
    return value;
  }
  std::string_view raw(std::uint64_t length) {
    if (length > bytes_.size()) throw RecordingError("A record ends before its last member.");
    const std::string_view part = bytes_.substr(0, length);
    bytes_.remove_prefix(length);
    return part;
  }
  std::string_view text() { return raw(take<std::uint32_t>()); }
  std::string_view rest() const { return bytes_; }
  bool empty() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
};

}  // namespace takt::recording::mcap
