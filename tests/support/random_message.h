#pragma once
// Any message of idl/*.idl with random values within the bounds of its fields. Same seed, same message.
#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include "idl/common/message.h"

namespace takt::test {

class RandomMessage {
 public:
  explicit RandomMessage(unsigned seed) : dice_(seed) {}

  template <Message Type>
  Type make() {
    Type message;
    set(FieldInfo{}, message);
    return message;
  }

 private:
  std::size_t length(std::uint32_t bound) {
    const std::size_t most = dice_() % 3 == 0 ? 0 : 7;
    return dice_() % (1 + (bound == 0 ? most : std::min<std::size_t>(most, bound)));
  }
  void set(const FieldInfo&, bool& value) { value = dice_() % 2 == 0; }
  void set(const FieldInfo&, float& value) { value = static_cast<float>(dice_()) / 7.0F; }
  void set(const FieldInfo&, double& value) { value = static_cast<double>(dice_()) / 7.0 - 1e8; }
  void set(const FieldInfo& field, std::string& text) {
    text.assign(length(field.string_bound), ' ');
    for (char& c : text) c = static_cast<char>('a' + dice_() % 26);
  }
  template <typename Number>
  requires std::is_integral_v<Number> || std::is_enum_v<Number>
  void set(const FieldInfo&, Number& value) {
    value = static_cast<Number>(static_cast<std::uint64_t>(dice_()) << 32U | dice_());
  }
  template <Message Type>
  void set(const FieldInfo&, Type& message) {
    for_each_field(message, [&](const FieldInfo& field, auto& value) { set(field, value); });
  }
  template <typename Value>
  void set(const FieldInfo& field, std::vector<Value>& values) {
    values.resize(length(field.bound));
    for (Value& value : values) set(field, value);
  }

  std::mt19937 dice_;
};

}  // namespace takt::test
