#pragma once
// Writes a recording as an MCAP file (https://mcap.dev/spec): chunks compressed by zstd or lz4, each with its
// index, summary at the end; profile `ros2`, schemas `ros2msg`, samples in CDR, so that Foxglove, PlotJuggler
// and rosbag2 open it. Whole chunks survive a crash of the writer.
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/recording/compression.h"
#include "client_lib/recording/message_types.h"
#include "client_lib/recording/offered_qos.h"

namespace takt::recording {

class McapWriter {
 public:
  /// A chunk is closed when it has this many bytes before compression.
  static constexpr std::size_t kChunk_bytes = std::size_t{1} << 20U;

  /// `library` names the program. Throws RecordingError when the file cannot be written.
  McapWriter(const std::filesystem::path& file, const std::string& library,
             Compression compression = Compression::zstd);
  /// Closes the file unless it is closed; errors of this are ignored.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Adds a topic (ROS 2 name) with the type of its messages, described by `types`, and the QoS of its writer.
  /// Returns the channel's number.
  std::uint16_t add_channel(const std::string& topic, const MessageTypes& types, const std::string& type,
                            const OfferedQos& qos);
  /// Times in ns; the log time of a message is at least that of its predecessor. Throws RecordingError.
  void write(std::uint16_t channel, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
             std::string_view sample);
  /// Ends the present chunk and hands it to the operating system. Throws RecordingError.
  void flush();
  /// Summary and end of the file. Throws RecordingError.
  void close();

  std::uint64_t message_count() const { return messages_; }

 private:
  struct Channel {
    std::string record, schema_record;
    std::uint64_t count = 0;
    std::uint32_t sequence = 0;
    bool announced = false;                                      ///< in a chunk
    std::vector<std::pair<std::uint64_t, std::uint64_t>> index;  ///< of the present chunk: time, place
  };
  struct ChunkIndex {
    std::uint64_t first_ns, last_ns, place, length, index_length, compressed, uncompressed;
    std::vector<std::pair<std::uint16_t, std::uint64_t>> indexes;  ///< channel, place of its index
  };
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void append(std::string_view bytes);
  void end_chunk();
  std::string summary();

  std::filesystem::path name_;
  const Compression compression_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  std::uint64_t place_ = 0;
  std::uint32_t data_crc_ = 0;
  std::map<std::string, std::uint16_t> schemas_;
  std::vector<Channel> channels_;  ///< number = index + 1
  std::string chunk_, compressed_;
  std::uint64_t chunk_first_ns_ = 0, newest_ns_ = 0;
  std::vector<ChunkIndex> chunks_;
  std::uint64_t messages_ = 0;
  bool chunk_has_messages_ = false;
  bool closed_ = false;
};

}  // namespace takt::recording
