// Samples and description of a cell as Python classes; values of requests.
#include "client_lib/python/module.h"

#include <algorithm>
#include <charconv>

namespace takt::python {

std::vector<py::ssize_t> shape_of(std::string_view text, std::size_t size) {
  std::vector<py::ssize_t> shape;
  py::ssize_t known = 1;
  std::size_t open = std::string_view::npos;
  for (std::size_t at = 0; at < text.size();) {
    py::ssize_t length = 0;
    const bool is_number =
        std::from_chars(text.data() + at, text.data() + text.size(), length).ec == std::errc();
    if (is_number)
      known *= length;
    else
      open = shape.size();
    shape.push_back(length);
    at = text.find_first_not_of(", ", std::min(text.find(',', at), text.size()));
  }
  const auto count = static_cast<py::ssize_t>(size);
  if (open < shape.size()) shape[open] = count / known, known *= shape[open];
  return shape.empty() || known != count ? std::vector{count} : shape;
}

namespace {

std::string shape_text(const FieldInfo& field) {
  std::string_view shape = annotation(field.annotations, "shape");
  if (shape.empty() && field.message != nullptr) shape = annotation(field.message->annotations, "shape");
  if (shape.empty()) shape = annotation(field.annotations, "order");
  std::string text(shape);
  if (text.empty()) text = field.message != nullptr ? std::to_string(field.message->fields.size()) : "n";
  text = "array (" + text + (text.find(',') == std::string::npos ? ",)" : ")");
  if (shape.empty() && field.message != nullptr)
    for (const FieldInfo& element : field.message->fields) text += " " + std::string(element.name);
  return text;
}

bool is_array(const FieldInfo& field) {
  if (field.kind == FieldKind::message) return has_annotation(field.message->annotations, "quantity");
  return field.sequence && field.kind != FieldKind::string && field.enumeration == nullptr;
}

}  // namespace

// As meaning() of idl/generator/python_api.py.
std::string text_of_field(const FieldInfo& field) {
  std::string text(field.doc);
  std::string name(field.name);
  std::replace(name.begin(), name.end(), '_', ' ');
  for (const char* preposition : {"of ", "to ", "in ", "from "})
    if (field.doc.starts_with(preposition)) text.insert(0, name + " ");
  if (text.empty() && field.enumeration != nullptr) text = field.enumeration->doc;
  if (has_annotation(field.annotations, "index"))
    if (const std::size_t at = text.find("-1"); at != std::string::npos) text.replace(at, 2, "None");
  std::string about;
  const auto add = [&](const std::string& part) { about += (about.empty() ? "" : ", ") + part; };
  if (is_array(field)) add(shape_text(field));
  const bool real = field.kind == FieldKind::float32 || field.kind == FieldKind::float64;
  if (field.message == &message_info<builtin_interfaces::msg::Time>()) add("in s");
  if (field.unit.starts_with("of "))
    add("in the unit " + std::string(field.unit));
  else if (field.unit == "1" && real)
    add("without unit");
  else if (!field.unit.empty() && field.unit != "1")
    add("in " + std::string(field.unit));
  if (!field.frame.empty()) add("in frame " + std::string(field.frame));
  return about.empty() ? text : text + " (" + about + ")";
}

namespace {

/// None for an empty name.
std::optional<std::string> name_or_none(std::string name) {
  if (name.empty()) return std::nullopt;
  return name;
}

/// A class of the package that is a message with more members.
template <typename Sample, Message Type>
py::class_<SampleView<Sample, Type>, View<Type>> bind_sample(py::module_& m, const char* name) {
  return {m, name, std::string(message_info<Type>().doc).c_str()};
}

}  // namespace

py::dict values_of(const Arguments& values) {
  py::dict result;
  for (const auto& [name, value] : values) {
    const py::str key(name);
    switch (value.kind) {
      case ValueKind::boolean:
        result[key] = value.flag;
        break;
      case ValueKind::integer:
        result[key] = value.integer;
        break;
      case ValueKind::number:
        result[key] = value.number;
        break;
      case ValueKind::text:
        result[key] = value.text;
        break;
      case ValueKind::numbers:
        result[key] = value.numbers;
        break;
      case ValueKind::texts:
        result[key] = value.texts;
        break;
      case ValueKind::document:
        result[key] = py::module_::import("json").attr("loads")(value.text);
        break;
    }
  }
  return result;
}

Arguments arguments_of_dict(const py::dict& given) {
  Arguments arguments;
  for (const auto& [key, object] : given) {
    Value value;
    if (py::isinstance<py::bool_>(object)) {
      value = {.kind = ValueKind::boolean, .flag = object.cast<bool>()};
    } else if (PyIndex_Check(object.ptr()) != 0 && !py::isinstance<py::array>(object)) {
      value = {.kind = ValueKind::integer, .integer = object.cast<std::int64_t>()};  // of numpy too
    } else if (py::isinstance<py::str>(object)) {
      value = {.kind = ValueKind::text, .text = object.cast<std::string>()};
    } else if (py::isinstance<py::array>(object)) {
      value = {.kind = ValueKind::numbers, .numbers = object.cast<std::vector<double>>()};
    } else if (py::hasattr(object, "name")) {  // an enumerator
      value = {.kind = ValueKind::text, .text = object.attr("name").cast<std::string>()};
    } else if (py::isinstance<py::sequence>(object)) {
      const auto items = py::reinterpret_borrow<py::sequence>(object);
      if (items.size() == 0 || py::isinstance<py::str>(items[0]))
        value = {.kind = ValueKind::texts, .texts = object.cast<std::vector<std::string>>()};
      else
        value = {.kind = ValueKind::numbers, .numbers = object.cast<std::vector<double>>()};
    } else {
      value = {.kind = ValueKind::number, .number = object.cast<double>()};
    }
    arguments.push_back({key.cast<std::string>(), std::move(value)});
  }
  return arguments;
}

void bind_cell(py::module_& m) {
  py::module_ messages =
      m.def_submodule("messages", "Messages of idl/takt_msgs.idl, as a client receives them.");
  topics::for_each([&]<typename Type>(const Topic<Type>& topic) {
    if constexpr (kIsOfTopic<Type>)
      if (topic.is_for_clients()) bind_message<Type>(messages);
  });
  bind_sample<CellInfo, takt_msgs::msg::CellDescription>(m, "CellInfo");
  bind_sample<State, takt_msgs::msg::CellState>(m, "State")
      .def_property_readonly(
          "info", [](const StateView& self) { return view(self.cell); },
          "Description of the cell that this state belongs to.")
      .def(
          "component",
          [](const StateView& self, const std::string& name) {
            const ComponentState& found = self.sample().component(name);
            return View<ComponentState>{{self.message, &found}, self.cell, self.of};
          },
          py::arg("name"), "State of a component. Raises NotFound with the names that exist.")
      .def(
          "robot",
          [](const StateView& self, const std::string& name) {
            const RobotState& found = self.sample().robot(name);
            return View<RobotState>{{self.message, &found}, self.cell, self.of};
          },
          py::arg("name"), "State of a robot. Raises NotFound with the names that exist.")
      .def(
          "gripper",
          [](const StateView& self, const std::string& name) {
            const GripperState& found = self.sample().gripper(name);
            return View<GripperState>{{self.message, &found}, self.cell, self.of};
          },
          py::arg("name"), "State of a gripper. Raises NotFound with the names that exist.")
      .def(
          "device",
          [](const StateView& self, const std::string& name) {
            const DeviceState& found = self.sample().device(name);
            return View<DeviceState>{{self.message, &found}, self.cell, self.of};
          },
          py::arg("name"), "State of a device. Raises NotFound with the names that exist.")
      .def(
          "signals",
          [](const StateView& self, const std::string& device) {
            const std::map<std::string, double> values = self.sample().signals(device);
            py::dict ordered;
            const auto index = static_cast<std::size_t>(self.cell->find_device(device));
            for (const auto& signal : self.cell->devices.at(index).signals)
              ordered[py::str(signal.name)] = values.at(signal.name);
            return ordered;
          },
          py::arg("device"),
          "Signals of a device by name, each in the unit of its description (info.devices). Raises NotFound "
          "with the names that exist.")
      .def(
          "partner_of",
          [](const StateView& self, const std::string& name) {
            return name_or_none(self.sample().partner_of(name));
          },
          py::arg("name"),
          "Name of the component that holds a Part; None: nothing holds it. Raises NotFound.")
      .def(
          "part_present",
          [](const StateView& self, const std::string& gripper) {
            return name_or_none(self.sample().part_present(gripper));
          },
          py::arg("gripper"),
          "Name of the Part that both jaws touch and hold (of several the first), or None for a gripper that "
          "holds no Part. Raises NotFound.");
  bind_sample<Event, takt_msgs::msg::Event>(m, "Event")
      .def_property_readonly(
          "missed_before", [](const EventView& self) { return self.sample().missed_before; },
          "Number of events that were lost directly before this one.");
  py::class_<Reply>(m, "Reply", "Reply to a request that was sent by name.")
      .def_property_readonly(
          "message", [](const Reply& reply) { return reply.message; }, "The server's sentence.")
      .def_property_readonly(
          "values", [](const Reply& reply) { return values_of(reply.values); },
          "Values of the reply by name: bool, int, float, str, lists, or dicts of a JSON document.");
}

}  // namespace takt::python
