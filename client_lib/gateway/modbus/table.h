#pragma once
// The memory of a Modbus server: elements of a mapping at their addresses in four areas. An area reaches to the end of
// its last element; addresses between elements are plain memory, which a PLC may write and read back, so that it can
// transfer whole blocks.
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "client_lib/gateway/modbus/messages.h"

namespace takt::gateway::modbus {

enum class Area : std::uint8_t { coils, discrete_inputs, holding_registers, input_registers };
inline constexpr std::size_t kAreas = 4;
constexpr bool is_bits(Area area) {
  return area == Area::coils || area == Area::discrete_inputs;
}

/// A value at an address.
struct Element {
  Area area = Area::coils;
  std::size_t address = 0;
  NumberType type = NumberType::int16;  ///< in registers
  WordOrder order = WordOrder::high_first;
  /// Of a value that the other side writes: values outside are refused with the exception illegal value.
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();

  std::size_t count() const { return is_bits(area) ? 1 : registers_of(type); }  ///< of its addresses
};

class Table final : public Memory {
 public:
  /// The elements do not overlap.
  explicit Table(std::vector<Element> elements);

  std::span<const Element> elements() const { return elements_; }
  double number(std::size_t element) const;
  /// Sets an element without a mark as written. False if the number is beyond the range of its type.
  bool set(std::size_t element, double number);
  /// Elements that write_coils() and write_registers() have written since the last call, each once, in the order of
  /// elements.
  std::vector<std::size_t> take_written();

  bool read_bits(bool coils, std::size_t first, std::size_t count, std::vector<bool>& bits) override;
  bool read_registers(bool holding, std::size_t first, std::size_t count,
                      std::vector<std::uint16_t>& values) override;
  /// Illegal address: beyond the area, or a part of a 32-bit value. Illegal value: outside the limits of an element, or not
  /// a finite number.
  Exception write_coils(std::size_t first, const std::vector<bool>& bits) override;
  Exception write_registers(std::size_t first, const std::vector<std::uint16_t>& values) override;

 private:
  std::vector<std::uint16_t>& memory(Area area) { return memory_[static_cast<std::size_t>(area)]; }
  const std::vector<std::uint16_t>& memory(Area area) const {
    return memory_[static_cast<std::size_t>(area)];
  }
  Exception write(Area area, std::size_t first, std::span<const std::uint16_t> values);

  std::vector<Element> elements_;
  std::array<std::vector<std::uint16_t>, kAreas> memory_;  ///< a bit is a register of 0 or 1
  std::vector<char> written_;
};

}  // namespace takt::gateway::modbus
