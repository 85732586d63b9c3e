#pragma once
// Whether a serialised sample can be what it claims, looked at before it is decoded. The decoder of
// fastddsgen makes room for as many elements as a sequence claims to have, before it finds that the sample
// ends: thirty bytes would take gigabytes. A sample with this check takes memory in proportion to its own
// size.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "idl/transport/rtps_guard/wire_cursor.h"

namespace takt {

/// The fields of a type in their order, plain XCDR1: `1`, `2`, `4`, `8` a number of that many bytes, `s` a
/// string, `[...]` a sequence of what is within (never empty).
using WireShape = std::string_view;

namespace wire_shape_detail {

/// From `shape[at]` on to the bracket that closes, or the end; returns its place. Each element of a sequence
/// takes at least one byte of the payload, so that the work is bounded by the payload's size.
inline std::size_t read(WireShape shape, std::size_t at, WireCursor& cursor) {
  while (at < shape.size() && shape[at] != ']' && cursor.ok()) {
    const char field = shape[at];
    if (field == '[') {
      cursor.align_to(4);
      const std::uint32_t count = cursor.u32();
      if (count > cursor.left()) cursor.fail();
      for (std::uint32_t i = 0; i < count && cursor.ok(); ++i) (void)read(shape, at + 1, cursor);
      int depth = 1;
      while (depth > 0) {
        ++at;
        depth += shape[at] == '[' ? 1 : shape[at] == ']' ? -1 : 0;
      }
    } else if (field == 's') {
      cursor.align_to(4);
      cursor.skip(cursor.u32());
    } else {
      const auto size = static_cast<std::size_t>(field - '0');
      cursor.align_to(size);
      cursor.skip(size);
    }
    ++at;
  }
  return at;
}

}  // namespace wire_shape_detail

/// `payload` begins with its encapsulation (4 bytes). What follows the last field does not matter.
inline bool has_shape(std::span<const std::uint8_t> payload, WireShape shape) {
  constexpr std::size_t kEncapsulation = 4;
  if (payload.size() < kEncapsulation) return false;
  WireCursor cursor(payload.subspan(kEncapsulation), (payload[1] & 1U) == 0);
  (void)wire_shape_detail::read(shape, 0, cursor);
  return cursor.ok();
}

}  // namespace takt
