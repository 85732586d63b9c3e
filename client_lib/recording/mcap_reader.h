#pragma once
// Reads MCAP recordings: takt's own, and others whose chunks are compressed by zstd or lz4 or uncompressed. A file that
// a crash of its writer or a full disk has cut off is read up to its last whole chunk.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/recording/message_types.h"

namespace takt::recording {

struct McapChannel {
  std::uint16_t number = 0;
  std::string topic;     ///< ROS 2 name
  std::string type;      ///< pkg/msg/Name
  std::string encoding;  ///< of its messages: cdr
  std::string schema_encoding, schema;
  std::map<std::string, std::string> metadata;  ///< as rosbag2 knows it: offered_qos_profiles
};

struct McapMessage {
  const McapChannel* channel = nullptr;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  std::string_view sample;  ///< until the function that got it returns
};

/// Sizes that are read: a few kB can claim gigabytes, and become them.
struct McapLimits {
  std::uint64_t record_bytes = std::uint64_t{256} << 20U;  ///< of a record, and of a chunk before compression
  std::uint64_t overlap_bytes = std::uint64_t{512}
                                << 20U;  ///< of chunks that overlap in time: in memory together
};

class McapReader {
 public:
  static constexpr std::uint64_t kEver = std::numeric_limits<std::uint64_t>::max();

  /// Reads the structure of the file. Throws RecordingError if the file is no recording or cannot be read.
  explicit McapReader(const std::filesystem::path& file, const McapLimits& limits = {});

  const std::filesystem::path& file() const { return name_; }
  const std::string& profile() const { return profile_; }
  /// All channels with messages in whole chunks, by number.
  const std::map<std::uint16_t, McapChannel>& channels() const { return channels_; }
  /// The first channel of the topic; nullptr without a channel.
  const McapChannel* channel(const std::string& topic) const;
  /// Types of all channels with schemas in `ros2msg`.
  const MessageTypes& types() const { return types_; }
  /// Empty for a file with a proper end; else a sentence that names the missing part.
  const std::string& cut_off() const { return cut_off_; }
  std::size_t chunk_count() const { return chunks_.size(); }
  /// 0 without messages.
  std::uint64_t first_ns() const { return first_ns_; }
  std::uint64_t last_ns() const { return last_ns_; }

  /// Calls the function for the messages with first_ns <= log time <= last_ns, in the order of time, until it
  /// returns false. Throws RecordingError at a damaged chunk.
  void read(const std::function<bool(const McapMessage&)>& function, std::uint64_t first_ns = 0,
            std::uint64_t last_ns = kEver);

 private:
  struct Chunk {
    std::uint64_t first_ns, last_ns, place;  ///< place of the content of its record
    std::uint64_t length;
  };
  struct Loaded;

  bool read_summary();
  void scan();
  std::string with_name(const std::string& sentence) const;
  std::string record_at(std::uint64_t place, std::uint64_t length);
  std::string uncompressed(const Chunk& chunk);
  void note_schema(std::string_view content);
  void note_channel(std::string_view content);
  void note_chunk_contents(std::string_view records);
  void finish_channels();

  [[noreturn]] void refuse_size(const std::string& subject, std::uint64_t bytes) const;

  std::filesystem::path name_;
  McapLimits limits_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
  std::string profile_, cut_off_;
  struct Schema {
    std::string name, encoding, text;
  };
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, std::uint16_t> schema_of_;  ///< by channel
  std::map<std::uint16_t, McapChannel> channels_;
  MessageTypes types_;
  std::vector<Chunk> chunks_;
  std::uint64_t first_ns_ = 0, last_ns_ = 0;
};

}  // namespace takt::recording
