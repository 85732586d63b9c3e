#include "idl/transport/rtps_guard/rtps_packet_memory.h"

#include <algorithm>
#include <ctime>

#include "idl/transport/rtps_guard/rtps_submessage.h"
#include "idl/transport/rtps_guard/wire_cursor.h"

namespace takt {

std::uint32_t uptime_s() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC_COARSE, &now);
  return static_cast<std::uint32_t>(now.tv_sec);
}

namespace {

ParticipantPlaces::Prefix prefix_of(std::span<const std::uint8_t> guid) {
  ParticipantPlaces::Prefix prefix{};
  std::copy_n(guid.begin(), prefix.size(), prefix.begin());
  return prefix;
}

}  // namespace

std::uint64_t mixed(std::span<const std::uint8_t> bytes, std::uint64_t seed) {
  std::uint64_t key = 0xcbf29ce484222325ULL ^ seed;  // FNV-1a, and the bits stirred once more at the end
  for (const std::uint8_t byte : bytes) key = (key ^ byte) * 0x100000001b3ULL;
  key = (key ^ key >> 32U) * 0x9e3779b97f4a7c15ULL;
  return (key ^ key >> 29U) | 1U;
}

std::uint64_t participant_key(std::span<const std::uint8_t> guid) {
  constexpr std::size_t prefix_bytes = 12;
  return mixed(guid.first(prefix_bytes), 0);
}

std::size_t RtpsSessionState::slot(std::uint32_t writer, std::int64_t sequence_number) {
  const auto mixed = (static_cast<std::uint64_t>(sequence_number) + writer * 0x9e3779b97f4a7c15ULL);
  return static_cast<std::size_t>(mixed % kSent);
}

void RtpsSessionState::note(std::span<const std::uint8_t> packet) {
  std::size_t at = kRtpsHeaderBytes;
  while (const auto submessage = submessage_at(packet, at)) {
    at += kSubmessageHeadBytes;
    if (submessage->id == kDataFrag) {
      WireCursor cursor(packet.subspan(at, submessage->body_bytes), submessage->big_endian());
      cursor.skip(8);
      const std::uint32_t writer = cursor.entity_id();
      const std::int64_t number = cursor.sequence_number();
      cursor.skip(6);
      const std::uint32_t fragment_bytes = cursor.u16(), sample_bytes = cursor.u32();
      if (cursor.ok() && fragment_bytes > 0 && sample_bytes > 0) {
        const std::lock_guard lock(mutex_);
        sent_[slot(writer, number)] = {writer, (sample_bytes - 1) / fragment_bytes + 1, number};
      }
    } else {
      note_announcement(*submessage, packet.subspan(at, submessage->body_bytes));
    }
    at += submessage->body_bytes;
  }
}

void RtpsSessionState::note_announcement(const Submessage& submessage, std::span<const std::uint8_t> body) {
  if (submessage.id != kData && submessage.id != kHeartbeat) return;
  WireCursor cursor(body, submessage.big_endian());
  cursor.skip(submessage.id == kData ? 8 : 4);
  const std::uint32_t writer = cursor.entity_id();
  if (writer != kPublicationsWriter && writer != kSubscriptionsWriter) return;
  if (submessage.id == kHeartbeat) cursor.skip(8);  // the first number
  const std::int64_t number = cursor.sequence_number();
  if (!cursor.ok()) return;
  const auto kind = writer == kPublicationsWriter ? AnnouncedEndpoints::writers : AnnouncedEndpoints::readers;
  const std::lock_guard lock(mutex_);
  std::int64_t& last = last_announcements_[static_cast<std::size_t>(kind)];
  last = std::max(last, number);
}

std::int64_t RtpsSessionState::last_announcement(AnnouncedEndpoints kind) const {
  const std::lock_guard lock(mutex_);
  return last_announcements_[static_cast<std::size_t>(kind)];
}

std::uint32_t RtpsSessionState::count(std::uint32_t writer, std::int64_t sequence_number) const {
  const std::lock_guard lock(mutex_);
  const Sent& entry = sent_[slot(writer, sequence_number)];
  return entry.writer == writer && entry.sequence_number == sequence_number ? entry.fragments : 0;
}

