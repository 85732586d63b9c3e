#include "client_lib/recording/mcap_writer.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>

#include "client_lib/recording/mcap_format.h"

namespace takt::recording {

using mcap::Record;

namespace {

std::uint32_t crc_of(std::string_view bytes, std::uint32_t before = 0) {
  // In parts, as zlib counts in 32 bits.
  constexpr std::size_t most = std::size_t{1} << 30U;
  std::uint32_t crc = before;
  while (!bytes.empty()) {
    const std::size_t part = std::min(bytes.size(), most);
    crc = static_cast<std::uint32_t>(
        crc32(crc, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(part)));
    bytes.remove_prefix(part);
  }
  return crc;
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& file, const std::string& library, Compression compression)
    : name_(file), compression_(compression), file_(std::fopen(file.c_str(), "wb")) {
  if (!file_)
    throw RecordingError("The recording '" + file.string() + "' cannot be written: " + std::strerror(errno) +
                         ".");
  append(mcap::kMagic);
  append(Record(mcap::kHeader).text("ros2").text(library).finished());
  if (std::fflush(file_.get()) != 0)
    throw RecordingError("The recording '" + file.string() + "' cannot be written.");
}

McapWriter::~McapWriter() {
  try {
    if (!closed_) close();
  } catch (const RecordingError&) {
    return;  // the chunks that are whole stay readable
  }
}

void McapWriter::append(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
    throw RecordingError("The recording '" + name_.string() +
                         "' cannot be written on: " + std::strerror(errno) + ".");
  place_ += bytes.size();
  data_crc_ = crc_of(bytes, data_crc_);
}

std::uint16_t McapWriter::add_channel(const std::string& topic, const MessageTypes& types,
                                      const std::string& type, const OfferedQos& qos) {
  const auto [schema, is_new] = schemas_.emplace(type, static_cast<std::uint16_t>(schemas_.size() + 1));
  Channel channel;
  channel.schema_record = Record(mcap::kSchema)
                              .put(schema->second)
                              .text(type)
                              .text("ros2msg")
                              .text(types.ros2msg(type))
                              .finished();
  const auto number = static_cast<std::uint16_t>(channels_.size() + 1);
  std::string metadata;
  for (const std::string& text : {std::string(kOfferedQosProfiles), offered_qos_profiles(qos)}) {
    const auto length = static_cast<std::uint32_t>(text.size());
    metadata.append(reinterpret_cast<const char*>(&length), sizeof(length));
    metadata.append(text);
  }
  channel.record = Record(mcap::kChannel)
                       .put(number)
                       .put(schema->second)
                       .text(topic)
                       .text("cdr")
                       .text(metadata)
                       .finished();
  channels_.push_back(std::move(channel));
  return number;
}

void McapWriter::write(std::uint16_t number, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
                       std::string_view sample) {
  Channel& channel = channels_.at(number - 1U);
  newest_ns_ = std::max(newest_ns_, log_time_ns);
  if (!chunk_has_messages_) chunk_first_ns_ = newest_ns_;
  chunk_has_messages_ = true;
  if (!channel.announced) {  // readers that go through the file from its begin meet it here
    channel.announced = true;
    chunk_ += channel.schema_record;
    chunk_ += channel.record;
  }
  channel.index.emplace_back(newest_ns_, chunk_.size());
  chunk_ += Record(mcap::kMessage)
                .put(number)
                .put(channel.sequence++)
                .put(newest_ns_)
                .put(publish_time_ns)
                .raw(sample)
                .finished();
  ++channel.count;
  ++messages_;
  if (chunk_.size() >= kChunk_bytes) end_chunk();
}

void McapWriter::end_chunk() {
  if (!chunk_has_messages_) return;
  compress(compression_, chunk_, compressed_);
  const std::size_t size = compressed_.size();

  ChunkIndex index{chunk_first_ns_, newest_ns_, place_, 0, 0, size, chunk_.size(), {}};
  append(Record(mcap::kChunk)
             .put(chunk_first_ns_)
             .put(newest_ns_)
             .put(std::uint64_t{chunk_.size()})
             .put(crc_of(chunk_))
             .text(mcap_name(compression_))
             .put(std::uint64_t{size})
             .raw(compressed_)
             .finished());
  index.length = place_ - index.place;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    auto& messages = channels_[i].index;
    if (messages.empty()) continue;
    const auto number = static_cast<std::uint16_t>(i + 1);
    index.indexes.emplace_back(number, place_);
    Record record(mcap::kMessageIndex);
    record.put(number).put(static_cast<std::uint32_t>(messages.size() * 16));
    for (const auto& [time_ns, place] : messages) record.put(time_ns).put(place);
    append(record.finished());
    messages.clear();
  }
  index.index_length = place_ - index.place - index.length;
  chunks_.push_back(std::move(index));
  chunk_.clear();
  chunk_has_messages_ = false;
}

void McapWriter::flush() {
  end_chunk();
  if (std::fflush(file_.get()) != 0)
    throw RecordingError("The recording '" + name_.string() + "' cannot be written on.");
}

/// The records after the data: schemas, channels, statistics, indices of chunks, and the begin of each group.
std::string McapWriter::summary() {
  std::string all, offsets;
  const auto group = [&](mcap::Opcode opcode, const std::string& records) {
    if (records.empty()) return;
    offsets += Record(mcap::kSummaryOffset)
                   .put(static_cast<std::uint8_t>(opcode))
                   .put(std::uint64_t{place_ + all.size()})
                   .put(std::uint64_t{records.size()})
                   .finished();
    all += records;
  };
  std::string schemas, channels, indices;
  std::set<std::string> written;
  for (const Channel& channel : channels_) {
    if (written.insert(channel.schema_record).second) schemas += channel.schema_record;
    channels += channel.record;
  }
  Record statistics(mcap::kStatistics);
  statistics.put(messages_)
      .put(static_cast<std::uint16_t>(schemas_.size()))
      .put(static_cast<std::uint32_t>(channels_.size()))
      .put(std::uint32_t{0})
      .put(std::uint32_t{0})
      .put(static_cast<std::uint32_t>(chunks_.size()))
      .put(chunks_.empty() ? std::uint64_t{0} : chunks_.front().first_ns)
      .put(chunks_.empty() ? std::uint64_t{0} : chunks_.back().last_ns)
      .put(static_cast<std::uint32_t>(channels_.size() * 10));
  for (std::size_t i = 0; i < channels_.size(); ++i)
    statistics.put(static_cast<std::uint16_t>(i + 1)).put(channels_[i].count);
  for (const ChunkIndex& chunk : chunks_) {
    Record record(mcap::kChunkIndex);
    record.put(chunk.first_ns).put(chunk.last_ns).put(chunk.place).put(chunk.length);
    record.put(static_cast<std::uint32_t>(chunk.indexes.size() * 10));
    for (const auto& [number, place] : chunk.indexes) record.put(number).put(place);
    record.put(chunk.index_length)
        .text(mcap_name(compression_))
        .put(chunk.compressed)
        .put(chunk.uncompressed);
    indices += record.finished();
  }
  group(mcap::kSchema, schemas);
  group(mcap::kChannel, channels);
  group(mcap::kStatistics, statistics.finished());
  group(mcap::kChunkIndex, indices);
  const std::uint64_t begin = place_, offsets_begin = place_ + all.size();
  all += offsets;
  // The checksum covers the footer up to itself.
  const std::uint64_t footer_length = 8 + 8 + 4;
  Record footer(mcap::kFooter);
  footer.put(begin).put(offsets_begin);
  std::string head(1, static_cast<char>(mcap::kFooter));
  head.append(reinterpret_cast<const char*>(&footer_length), sizeof(footer_length));
  head.append(reinterpret_cast<const char*>(&begin), sizeof(begin));
  head.append(reinterpret_cast<const char*>(&offsets_begin), sizeof(offsets_begin));
  footer.put(crc_of(head, crc_of(all)));
  return all + footer.finished();
}

void McapWriter::close() {
  if (closed_) return;
  closed_ = true;
  end_chunk();
  append(Record(mcap::kDataEnd).put(data_crc_).finished());
  append(summary());
  append(mcap::kMagic);
  if (std::fclose(file_.release()) != 0)
    throw RecordingError("The recording '" + name_.string() + "' cannot be written to its end.");
}

}  // namespace takt::recording
