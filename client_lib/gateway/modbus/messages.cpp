#include "client_lib/gateway/modbus/messages.h"

#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace takt::gateway::modbus {
namespace {

void put16(std::string& bytes, std::size_t value) {
  bytes += static_cast<char>(value >> 8U & 0xffU);
  bytes += static_cast<char>(value & 0xffU);
}

std::uint8_t byte_at(std::string_view bytes, std::size_t at) {
  return static_cast<std::uint8_t>(bytes[at]);
}

std::size_t get16(std::string_view bytes, std::size_t at) {
  return static_cast<std::size_t>(byte_at(bytes, at)) << 8U | byte_at(bytes, at + 1);
}

void put_bits(std::string& bytes, const std::vector<bool>& bits) {
  for (std::size_t i = 0; i < bits.size(); i += 8) {
    unsigned packed = 0;
    for (std::size_t bit = 0; bit < 8 && i + bit < bits.size(); ++bit)
      packed |= static_cast<unsigned>(bits[i + bit]) << bit;
    bytes += static_cast<char>(packed);
  }
}

std::vector<bool> get_bits(std::string_view bytes, std::size_t at, std::size_t count) {
  std::vector<bool> bits(count);
  for (std::size_t i = 0; i < count; ++i)
    bits[i] = (static_cast<unsigned>(byte_at(bytes, at + i / 8)) >> (i % 8) & 1U) != 0;
  return bits;
}

std::vector<std::uint16_t> get_registers(std::string_view bytes, std::size_t at, std::size_t count) {
  std::vector<std::uint16_t> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<std::uint16_t>(get16(bytes, at + 2 * i));
  return values;
}

std::string head(Function function) {
  return std::string(1, static_cast<char>(function));
}

bool in_range(std::size_t first, std::size_t count) {
  return first + count <= kAddresses;
}

std::string with_registers(std::uint8_t function, const std::vector<std::uint16_t>& values) {
  std::string pdu(1, static_cast<char>(function));
  pdu += static_cast<char>(2 * values.size());
  for (const std::uint16_t value : values) put16(pdu, value);
  return pdu;
}

/// Device identification (section 6.21): the three basic objects. Throws the exception.
std::string identification(std::string_view pdu) {
  constexpr std::size_t kReadIdentification = 0x0e, kOneObject = 4;
  constexpr unsigned kBasicAndOneByOne = 0x81;
  static constexpr std::array<std::string_view, 3> kObjects{"takt", "takt-modbus", TAKT_VERSION};
  if (pdu.size() < 2 || byte_at(pdu, 1) != kReadIdentification) throw Exception::illegal_function;
  if (pdu.size() != 4) throw Exception::illegal_value;
  const std::size_t code = byte_at(pdu, 2);
  std::size_t first = byte_at(pdu, 3), end = kObjects.size();
  if (code < 1 || code > kOneObject) throw Exception::illegal_value;
  if (code == kOneObject) {
    if (first >= kObjects.size()) throw Exception::illegal_address;
    end = first + 1;
  } else if (first >= kObjects.size()) {
    first = 0;  // such a stream has all objects
  }
  std::string reply(pdu.substr(0, 3));
  reply += static_cast<char>(kBasicAndOneByOne);
  reply += std::string(2, '\0');  // nothing follows
  reply += static_cast<char>(end - first);
  for (std::size_t i = first; i < end; ++i) {
    reply += static_cast<char>(i);
    reply += static_cast<char>(kObjects[i].size());
    reply += kObjects[i];
  }
  return reply;
}

/// Serves one request; throws its exception.
std::string serve(std::string_view pdu, Memory& memory) {
  const std::uint8_t function = byte_at(pdu, 0);
  const auto need = [](bool holds, Exception exception) {
    if (!holds) throw exception;
  };
  const auto done = [&](Exception exception) { need(exception == Exception::none, exception); };
  switch (static_cast<Function>(function)) {
    case Function::read_coils:
    case Function::read_discrete_inputs: {
      need(pdu.size() == 5, Exception::illegal_value);
      const std::size_t first = get16(pdu, 1), count = get16(pdu, 3);
      need(count >= 1 && count <= kMostReadBits, Exception::illegal_value);
      std::vector<bool> bits;
      need(in_range(first, count) &&
               memory.read_bits(function == static_cast<std::uint8_t>(Function::read_coils), first, count,
                                bits),
           Exception::illegal_address);
      std::string reply(1, static_cast<char>(function));
      reply += static_cast<char>((count + 7) / 8);
      put_bits(reply, bits);
      return reply;
    }
    case Function::read_holding_registers:
    case Function::read_input_registers: {
      need(pdu.size() == 5, Exception::illegal_value);
      const std::size_t first = get16(pdu, 1), count = get16(pdu, 3);
      need(count >= 1 && count <= kMostReadRegisters, Exception::illegal_value);
      std::vector<std::uint16_t> values;
      need(in_range(first, count) &&
               memory.read_registers(function == static_cast<std::uint8_t>(Function::read_holding_registers),
                                     first, count, values),
           Exception::illegal_address);
      return with_registers(function, values);
    }
    case Function::write_coil: {
      need(pdu.size() == 5, Exception::illegal_value);
      const std::size_t value = get16(pdu, 3);
      need(value == 0xff00U || value == 0, Exception::illegal_value);
      done(memory.write_coils(get16(pdu, 1), {value != 0}));
      return std::string(pdu);
    }
    case Function::write_register:
      need(pdu.size() == 5, Exception::illegal_value);
      done(memory.write_registers(get16(pdu, 1), get_registers(pdu, 3, 1)));
      return std::string(pdu);
    case Function::write_coils: {
      need(pdu.size() >= 6, Exception::illegal_value);
      const std::size_t first = get16(pdu, 1), count = get16(pdu, 3), bytes = byte_at(pdu, 5);
      need(count >= 1 && count <= kMostWrittenBits && bytes == (count + 7) / 8 && pdu.size() == 6 + bytes,
           Exception::illegal_value);
      need(in_range(first, count), Exception::illegal_address);
      done(memory.write_coils(first, get_bits(pdu, 6, count)));
      return std::string(pdu.substr(0, 5));
    }
    case Function::write_registers: {
      need(pdu.size() >= 6, Exception::illegal_value);
      const std::size_t first = get16(pdu, 1), count = get16(pdu, 3), bytes = byte_at(pdu, 5);
      need(count >= 1 && count <= kMostWrittenRegisters && bytes == 2 * count && pdu.size() == 6 + bytes,
           Exception::illegal_value);
      need(in_range(first, count), Exception::illegal_address);
      done(memory.write_registers(first, get_registers(pdu, 6, count)));
      return std::string(pdu.substr(0, 5));
    }
    case Function::mask_write_register: {
      need(pdu.size() == 7, Exception::illegal_value);
      const std::size_t at = get16(pdu, 1), keep = get16(pdu, 3), set = get16(pdu, 5);
      std::vector<std::uint16_t> values;
      need(memory.read_registers(true, at, 1, values), Exception::illegal_address);
      values[0] = static_cast<std::uint16_t>((values[0] & keep) | (set & ~keep));
      done(memory.write_registers(at, values));
      return std::string(pdu);
    }
    case Function::encapsulated:
      return identification(pdu);
    case Function::read_write_registers: {
      need(pdu.size() >= 10, Exception::illegal_value);
      const std::size_t read_first = get16(pdu, 1), read_count = get16(pdu, 3), first = get16(pdu, 5),
                        count = get16(pdu, 7), bytes = byte_at(pdu, 9);
      need(read_count >= 1 && read_count <= kMostReadRegisters && count >= 1 &&
               count <= kMostReadWriteRegisters && bytes == 2 * count && pdu.size() == 10 + bytes,
           Exception::illegal_value);
      need(in_range(first, count) && in_range(read_first, read_count), Exception::illegal_address);
      // The write comes first; nothing is written where the read fails.
      std::vector<std::uint16_t> values;
      need(memory.read_registers(true, read_first, read_count, values), Exception::illegal_address);
      done(memory.write_registers(first, get_registers(pdu, 10, count)));
      memory.read_registers(true, read_first, read_count, values);
      return with_registers(function, values);
    }
  }
  throw Exception::illegal_function;
}

template <class Whole>
std::vector<std::uint16_t> whole_registers(double number, WordOrder order, bool& beyond) {
  const double rounded = std::round(number);
  Whole value = 0;
  if (rounded < static_cast<double>(std::numeric_limits<Whole>::min())) {
    value = std::numeric_limits<Whole>::min();
    beyond = true;
  } else if (rounded > static_cast<double>(std::numeric_limits<Whole>::max())) {
    value = std::numeric_limits<Whole>::max();
    beyond = true;
  } else {
    value = static_cast<Whole>(rounded);
  }
  if constexpr (sizeof(Whole) == 2) {
    return {static_cast<std::uint16_t>(value)};
  } else {
    const auto bits = static_cast<std::uint32_t>(value);
    const auto high = static_cast<std::uint16_t>(bits >> 16U), low = static_cast<std::uint16_t>(bits);
    return order == WordOrder::high_first ? std::vector<std::uint16_t>{high, low}
                                          : std::vector<std::uint16_t>{low, high};
  }
}

}  // namespace

