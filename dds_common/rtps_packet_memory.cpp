#include "dds_common/rtps_packet_memory.h"

#include <algorithm>

#include "dds_common/wire_cursor.h"

namespace takt {

std::uint64_t mixed(std::span<const std::uint8_t> bytes, std::uint64_t seed) {
  std::uint64_t key = 0xcbf29ce484222325ULL ^ seed;  // FNV-1a, and the bits stirred once more at the end
  for (const std::uint8_t byte : bytes) key = (key ^ byte) * 0x100000001b3ULL;
  key = (key ^ key >> 32U) * 0x9e3779b97f4a7c15ULL;
  return (key ^ key >> 29U) | 1U;
}

std::size_t PacketMemory::slot(std::uint32_t writer, std::int64_t sequence_number) {
  const auto mixed = (static_cast<std::uint64_t>(sequence_number) + writer * 0x9e3779b97f4a7c15ULL);
  return static_cast<std::size_t>(mixed % kSent);
}

void PacketMemory::note(std::span<const std::uint8_t> packet) {
  constexpr std::size_t header_bytes = 20;
  constexpr std::uint8_t data_fragment = 0x16;
  std::size_t at = header_bytes;
  while (at + 4 <= packet.size()) {
    const bool big_endian = (packet[at + 1] & 1U) == 0;
    WireCursor size(packet.subspan(at + 2, 2), big_endian);
    std::size_t length = size.u16();
    const std::size_t rest = packet.size() - at - 4;
    if (length == 0 || length > rest) length = rest;
    if (packet[at] == data_fragment) {
      WireCursor cursor(packet.subspan(at + 4, length), big_endian);
      cursor.skip(8);
      const std::uint32_t writer = cursor.entity_id();
      const std::int64_t number = cursor.sequence_number();
      cursor.skip(6);
      const std::uint32_t fragment_bytes = cursor.u16(), sample_bytes = cursor.u32();
      if (cursor.ok() && fragment_bytes > 0 && sample_bytes > 0) {
        const std::lock_guard lock(mutex_);
        sent_[slot(writer, number)] = {writer, (sample_bytes - 1) / fragment_bytes + 1, number};
      }
    }
    at += 4 + length;
  }
}

std::uint32_t PacketMemory::count(std::uint32_t writer, std::int64_t sequence_number) const {
  const std::lock_guard lock(mutex_);
  const Sent& entry = sent_[slot(writer, sequence_number)];
  return entry.writer == writer && entry.sequence_number == sequence_number ? entry.fragments : 0;
}

std::uint64_t PacketMemory::key_of(const Sample& sample) {
  return mixed(sample.sender,
               static_cast<std::uint64_t>(sample.sequence_number) * 0x9e3779b97f4a7c15ULL + sample.writer);
}

bool PacketMemory::admit(const Sample& sample, std::uint16_t fragment_bytes, std::uint32_t sample_bytes) {
  const std::uint64_t key = key_of(sample);
  any_received_.store(true, std::memory_order_relaxed);
  const std::lock_guard lock(mutex_);
  const std::uint64_t writer_key = writer_key_of(sample);
  Writer& writer = writers_[(writer_key >> 20U) % kWriters];
  if (writer.key == writer_key) {
    const std::int64_t number = sample.sequence_number;
    if (too_old(writer, number)) return false;
    const bool first = writer.fragments_to < writer.fragments_from;
    writer.fragments_from = first ? number : std::min(writer.fragments_from, number);
    writer.fragments_to = first ? number : std::max(writer.fragments_to, number);
  }
  if (const Received* known = find(key))
    return known->fragment_bytes == fragment_bytes && known->sample_bytes == sample_bytes;
  auto& ways = received_[(key >> 20U) % kReceived];
  std::move_backward(ways.begin(), ways.end() - 1, ways.end());
  ways.front() = {key, sample_bytes, fragment_bytes};
  return true;
}

const PacketMemory::Received* PacketMemory::find(std::uint64_t key) const {
  for (const Received& entry : received_[(key >> 20U) % kReceived])
    if (entry.key == key) return &entry;
  return nullptr;
}

bool PacketMemory::follows(const Sample& sample) {
  const std::uint64_t key = writer_key_of(sample);
  const std::int64_t number = sample.sequence_number;
  const std::lock_guard lock(mutex_);
  Writer& writer = writers_[(key >> 20U) % kWriters];
  if (writer.key != key) {
    writer = {};
    writer.key = key;
  }
  if (number <= writer.highest + kStep) {
    if (number > writer.highest) writer.highest = number;
    writer.candidate = 0;
    return true;
  }
  const std::int64_t most = writer.highest == 0 ? kLargestFirst : writer.highest + kLongestLeap;
  const bool near = number <= writer.candidate + kStep && number >= writer.candidate - kStep;
  writer.confirmed = near ? writer.confirmed + 1 : 0;
  writer.candidate = number;
  if (number > most || writer.confirmed < kConfirmations) return false;
  writer.highest = number;
  return true;
}

bool PacketMemory::fragments_within(const Sample& sample, std::int64_t last) const {
  const std::uint64_t key = writer_key_of(sample);
  const std::lock_guard lock(mutex_);
  const Writer& writer = writers_[(key >> 20U) % kWriters];
  return writer.key == key && writer.fragments_from <= last && sample.sequence_number <= writer.fragments_to;
}

void PacketMemory::left_behind(const Sample& sample) {
  const std::uint64_t key = writer_key_of(sample);
  const std::lock_guard lock(mutex_);
  Writer& writer = writers_[(key >> 20U) % kWriters];
  if (writer.key == key) writer.fragments_from = std::max(writer.fragments_from, sample.sequence_number);
}

bool PacketMemory::same_as_before(std::uint64_t endpoint, std::uint64_t unchanging) {
  const std::lock_guard lock(mutex_);
  Endpoint& entry = endpoints_[(endpoint >> 20U) % kEndpoints];
  if (entry.key == endpoint) return entry.unchanging == unchanging;
  entry = {endpoint, unchanging};
  return true;
}

bool PacketMemory::fragmented(const Sample& sample) const {
  if (!any_received_.load(std::memory_order_relaxed)) return false;
  const std::uint64_t key = key_of(sample);
  const std::uint64_t writer_key = writer_key_of(sample);
  const std::lock_guard lock(mutex_);
  const Writer& writer = writers_[(writer_key >> 20U) % kWriters];
  return (writer.key == writer_key && too_old(writer, sample.sequence_number)) || find(key) != nullptr;
}

}  // namespace takt
