#include "idl/transport/rtps_guard/rtps_guard.h"

#include <algorithm>

#include "idl/transport/rtps_guard/rtps_packet_memory.h"
#include "idl/transport/rtps_guard/rtps_parameters.h"
#include "idl/transport/rtps_guard/rtps_submessage.h"
#include "idl/transport/rtps_guard/wire_cursor.h"

namespace takt {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// No writer gets this far: 4000 years at 1 kHz. Leaves room for sums without overflow.
constexpr std::int64_t kLargestSequenceNumber = std::int64_t{1} << 47U;
/// Fast DDS walks over each number of a gap.
constexpr std::int64_t kLongestGap = std::int64_t{1} << 16U;
/// Shorter fragments do not hold the list of missing ones that Fast DDS keeps inside them.
constexpr std::uint16_t kShortestFragment = 8;

constexpr std::size_t kStatisticsBytes = 60;  ///< of Fast DDS, at the end

constexpr std::uint32_t kUnknownEntity = 0;
constexpr std::uint32_t kParticipantWriter = 0x000100c2, kParticipantSecureWriter = 0xff0101c2;
constexpr std::uint32_t kLivelinessWriter = 0x000200c2, kLivelinessSecureWriter = 0xff0200c2;
constexpr std::uint32_t kHandshakeWriter = 0x000201c3, kKeysWriter = 0xff0202c3;
constexpr std::uint32_t kTypeRequestWriter = 0x000300c3, kTypeReplyWriter = 0x000301c3;
constexpr std::uint32_t kTopicsWriter = 0x000002c2;
constexpr std::uint32_t kPublicationsSecureWriter = 0xff0003c2, kSubscriptionsSecureWriter = 0xff0004c2;

bool is_sequence_number(std::int64_t number) {
  return number > 0 && number <= kLargestSequenceNumber;
}

struct NumberSet {
  std::int64_t base = 0;
  std::uint32_t highest = 0;  ///< offset of the last number that is in it
  bool empty = true;
};

/// `fragments`: numbers of 32 bits instead of 64.
bool read_number_set(WireCursor& cursor, bool fragments, NumberSet& set) {
  set.base = fragments ? static_cast<std::int64_t>(cursor.u32()) : cursor.sequence_number();
  const std::uint32_t bits = cursor.u32();
  if (!cursor.ok() || bits > 256 || set.base < 0 || set.base > kLargestSequenceNumber) return false;
  for (std::uint32_t first = 0; first < bits; first += 32) {
    const std::uint32_t word = cursor.u32();
    for (std::uint32_t i = 0; i < 32 && first + i < bits; ++i) {
      if ((word & 0x80000000U >> i) == 0) continue;
      set.highest = first + i;
      set.empty = false;
    }
  }
  return cursor.ok();
}

struct Fragment {
  std::uint32_t first = 0, sample_bytes = 0;
  std::uint16_t count = 0, size = 0;
  std::uint32_t total() const { return (sample_bytes - 1) / size + 1; }
};

RtpsError check_fragment(const Fragment& fragment, std::size_t payload_bytes, std::uint32_t largest_sample) {
  const bool sizes = fragment.size >= kShortestFragment && fragment.sample_bytes > 0 &&
                     fragment.sample_bytes <= largest_sample && fragment.first > 0 && fragment.count > 0;
  if (!sizes) return RtpsError::fragment;
  const std::uint64_t total = fragment.total(), last = std::uint64_t{fragment.first} + fragment.count - 1;
  // A complete sample in one piece would not be a fragment; Fast DDS uses such a sample even after its reader
  // has taken it.
  if (last > total || fragment.count >= total) return RtpsError::fragment;
  const std::uint64_t offset = std::uint64_t{fragment.first - 1} * fragment.size;
  const std::uint64_t announced =
      last == total ? fragment.sample_bytes - offset : std::uint64_t{fragment.count} * fragment.size;
  if (payload_bytes < announced) return RtpsError::fragment;
  // Fast DDS keeps the list of missing fragments in the first aligned word of each: it has to fit the last
  // one too.
  const std::uint64_t word = ((total - 1) * fragment.size + 3U) & ~std::uint64_t{3};
  return word + 4 <= ((std::uint64_t{fragment.sample_bytes} + 3U) & ~std::uint64_t{3}) ? RtpsError::none
                                                                                       : RtpsError::fragment;
}

/// CDR, parameter list, XCDR2: the encodings that decoders accept.
bool is_encapsulation(Bytes payload) {
  return payload.size() >= 4 && payload[0] == 0 && payload[1] <= 0x0b;
}

class PacketInspector {
 public:
  PacketInspector(Bytes packet, const GuardLimits& limits, RtpsSessionState* memory, std::uint8_t* rewrite,
                  std::uint32_t now_s, const PacketOrigin& origin)
      : packet_(packet),
        limits_(limits),
        memory_(memory),
        rewrite_(rewrite),
        now_s_(now_s),
        origin_(origin) {}

