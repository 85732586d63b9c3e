#pragma once
// Enumerations as data: each `enum` of idl/*.idl becomes an `enum class` in namespace takt with a table of
// its names (takt_enumerations.h). A value that arrived from a peer may be a number without a name.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace takt {

struct EnumeratorInfo {
  std::string_view name;
  std::int64_t value = 0;
  std::string_view doc;  ///< one line, or empty
};

struct EnumerationInfo {
  std::string_view name, doc;
  std::span<const EnumeratorInfo> enumerators;  ///< in the order of the IDL

  /// nullptr where no enumerator has this value.
  constexpr const EnumeratorInfo* find(std::int64_t value) const {
    const auto found = std::find_if(enumerators.begin(), enumerators.end(),
                                    [&](const EnumeratorInfo& one) { return one.value == value; });
    return found == enumerators.end() ? nullptr : &*found;
  }
};

/// Generated for each enumeration of the IDL; empty for any other type.
template <typename Enumeration>
inline constexpr EnumerationInfo kEnumeration{};

template <typename Enumeration>
concept TabledEnumeration = std::is_enum_v<Enumeration> && !kEnumeration<Enumeration>.enumerators.empty();

template <TabledEnumeration Enumeration>
constexpr bool is_known(Enumeration value) {
  return kEnumeration<Enumeration>.find(static_cast<std::int64_t>(value)) != nullptr;
}

/// The name as in the IDL, or "unknown".
template <TabledEnumeration Enumeration>
constexpr std::string_view to_string(Enumeration value) {
  const EnumeratorInfo* found = kEnumeration<Enumeration>.find(static_cast<std::int64_t>(value));
  return found == nullptr ? std::string_view("unknown") : found->name;
}

/// The value of a name; std::nullopt for an unknown name.
template <TabledEnumeration Enumeration>
constexpr std::optional<Enumeration> enumerator_of(std::string_view name) {
  for (const EnumeratorInfo& one : kEnumeration<Enumeration>.enumerators)
    if (one.name == name) return static_cast<Enumeration>(one.value);
  return std::nullopt;
}

/// All names, for error messages: "a, b, c".
template <TabledEnumeration Enumeration>
std::string enumerator_names() {
  std::string names;
  for (const EnumeratorInfo& one : kEnumeration<Enumeration>.enumerators)
    names.append(names.empty() ? "" : ", ").append(one.name);
  return names;
}

}  // namespace takt
