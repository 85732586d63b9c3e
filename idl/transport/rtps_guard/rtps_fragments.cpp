#include "idl/transport/rtps_guard/rtps_fragments.h"

#include <algorithm>

#include "idl/transport/rtps_guard/rtps_submessage.h"
#include "idl/transport/rtps_guard/wire_cursor.h"

namespace takt {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kTimestamp = 8;
constexpr std::size_t kDataBeforeQos = 20, kFragmentBeforeQos = 32;
constexpr std::size_t kMaxQos = 1024;  // those of a reply have 36 bytes
/// Space ahead of a sample for the parts of a packet that precede the data.
constexpr std::size_t kRoom =
    kRtpsHeaderBytes + kSubmessageHeadBytes + kTimestamp + kSubmessageHeadBytes + kDataBeforeQos + kMaxQos;
constexpr std::size_t kLeastMost = std::size_t{64} << 20U;

/// Bytes of the list up to and with its end.
std::size_t size_of_list(Bytes bytes, bool big_endian) {
  constexpr std::uint16_t sentinel = 1;
  WireCursor cursor(bytes, big_endian);
  while (cursor.ok()) {
    const std::uint16_t id = cursor.u16(), length = cursor.u16();
    if (id == sentinel) break;
    cursor.skip(length);
  }
  return cursor.ok() ? cursor.position() : bytes.size();
}

}  // namespace

struct FragmentAssembly::Piece {
  Prefix sender{};
  std::uint32_t writer = 0;
  std::int64_t number = 0;
  std::uint32_t first = 0, sample_bytes = 0;
  std::uint16_t count = 0, fragment_bytes = 0;
  Bytes header, timestamp, ids, qos, payload;  ///< `ids`: reader, writer, number
  std::uint8_t flags = 0;
  bool key = false;

  std::uint32_t fragments() const { return (sample_bytes - 1) / fragment_bytes + 1; }
  std::size_t room() const {
    return kRtpsHeaderBytes + (timestamp.empty() ? 0 : kSubmessageHeadBytes + kTimestamp) +
           kSubmessageHeadBytes + kDataBeforeQos + qos.size();
  }
  /// Of the DATA_FRAG submessage with this body.
  void read(Bytes body, std::uint8_t submessage_flags) {
    constexpr std::uint8_t has_qos = 2, has_key = 4;
    flags = submessage_flags;
    const bool big_endian = (flags & 1U) == 0;
    WireCursor cursor(body, big_endian);
    cursor.skip(8);
    writer = cursor.entity_id();
    number = cursor.sequence_number();
    first = cursor.u32();
    count = cursor.u16();
    fragment_bytes = cursor.u16();
    sample_bytes = cursor.u32();
    ids = body.subspan(4, 16);
    qos = (flags & has_qos) != 0 ? body.subspan(kFragmentBeforeQos) : Bytes{};
    if (!qos.empty()) qos = qos.first(size_of_list(qos, big_endian));
    payload = body.subspan(kFragmentBeforeQos + qos.size());
    key = (flags & has_key) != 0;
  }
  /// The parts that precede the data, ending at `end`. Returns their beginning.
  std::uint8_t* write_head(std::uint8_t* end) const {
    const auto put = [&](Bytes bytes) { end = std::copy(bytes.begin(), bytes.end(), end); };
    end -= room();
    std::uint8_t* begin = end;
    put(header);
    put(timestamp);
    const bool little_endian = (flags & 1U) != 0;
    constexpr std::uint8_t has_data = 4, to_qos = 16;
    // A length of 0: up to the end of the packet, however far that is.
    const std::array<std::uint8_t, 8> head{kData,
                                           static_cast<std::uint8_t>((flags & 3U) | has_data),
                                           0,
                                           0,
                                           0,
                                           0,
                                           little_endian ? to_qos : std::uint8_t{0},
                                           little_endian ? std::uint8_t{0} : to_qos};
    put(head);
    put(ids);
    put(qos);
    return begin;
  }
};

FragmentAssembly::FragmentAssembly(std::uint32_t largest_sample_bytes, std::uint32_t most_fragments)
    : most_bytes_(std::max(kLeastMost, 2 * (std::size_t{largest_sample_bytes} + kRoom))),
      most_fragments_(most_fragments) {
  samples_.reserve(kMaxSamples);
}

void FragmentAssembly::sending(Bytes packet) {
  constexpr std::size_t prefix = 8;
  if (knows_itself_.load(std::memory_order_relaxed) || packet.size() < kRtpsHeaderBytes) return;
  const std::lock_guard lock(mutex_);
  std::copy_n(packet.begin() + prefix, self_.size(), self_.begin());
  knows_itself_.store(true, std::memory_order_release);
}

bool FragmentAssembly::is_own(Bytes destination) const {
  if (std::all_of(destination.begin(), destination.end(), [](auto byte) { return byte == 0; })) return true;
  return knows_itself_.load(std::memory_order_acquire) &&
         std::equal(self_.begin(), self_.end(), destination.begin());
}

