#pragma once
// Pieces of the Python module.
#include "client_lib/python/messages.h"

namespace takt::python {

using InfoView = SampleView<CellInfo, takt_msgs::msg::CellDescription>;
using StateView = SampleView<State, takt_msgs::msg::CellState>;
using EventView = SampleView<Event, takt_msgs::msg::Event>;

inline InfoView view(const std::shared_ptr<const CellInfo>& info) {
  return InfoView(info, info);
}
inline StateView view(const State& state) {
  return StateView(std::make_shared<const State>(state), state.cell);
}
inline InfoView view(const CellInfo& info) {
  return view(std::make_shared<const CellInfo>(info));
}
inline EventView view(const Event& event) {
  return EventView(std::make_shared<const Event>(event), event.cell);
}
template <Message Type>
View<Type> view(const Sample<Type>& sample) {
  return {std::make_shared<const Sample<Type>>(sample), sample.cell,
          sample.cell ? &sample.cell->lists : nullptr};
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
