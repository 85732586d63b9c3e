#pragma once
// Events of takt_events.idl. An event of the step loop is a record of fixed size: the loop makes no text.
// describe() makes the sentence, in the thread that sends the event.
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/simulation/model/cell_description.h"
#include "takt_event_table.h"

namespace takt {

class Simulation;

struct EventRecord {
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;
  std::uint64_t sender = 0;  ///< of the command that caused it; 0: none
  events::OfLoop event;
};

const EventInfo& info_of(const EventRecord& record);

/// Reports the events of the newest step: changed connections, ends of motions, collisions, weak grips,
/// alternating forces.
void report_step(const Simulation& simulation, const std::function<void(const EventRecord&)>& report);

/// The reason why the simulation cannot continue.
EventRecord fault_record(const Simulation& simulation);

struct EventText {
  std::string subject;
  std::string message;
};
EventText describe(const EventRecord& record, const CellDescription& cell);

namespace detail {

/// A field of an event, for its sentence.
struct FieldText {
  std::string_view name;
  std::string text;
  bool given = true;  ///< not 0, not empty, index not negative
};
FieldText text_of_field(const FieldInfo& field, double value, const CellDescription& cell);
FieldText text_of_field(const FieldInfo& field, std::int32_t value, const CellDescription& cell);
FieldText text_of_field(const FieldInfo& field, std::uint64_t value, const CellDescription& cell);
FieldText text_of_field(const FieldInfo& field, bool value, const CellDescription& cell);
FieldText text_of_field(const FieldInfo& field, std::string_view value, const CellDescription& cell);
FieldText text_of_field(const FieldInfo& field, const takt_msgs::msg::Vector3& value,
                        const CellDescription& cell);
template <TabledEnumeration Type>
FieldText text_of_field(const FieldInfo& field, Type value, const CellDescription&) {
  return {field.name, std::string(to_string(value))};
}
template <std::size_t capacity>
FieldText text_of_field(const FieldInfo& field, const FixedString<capacity>& value,
                        const CellDescription& cell) {
  return text_of_field(field, value.view(), cell);
}

EventText render(const EventInfo& info, std::span<const FieldText> fields, const CellDescription& cell);

}  // namespace detail

template <EventType Type>
EventText describe(const Type& event, const CellDescription& cell) {
  std::vector<detail::FieldText> fields;
  for_each_field(event, [&](const FieldInfo& field, const auto& value) {
    fields.push_back(detail::text_of_field(field, value, cell));
  });
  fields.push_back({"scenario", cell.scenario});
  return detail::render(event_info<Type>(), fields, cell);
}

/// As words of a sentence: "without a scenario".
std::string_view words_of(SimulationState state);

}  // namespace takt