  PacketReport inspect() {
    report_.flaw = check_packet();
    return report_;
  }

 private:
  RtpsError check_packet() {
    if (packet_.size() < kRtpsHeaderBytes) return RtpsError::too_short;
    constexpr std::array<std::uint8_t, 4> magic{'R', 'T', 'P', 'S'};
    if (!std::equal(magic.begin(), magic.end(), packet_.begin())) return RtpsError::not_rtps;
    if (packet_[4] != 2) return RtpsError::version;
    std::copy_n(packet_.begin() + kSenderAt, sender_.size(), sender_.begin());
    report_.size = packet_.size();
    if (memory_ != nullptr && !memory_->sends_from(sender_, origin_)) return RtpsError::source;
    const RtpsError flaw = check_submessages();
    if (flaw == RtpsError::none || tail_ == 0) return flaw;
    cut_tail();
    return RtpsError::none;
  }

  RtpsError check_submessages() {
    const Bytes from = packet_.subspan(kSenderAt, sender_.size());
    const bool fast_dds = packet_[6] == 1 && packet_[7] == 15;
    const bool may_have_tail = fast_dds && origin_.transport == TransportKind::shared_memory;
    std::size_t at = kRtpsHeaderBytes;
    while (at < packet_.size()) {
      if (may_have_tail && !prefixes_open_ && packet_.size() - at == kStatisticsBytes) {
        tail_ = at;
        if (packet_[at] == 0 || (memory_ != nullptr && memory_->leaves_tails(from))) {
          cut_tail();
          break;
        }
      }
      const auto submessage = submessage_at(packet_, at);
      if (!submessage) return RtpsError::submessage;
      offset_ = at + kSubmessageHeadBytes;
      const std::size_t end = offset_ + submessage->body_bytes;
      const bool last = end == packet_.size();
      if (submessage->body_bytes % 4 != 0 && !last) return RtpsError::alignment;
      if (submessage->id == kFastDdsStatistics && fast_dds) {
        if (!last) return RtpsError::submessage;
        report_.size = at;
        break;
      }
      const RtpsError flaw = check_submessage(*submessage, packet_.subspan(offset_, submessage->body_bytes));
      if (flaw != RtpsError::none) return flaw;
      at = end;
    }
    return prefixes_open_ ? RtpsError::submessage : RtpsError::none;
  }

  /// Shared memory of Fast DDS 3.1.2 sends old bytes in the place of its statistics. A sender that did it
  /// once always does.
  void cut_tail() {
    report_.size = tail_;
    if (memory_ != nullptr) memory_->note_tail(packet_.subspan(kSenderAt, sender_.size()));
  }

