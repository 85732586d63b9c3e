#pragma once
// Checks that a packet is well-formed RTPS, for every packet ahead of Fast DDS: stock 2.9.1 ends the process
// on one malformed datagram, without checking any signature. Pure functions over bytes: no DDS, no
// allocation, no state except the arguments.
//
// Checked (DDSI-RTPS 2.3, sections 9.4 and 9.6): header, submessage lengths and alignment, every submessage
// that Fast DDS reads, sequence and fragment number sets, fragments, inline QoS, and in discovery data every
// parameter that Fast DDS reads: sizes, strings, lists, tokens, locators, durations, and whether the sender
// speaks for itself. Of encrypted submessages only the frame is checked: their payload comes from an
// authenticated participant.
//
// This room can go when every supported Fast DDS survives takt-guard-fuzz without it (decision 176).
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace takt {

/// Reason why a packet is dropped; `none` for an accepted packet.
enum class RtpsError : std::uint8_t {
  none,
  too_short,         ///< not even a header
  not_rtps,          ///< other magic
  version,           ///< another major version of the protocol
  submessage,        ///< a submessage does not fit the packet, or is too short for its kind
  alignment,         ///< a submessage that is not the last has a length that is no multiple of 4
  sequence_number,   ///< not positive, absurdly large, or an invalid range
  number_set,        ///< a set of sequence or fragment numbers of more than 256, or beyond its submessage
  inline_qos,        ///< invalid parameters ahead of the data
  fragment,          ///< sizes and numbers of a fragment contradict each other, or the sample is too large
  fragment_request,  ///< requests fragments of a sample that was not sent in fragments
  payload,           ///< no data where they are required, or in an unknown encoding
  parameter_list,    ///< does not end, or a length beyond its end
  parameter,         ///< a parameter of a wrong size or value
  text,              ///< a string that is too long or not terminated
  locator,           ///< an invalid address
  lease,             ///< a participant with an infinite or zero lease
  identity,          ///< speaks in the name of another participant, or to an endpoint it has no business with
  changed,           ///< an endpoint that changes an immutable property: another topic or reliability
  fragmented_discovery,  ///< discovery data in pieces cannot be checked
  encrypted,             ///< encrypted, and this participant has no security
  source,                ///< names a participant that sends from another address and port
  crowded,               ///< announces a participant for which there is no place
  count_,
};
inline constexpr std::size_t kRtpsErrorCount = static_cast<std::size_t>(RtpsError::count_);
std::string_view to_string(RtpsError flaw);

struct GuardLimits {
  std::uint32_t largest_sample_bytes = 1U << 20U;  ///< of samples that come in fragments
  /// Samples with more fragments are assembled by Fast DDS (rtps_fragments.h).
  std::uint32_t most_fragments_joined = 0xFFFFFFFF;
  /// Ports in shared memory that a peer may announce. Each that is written to becomes a file.
  std::uint32_t first_shared_memory_port = 7400, last_shared_memory_port = 65535;
  std::uint32_t longest_lease_s = 3600;
  bool relayed_discovery = false;  ///< a discovery server announces other participants
  bool encrypted = false;          ///< this participant has security
};

class RtpsSessionState;

/// Transport of a packet. Packets of Fast DDS 3.1.2 in shared memory end with 60 bytes of other packets, in
/// the place of its statistics (Fast-DDS #5759); they are cut off.
enum class TransportKind : std::uint8_t { network, shared_memory };

/// Where a packet came from.
struct PacketOrigin {
  PacketOrigin(TransportKind kind = TransportKind::network) : transport(kind) {}
  TransportKind transport;
  std::uint64_t source = 0;   ///< hash of the sender's address and port; 0: not known
  std::uint64_t address = 0;  ///< hash of the address alone
};

struct PacketReport {
  RtpsError flaw = RtpsError::none;
  bool needs_cleaning = false;  ///< contains parameters that clean_packet() removes
  bool fragments = false;       ///< has data in fragments
  /// Length of the packet for Fast DDS: its own statistics at the end, which it reads with asserts, are cut
  /// off, and so are bytes in their place.
  std::size_t size = 0;
};

/// `memory` may be null: fragments and requests for them are then checked one by one only.
PacketReport inspect_packet(std::span<const std::uint8_t> packet, const GuardLimits& limits,
                            RtpsSessionState* memory, const PacketOrigin& origin = {}) noexcept;

/// The same, and removes parameters that takt does not need and that make Fast DDS crash or reject samples:
/// type objects, type information, content filters and data sharing become padding, source timestamps after
/// `now_s` (s since 1970) become `now_s` (a history keeps the latest sample: one from the future shuts out
/// all others). Only useful for a packet without flaw.
PacketReport clean_packet(std::span<std::uint8_t> packet, const GuardLimits& limits, RtpsSessionState* memory,
                          std::uint32_t now_s, const PacketOrigin& origin = {}) noexcept;

}  // namespace takt
