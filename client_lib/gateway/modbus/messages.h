#pragma once
// Messages of Modbus TCP (Modbus Application Protocol 1.1b3, Modbus Messaging on TCP/IP 1.0b), big-endian:
//
//   MBAP header   uint16 transaction, uint16 protocol 0, uint16 length (unit and PDU), uint8 unit
//   PDU           uint8 function, data; an exception reply has function | 0x80 and uint8 exception
//
// Functions 1 to 6, 15, 16, 22, 23 and 43 (device identification). TCP may cut and join messages anywhere: FrameStream puts them together.
// Functions on bytes: no sockets, no clock.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace takt::gateway::modbus {

enum class Function : std::uint8_t {
  read_coils = 1,
  read_discrete_inputs = 2,
  read_holding_registers = 3,
  read_input_registers = 4,
  write_coil = 5,
  write_register = 6,
  write_coils = 15,
  write_registers = 16,
  mask_write_register = 22,
  read_write_registers = 23,
  encapsulated = 43,
};

/// Codes of an exception reply.
enum class Exception : std::uint8_t {
  none = 0,
  illegal_function = 1,
  illegal_address = 2,
  illegal_value = 3,
  device_failure = 4,
  no_such_unit = 11,  ///< gateway target device failed to respond
};

inline constexpr std::size_t kHeader_bytes = 7, kMostPdu_bytes = 253;
inline constexpr std::size_t kMostReadBits = 2000, kMostWrittenBits = 1968;
inline constexpr std::size_t kMostReadRegisters = 125, kMostWrittenRegisters = 123;
inline constexpr std::size_t kMostReadWriteRegisters = 121;  ///< written by function 23
inline constexpr std::size_t kAddresses = 65536;

/// A message of either direction.
struct Frame {
  std::uint16_t transaction = 0;
  std::uint8_t unit = 0;
  std::string pdu;  ///< 1 to 253 bytes
};
std::string encode(const Frame& frame);

/// Messages of a byte stream.
class FrameStream {
 public:
  void add(std::string_view bytes);
  /// The next whole message. After bytes that are no Modbus the stream has a fault, and no further message.
  std::optional<Frame> next();
  /// Why the connection must be closed; empty: it need not.
  const std::string& fault() const { return fault_; }

 private:
  std::string bytes_;
  std::size_t begin_ = 0;  ///< of the next message
  std::string fault_;
};

/// What a server reads and writes: four areas of 65536 addresses at most.
class Memory {
 public:
  virtual ~Memory() = default;
  /// False: an address of the range does not exist. `count` is at least 1, and first + count at most 65536.
  virtual bool read_bits(bool coils, std::size_t first, std::size_t count, std::vector<bool>& bits) = 0;
  virtual bool read_registers(bool holding, std::size_t first, std::size_t count,
                              std::vector<std::uint16_t>& values) = 0;
  /// Either writes all or nothing.
  virtual Exception write_coils(std::size_t first, const std::vector<bool>& bits) = 0;
  virtual Exception write_registers(std::size_t first, const std::vector<std::uint16_t>& values) = 0;
};

/// The reply of a server to a request's PDU. Never empty: a request that cannot be served has an exception reply.
std::string reply_to(std::string_view pdu, Memory& memory);
std::string exception_reply(std::uint8_t function, Exception exception);
/// Whether the request asks for a write, and so makes its sender one that commands.
bool is_write(std::string_view pdu);

// Requests of a client, as PDU. Counts within the limits above.

std::string read_request(Function function, std::size_t first, std::size_t count);
std::string write_coils_request(std::size_t first, const std::vector<bool>& bits);
std::string write_registers_request(std::size_t first, const std::vector<std::uint16_t>& values);
std::string read_write_request(std::size_t read_first, std::size_t read_count, std::size_t write_first,
                               const std::vector<std::uint16_t>& values);

/// What a reply says, checked against its request.
struct Reply {
  std::string fault;  ///< why the reply does not answer this request; empty: it does
  std::uint8_t exception = 0;
  std::vector<bool> bits{};  ///< of functions 1 and 2, as many as were asked for
  std::vector<std::uint16_t> registers{};
};
Reply parse_reply(std::string_view request, std::string_view reply);

/// "illegal address (2)".
std::string exception_text(std::uint8_t exception);

// Numbers in registers.

enum class NumberType : std::uint8_t { int16, uint16, int32, uint32, float32 };
/// Which register of a 32-bit value comes first.
enum class WordOrder : std::uint8_t { high_first, low_first };

constexpr std::size_t registers_of(NumberType type) {
  return type == NumberType::int16 || type == NumberType::uint16 ? 1 : 2;
}
/// The registers of a number, rounded to a whole one but for float32. A number beyond the type's range gives the end
/// of the range, and not a number gives 0; both set `beyond`.
std::vector<std::uint16_t> to_registers(double number, NumberType type, WordOrder order, bool& beyond);
/// `registers`: registers_of(type).
double from_registers(const std::uint16_t* registers, NumberType type, WordOrder order);

}  // namespace takt::gateway::modbus
