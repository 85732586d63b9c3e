#include "dds_common/rtps_sent_fragments.h"

#include "dds_common/wire_cursor.h"

namespace takt {

std::size_t SentFragments::slot(std::uint32_t writer, std::int64_t sequence_number) {
  const auto mixed = (static_cast<std::uint64_t>(sequence_number) + writer * 0x9e3779b97f4a7c15ULL);
  return static_cast<std::size_t>(mixed % kEntries);
}

void SentFragments::note(std::span<const std::uint8_t> packet) {
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
        entries_[slot(writer, number)] = {writer, (sample_bytes - 1) / fragment_bytes + 1, number};
      }
    }
    at += 4 + length;
  }
}

std::uint32_t SentFragments::count(std::uint32_t writer, std::int64_t sequence_number) const {
  const std::lock_guard lock(mutex_);
  const Entry& entry = entries_[slot(writer, sequence_number)];
  return entry.writer == writer && entry.sequence_number == sequence_number ? entry.fragments : 0;
}

}  // namespace takt