  RtpsError check_submessage(const Submessage& submessage, Bytes body) {
    const std::uint8_t flags = submessage.flags;
    WireCursor cursor(body, submessage.big_endian());
    switch (submessage.id) {
      case kData:
        return check_data(cursor, flags, body);
      case kDataFrag:
        return check_data_fragment(cursor, flags, body);
      case kHeartbeat:
        return check_heartbeat(cursor);
      case kAckNack:
        return check_acknowledgement(cursor, flags);
      case kGap:
        return check_gap(cursor);
      case kNackFrag:
        return check_fragment_request(cursor);
      case kHeartbeatFrag: {
        cursor.skip(8);
        const std::int64_t number = cursor.sequence_number();
        cursor.skip(8);
        if (!cursor.ok()) return RtpsError::submessage;
        return is_sequence_number(number) ? RtpsError::none : RtpsError::sequence_number;
      }
      case kInfoTimestamp:
        return check_timestamp(flags, body, submessage.big_endian());
      case kInfoDestination:
        return body.size() >= 12 ? RtpsError::none : RtpsError::submessage;
      case kInfoSource:
        if (body.size() != 20) return RtpsError::submessage;
        if (body[4] != 2) return RtpsError::version;
        return change_sender(body.subspan(8));
      case kSecureBody:
      case kSecurePrefix:
      case kSecurePostfix:
      case kSecureRtpsPrefix:
      case kSecureRtpsPostfix:
        return check_encrypted(submessage.id, body);
      default:
        return RtpsError::none;  // of other vendors or versions: skipped by all participants
    }
  }

  /// The submessages that follow are of another participant. Only a discovery server relays them.
  RtpsError change_sender(Bytes prefix) {
    std::copy_n(prefix.begin(), sender_.size(), sender_.begin());
    if (memory_ == nullptr || limits_.relayed_discovery) return RtpsError::none;
    return memory_->sends_from(sender_, origin_) ? RtpsError::none : RtpsError::source;
  }

  /// A timestamp in the future becomes the present second. It is not removed: without timestamps Fast DDS
  /// 2.9.1 loses endpoints if several participants announce theirs at once (measured).
  RtpsError check_timestamp(std::uint8_t flags, Bytes body, bool big_endian) {
    constexpr std::uint8_t invalid = 2;
    constexpr std::size_t fraction = 4, size = 8;
    if ((flags & invalid) != 0) return RtpsError::none;
    if (body.size() < size) return RtpsError::submessage;
    if (WireCursor(body, big_endian).u32() <= now_s_) return RtpsError::none;
    report_.needs_cleaning = true;
    if (rewrite_ == nullptr) return RtpsError::none;
    for (std::size_t i = 0; i < fraction; ++i)
      rewrite_[offset_ + i] = static_cast<std::uint8_t>(now_s_ >> 8U * (big_endian ? fraction - 1 - i : i));
    std::fill_n(rewrite_ + offset_ + fraction, size - fraction, std::uint8_t{0});
    return RtpsError::none;
  }

  /// Header of the transformation, encrypted bytes, tag: the sizes of AES-GCM and GMAC.
  RtpsError check_encrypted(std::uint8_t id, Bytes body) {
    if (!limits_.encrypted) return RtpsError::encrypted;
    constexpr std::size_t transformation = 20, tag = 20, own_tag = 20;
    WireCursor cursor(body, true);  // lengths inside are big-endian always
    const bool first = offset_ == kRtpsHeaderBytes + kSubmessageHeadBytes;
    switch (id) {
      case kSecureBody:
        cursor.skip(cursor.u32());
        return cursor.ok() ? RtpsError::none : RtpsError::submessage;
      case kSecurePrefix:
        if (prefixes_open_ || body.size() < transformation) return RtpsError::submessage;
        prefixes_open_ = true;
        if (memory_ != nullptr) memory_->answers(sender_);  // behind the handshake
        return RtpsError::none;
      case kSecurePostfix:
        if (!prefixes_open_) return RtpsError::submessage;
        prefixes_open_ = false;
        break;
      case kSecureRtpsPrefix:
        return first && body.size() >= transformation ? RtpsError::none : RtpsError::submessage;
      default:
        break;
    }
    // A tag for all, and one for each receiver.
    cursor.skip(tag - 4);
    cursor.skip(std::size_t{cursor.u32()} * own_tag);
    return cursor.ok() ? RtpsError::none : RtpsError::submessage;
  }

