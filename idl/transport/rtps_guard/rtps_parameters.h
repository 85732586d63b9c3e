#pragma once
// Parameter lists of RTPS, of discovery and inline, and the messages of security: structure and bounds.
#include <array>
#include <cstdint>
#include <span>

#include "idl/transport/rtps_guard/rtps_guard.h"
#include "idl/transport/rtps_guard/rtps_packet_memory.h"

namespace takt {

using GuidPrefixBytes = std::array<std::uint8_t, 12>;

enum class ListKind : std::uint8_t { inline_qos, participant, endpoint };

struct ListContext {
  ListKind kind = ListKind::inline_qos;
  const GuidPrefixBytes* sender = nullptr;  ///< announces only itself; null: announcements of any participant
  const GuardLimits* limits = nullptr;
  bool hide_key = false;  ///< inline, of topics without keys: a key corrupts the history of Fast DDS
};

struct ListReport {
  RtpsError flaw = RtpsError::none;
  bool needs_cleaning = false;
  std::size_t size = 0;  ///< bytes up to and with the sentinel
  EndpointTraits endpoint;
};

/// `bytes` starts with the first parameter. `rewrite`: the same bytes, writable, or null; hidden parameters
/// become padding in it.
ListReport inspect_parameters(std::span<const std::uint8_t> bytes, bool big_endian,
                              const ListContext& context, std::uint8_t* rewrite) noexcept;

/// ParticipantGenericMessage, the authentication messages between participants. After the encapsulation.
RtpsError inspect_security_message(std::span<const std::uint8_t> bytes, bool big_endian) noexcept;

}  // namespace takt