std::string encode(const Frame& frame) {
  std::string bytes;
  bytes.reserve(kHeader_bytes + frame.pdu.size());
  put16(bytes, frame.transaction);
  put16(bytes, 0);
  put16(bytes, 1 + frame.pdu.size());
  bytes += static_cast<char>(frame.unit);
  return bytes + frame.pdu;
}

void FrameStream::add(std::string_view bytes) {
  if (!fault_.empty()) return;
  bytes_.erase(0, begin_);
  begin_ = 0;
  bytes_ += bytes;
}

std::optional<Frame> FrameStream::next() {
  const std::string_view rest = std::string_view(bytes_).substr(begin_);
  if (!fault_.empty() || rest.size() < 4) return std::nullopt;
  if (const std::size_t protocol = get16(rest, 2); protocol != 0) {
    fault_ = "protocol " + std::to_string(protocol) + "; Modbus is 0";
    return std::nullopt;
  }
  if (rest.size() < 6) return std::nullopt;
  const std::size_t length = get16(rest, 4);
  if (length < 2 || length > 1 + kMostPdu_bytes) {
    fault_ = "length " + std::to_string(length) + "; allowed: 2 to " + std::to_string(1 + kMostPdu_bytes);
    return std::nullopt;
  }
  if (rest.size() < 6 + length) return std::nullopt;
  Frame frame{static_cast<std::uint16_t>(get16(rest, 0)), byte_at(rest, 6),
              std::string(rest.substr(kHeader_bytes, length - 1))};
  begin_ += 6 + length;
  return frame;
}

