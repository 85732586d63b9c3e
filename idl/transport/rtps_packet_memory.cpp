#include "idl/transport/rtps_packet_memory.h"

#include <algorithm>

#include "idl/transport/wire_cursor.h"

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

bool PacketMemory::follows(const Sample& sample) {
  const std::uint64_t key = writer_key_of(sample);
  const std::int64_t number = sample.sequence_number;
  const std::lock_guard lock(mutex_);
  Writer* known = writers_.find(key);
  Writer& writer = known != nullptr ? *known : writers_.insert(key);
  if (number <= writer.highest + kStep) {
    writer.highest = std::max(writer.highest, number);
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

bool PacketMemory::same_as_before(std::uint64_t endpoint, std::uint64_t unchanging) {
  const std::lock_guard lock(mutex_);
  if (const Endpoint* known = endpoints_.find(endpoint)) return known->unchanging == unchanging;
  endpoints_.insert(endpoint).unchanging = unchanging;
  return true;
}

}  // namespace takt
