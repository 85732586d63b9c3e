#pragma once
// Names and types of RTDE variables (RTDE guide, docs.universal-robots.com), and values of them.
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/gateway/rtde/big_endian.h"

namespace takt::rtde {

enum class Type : std::uint8_t {
  boolean,
  uint8,
  uint32,
  uint64,
  int32,
  real,
  vector3,
  vector6,
  vector6_int32,
  vector6_uint32
};

/// As the protocol writes it, e.g. VECTOR6D.
std::string_view type_name(Type type);
std::optional<Type> type_of_name(std::string_view name);
/// Its numbers are Value::real.
bool is_real(Type type);
/// Bytes on the wire.
std::size_t size_of(Type type);

struct Variable {
  std::string name;
  Type type = Type::real;
};

/// A value of any type: numbers of real and vector types, whole numbers of all others.
struct Value {
  std::array<double, 6> real{};
  std::array<std::int64_t, 6> whole{};
};

void append(std::string& bytes, Type type, const Value& value);
Value read(Reader& reader, Type type);

/// All variables of one direction, in a fixed order, and their values.
class Table {
 public:
  explicit Table(std::vector<Variable> variables);
  std::span<const Variable> variables() const { return variables_; }
  /// Index by name.
  std::optional<std::size_t> find(std::string_view name) const;
  Value& value(std::size_t index) { return values_[index]; }
  const Value& value(std::size_t index) const { return values_[index]; }
  /// By name, which must exist (otherwise std::out_of_range: a mistake of the program).
  Value& operator[](std::string_view name);
  const Value& operator[](std::string_view name) const;
  void set(std::string_view name, double number) { (*this)[name].real[0] = number; }
  void set_whole(std::string_view name, std::int64_t number) { (*this)[name].whole[0] = number; }
  void set_vector(std::string_view name, std::span<const double> numbers);

 private:
  std::vector<Variable> variables_;
  std::vector<Value> values_;
  std::vector<std::size_t> by_name_;  ///< indices, ascending by name
};

/// What a controller sends: the outputs of the guide.
Table output_table();
/// What it receives.
Table input_table();

}  // namespace takt::rtde
