#pragma once
// RTPS packets made by hand, after the tables of DDSI-RTPS 2.3.
#include <cstdint>
#include <string>
#include <vector>

namespace takt::test {

/// Entities of users, as DDS names them.
inline constexpr std::uint32_t kWriter = 0x00000103, kReader = 0x00000204;

/// Bytes in either byte order.
class Wire {
 public:
  explicit Wire(bool big_endian = false) : big_(big_endian) {}
  Wire& u8(unsigned value) {
    bytes.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
  Wire& u16(unsigned value) { return number(value, 2); }
  Wire& u32(std::uint64_t value) { return number(value, 4); }
  Wire& sequence(std::int64_t value) {
    const auto bits = static_cast<std::uint64_t>(value);
    return u32(bits >> 32U).u32(bits & 0xffffffffU);
  }
  Wire& id(std::uint32_t entity) {
    for (int shift = 24; shift >= 0; shift -= 8) u8(entity >> static_cast<unsigned>(shift) & 0xffU);
    return *this;
  }
  Wire& fill(std::size_t count, unsigned value = 0) {
    for (std::size_t i = 0; i < count; ++i) u8(value);
    return *this;
  }
  Wire& text(const std::string& value) {
    u32(value.size() + 1);
    for (const char c : value) u8(static_cast<unsigned char>(c));
    u8(0);
    while (bytes.size() % 4 != 0) u8(0);
    return *this;
  }
  Wire& add(const std::vector<std::uint8_t>& more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return *this;
  }
  Wire& parameter(unsigned parameter_id, const std::vector<std::uint8_t>& value) {
    return u16(parameter_id).u16(static_cast<unsigned>(value.size())).add(value);
  }
  std::vector<std::uint8_t> bytes;

 private:
  Wire& number(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i)
      u8(static_cast<unsigned>(value >> static_cast<unsigned>(8 * (big_ ? size - 1 - i : i)) & 0xffU));
    return *this;
  }
  bool big_;
};

struct Packet {
  explicit Packet(bool big_endian = false) : big(big_endian) {
    wire.add({'R', 'T', 'P', 'S', 2, 2, 1, 15});
    wire.fill(12, 7);  // the sender's GUID prefix
  }
  Packet& submessage(unsigned id, unsigned flags, const Wire& body) {
    wire.u8(id).u8(flags | (big ? 0U : 1U));
    wire.add(Wire(big).u16(static_cast<unsigned>(body.bytes.size())).bytes).add(body.bytes);
    return *this;
  }
  /// DATA of a writer: `flags` 2 parameters before, 4 data, 8 key.
  Packet& data(std::uint32_t reader, std::uint32_t writer, unsigned flags,
               const std::vector<std::uint8_t>& rest, std::int64_t number = 1) {
    return submessage(0x15, flags, Wire(big).u16(0).u16(16).id(reader).id(writer).sequence(number).add(rest));
  }
  bool big;
  Wire wire;
};

inline constexpr std::uint32_t kSpdpWriter = 0x000100c2, kSedpWriter = 0x000003c2;
inline std::vector<std::uint8_t> guid(unsigned prefix_byte, std::uint32_t entity) {
  return Wire().fill(12, prefix_byte).id(entity).bytes;
}
/// Encapsulation and parameters of a participant that is in order, but for the sentinel.
inline Wire participant(bool big = false) {
  Wire list(big);
  list.u8(0).u8(big ? 2 : 3).fill(2);
  list.parameter(0x0015, {2, 2, 0, 0})
      .parameter(0x0016, {1, 15, 0, 0})
      .parameter(0x0050, guid(7, 0x000001c1));
  list.parameter(0x0002, Wire(big).u32(20).u32(0).bytes);
  list.parameter(0x0032, Wire(big).u32(1).u32(7410).fill(12).add({127, 0, 0, 1}).bytes);
  list.parameter(0x0062, Wire(big).text("somebody").bytes);
  return list;
}
inline Wire endpoint(bool big = false) {
  Wire list(big);
  list.u8(0).u8(big ? 2 : 3).fill(2);
  list.parameter(0x005a, guid(7, 0x00000103)).parameter(0x0005, Wire(big).text("rt/cell/state").bytes);
  list.parameter(0x0007, Wire(big).text("a::b_").bytes);
  list.parameter(0x001a, Wire(big).u8(2).fill(3).u32(0).u32(0).bytes);
  return list;
}

}  // namespace takt::test
