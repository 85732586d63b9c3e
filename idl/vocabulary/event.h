#pragma once
// Events as data: each @event struct of idl/takt_events.idl is a row (takt_event_table.h) with its code,
// severity, the sentence with the names of its fields, and the remedy.
#include <string_view>

#include "idl/common/message.h"
#include "takt_enumerations.h"

namespace takt {

struct EventInfo {
  std::string_view code;
  Severity severity;
  std::string_view subject;  ///< "{part}"; empty: the cell
  std::string_view says;     ///< "{part} was put to {position}."
  std::string_view remedy;   ///< a sentence, or empty
  const MessageInfo* fields;
};

/// Generated for each event: `info`.
template <typename Type>
struct EventTable;

template <typename Type>
concept EventType = requires {
  EventTable<Type>::info;
};

template <EventType Type>
constexpr const EventInfo& event_info() {
  return EventTable<Type>::info;
}

}  // namespace takt