  bool follows(std::uint32_t writer, std::int64_t number) {
    return is_sequence_number(number) && (memory_ == nullptr || memory_->follows({sender_, writer, number}));
  }

  RtpsError check_heartbeat(WireCursor& cursor) {
    cursor.skip(4);
    const std::uint32_t writer = cursor.entity_id();
    const std::int64_t first = cursor.sequence_number(), last = cursor.sequence_number();
    cursor.skip(4);
    if (!cursor.ok()) return RtpsError::submessage;
    const bool range = is_sequence_number(first) && last >= first - 1 && last <= kLargestSequenceNumber;
    return range && follows(writer, std::max(first, last)) ? RtpsError::none : RtpsError::sequence_number;
  }

  RtpsError check_acknowledgement(WireCursor& cursor, std::uint8_t flags) {
    constexpr std::uint8_t final = 2;  // it answers a heartbeat
    const std::uint32_t reader = cursor.entity_id(), writer = cursor.entity_id();
    NumberSet set;
    if (!read_number_set(cursor, false, set)) return RtpsError::number_set;
    cursor.skip(4);
    if (!cursor.ok()) return RtpsError::submessage;
    if (memory_ == nullptr) return RtpsError::none;
    if (is_builtin(reader) && is_builtin(writer)) memory_->answers(sender_);
    if (is_cyclone(packet_.subspan(kSenderAt)) && !is_builtin(writer) && (flags & final) != 0)
      memory_->note_synchronised(sender_, writer);
    return RtpsError::none;
  }

  RtpsError check_gap(WireCursor& cursor) {
    cursor.skip(4);
    const std::uint32_t writer = cursor.entity_id();
    const std::int64_t start = cursor.sequence_number();
    NumberSet set;
    if (!cursor.ok()) return RtpsError::submessage;
    if (!is_sequence_number(start)) return RtpsError::sequence_number;
    if (!read_number_set(cursor, false, set)) return RtpsError::number_set;
    const bool range = set.base >= start && set.base - start <= kLongestGap;
    const std::int64_t last = set.base + set.highest;
    return range && follows(writer, last) ? RtpsError::none : RtpsError::sequence_number;
  }

  RtpsError check_fragment_request(WireCursor& cursor) {
    cursor.entity_id();
    const std::uint32_t writer = cursor.entity_id();
    const std::int64_t number = cursor.sequence_number();
    NumberSet set;
    if (!cursor.ok()) return RtpsError::submessage;
    if (!is_sequence_number(number)) return RtpsError::sequence_number;
    if (!read_number_set(cursor, true, set) || set.base == 0) return RtpsError::number_set;
    cursor.skip(4);
    if (!cursor.ok()) return RtpsError::submessage;
    if (memory_ == nullptr) return RtpsError::none;
    const std::int64_t highest = set.base + set.highest;
    return highest <= memory_->count(writer, number) ? RtpsError::none : RtpsError::fragment_request;
  }

  RtpsError check_data(WireCursor& cursor, std::uint8_t flags, Bytes body) {
    constexpr std::uint16_t to_inline_qos = 16;
    const bool has_inline = (flags & 2U) != 0, has_data = (flags & 4U) != 0, has_key = (flags & 8U) != 0;
    cursor.skip(2);
    const std::uint16_t skip = cursor.u16();
    const std::uint32_t reader = cursor.entity_id(), writer = cursor.entity_id();
    const std::int64_t number = cursor.sequence_number();
    if (!cursor.ok() || skip != to_inline_qos || (has_data && has_key)) return RtpsError::submessage;
    if (!follows(writer, number)) return RtpsError::sequence_number;
    const RtpsError before = check_before_data(cursor, has_inline, reader, writer, body);
    if (before != RtpsError::none) return before;
    const Bytes payload = body.subspan(cursor.position());
    // A topic without keys has neither keys nor samples without data; Fast DDS takes both for samples.
    constexpr std::uint32_t writer_without_key = 0x03;
    if ((writer & 0xffU) == writer_without_key && !has_data) return RtpsError::payload;
    if (has_key) return payload.empty() ? RtpsError::payload : RtpsError::none;
    if (!has_data) return RtpsError::none;
    if (!is_encapsulation(payload)) return RtpsError::payload;
    const RtpsError flaw = check_payload(writer, payload, offset_ + cursor.position());
    const bool announces = writer == kParticipantWriter && flaw == RtpsError::none && memory_ != nullptr;
    if (!announces || limits_.relayed_discovery) return flaw;
    return memory_->has_place(sender_, origin_, number) ? RtpsError::none : RtpsError::crowded;
  }