std::string exception_reply(std::uint8_t function, Exception exception) {
  return {static_cast<char>(function | 0x80U), static_cast<char>(exception)};
}

std::string reply_to(std::string_view pdu, Memory& memory) {
  if (pdu.empty()) return exception_reply(0, Exception::illegal_function);
  try {
    return serve(pdu, memory);
  } catch (const Exception exception) {
    return exception_reply(byte_at(pdu, 0), exception);
  }
}

bool is_write(std::string_view pdu) {
  if (pdu.empty()) return false;
  switch (static_cast<Function>(byte_at(pdu, 0))) {
    case Function::write_coil:
    case Function::write_register:
    case Function::write_coils:
    case Function::write_registers:
    case Function::mask_write_register:
    case Function::read_write_registers:
      return true;
    default:
      return false;
  }
}

std::string read_request(Function function, std::size_t first, std::size_t count) {
  std::string pdu = head(function);
  put16(pdu, first);
  put16(pdu, count);
  return pdu;
}

std::string write_coils_request(std::size_t first, const std::vector<bool>& bits) {
  std::string pdu = read_request(Function::write_coils, first, bits.size());
  pdu += static_cast<char>((bits.size() + 7) / 8);
  put_bits(pdu, bits);
  return pdu;
}

std::string write_registers_request(std::size_t first, const std::vector<std::uint16_t>& values) {
  std::string pdu = read_request(Function::write_registers, first, values.size());
  pdu += static_cast<char>(2 * values.size());
  for (const std::uint16_t value : values) put16(pdu, value);
  return pdu;
}

