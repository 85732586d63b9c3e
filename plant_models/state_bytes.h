#pragma once
// State of the simulation as bytes and back: numbers in sequence in the machine's own representation
// (little-endian on all supported machines), in sections with a name and a length, so that the error for
// unsuitable bytes names the place.
//
// Every read is checked: against the remaining length, for valid numbers, and against the caller's bounds. A
// violation is a StateError, so a reader builds its state aside and adopts it after the last successful read.
#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "plant_models/spatial.h"

namespace takt {

/// Bytes are not the state they should be: a sentence with section and quantity.
class StateError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Appends to a vector, which allocates only to grow.
class StateWriter {
 public:
  explicit StateWriter(std::vector<std::byte>& out) : out_(out) {}

  template <typename T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void put(T value) { append(&value, sizeof(value)); }
  void put(std::span<const double> values) { append(values.data(), values.size_bytes()); }
  void put(const Vec3& v) { append(v.data(), 3 * sizeof(double)); }
  void put(const Mat3& m) { append(m.data(), 9 * sizeof(double)); }
  void put(const Pose& X) { put(X.R), put(X.p); }
  void put_size(std::size_t n) { put(static_cast<std::uint64_t>(n)); }
  void put(std::string_view text) {
    put_size(text.size());
    append(text.data(), text.size());
  }

  /// `name`: four letters. `body` writes the content.
  template <typename Body>
  void section(const char (&name)[5], const Body& body) {
    append(name, 4);
    const std::size_t at = out_.size();
    put_size(0);
    body();
    const std::uint64_t length = out_.size() - at - sizeof(std::uint64_t);
    std::memcpy(&out_[at], &length, sizeof(length));
  }

 private:
  void append(const void* from, std::size_t size) {
    const auto* bytes = static_cast<const std::byte*>(from);
    out_.insert(out_.end(), bytes, bytes + size);
  }
  std::vector<std::byte>& out_;
};

class StateReader {
 public:
  /// Upper limit of all values of a cell (Simulation refuses larger ones).
  static constexpr double kLargest = 1e30;

  explicit StateReader(std::span<const std::byte> bytes, std::string where = "the state")
      : left_(bytes), where_(std::move(where)) {}

  [[noreturn]] void fail(const std::string& why) const { throw StateError(where_ + ": " + why); }

  template <typename T>
  requires std::is_arithmetic_v<T> &&(!std::same_as<T, bool>)T get() {
    T value;
    take(&value, sizeof(value));
    return value;
  }
  bool flag(const char* what) { return integer(0, 1, what) != 0; }
  /// Written with put() of an int, an enumeration of one byte or a bool.
  template <typename T = std::uint8_t>
  int integer(int lower, int upper, const char* what) {
    const auto value = static_cast<std::int64_t>(get<T>());
    if (value < lower || value > upper)
      fail(std::string(what) + " is " + std::to_string(value) + "; allowed is " + std::to_string(lower) +
           " to " + std::to_string(upper));
    return static_cast<int>(value);
  }
  /// An index, or -1.
  int index(std::size_t count, const char* what) {
    return integer<int>(-1, static_cast<int>(count) - 1, what);
  }
  double number(double lower, double upper, const char* what) {
    const double value = get<double>();
    if (!(value >= lower && value <= upper))
      fail(std::string(what) + " is " + std::to_string(value) + "; allowed is " + std::to_string(lower) +
           " to " + std::to_string(upper));
    return value;
  }
  double number(const char* what) { return number(-kLargest, kLargest, what); }
  void numbers(std::span<double> values, const char* what, double largest = kLargest) {
    for (double& value : values) value = number(-largest, largest, what);
  }
  Vec3 vector(const char* what) {
    Vec3 v;
    numbers({v.data(), 3}, what);
    return v;
  }
  Mat3 rotation(const char* what) {
    Mat3 R;
    numbers({R.data(), 9}, what);
    if (!((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-6 && R.determinant() > 0.0))
      fail(std::string(what) + " is no rotation");
    return R;
  }
  Pose pose(const char* what) {
    Pose X;
    X.R = rotation(what);
    X.p = vector(what);
    return X;
  }
  /// Number of following elements, each of at least the given number of bytes.
  std::size_t size(std::size_t most, const char* what) {
    const auto n = get<std::uint64_t>();
    if (n > most)
      fail("the number of " + std::string(what) + " is " + std::to_string(n) + "; at most " +
           std::to_string(most) + " are possible");
    return static_cast<std::size_t>(n);
  }
  void expect_size(std::size_t n, const char* what) {
    const auto found = get<std::uint64_t>();
    if (found != n)
      fail("the number of " + std::string(what) + " is " + std::to_string(found) + "; the cell has " +
           std::to_string(n));
  }
  std::string text(std::size_t most, const char* what) {
    std::string result(size(std::min(most, left_.size()), what), '\0');
    take(result.data(), result.size());
    return result;
  }

  /// `body(StateReader&)` has to read the whole content.
  template <typename Body>
  void section(const char (&name)[5], const Body& body) {
    char found[4];
    take(found, 4);
    if (std::memcmp(found, name, 4) != 0)
      fail("section '" + std::string(name) + "' was expected, but something else follows");
    const std::size_t length = size(left_.size(), (std::string("bytes of section '") + name + "'").c_str());
    StateReader content(left_.first(length), where_ + ", section '" + name + "'");
    left_ = left_.subspan(length);
    body(content);
    content.expect_end();
  }
  /// All remaining bytes.
  std::span<const std::byte> rest() { return std::exchange(left_, {}); }
  void expect_end() const {
    if (!left_.empty()) fail(std::to_string(left_.size()) + " bytes are left over");
  }

 private:
  void take(void* to, std::size_t size) {
    if (size > left_.size()) fail("the bytes end too early");
    if (size > 0) std::memcpy(to, left_.data(), size);
    left_ = left_.subspan(size);
  }
  std::span<const std::byte> left_;
  std::string where_;
};

}  // namespace takt
