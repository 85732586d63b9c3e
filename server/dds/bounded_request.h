#pragma once
// Control requests whose bounds are looked at before they are decoded. The decoder of fastddsgen makes room
// for as many arguments as a sample claims to have, at 4 KB each: a request of 200 KB would take a gigabyte.
#include <cstddef>
#include <cstdint>
#include <span>

#include "idl/transport/fastdds/fastdds.h"
#include "idl/transport/rtps_guard/wire_cursor.h"
#include "takt_msgsPubSubTypes.h"

namespace takt {

class BoundedControlRequest : public takt_msgs::msg::ControlRequestPubSubType {
 public:
  bool deserialize(DdsPayload payload, void* data) override {
    return within_bounds(bytes_of(payload)) &&
           takt_msgs::msg::ControlRequestPubSubType::deserialize(payload, data);
  }

  /// `payload` with its encapsulation; the fields in the order of the IDL.
  static bool within_bounds(std::span<const std::uint8_t> payload) {
    constexpr std::size_t encapsulation = 4, sequence_number_bytes = 8;
    constexpr std::uint32_t most_arguments = 64;
    if (payload.size() < encapsulation) return false;
    WireCursor cursor(payload.subspan(encapsulation), (payload[1] & 1U) == 0);
    cursor.skip(cursor.u32());  // client id
    cursor.skip((sequence_number_bytes - cursor.position() % sequence_number_bytes) % sequence_number_bytes);
    cursor.skip(sequence_number_bytes);
    cursor.skip(cursor.u32());  // request
    cursor.align();
    return cursor.u32() <= most_arguments && cursor.ok();
  }
};

}  // namespace takt
