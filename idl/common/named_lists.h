#pragma once
// Lists of a description (components, robots, their joints) by name, and what the IDL says by them: a list of one element
// for each, @order(joints), and the index of one of them, @index(components).
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "idl/common/message.h"

namespace takt {

template <typename Type>
inline constexpr bool kIsList = false;
template <typename Element>
inline constexpr bool kIsList<std::vector<Element>> = true;
template <typename Type>
inline constexpr bool kIsMessageList = false;
template <Message Element>
inline constexpr bool kIsMessageList<std::vector<Element>> = true;

/// A described thing, and the lists that it has again.
struct Named {
  std::string name;
  std::map<std::string, std::vector<Named>, std::less<>> lists;

  /// nullptr where there is no such list.
  const std::vector<Named>* find(std::string_view list) const {
    const auto found = lists.find(list);
    return found == lists.end() ? nullptr : &found->second;
  }
  /// Name of an element; nullptr where there is no such list or element.
  const std::string* name_of(std::string_view list, std::int64_t index) const {
    const auto* elements = find(list);
    const bool has = elements != nullptr && index >= 0 && static_cast<std::size_t>(index) < elements->size();
    return has ? &(*elements)[static_cast<std::size_t>(index)].name : nullptr;
  }
};

/// Of a CellDescription: the whole cell.
template <Message Type>
Named named_lists(const Type& description) {
  Named made;
  for_each_field(description, [&](const FieldInfo& field, const auto& value) {
    using Member = std::decay_t<decltype(value)>;
    if constexpr (std::is_same_v<Member, std::string>) {
      if (field.name == "name") made.name = value;
    } else if constexpr (kIsMessageList<Member>) {
      auto& list = made.lists[std::string(field.name)];
      for (const auto& element : value) list.push_back(named_lists(element));
    }
  });
  return made;
}

/// The described elements that a list has one element for each of, by its @order; nullptr where the IDL names none.
inline const std::vector<Named>* order_of(std::string_view order, const Named& of) {
  return order.empty() ? nullptr : of.find(order);
}
inline const std::vector<Named>* order_of(const FieldInfo& list, const Named& of) {
  return order_of(annotation(list.annotations, "order"), of);
}

/// What the IDL says of a field by lists of a description.
struct ListAnnotations {
  std::string_view index, order;  ///< names of lists
  bool may_be_none, may_be_empty;
};
template <Message Type>
constexpr auto list_annotations() {
  constexpr const MessageInfo& info = message_info<Type>();
  std::array<ListAnnotations, info.fields.size()> made{};
  for (std::size_t i = 0; i < made.size(); ++i) {
    const auto all = info.fields[i].annotations;
    made[i] = {annotation(all, "index"), annotation(all, "order"), annotation(all, "default") == "-1",
               has_annotation(all, "may_be_empty")};
  }
  return made;
}

/// By field of a message: the list whose elements its @index counts; nullptr for a field without one.
template <Message Type>
auto index_lists(const Named& cell) {
  static constexpr auto kAnnotations = list_annotations<Type>();
  std::array<const std::vector<Named>*, kAnnotations.size()> found{};
  for (std::size_t i = 0; i < found.size(); ++i)
    if (!kAnnotations[i].index.empty()) found[i] = cell.find(kAnnotations[i].index);
  return found;
}

template <Message Type>
bool fits(const Type& message, const Named& of, const Named& cell);

/// The same, with index_lists(): they are found once for all elements of a list.
template <Message Type, typename Lists>
bool fits(const Type& message, const Named& of, const Named& cell, [[maybe_unused]] const Lists& indexed) {
  [[maybe_unused]] static constexpr auto kAnnotations = list_annotations<Type>();
  bool good = true;
  std::size_t number = 0;
  for_each_field(message, [&](const FieldInfo&, const auto& value) {
    using Member = std::decay_t<decltype(value)>;
    [[maybe_unused]] const auto* const list = indexed[number];
    [[maybe_unused]] const ListAnnotations& field = kAnnotations[number++];
    if (!good) return;
    if constexpr (std::is_integral_v<Member>) {
      if (!field.index.empty())
        good = (field.may_be_none && value == static_cast<Member>(-1)) ||
               (list != nullptr && static_cast<std::uint64_t>(value) < list->size());
    } else if constexpr (kIsList<Member>) {
      const auto* order = order_of(field.order, of);
      if (!field.order.empty() && !(value.empty() && field.may_be_empty))
        good = value.size() == (order == nullptr ? 0 : order->size());
      if constexpr (kIsMessageList<Member>) {
        const auto of_elements = index_lists<typename Member::value_type>(cell);
        for (std::size_t i = 0; i < value.size() && good; ++i)
          good = fits(value[i], order == nullptr ? of : (*order)[i], cell, of_elements);
      }
    } else if constexpr (Message<Member>) {
      if constexpr (!has_annotation(message_info<Member>().annotations, "quantity"))
        good = fits(value, of, cell);
    }
  });
  return good;
}

/// Whether a message fits a description: each list has as many elements as its @order says, each @index is that of an
/// element, or its default. `of`: what the message is of; indices are those of `cell`.
template <Message Type>
bool fits(const Type& message, const Named& of, const Named& cell) {
  return fits(message, of, cell, index_lists<Type>(cell));
}

}  // namespace takt
