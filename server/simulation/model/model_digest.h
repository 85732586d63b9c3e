#pragma once
// A hash over values and over structs with all their members (members.h): a parameter that is added to a
// struct enters it without further code. A type with members that do not count has a function
// `digest(ModelDigest&, const T&)` beside it or in model_hash.cpp, which lists the omitted members.
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "plant_models/spatial.h"
#include "server/simulation/model/members.h"
#include "server/simulation/model/state_hash.h"

namespace takt {

class ModelDigest {
 public:
  template <class T>
  ModelDigest& operator<<(const T& value) {
    if constexpr (std::is_integral_v<T> || std::is_enum_v<T>)
      hash_.add(static_cast<std::uint64_t>(value));
    else if constexpr (std::is_floating_point_v<T>)
      hash_.add(static_cast<double>(value));
    else
      add(value);
    return *this;
  }
  std::uint64_t value() const { return hash_.value(); }
  /// All members of a struct, whether or not it has a digest() of its own.
  template <class T>
  void members(const T& s) {
    visit_members(s, [this](const auto&... member) { (*this << ... << member); });
  }

 private:
  void add(const std::string& text) {
    *this << text.size();
    for (const char letter : text) *this << letter;
  }
  template <int kRows, int kColumns, int kOptions>
  void add(const Eigen::Matrix<double, kRows, kColumns, kOptions>& m) {
    hash_.add(std::span<const double>(m.data(), static_cast<std::size_t>(m.size())));
  }
  template <class T, std::size_t kSize>
  void add(const std::array<T, kSize>& values) {
    for (const T& value : values) *this << value;
  }
  template <class T>
  void add(const std::vector<T>& values) {
    *this << values.size();
    for (const T& value : values) *this << value;
  }
  template <class T>
  void add(const std::optional<T>& value) {
    *this << value.has_value();
    if (value) *this << *value;
  }
  template <class... T>
  void add(const std::variant<T...>& value) {
    *this << value.index();
    std::visit([this](const auto& held) { *this << held; }, value);
  }
  template <class T>
  void add(const T& s) {
    if constexpr (requires { digest(*this, s); })
      digest(*this, s);
    else
      members(s);
  }

  StateHash hash_;
};

}  // namespace takt
