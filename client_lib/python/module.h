#pragma once
// Pieces of the Python module.
#include "client_lib/python/messages.h"

namespace takt::python {

using InfoView = SampleView<CellInfo, takt_msgs::msg::CellDescription>;
using StateView = SampleView<State, takt_msgs::msg::CellState>;
using StatusView = SampleView<Status, takt_msgs::msg::Status>;
using PowerView = SampleView<Power, takt_msgs::msg::Power>;
using ContactsView = SampleView<Contacts, takt_msgs::msg::Contacts>;
using EventView = SampleView<Event, takt_msgs::msg::Event>;

inline InfoView view(const std::shared_ptr<const CellInfo>& info) {
  return InfoView(info, info);
}
inline StateView view(const State& state) {
  return StateView(std::make_shared<const State>(state), state.cell);
}
inline StatusView view(const Status& status) {
  return StatusView(std::make_shared<const Status>(status));
}
inline PowerView view(const Power& power) {
  return PowerView(std::make_shared<const Power>(power));
}
inline ContactsView view(const Contacts& contacts) {
  return ContactsView(std::make_shared<const Contacts>(contacts), contacts.cell);
}
inline EventView view(const Event& event) {
  return EventView(std::make_shared<const Event>(event));
}
template <typename Sample>
auto view(const std::optional<Sample>& sample) -> std::optional<decltype(view(*sample))> {
  if (!sample) return std::nullopt;
  return view(*sample);
}

/// Values of a reply, {name: value}; and arguments of a request: bool, int, float, str, enumerators, arrays,
/// sequences of numbers or of str.
py::dict values_of(const Arguments& values);
Arguments arguments_of_dict(const py::dict& given);

/// Description, state, status, events: all that is read.
void bind_cell(py::module_& m);
/// takt::Arm, poses and trajectories.
void bind_arm(py::module_& m);

}  // namespace takt::python
