#include "client_lib/recording/mcap_reader.h"

#include <zlib.h>

#include <algorithm>
#include <cstdio>
#include <queue>

#include "client_lib/recording/compression.h"
#include "client_lib/recording/mcap_format.h"

namespace takt::recording {

using mcap::Content;

namespace {

/// Longest record that is believed: a damaged length must not take all memory.
constexpr std::uint64_t kLongest_bytes = std::uint64_t{1} << 31U;
constexpr std::uint64_t kFooter_bytes = mcap::kRecordHead_bytes + 8 + 8 + 4;

/// Calls function(opcode, content, place of the content) for each whole record; returns what is left over.
template <typename Function>
std::string_view each_record(std::string_view bytes, const Function& function) {
  const std::string_view all = bytes;
  while (bytes.size() >= mcap::kRecordHead_bytes) {
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + 1, sizeof(length));
    if (length > bytes.size() - mcap::kRecordHead_bytes) break;
    const auto place = static_cast<std::uint64_t>(bytes.data() - all.data()) + mcap::kRecordHead_bytes;
    function(static_cast<std::uint8_t>(bytes[0]), bytes.substr(mcap::kRecordHead_bytes, length), place);
    bytes.remove_prefix(mcap::kRecordHead_bytes + length);
  }
  return bytes;
}

}  // namespace

/// A chunk whose messages are being handed out.
struct McapReader::Loaded {
  std::string bytes;
  struct Entry {
    std::uint64_t time_ns, place, length;
  };
  std::vector<Entry> messages;  // by time
  std::size_t next = 0;

  std::uint64_t size() const { return bytes.size() + messages.size() * sizeof(Entry); }
};

McapReader::McapReader(const std::filesystem::path& file, const McapLimits& limits)
    : name_(file), limits_(limits), file_(file, std::ios::binary) {
  std::error_code problem;
  size_ = std::filesystem::file_size(file, problem);
  if (!file_ || problem) throw RecordingError("The recording '" + file.string() + "' cannot be read.");
  if (size_ < mcap::kMagic.size() || record_at(0, mcap::kMagic.size()) != mcap::kMagic)
    throw RecordingError("'" + file.string() + "' is no MCAP recording.");
  try {
    if (!read_summary()) scan();
    finish_channels();
  } catch (const RecordingError& damage) {
    throw RecordingError(with_name(damage.what()));
  }
  std::stable_sort(chunks_.begin(), chunks_.end(),
                   [](const Chunk& a, const Chunk& b) { return a.first_ns < b.first_ns; });
  if (!chunks_.empty()) {
    first_ns_ = chunks_.front().first_ns;
    for (const Chunk& chunk : chunks_) last_ns_ = std::max(last_ns_, chunk.last_ns);
  }
}

/// Of a recording whose name the sentence may not say.
std::string McapReader::with_name(const std::string& sentence) const {
  const std::string name = "'" + name_.string() + "'";
  return sentence.starts_with(name) ? sentence : name + ": " + sentence;
}

void McapReader::refuse_size(const std::string& subject, std::uint64_t bytes) const {
  throw RecordingError(subject + " has " + std::to_string(bytes >> 20U) + " MB; takt reads up to " +
                       std::to_string(limits_.record_bytes >> 20U) + " MB");
}

std::string McapReader::record_at(std::uint64_t place, std::uint64_t length) {
  if (length > kLongest_bytes || place > size_ || length > size_ - place)
    throw RecordingError("'" + name_.string() + "' names a place that is not in it.");
  if (length > limits_.record_bytes) refuse_size("a record", length);
  std::string bytes(length, '\0');
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(place));
  if (!file_.read(bytes.data(), static_cast<std::streamsize>(length)))
    throw RecordingError("The recording '" + name_.string() + "' cannot be read on.");
  return bytes;
}

const McapChannel* McapReader::channel(const std::string& topic) const {
  for (const auto& [number, channel] : channels_)
    if (channel.topic == topic) return &channel;
  return nullptr;
}

void McapReader::note_schema(std::string_view bytes) {
  Content content(bytes);
  const auto number = content.take<std::uint16_t>();
  Schema schema;
  schema.name = content.text();
  schema.encoding = content.text();
  schema.text = content.text();
  schemas_.insert_or_assign(number, std::move(schema));
}

void McapReader::note_channel(std::string_view bytes) {
  Content content(bytes);
  McapChannel channel;
  channel.number = content.take<std::uint16_t>();
  schema_of_[channel.number] = content.take<std::uint16_t>();
  channel.topic = content.text();
  channel.encoding = content.text();
  for (Content metadata(content.text()); !metadata.empty();) {
    const std::string key(metadata.text());
    channel.metadata[key] = metadata.text();
  }
  channels_.insert_or_assign(channel.number, std::move(channel));
}