bool RtpsSessionState::sends_from(std::span<const std::uint8_t> sender, const PacketOrigin& origin) {
  const bool here = origin.transport == TransportKind::shared_memory;
  if (!here && origin.source == 0) return true;
  const std::uint64_t participant = participant_key(sender);
  const std::uint32_t now_s = now_s_();
  const std::lock_guard lock(mutex_);
  return sources_.admits(participant, here ? SourceTable::kSharedMemory : origin.source, now_s);
}

bool RtpsSessionState::has_place(const ParticipantPlaces::Prefix& sender, const PacketOrigin& origin,
                                 std::int64_t number) {
  const std::uint32_t now_s = now_s_();
  const std::lock_guard lock(mutex_);
  return places_.announced(sender, origin.address, number, now_s);
}

void RtpsSessionState::answers(const ParticipantPlaces::Prefix& sender) {
  const std::lock_guard lock(mutex_);
  places_.answered(sender);
}

void RtpsSessionState::note_synchronised(const ParticipantPlaces::Prefix& sender, std::uint32_t writer) {
  const std::uint64_t key = mixed(sender, writer);
  const std::lock_guard lock(mutex_);
  if (synchronised_.find(key) == nullptr) synchronised_.insert(key);
}

bool RtpsSessionState::is_synchronised(const ParticipantPlaces::Prefix& sender, std::uint32_t writer) {
  const std::uint64_t key = mixed(sender, writer);
  const std::lock_guard lock(mutex_);
  return synchronised_.find(key) != nullptr;
}

std::optional<ParticipantPlaces::Farewell> RtpsSessionState::overdue_participant() {
  const std::uint32_t now_s = now_s_();
  const std::lock_guard lock(mutex_);
  return places_.overdue(now_s);
}

bool RtpsSessionState::follows(const Sample& sample) {
  const std::uint64_t key = mixed(sample.sender, sample.writer);
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

bool RtpsSessionState::same_as_before(const EndpointTraits& endpoint) {
  const std::uint32_t now_s = now_s_();
  const std::lock_guard lock(mutex_);
  Endpoint* entry = endpoints_.find(endpoint.guid);
  if (entry == nullptr) {
    entry = endpoints_.insert_for(endpoint.guid, [&](const Endpoint& other) {
      return other.gone || participants_.find(other.participant) == nullptr;
    });
    if (entry == nullptr) return false;
    entry->participant = endpoint.participant;
    entry->unchanging = endpoint.unchanging;
  }
  if (entry->unchanging != endpoint.unchanging) return false;
  entry->gone = false;
  entry->announced_s = now_s;
  return true;
}

void RtpsSessionState::know(std::span<const std::uint8_t> guid) {
  const std::uint64_t participant = participant_key(guid);
  const std::lock_guard lock(mutex_);
  if (participants_.find(participant) == nullptr) participants_.insert(participant);
  places_.taken(prefix_of(guid));
}

void RtpsSessionState::forget(std::span<const std::uint8_t> guid) {
  constexpr std::uint8_t participant_kind = 0xc1;
  const std::lock_guard lock(mutex_);
  if (guid.back() == participant_kind) {
    forget(participant_key(guid), static_cast<std::uint32_t>(-1));
    sources_.forget(participant_key(guid));
    places_.left(prefix_of(guid));
  } else if (Endpoint* endpoint = endpoints_.find(mixed(guid, 0))) {
    endpoint->gone = true;
  }
}

void RtpsSessionState::forget_silent(std::span<const std::uint8_t> guid) {
  constexpr std::uint32_t recent_s = 2;
  const std::uint32_t now_s = now_s_();
  const std::lock_guard lock(mutex_);
  forget(participant_key(guid), now_s - std::min(now_s, recent_s + 1));
  places_.left(prefix_of(guid));
}

void RtpsSessionState::forget(std::uint64_t participant, std::uint32_t announced_until_s) {
  endpoints_.erase_if(
      [&](const Endpoint& e) { return e.participant == participant && e.announced_s <= announced_until_s; });
  participants_.erase_if([&](const Sender& p) { return p.key == participant; });
}

void RtpsSessionState::note_tail(std::span<const std::uint8_t> sender) {
  const std::uint64_t key = mixed(sender, 0);
  const std::lock_guard lock(mutex_);
  if (leaving_tails_.find(key) == nullptr) leaving_tails_.insert(key);
}

bool RtpsSessionState::leaves_tails(std::span<const std::uint8_t> sender) {
  const std::uint64_t key = mixed(sender, 0);
  const std::lock_guard lock(mutex_);
  return leaving_tails_.find(key) != nullptr;
}

}  // namespace takt