  RtpsError check_data_fragment(WireCursor& cursor, std::uint8_t flags, Bytes body) {
    constexpr std::uint16_t to_inline_qos = 28;
    const bool has_inline = (flags & 2U) != 0;
    cursor.skip(2);
    const std::uint16_t skip = cursor.u16();
    const std::uint32_t reader = cursor.entity_id(), writer = cursor.entity_id();
    const std::int64_t number = cursor.sequence_number();
    Fragment fragment;
    fragment.first = cursor.u32();
    fragment.count = cursor.u16();
    fragment.size = cursor.u16();
    fragment.sample_bytes = cursor.u32();
    if (!cursor.ok() || skip != to_inline_qos) return RtpsError::submessage;
    if (!follows(writer, number)) return RtpsError::sequence_number;
    if (is_builtin(reader) || is_builtin(writer)) return RtpsError::fragmented_discovery;
    const RtpsError before = check_before_data(cursor, has_inline, reader, writer, body);
    if (before != RtpsError::none) return before;
    report_.fragments = true;
    const Bytes payload = body.subspan(cursor.position());
    const RtpsError flaw = check_fragment(fragment, payload.size(), limits_.largest_sample_bytes);
    if (flaw != RtpsError::none) return flaw;
    return fragment.first > 1 || is_encapsulation(payload) ? RtpsError::none : RtpsError::payload;
  }

  /// Sender and receiver, and the parameters ahead of the data.
  RtpsError check_before_data(WireCursor& cursor, bool has_inline, std::uint32_t reader, std::uint32_t writer,
                              Bytes body) {
    if (reader != kUnknownEntity && is_builtin(reader) != is_builtin(writer)) return RtpsError::identity;
    if (is_builtin(writer) && is_builtin(reader) && (reader & ~0x3fU) != (writer & ~0x3fU))
      return RtpsError::identity;
    if (!has_inline) return RtpsError::none;
    const ListContext context{ListKind::inline_qos, speaks_for_itself(writer) ? &sender_ : nullptr, &limits_,
                              !is_builtin(writer)};
    const std::size_t at = cursor.position();
    const ListReport list = inspect_parameters(body.subspan(at), cursor.big_endian(), context,
                                               rewrite_ == nullptr ? nullptr : rewrite_ + offset_ + at);
    report_.needs_cleaning = report_.needs_cleaning || list.needs_cleaning;
    if (list.flaw != RtpsError::none) return list.flaw;
    cursor.skip(list.size);
    return RtpsError::none;
  }

  bool speaks_for_itself(std::uint32_t writer) const {
    if (limits_.relayed_discovery) return false;
    return writer == kParticipantWriter || writer == kParticipantSecureWriter ||
           writer == kPublicationsWriter || writer == kPublicationsSecureWriter ||
           writer == kSubscriptionsWriter || writer == kSubscriptionsSecureWriter;
  }