void McapReader::finish_channels() {
  for (auto& [number, channel] : channels_) {
    const auto schema = schemas_.find(schema_of_[number]);
    if (schema == schemas_.end()) continue;
    channel.type = schema->second.name;
    channel.schema_encoding = schema->second.encoding;
    channel.schema = schema->second.text;
    if (channel.schema_encoding == "ros2msg") types_.add_ros2msg(channel.type, channel.schema);
  }
}

/// False for a file without one, which is a file that was not closed.
bool McapReader::read_summary() {
  const std::uint64_t tail = kFooter_bytes + mcap::kMagic.size();
  if (size_ < tail + mcap::kMagic.size()) return false;
  const std::string end = record_at(size_ - tail, tail);
  if (static_cast<std::uint8_t>(end[0]) != mcap::kFooter ||
      std::string_view(end).substr(kFooter_bytes) != mcap::kMagic)
    return false;
  Content footer(std::string_view(end).substr(mcap::kRecordHead_bytes));
  const auto begin = footer.take<std::uint64_t>();
  (void)footer.take<std::uint64_t>();
  const auto crc = footer.take<std::uint32_t>();
  if (begin == 0 || begin > size_ - tail) return false;
  const std::string bytes = record_at(begin, size_ - tail - begin);
  if (crc != 0) {
    const std::string covered = bytes + end.substr(0, kFooter_bytes - 4);
    if (crc32(0, reinterpret_cast<const Bytef*>(covered.data()), static_cast<uInt>(covered.size())) != crc)
      return false;
  }
  bool has_chunks = false, has_statistics = false;
  std::uint32_t chunk_count = 0;
  each_record(bytes, [&](std::uint8_t opcode, std::string_view content, std::uint64_t) {
    if (opcode == mcap::kSchema) note_schema(content);
    if (opcode == mcap::kChannel) note_channel(content);
    if (opcode == mcap::kStatistics) {
      has_statistics = true;
      Content statistics(content);
      (void)statistics.raw(8 + 2 + 4 + 4 + 4);
      chunk_count = statistics.take<std::uint32_t>();
    }
    if (opcode == mcap::kChunkIndex) {
      Content index(content);
      const auto first = index.take<std::uint64_t>(), last = index.take<std::uint64_t>(),
                 place = index.take<std::uint64_t>(), length = index.take<std::uint64_t>();
      if (length < mcap::kRecordHead_bytes)
        throw RecordingError("'" + name_.string() + "' has a damaged index of its chunks.");
      chunks_.push_back({first, last, place + mcap::kRecordHead_bytes, length - mcap::kRecordHead_bytes});
      has_chunks = true;
    }
  });
  // One chunk named a million times would be read a million times.
  std::vector<std::uint64_t> places;
  for (const Chunk& chunk : chunks_) places.push_back(chunk.place);
  std::sort(places.begin(), places.end());
  if (std::adjacent_find(places.begin(), places.end()) != places.end())
    throw RecordingError("'" + name_.string() + "' has a damaged index of its chunks.");
  const bool complete =
      has_chunks ? (!has_statistics || chunks_.size() == chunk_count) : (has_statistics && chunk_count == 0);
  if (complete) {
    const std::string head = record_at(mcap::kMagic.size(), mcap::kRecordHead_bytes);
    std::uint64_t length = 0;
    std::memcpy(&length, head.data() + 1, sizeof(length));
    const std::string text = record_at(mcap::kMagic.size() + mcap::kRecordHead_bytes, length);
    profile_ = Content(text).text();
    return true;
  }
  schemas_.clear();
  schema_of_.clear();
  channels_.clear();
  chunks_.clear();
  return false;
}

void McapReader::note_chunk_contents(std::string_view records) {
  each_record(records, [&](std::uint8_t opcode, std::string_view content, std::uint64_t) {
    if (opcode == mcap::kSchema) note_schema(content);
    if (opcode == mcap::kChannel) note_channel(content);
  });
}

/// From the begin on, record by record, as far as they are whole.
void McapReader::scan() {
  std::uint64_t place = mcap::kMagic.size();
  bool ended = false;
  std::string why = "the file ends within a record";
  while (size_ - place >= mcap::kRecordHead_bytes) {
    const std::string head = record_at(place, mcap::kRecordHead_bytes);
    const auto opcode = static_cast<std::uint8_t>(head[0]);
    std::uint64_t length = 0;
    std::memcpy(&length, head.data() + 1, sizeof(length));
    const std::uint64_t content = place + mcap::kRecordHead_bytes;
    if (length > size_ - content || length > kLongest_bytes) break;
    if (opcode == mcap::kHeader) {
      const std::string text = record_at(content, length);
      profile_ = Content(text).text();
    } else if (opcode == mcap::kSchema) {
      note_schema(record_at(content, length));
    } else if (opcode == mcap::kChannel) {
      note_channel(record_at(content, length));
    } else if (opcode == mcap::kChunk) {
      const std::string times = record_at(content, std::min<std::uint64_t>(length, 16));
      Content reader(times);
      const auto first = reader.take<std::uint64_t>(), last = reader.take<std::uint64_t>();
      const Chunk chunk{first, last, content, length};
      try {
        note_chunk_contents(uncompressed(chunk));
      } catch (const RecordingError& damage) {
        why = damage.what();
        break;
      }
      chunks_.push_back(chunk);
    } else if (opcode == mcap::kDataEnd) {
      ended = true;
      why = "its summary is not whole";
      break;
    }
    place = content + length;
  }
  if (!ended && place == size_) why = "the file was not closed";
  cut_off_ = "'" + name_.string() + "' is not whole (" + why + "); read up to its last whole chunk, the " +
             std::to_string(chunks_.size()) + ". one.";
}