std::size_t FragmentAssembly::take(std::span<std::uint8_t> packet, const Deliver& deliver) {
  std::array<std::uint8_t, kRtpsHeaderBytes> header{};
  std::copy_n(packet.begin(), kRtpsHeaderBytes, header.begin());
  bool ours = true, secured = false;
  Piece piece;
  piece.header = header;
  std::size_t at = kRtpsHeaderBytes;
  while (const auto submessage = submessage_at(packet, at)) {
    const std::uint8_t id = submessage->id, flags = submessage->flags;
    const Bytes body = packet.subspan(at + kSubmessageHeadBytes, submessage->body_bytes);
    constexpr std::uint8_t invalid = 2;
    if (id == kInfoDestination && body.size() >= 12) {
      ours = is_own(body.first(12));
    } else if (id == kInfoSource && body.size() == 20) {
      std::copy(body.begin() + 4, body.end(), header.begin() + 4);  // version, vendor, prefix
    } else if (id == kInfoTimestamp) {
      const bool usable = (flags & invalid) == 0 && body.size() == kTimestamp;
      piece.timestamp = usable ? Bytes(packet.subspan(at, kSubmessageHeadBytes + kTimestamp)) : Bytes{};
    } else if (id == kSecurePrefix || id == kSecurePostfix) {
      secured = id == kSecurePrefix;
    } else if (id == kDataFrag && !secured && body.size() >= kFragmentBeforeQos) {
      std::copy_n(header.begin() + 8, piece.sender.size(), piece.sender.begin());
      piece.read(body, flags);
      if (piece.fragments() <= most_fragments_) {
        const bool wanted = ours && !piece.key && piece.qos.size() <= kMaxQos;
        if (const auto whole = wanted ? add(piece) : nullptr) {
          std::uint8_t* data = whole.get() + kRoom;
          std::uint8_t* begin = piece.write_head(data);
          deliver({begin, data + piece.sample_bytes});
        }
        if (submessage->open) return at;
        packet[at] = kPad;
      }
    }
    at += kSubmessageHeadBytes + body.size();
  }
  return packet.size();
}

std::unique_ptr<std::uint8_t[]> FragmentAssembly::add(const Piece& piece) {
  const std::lock_guard lock(mutex_);
  Sample& sample = sample_of(piece);
  sample.used = ++count_;
  const std::size_t offset = std::size_t{piece.first - 1} * piece.fragment_bytes;
  const std::size_t size =
      std::min(std::size_t{piece.count} * piece.fragment_bytes, std::size_t{piece.sample_bytes} - offset);
  std::copy_n(piece.payload.begin(), std::min(size, piece.payload.size()),
              sample.packet.get() + kRoom + offset);
  for (std::uint32_t i = 0; i < piece.count; ++i) {
    auto has = sample.has[piece.first - 1 + i];
    if (!has) --sample.missing;
    has = true;
  }
  if (sample.missing > 0) return nullptr;
  auto whole = std::move(sample.packet);
  held_bytes_ -= sample.bytes + kRoom;
  std::swap(sample, samples_.back());
  samples_.pop_back();
  return whole;
}

FragmentAssembly::Sample& FragmentAssembly::sample_of(const Piece& piece) {
  const auto found = std::find_if(samples_.begin(), samples_.end(), [&](const Sample& sample) {
    return sample.number == piece.number && sample.writer == piece.writer && sample.sender == piece.sender;
  });
  if (found != samples_.end()) {
    if (found->bytes == piece.sample_bytes && found->fragment_bytes == piece.fragment_bytes) return *found;
    // Contradicts earlier fragments: one of the two is forged, so the assembly starts again.
    held_bytes_ -= found->bytes + kRoom;
    std::swap(*found, samples_.back());
    samples_.pop_back();
  }
  const std::size_t bytes = piece.sample_bytes + kRoom;
  make_room(piece.sender, bytes);
  Sample& sample = samples_.emplace_back();
  sample.sender = piece.sender;
  sample.writer = piece.writer;
  sample.number = piece.number;
  sample.bytes = piece.sample_bytes;
  sample.fragment_bytes = piece.fragment_bytes;
  sample.missing = piece.fragments();
  sample.packet = std::make_unique_for_overwrite<std::uint8_t[]>(bytes);  // large ones: pages as they come
  sample.has.assign(piece.fragments(), false);
  held_bytes_ += bytes;
  return sample;
}

void FragmentAssembly::make_room(const Prefix& sender, std::size_t bytes) {
  const auto is_own_of = [&](const Sample& sample) { return sample.sender == sender; };
  while (!samples_.empty()) {
    const auto own = std::count_if(samples_.begin(), samples_.end(), is_own_of);
    const bool too_many = own >= static_cast<std::ptrdiff_t>(kMaxOfOneSender);
    if (!too_many && samples_.size() < kMaxSamples && held_bytes_ + bytes <= most_bytes_) return;
    // The oldest one: of the sender's own where there is any.
    const auto older = [&](const Sample& a, const Sample& b) {
      return is_own_of(a) != is_own_of(b) ? is_own_of(a) : a.used < b.used;
    };
    const auto oldest = std::min_element(samples_.begin(), samples_.end(), older);
    held_bytes_ -= oldest->bytes + kRoom;
    std::swap(*oldest, samples_.back());
    samples_.pop_back();
  }
}

std::size_t FragmentAssembly::samples() const {
  const std::lock_guard lock(mutex_);
  return samples_.size();
}

std::size_t FragmentAssembly::held_bytes() const {
  const std::lock_guard lock(mutex_);
  return held_bytes_;
}

}  // namespace takt
