// What is read of a cell, as Python classes. Vectors are plain lists.
#include "client_lib/python/module.h"

namespace takt::python {
namespace {

using namespace client;

std::vector<double> list(const Vector3& v) {
  return {v.x, v.y, v.z};
}
std::vector<double> list(const Quaternion& q) {
  return {q.x, q.y, q.z, q.w};
}

/// A property that is a list.
template <typename Class, typename Member>
void vector_property(py::class_<Class>& c, const char* name, Member member) {
  c.def_property_readonly(name, [member](const Class& self) { return list(self.*member); });
}

template <typename Items, typename Values>
py::dict by_name(const Items& items, const Values& values) {
  py::dict result;
  for (std::size_t i = 0; i < items.size() && i < values.size(); ++i)
    result[py::str(items[i].name)] = py::cast(values[i]);
  return result;
}

template <TabledEnumeration Enumeration>
void bind_enumeration(py::module_& m) {
  const EnumerationInfo& info = kEnumeration<Enumeration>;
  py::enum_<Enumeration> bound(m, std::string(info.name).c_str(), std::string(info.doc).c_str());
  for (const EnumeratorInfo& one : info.enumerators)
    bound.value(std::string(one.name).c_str(), static_cast<Enumeration>(one.value),
                std::string(one.doc).c_str());
}

void bind_enums(py::module_& m) {
  bind_enumeration<ComponentType>(m);
  bind_enumeration<PartState>(m);
  bind_enumeration<SimulationState>(m);
  bind_enumeration<Severity>(m);
  bind_enumeration<SafeAction>(m);
  bind_enumeration<GripperAction>(m);
  bind_enumeration<Pace>(m);
}

void bind_description(py::module_& m) {
  py::class_<ComponentInfo> component(m, "ComponentInfo");
  component.def_readonly("name", &ComponentInfo::name)
      .def_readonly("type", &ComponentInfo::type)
      .def_readonly("hierarchy", &ComponentInfo::hierarchy)
      .def_readonly("mass_kg", &ComponentInfo::mass_kg)
      .def_readonly("mesh_uri", &ComponentInfo::mesh_uri)
      .def_readonly("vertices_m", &ComponentInfo::vertices_m)
      .def_readonly("triangles", &ComponentInfo::triangles);
  vector_property(component, "center_of_mass_m", &ComponentInfo::center_of_mass_m);
  py::class_<JointInfo>(m, "JointInfo")
      .def_readonly("name", &JointInfo::name)
      .def_readonly("prismatic", &JointInfo::prismatic)
      .def_readonly("lower", &JointInfo::lower)
      .def_readonly("upper", &JointInfo::upper)
      .def_readonly("max_velocity", &JointInfo::max_velocity)
      .def_readonly("max_effort", &JointInfo::max_effort);
  py::class_<RobotInfo>(m, "RobotInfo")
      .def_readonly("name", &RobotInfo::name)
      .def_readonly("urdf", &RobotInfo::urdf)
      .def_readonly("joints", &RobotInfo::joints)
      .def_readonly("command_period_s", &RobotInfo::command_period_s)
      .def_readonly("command_deadline_s", &RobotInfo::command_deadline_s)
      .def_readonly("safe_action", &RobotInfo::safe_action);
  py::class_<GripperInfo>(m, "GripperInfo")
      .def_readonly("name", &GripperInfo::name)
      .def_readonly("max_width_m", &GripperInfo::max_width_m)
      .def_readonly("max_force_N", &GripperInfo::max_force_N)
      .def_readonly("jaw_speed_m_per_s", &GripperInfo::jaw_speed_m_per_s);
  py::class_<SignalInfo>(m, "SignalInfo")
      .def_readonly("name", &SignalInfo::name)
      .def_readonly("unit", &SignalInfo::unit)
      .def_readonly("commanded", &SignalInfo::commanded)
      .def_readonly("lower", &SignalInfo::lower)
      .def_readonly("upper", &SignalInfo::upper);
  py::class_<DeviceInfo>(m, "DeviceInfo")
      .def_readonly("name", &DeviceInfo::name)
      .def_property_readonly("signals",
                             [](const DeviceInfo& self) { return by_name(self.signals, self.signals); });
  py::class_<CellInfo, std::shared_ptr<CellInfo>>(m, "CellInfo")
      .def_readonly("cell", &CellInfo::cell)
      .def_readonly("scenario", &CellInfo::scenario)
      .def_readonly("scenario_generation", &CellInfo::scenario_generation)
      .def_readonly("server_version", &CellInfo::server_version)
      .def_readonly("step_s", &CellInfo::step_s)
      .def_property_readonly("components",
                             [](const CellInfo& self) { return by_name(self.components, self.components); })
      .def_property_readonly("robots", [](const CellInfo& self) { return by_name(self.robots, self.robots); })
      .def_property_readonly("grippers",
                             [](const CellInfo& self) { return by_name(self.grippers, self.grippers); })
      .def_property_readonly("devices",
                             [](const CellInfo& self) { return by_name(self.devices, self.devices); });
}

void bind_state(py::module_& m) {
  py::class_<ComponentState> component(m, "ComponentState");
  vector_property(component, "position_m", &ComponentState::position_m);
  vector_property(component, "orientation", &ComponentState::orientation);
  vector_property(component, "linear_velocity", &ComponentState::linear_velocity);
  vector_property(component, "angular_velocity", &ComponentState::angular_velocity);
  vector_property(component, "force_N", &ComponentState::force_N);
  vector_property(component, "torque_Nm", &ComponentState::torque_Nm);
  component.def_readonly("state", &ComponentState::state);
  py::class_<RobotState>(m, "RobotState")
      .def_readonly("position", &RobotState::position)
      .def_readonly("velocity", &RobotState::velocity)
      .def_readonly("effort", &RobotState::effort)
      .def_readonly("motor_power_W", &RobotState::motor_power_W);
  py::class_<GripperState>(m, "GripperState")
      .def_readonly("width_m", &GripperState::width_m)
      .def_readonly("force_N", &GripperState::force_N)
      .def_readonly("closed", &GripperState::closed)
      .def_readonly("moving", &GripperState::moving)
      .def_readonly("in_position", &GripperState::in_position);
  py::class_<AppliedCommand>(m, "AppliedCommand")
      .def_readonly("target", &AppliedCommand::target)
      .def_readonly("count", &AppliedCommand::count)
      .def_readonly("newest_stamp_s", &AppliedCommand::newest_stamp_s);
  py::class_<State>(m, "State")
      .def_readonly("time_s", &State::time_s)
      .def_readonly("step", &State::step)
      .def_readonly("epoch", &State::epoch)
      .def_readonly("state_hash", &State::state_hash)
      .def_readonly("sample_number", &State::sample_number)
      .def_property_readonly("info", [](const State& self) { return shared(self.cell); })
      .def_property_readonly(
          "components", [](const State& self) { return by_name(self.cell->components, self.components); })
      .def_property_readonly("robots",
                             [](const State& self) { return by_name(self.cell->robots, self.robots); })
      .def_property_readonly("grippers",
                             [](const State& self) { return by_name(self.cell->grippers, self.grippers); })
      .def_property_readonly("devices",
                             [](const State& self) {
                               py::dict result;
                               for (std::size_t i = 0; i < self.devices.size(); ++i)
                                 result[py::str(self.cell->devices[i].name)] =
                                     by_name(self.cell->devices[i].signals, self.devices[i]);
                               return result;
                             })
      .def_property_readonly("applied",
                             [](const State& self) {
                               py::dict result;
                               for (const AppliedCommand& applied : self.applied)
                                 result[py::str(applied.target)] = py::cast(applied);
                               return result;
                             })
      .def("component", &State::component, py::arg("name"))
      .def("robot", &State::robot, py::arg("name"))
      .def("gripper", &State::gripper, py::arg("name"))
      .def(
          "partner_of",
          [](const State& self, const std::string& name) -> std::optional<std::string> {
            std::string partner = self.partner_of(name);
            if (partner.empty()) return std::nullopt;
            return partner;
          },
          py::arg("name"))
      .def(
          "part_present",
          [](const State& self, const std::string& gripper) -> std::optional<std::string> {
            std::string part = self.part_present(gripper);
            if (part.empty()) return std::nullopt;
            return part;
          },
          py::arg("gripper"))
      .def("__repr__", [](const State& self) {
        return "<takt.State at " + std::to_string(self.time_s) + " s, step " + std::to_string(self.step) +
               ", epoch " + std::to_string(self.epoch) + ">";
      });
  py::class_<Status>(m, "Status")
      .def_readonly("time_s", &Status::time_s)
      .def_readonly("step", &Status::step)
      .def_readonly("epoch", &Status::epoch)
      .def_readonly("scenario_generation", &Status::scenario_generation)
      .def_readonly("state", &Status::state)
      .def_readonly("pace", &Status::pace)
      .def_readonly("pace_factor", &Status::pace_factor)
      .def_readonly("wall_time_s", &Status::wall_time_s)
      .def_readonly("real_time_factor", &Status::real_time_factor)
      .def_readonly("computation_ratio", &Status::computation_ratio)
      .def_readonly("lag_s", &Status::lag_s)
      .def_readonly("overruns", &Status::overruns)
      .def_readonly("commands_applied", &Status::commands_applied)
      .def_readonly("commands_rejected", &Status::commands_rejected)
      .def_readonly("waiting_for", &Status::waiting_for)
      .def_readonly("scheduling", &Status::scheduling)
      .def_readonly("fault", &Status::fault)
      .def_readonly("sample_number", &Status::sample_number)
      .def_property_readonly("levels_of_detail", [](const Status& self) {
        std::map<std::string, int> levels;
        for (const auto& process : self.processes) levels[process.name] = process.level_of_detail;
        return levels;
      });
  py::class_<Event>(m, "Event")
      .def_readonly("sequence_number", &Event::sequence_number)
      .def_readonly("missed_before", &Event::missed_before)
      .def_readonly("time_s", &Event::time_s)
      .def_readonly("step", &Event::step)
      .def_readonly("epoch", &Event::epoch)
      .def_readonly("severity", &Event::severity)
      .def_readonly("code", &Event::code)
      .def_readonly("subject", &Event::subject)
      .def_readonly("sender", &Event::sender)
      .def_readonly("message", &Event::message)
      .def("__repr__", [](const Event& self) {
        return "<takt.Event " + self.code + " " + self.subject + " at " + std::to_string(self.time_s) +
               " s: " + self.message + ">";
      });
}

void bind_figures(py::module_& m) {
  py::class_<PowerConsumer>(m, "PowerConsumer")
      .def_readonly("name", &PowerConsumer::name)
      .def_readonly("mechanical_W", &PowerConsumer::mechanical_W)
      .def_readonly("mechanical_total_W", &PowerConsumer::mechanical_total_W)
      .def_readonly("electrical_W", &PowerConsumer::electrical_W)
      .def_readonly("mechanical_energy_J", &PowerConsumer::mechanical_energy_J)
      .def_readonly("electrical_energy_J", &PowerConsumer::electrical_energy_J);
  py::class_<Power>(m, "Power")
      .def_readonly("time_s", &Power::time_s)
      .def_readonly("step", &Power::step)
      .def_readonly("epoch", &Power::epoch)
      .def_property_readonly("consumers",
                             [](const Power& self) { return by_name(self.consumers, self.consumers); });
  py::class_<Contact> contact(m, "Contact");
  contact.def_readonly("base", &Contact::base)
      .def_readonly("target", &Contact::target)
      .def_readonly("elements", &Contact::elements)
      .def_readonly("area_m2", &Contact::area_m2)
      .def_readonly("normal_force_N", &Contact::normal_force_N)
      .def_readonly("friction_force_N", &Contact::friction_force_N)
      .def_readonly("largest_pressure_Pa", &Contact::largest_pressure_Pa)
      .def_readonly("largest_penetration_m", &Contact::largest_penetration_m);
  vector_property(contact, "force_N", &Contact::force_N);
  vector_property(contact, "torque_Nm", &Contact::torque_Nm);
  vector_property(contact, "center_of_pressure_m", &Contact::center_of_pressure_m);
  py::class_<Contacts>(m, "Contacts")
      .def_readonly("time_s", &Contacts::time_s)
      .def_readonly("step", &Contacts::step)
      .def_readonly("epoch", &Contacts::epoch)
      .def_readonly("contacts", &Contacts::contacts)
      .def_readonly("omitted", &Contacts::omitted);
  py::class_<Reply>(m, "Reply")
      .def_readonly("message", &Reply::message)
      .def_property_readonly("values", [](const Reply& reply) { return values_of(reply.values); });
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
    } else if (py::isinstance<py::int_>(object)) {
      value = {.kind = ValueKind::integer, .integer = object.cast<std::int64_t>()};
    } else if (py::isinstance<py::str>(object)) {
      value = {.kind = ValueKind::text, .text = object.cast<std::string>()};
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

void bind_errors(py::module_& m) {
  static py::exception<ClientError> cell_error(m, "CellError", PyExc_RuntimeError);
  static py::exception<ClientError> timed_out(m, "CellTimeout", cell_error);
  static py::exception<ClientError> not_found(m, "NotFound", cell_error);
  static py::exception<ClientError> invalid(m, "Invalid", cell_error);
  static py::exception<ClientError> refused(m, "Refused", cell_error);
  static py::exception<ClientError> lost(m, "Lost", cell_error);
  cell_error.attr("result") = 0;
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const ClientError& error) {
      using Kind = ClientError::Kind;
      const Kind kind = error.kind();
      const py::object& type = kind == Kind::timeout     ? timed_out
                               : kind == Kind::not_found ? not_found
                               : kind == Kind::invalid   ? invalid
                               : kind == Kind::refused   ? refused
                               : kind == Kind::lost      ? lost
                                                         : cell_error;
      const py::object instance = type(error.what());
      instance.attr("result") = error.result();
      PyErr_SetObject(type.ptr(), instance.ptr());
    }
  });
}

void bind_cell(py::module_& m) {
  bind_enums(m);
  bind_description(m);
  bind_state(m);
  bind_figures(m);
}

}  // namespace takt::python