std::string McapReader::uncompressed(const Chunk& chunk) {
  const std::string bytes = record_at(chunk.place, chunk.length);
  Content content(bytes);
  (void)content.raw(16);
  const auto size = content.take<std::uint64_t>();
  const auto crc = content.take<std::uint32_t>();
  const std::string compression(content.text());
  const std::string_view packed = content.raw(content.take<std::uint64_t>());
  if (size > kLongest_bytes) throw RecordingError("a chunk is damaged");
  if (size > limits_.record_bytes) refuse_size("a chunk", size);
  std::string records = decompress(compression, packed, size);
  if (crc != 0 &&
      crc32(0, reinterpret_cast<const Bytef*>(records.data()), static_cast<uInt>(records.size())) != crc)
    throw RecordingError("a chunk is damaged");
  return records;
}

void McapReader::read(const std::function<bool(const McapMessage&)>& function, std::uint64_t first_ns,
                      std::uint64_t last_ns) {
  // Chunks may overlap in time: the next one is opened before anything later than its begin is handed out.
  std::vector<std::unique_ptr<Loaded>> loaded;
  std::priority_queue<std::pair<std::uint64_t, std::size_t>,
                      std::vector<std::pair<std::uint64_t, std::size_t>>,
                      std::greater<>>
      open;  // time of the next message, which chunk
  std::size_t next_chunk = 0;
  std::uint64_t loaded_bytes = 0;
  const auto load = [&](const Chunk& chunk) {
    auto added = std::make_unique<Loaded>();
    try {
      added->bytes = uncompressed(chunk);
    } catch (const RecordingError& damage) {
      const auto seconds = [&](std::uint64_t ns) { return 1e-9 * static_cast<double>(ns - first_ns_); };
      char span[64];
      std::snprintf(span, sizeof span, "%.3f to %.3f s", seconds(chunk.first_ns), seconds(chunk.last_ns));
      std::string sentence = with_name(damage.what());
      if (sentence.ends_with('.')) sentence.pop_back();
      throw RecordingError(sentence + "; what was recorded from " + span +
                           " after its begin cannot be read.");
    }
    each_record(added->bytes, [&](std::uint8_t opcode, std::string_view content, std::uint64_t place) {
      if (opcode != mcap::kMessage) return;
      Content message(content);
      (void)message.raw(2 + 4);
      const auto time_ns = message.take<std::uint64_t>();
      if (time_ns >= first_ns && time_ns <= last_ns)
        added->messages.push_back({time_ns, place, content.size()});
    });
    std::stable_sort(added->messages.begin(), added->messages.end(),
                     [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
    if (added->messages.empty()) return;
    loaded_bytes += added->size();
    if (loaded_bytes > limits_.overlap_bytes)
      throw RecordingError(with_name("its chunks overlap in time and hold more than " +
                                     std::to_string(limits_.overlap_bytes >> 20U) + " MB together."));
    open.emplace(added->messages.front().time_ns, loaded.size());
    loaded.push_back(std::move(added));
  };
  for (;;) {
    while (next_chunk < chunks_.size() &&
           (open.empty() || chunks_[next_chunk].first_ns <= open.top().first)) {
      const Chunk& chunk = chunks_[next_chunk++];
      if (chunk.last_ns >= first_ns && chunk.first_ns <= last_ns) load(chunk);
    }
    if (open.empty()) return;
    const std::size_t which = open.top().second;
    open.pop();
    Loaded& chunk = *loaded[which];
    const auto& entry = chunk.messages[chunk.next++];
    Content content(std::string_view(chunk.bytes).substr(entry.place, entry.length));
    McapMessage message;
    const auto number = content.take<std::uint16_t>();
    message.sequence = content.take<std::uint32_t>();
    message.log_time_ns = content.take<std::uint64_t>();
    message.publish_time_ns = content.take<std::uint64_t>();
    message.sample = content.rest();
    const auto channel = channels_.find(number);
    if (channel != channels_.end()) {
      message.channel = &channel->second;
      if (!function(message)) return;
    }
    if (chunk.next < chunk.messages.size()) {
      open.emplace(chunk.messages[chunk.next].time_ns, which);
    } else {
      loaded_bytes -= chunk.size();
      loaded[which].reset();
    }
  }
}

}  // namespace takt::recording