  RtpsError check_payload(std::uint32_t writer, Bytes payload, std::size_t offset) {
    constexpr std::size_t encapsulation = 4;
    const bool big_endian = (payload[1] & 1U) == 0;
    const Bytes content = payload.subspan(encapsulation);
    switch (writer) {
      case kParticipantWriter:
      case kParticipantSecureWriter:
        return check_list(ListKind::participant, writer, payload, offset);
      case kTopicsWriter:
      case kPublicationsWriter:
      case kPublicationsSecureWriter:
      case kSubscriptionsWriter:
      case kSubscriptionsSecureWriter:
        return check_list(ListKind::endpoint, writer, payload, offset);
      case kLivelinessWriter:
      case kLivelinessSecureWriter: {
        WireCursor cursor(content, big_endian);
        cursor.skip(16);
        const std::uint32_t length = cursor.u32();
        cursor.skip(length);
        return cursor.ok() ? RtpsError::none : RtpsError::payload;
      }
      case kHandshakeWriter:
      case kKeysWriter:
        return limits_.encrypted ? inspect_security_message(content, big_endian) : RtpsError::none;
      case kTypeRequestWriter:
      case kTypeReplyWriter:
        return RtpsError::none;  // not read by takt
      default:
        return RtpsError::none;
    }
  }

  RtpsError check_list(ListKind kind, std::uint32_t writer, Bytes payload, std::size_t offset) {
    constexpr std::uint8_t parameter_list_big = 2, parameter_list_little = 3;
    if (payload[1] != parameter_list_big && payload[1] != parameter_list_little) return RtpsError::payload;
    const ListContext context{kind, speaks_for_itself(writer) ? &sender_ : nullptr, &limits_};
    const ListReport list = inspect_parameters(payload.subspan(4), payload[1] == parameter_list_big, context,
                                               rewrite_ == nullptr ? nullptr : rewrite_ + offset + 4);
    report_.needs_cleaning = report_.needs_cleaning || list.needs_cleaning;
    if (list.flaw != RtpsError::none || kind != ListKind::endpoint || memory_ == nullptr ||
        list.endpoint.guid == 0)
      return list.flaw;
    return memory_->same_as_before(list.endpoint) ? RtpsError::none : RtpsError::changed;
  }

  Bytes packet_;
  const GuardLimits& limits_;
  RtpsSessionState* memory_;
  std::uint8_t* rewrite_;
  std::uint32_t now_s_;
  const PacketOrigin& origin_;
  PacketReport report_;
  GuidPrefixBytes sender_{};
  std::size_t offset_ = 0;      ///< of the present submessage's body
  std::size_t tail_ = 0;        // start of bytes that may be no submessages; 0: none
  bool prefixes_open_ = false;  ///< an encrypted submessage has begun and not ended
};

}  // namespace

std::string_view to_string(RtpsError flaw) {
  constexpr std::array<std::string_view, kRtpsErrorCount> names{"none",
                                                                "too_short",
                                                                "not_rtps",
                                                                "version",
                                                                "submessage",
                                                                "alignment",
                                                                "sequence_number",
                                                                "number_set",
                                                                "inline_qos",
                                                                "fragment",
                                                                "fragment_request",
                                                                "payload",
                                                                "parameter_list",
                                                                "parameter",
                                                                "text",
                                                                "locator",
                                                                "lease",
                                                                "identity",
                                                                "changed",
                                                                "fragmented_discovery",
                                                                "encrypted",
                                                                "source",
                                                                "crowded"};
  const auto index = static_cast<std::size_t>(flaw);
  return index < names.size() ? names[index] : "unknown";
}

PacketReport inspect_packet(Bytes packet, const GuardLimits& limits, RtpsSessionState* memory,
                            const PacketOrigin& origin) noexcept {
  constexpr auto kAnyTime = static_cast<std::uint32_t>(-1);
  return PacketInspector(packet, limits, memory, nullptr, kAnyTime, origin).inspect();
}

PacketReport clean_packet(std::span<std::uint8_t> packet, const GuardLimits& limits, RtpsSessionState* memory,
                          std::uint32_t now_s, const PacketOrigin& origin) noexcept {
  return PacketInspector(packet, limits, memory, packet.data(), now_s, origin).inspect();
}

}  // namespace takt