std::string read_write_request(std::size_t read_first, std::size_t read_count, std::size_t write_first,
                               const std::vector<std::uint16_t>& values) {
  std::string pdu = read_request(Function::read_write_registers, read_first, read_count);
  put16(pdu, write_first);
  put16(pdu, values.size());
  pdu += static_cast<char>(2 * values.size());
  for (const std::uint16_t value : values) put16(pdu, value);
  return pdu;
}

Reply parse_reply(std::string_view request, std::string_view reply) {
  Reply result;
  const auto fail = [&](const std::string& fault) {
    result.fault = fault;
    return result;
  };
  if (reply.empty()) return fail("an empty reply");
  const unsigned asked = byte_at(request, 0), function = byte_at(reply, 0);
  if (function == (asked | 0x80U)) {
    if (reply.size() != 2 || reply[1] == 0) return fail("an exception reply without its code");
    result.exception = byte_at(reply, 1);
    return result;
  }
  if (function != asked)
    return fail("function " + std::to_string(function) + " in the reply to function " +
                std::to_string(asked));
  const std::size_t count = get16(request, 3);
  switch (static_cast<Function>(asked)) {
    case Function::read_coils:
    case Function::read_discrete_inputs:
      if (reply.size() != 2 + (count + 7) / 8 || byte_at(reply, 1) != (count + 7) / 8)
        return fail("another number of bytes than for " + std::to_string(count) + " bits");
      result.bits = get_bits(reply, 2, count);
      return result;
    case Function::read_holding_registers:
    case Function::read_input_registers:
    case Function::read_write_registers:
      if (reply.size() != 2 + 2 * count || byte_at(reply, 1) != 2 * count)
        return fail("another number of bytes than for " + std::to_string(count) + " registers");
      result.registers = get_registers(reply, 2, count);
      return result;
    default:
      if (reply != request.substr(0, 5)) return fail("another address or count than in the request");
      return result;
  }
}

std::string exception_text(std::uint8_t exception) {
  const char* words = "exception";
  switch (static_cast<Exception>(exception)) {
    case Exception::illegal_function:
      words = "illegal function";
      break;
    case Exception::illegal_address:
      words = "illegal address";
      break;
    case Exception::illegal_value:
      words = "illegal value";
      break;
    case Exception::device_failure:
      words = "device failure";
      break;
    case Exception::no_such_unit:
      words = "no such unit";
      break;
    case Exception::none:
      break;
  }
  return std::string(words) + " (" + std::to_string(exception) + ")";
}

std::vector<std::uint16_t> to_registers(double number, NumberType type, WordOrder order, bool& beyond) {
  if (std::isnan(number)) {
    number = 0.0;
    beyond = true;
  }
  switch (type) {
    case NumberType::int16:
      return whole_registers<std::int16_t>(number, order, beyond);
    case NumberType::uint16:
      return whole_registers<std::uint16_t>(number, order, beyond);
    case NumberType::int32:
      return whole_registers<std::int32_t>(number, order, beyond);
    case NumberType::uint32:
      return whole_registers<std::uint32_t>(number, order, beyond);
    case NumberType::float32:
      break;
  }
  constexpr double kMost = std::numeric_limits<float>::max();
  if (std::abs(number) > kMost) {
    number = std::copysign(kMost, number);
    beyond = true;
  }
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(number));
  const auto high = static_cast<std::uint16_t>(bits >> 16U), low = static_cast<std::uint16_t>(bits);
  return order == WordOrder::high_first ? std::vector<std::uint16_t>{high, low}
                                        : std::vector<std::uint16_t>{low, high};
}

double from_registers(const std::uint16_t* registers, NumberType type, WordOrder order) {
  if (type == NumberType::int16) return static_cast<std::int16_t>(registers[0]);
  if (type == NumberType::uint16) return registers[0];
  const auto high = static_cast<std::uint32_t>(registers[order == WordOrder::high_first ? 0 : 1]);
  const auto low = static_cast<std::uint32_t>(registers[order == WordOrder::high_first ? 1 : 0]);
  const std::uint32_t bits = high << 16U | low;
  if (type == NumberType::int32) return static_cast<std::int32_t>(bits);
  if (type == NumberType::uint32) return bits;
  return std::bit_cast<float>(bits);
}

}  // namespace takt::gateway::modbus
