#pragma once
// Structure of an RTPS packet: its header, and submessages, each with its own header (OMG DDSI-RTPS 2.3,
// 8.3.3 and 9.4). Never reads beyond the end of the packet.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "idl/transport/rtps_guard/wire_cursor.h"

namespace takt {

constexpr std::size_t kRtpsHeaderBytes = 20, kSubmessageHeadBytes = 4;
constexpr std::size_t kSenderAt = 8;  ///< GUID prefix, after magic, version and vendor

enum SubmessageId : std::uint8_t {
  kPad = 0x01,
  kAckNack = 0x06,
  kHeartbeat = 0x07,
  kGap = 0x08,
  kInfoTimestamp = 0x09,
  kInfoSource = 0x0c,
  kInfoDestination = 0x0e,
  kNackFrag = 0x12,
  kHeartbeatFrag = 0x13,
  kData = 0x15,
  kDataFrag = 0x16,
  kSecureBody = 0x30,
  kSecurePrefix = 0x31,
  kSecurePostfix = 0x32,
  kSecureRtpsPrefix = 0x33,
  kSecureRtpsPostfix = 0x34,
  kFastDdsStatistics = 0x80,
};

/// Builtin entities that announce the endpoints of a participant (RTPS 2.3, 9.3.1.3).
constexpr std::uint32_t kPublicationsWriter = 0x000003c2, kPublicationsReader = 0x000003c7,
                        kSubscriptionsWriter = 0x000004c2, kSubscriptionsReader = 0x000004c7;

/// One submessage: its head, and how many bytes follow it.
struct Submessage {
  std::uint8_t id = 0, flags = 0;
  std::size_t body_bytes = 0;
  bool open = false;  ///< the last one, which may leave its length to the end of the packet
  bool big_endian() const { return (flags & 1U) == 0; }
};

/// The submessage that begins at `at`; std::nullopt if the packet ends within it.
inline std::optional<Submessage> submessage_at(std::span<const std::uint8_t> packet, std::size_t at) {
  if (at > packet.size() || packet.size() - at < kSubmessageHeadBytes) return std::nullopt;
  Submessage found{packet[at], packet[at + 1]};
  found.body_bytes = WireCursor(packet.subspan(at + 2, 2), found.big_endian()).u16();
  const std::size_t rest = packet.size() - at - kSubmessageHeadBytes;
  found.open = found.body_bytes == 0 && found.id != kInfoTimestamp && found.id != kPad;
  if (found.open) found.body_bytes = rest;
  if (found.body_bytes > rest) return std::nullopt;
  return found;
}

/// Whether a GUID is of Eclipse Cyclone DDS: its first two bytes are the vendor's number (RTPS 2.2, 9.3.1.1), 1.16.
inline bool is_cyclone(std::span<const std::uint8_t> guid) {
  return guid.size() >= 2 && guid[0] == 0x01 && guid[1] == 0x10;
}

/// Entities of the protocol itself, which bring discovery, liveliness and security, have such ids.
inline bool is_builtin(std::uint32_t entity) {
  return (entity & 0xc0U) == 0xc0U;
}

/// Whether the submessage has data of builtin writers, or their sequence numbers, and so may change the
/// participants that DDS knows. False for encrypted ones.
inline bool speaks_of_discovery(std::span<const std::uint8_t> packet) {
  std::size_t at = kRtpsHeaderBytes;
  while (const auto submessage = submessage_at(packet, at)) {
    at += kSubmessageHeadBytes;
    const bool data = submessage->id == kData || submessage->id == kDataFrag;
    if (data || submessage->id == kHeartbeat || submessage->id == kGap) {
      WireCursor cursor(packet.subspan(at, submessage->body_bytes), submessage->big_endian());
      if (data) cursor.skip(4);
      const std::uint32_t reader = cursor.entity_id(), writer = cursor.entity_id();
      if (cursor.ok() && (is_builtin(reader) || is_builtin(writer))) return true;
    }
    at += submessage->body_bytes;
  }
  return false;
}

/// Whether the packet has the farewell of its sender: data of the participants' writer without an announcement.
inline bool ends_participant(std::span<const std::uint8_t> packet) {
  constexpr std::uint32_t participant_writer = 0x000100c2;
  constexpr std::uint8_t has_data = 4;
  std::size_t at = kRtpsHeaderBytes;
  while (const auto submessage = submessage_at(packet, at)) {
    at += kSubmessageHeadBytes;
    if (submessage->id == kData && (submessage->flags & has_data) == 0) {
      WireCursor cursor(packet.subspan(at, submessage->body_bytes), submessage->big_endian());
      cursor.skip(8);
      if (cursor.entity_id() == participant_writer) return true;
    }
    at += submessage->body_bytes;
  }
  return false;
}

/// Whether the packet announces a participant and does nothing else. A participant of several sockets sends its
/// announcements from each of them.
inline bool only_announces(std::span<const std::uint8_t> packet) {
  constexpr std::uint32_t participant_writer = 0x000100c2;
  constexpr std::uint8_t has_data = 4;
  bool announces = false;
  std::size_t at = kRtpsHeaderBytes;
  while (const auto submessage = submessage_at(packet, at)) {
    at += kSubmessageHeadBytes;
    if (submessage->id == kData) {
      WireCursor cursor(packet.subspan(at, submessage->body_bytes), submessage->big_endian());
      cursor.skip(8);
      if (cursor.entity_id() != participant_writer || (submessage->flags & has_data) == 0) return false;
      announces = true;
    } else if (submessage->id != kInfoTimestamp && submessage->id != kInfoDestination &&
               submessage->id != kFastDdsStatistics && submessage->id != kPad) {
      return false;
    }
    at += submessage->body_bytes;
  }
  return announces;
}

}  // namespace takt
