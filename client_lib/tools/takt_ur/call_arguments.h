#pragma once
// The arguments of a URScript call, with messages that say what is allowed.
#include <cmath>
#include <optional>

#include "client_lib/gateway/ur/path.h"
#include "client_lib/gateway/urscript/interpreter.h"

namespace takt::ur {

class CallArguments {
 public:
  CallArguments(const urscript::Function& function, std::span<const urscript::Value> values)
      : function_(function), values_(values) {}

  std::string_view function() const { return function_.name; }
  const urscript::Value& operator[](std::size_t i) const { return values_[i]; }
  bool given(std::size_t i) const { return !values_[i].is_none(); }

  [[noreturn]] void fail(const std::string& allowed) const {
    throw urscript::ValueError(std::string(function_.name) + ": allowed: " + allowed);
  }
  [[noreturn]] void fail() const { fail("(" + std::string(function_.parameters) + ")"); }

  double number(std::size_t i) const {
    if (!values_[i].is_number() || !(std::abs(values_[i].number()) <= kLargest)) fail();
    return values_[i].number();
  }
  double number(std::size_t i, double otherwise) const { return given(i) ? number(i) : otherwise; }
  /// A whole number from 0 to `most`.
  int whole(std::size_t i, int most) const {
    const double value = number(i);
    if (value != std::floor(value) || value < 0.0 || value > most)
      fail("(" + std::string(function_.parameters) + "), the first one 0 to " + std::to_string(most));
    return static_cast<int>(value);
  }
  bool flag(std::size_t i) const {
    if (values_[i].flag() == nullptr)
      fail("(" + std::string(function_.parameters) + "), the last one True or False");
    return *values_[i].flag();
  }
  bool flag(std::size_t i, bool otherwise) const { return given(i) ? flag(i) : otherwise; }
  const std::string& text(std::size_t i) const {
    if (values_[i].text() == nullptr) fail();
    return *values_[i].text();
  }
  std::string text(std::size_t i, const char* otherwise) const { return given(i) ? text(i) : otherwise; }
  std::vector<double> numbers(std::size_t i, std::size_t count) const {
    std::vector<double> found;
    if (values_[i].items() != nullptr) found = urscript::numbers_of(values_[i]);
    if (found.size() != count) fail();
    for (const double one : found)
      if (!(std::abs(one) <= kLargest)) fail();
    return found;
  }
  Vector6 six(std::size_t i) const {
    const std::vector<double> found = numbers(i, 6);
    Vector6 result;
    std::copy(found.begin(), found.end(), result.begin());
    return result;
  }
  Vector6 joints(std::size_t i) const {
    if (values_[i].list() == nullptr) fail("[q0, .., q5]");
    return six(i);
  }
  Vector6 pose(std::size_t i) const {
    if (values_[i].pose() == nullptr) fail("p[x, y, z, rx, ry, rz]");
    return six(i);
  }

 private:
  /// No number of a robot is larger; squares and whole numbers of it exist.
  static constexpr double kLargest = 2147483648.0;

  const urscript::Function& function_;
  std::span<const urscript::Value> values_;
};

inline urscript::Value list_value(const Vector6& values) {
  return std::vector<double>(values.begin(), values.end());
}
inline urscript::Value pose_value(const Vector6& values) {
  return urscript::Value::pose(std::vector<double>(values.begin(), values.end()));
}

}  // namespace takt::ur
