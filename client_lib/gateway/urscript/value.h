#pragma once
// Values of URScript. A value is immutable: what changes an element makes a new list, and copies share their elements.
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace takt::urscript {

/// Text that is no program of URScript, or what a program does that it must not. `what()` has the form of the controller's
/// messages, e.g. compile_error_name_not_found:foo:
class ScriptError : public std::runtime_error {
 public:
  ScriptError(int line, int column, const std::string& text)
      : std::runtime_error(text), line_(line), column_(column) {}
  int line() const { return line_; }
  int column() const { return column_; }

 private:
  int line_, column_;
};

/// A value that does not fit; the interpreter adds line and column of the statement.
class ValueError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Value;

/// Of a struct's members. All values that come from one place of a program share them.
using MemberNames = std::shared_ptr<const std::vector<std::string>>;

/// The elements of a list, a pose or a struct.
struct Items {
  enum class Kind : std::uint8_t { list, pose, record };
  Kind kind = Kind::list;
  std::vector<Value> values;
  MemberNames names{};       ///< of a struct
  std::size_t capacity = 0;  ///< of a list
  std::size_t weight = 1;    ///< cells of all that it contains
  int depth = 1;
};

class Value {
 public:
  /// A value of more cells is refused: a number is one, a text one for 16 bytes.
  static constexpr std::size_t kMostWeight = 2048;
  static constexpr int kMostDepth = 8;
  static constexpr std::size_t kMostTextBytes = 16384;

  Value() = default;
  Value(bool flag) : data_(flag) {}                      // NOLINT(google-explicit-constructor)
  Value(int number) : data_(std::int32_t{number}) {}     // NOLINT(google-explicit-constructor)
  Value(double number) : data_(number) {}                // NOLINT(google-explicit-constructor)
  Value(std::string text);                               // NOLINT(google-explicit-constructor)
  Value(const char* text) : Value(std::string(text)) {}  // NOLINT(google-explicit-constructor)
  /// A list of numbers.
  Value(const std::vector<double>& numbers);  // NOLINT(google-explicit-constructor)
  /// Elements of one type. Throws ValueError for others, and for too many.
  static Value list(std::vector<Value> values, std::size_t capacity = 0);
  /// Throws ValueError unless there are six numbers.
  static Value pose(std::vector<Value> values);
  static Value pose(const std::vector<double>& numbers);
  static Value record(std::vector<Value> values, MemberNames names);
  /// An integer; a real number where it has more than 32 bits.
  static Value whole(double number);

  bool is_none() const { return std::holds_alternative<std::monostate>(data_); }
  bool is_integer() const { return std::holds_alternative<std::int32_t>(data_); }
  bool is_number() const { return is_integer() || std::holds_alternative<double>(data_); }
  const bool* flag() const { return std::get_if<bool>(&data_); }
  /// Of a number.
  double number() const {
    const auto* integer = std::get_if<std::int32_t>(&data_);
    return integer != nullptr ? static_cast<double>(*integer) : std::get<double>(data_);
  }
  const std::string* text() const;
  const Items* items() const;
  const Items* list() const { return of(Items::Kind::list); }
  const Items* pose() const { return of(Items::Kind::pose); }
  const Items* record() const { return of(Items::Kind::record); }
  std::size_t weight() const;
  /// e.g. "a number", for messages.
  const char* type_name() const;
  /// Values of both types may stand in one list.
  bool same_type(const Value& other) const { return type() == other.type(); }
  bool operator==(const Value& other) const;

 private:
  const Items* of(Items::Kind kind) const {
    const Items* found = items();
    return found != nullptr && found->kind == kind ? found : nullptr;
  }
  static Value make(Items items);
  /// One number for each type; integers and reals have one type.
  std::size_t type() const {
    const Items* inner = items();
    return inner != nullptr ? 16 + static_cast<std::size_t>(inner->kind) : is_number() ? 8 : data_.index();
  }

  std::variant<std::monostate, bool, std::int32_t, double, std::shared_ptr<const std::string>,
               std::shared_ptr<const Items>>
      data_;
};

/// As std::string_view::find; its time does not grow with the product of both lengths.
std::size_t position_of(std::string_view text, std::string_view target, std::size_t from = 0);

/// The numbers of a list or pose; nothing else. Throws ValueError.
std::vector<double> numbers_of(const Value& value);

/// As to_str() and textmsg() write it: 2.12346, [True, False], p[1, 2, 3, 4, 5, 6].
std::string text_of(const Value& value);

}  // namespace takt::urscript
