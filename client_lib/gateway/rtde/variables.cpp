#include "client_lib/gateway/rtde/variables.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace takt::rtde {
namespace {

struct TypeInfo {
  std::string_view name;
  std::size_t element_size, count;
};
constexpr std::array<TypeInfo, 10> kTypes{{{"BOOL", 1, 1},
                                           {"UINT8", 1, 1},
                                           {"UINT32", 4, 1},
                                           {"UINT64", 8, 1},
                                           {"INT32", 4, 1},
                                           {"DOUBLE", 8, 1},
                                           {"VECTOR3D", 8, 3},
                                           {"VECTOR6D", 8, 6},
                                           {"VECTOR6INT32", 4, 6},
                                           {"VECTOR6UINT32", 4, 6}}};
const TypeInfo& info(Type type) {
  return kTypes.at(static_cast<std::size_t>(type));
}

struct Names {
  Type type;
  std::string_view names;  ///< separated by blanks
};
struct Registers {
  Type type;
  std::string_view stem;
  int first, last;
};

constexpr Names kOutputs[] = {
    {Type::real,
     "timestamp target_execution_time actual_execution_time speed_scaling target_speed_fraction "
     "actual_momentum "
     "actual_main_voltage actual_robot_voltage actual_robot_current io_current tcp_force_scalar "
     "tool_analog_input0 "
     "tool_analog_input1 standard_analog_input0 standard_analog_input1 standard_analog_output0 "
     "standard_analog_output1 tool_output_current tool_temperature payload joint_position_deviation_ratio "
     "collision_detection_ratio actual_robot_energy_consumed actual_robot_braking_energy_dissipated "
     "euromap67_24V_voltage euromap67_24V_current"},
    {Type::vector6,
     "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current "
     "actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose actual_TCP_speed "
     "actual_TCP_force target_TCP_pose target_TCP_speed actual_TCP_acceleration target_TCP_acceleration "
     "joint_temperatures actual_joint_voltage ft_raw_wrench wrench_calc_from_currents "
     "target_base_acceleration "
     "target_base_wrench tcp_offset payload_inertia"},
    {Type::vector3, "actual_tool_accelerometer elbow_position elbow_velocity payload_cog target_gravity"},
    {Type::vector6_int32, "joint_mode"},
    {Type::uint64,
     "actual_digital_input_bits actual_digital_output_bits actual_configurable_digital_input_bits "
     "actual_configurable_digital_output_bits control_step"},
    {Type::uint32,
     "runtime_state robot_status_bits safety_status_bits analog_io_types tool_analog_input_types tool_mode "
     "output_bit_registers0_to_31 output_bit_registers32_to_63 input_bit_registers0_to_31 "
     "input_bit_registers32_to_63 script_control_line euromap67_input_bits euromap67_output_bits"},
    {Type::int32,
     "robot_mode safety_mode safety_status tool_output_voltage encoder0_raw encoder1_raw time_scale_source"},
    {Type::uint8, "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode"},
};
constexpr Registers kOutputRegisters[] = {
    {Type::boolean, "output_bit_register_", 64, 127}, {Type::boolean, "input_bit_register_", 64, 127},
    {Type::int32, "output_int_register_", 0, 47},     {Type::int32, "input_int_register_", 0, 47},
    {Type::real, "output_double_register_", 0, 47},   {Type::real, "input_double_register_", 0, 47},
};
constexpr Names kInputs[] = {
    {Type::uint32, "speed_slider_mask input_bit_registers0_to_31 input_bit_registers32_to_63"},
    {Type::real, "speed_slider_fraction standard_analog_output_0 standard_analog_output_1"},
    {Type::uint8,
     "standard_digital_output_mask standard_digital_output configurable_digital_output_mask "
     "configurable_digital_output tool_digital_output_mask tool_digital_output standard_analog_output_mask "
     "standard_analog_output_type"},
    {Type::vector6, "external_force_torque"},
};
constexpr Registers kInputRegisters[] = {
    {Type::boolean, "input_bit_register_", 64, 127},
    {Type::int32, "input_int_register_", 0, 47},
    {Type::real, "input_double_register_", 0, 47},
};

std::vector<Variable> variables_of(std::span<const Names> lists, std::span<const Registers> registers) {
  std::vector<Variable> variables;
  for (const Names& list : lists) {
    for (std::string_view left = list.names; !left.empty();) {
      const std::size_t end = std::min(left.find(' '), left.size());
      variables.push_back({std::string(left.substr(0, end)), list.type});
      left.remove_prefix(std::min(end + 1, left.size()));
    }
  }
  for (const Registers& range : registers)
    for (int i = range.first; i <= range.last; ++i)
      variables.push_back({std::string(range.stem) + std::to_string(i), range.type});
  return variables;
}

}  // namespace

std::string_view type_name(Type type) {
  return info(type).name;
}

std::optional<Type> type_of_name(std::string_view name) {
  for (std::size_t i = 0; i < kTypes.size(); ++i)
    if (kTypes.at(i).name == name) return static_cast<Type>(i);
  return std::nullopt;
}

bool is_real(Type type) {
  return type == Type::real || type == Type::vector3 || type == Type::vector6;
}

std::size_t size_of(Type type) {
  return info(type).element_size * info(type).count;
}

void append(std::string& bytes, Type type, const Value& value) {
  for (std::size_t i = 0; i < info(type).count; ++i) {
    const std::int64_t whole = value.whole.at(i);
    if (is_real(type)) {
      append(bytes, value.real.at(i));
    } else if (info(type).element_size == 1) {
      append(bytes, type == Type::boolean ? static_cast<std::uint8_t>(whole != 0)
                                          : static_cast<std::uint8_t>(whole));
    } else if (info(type).element_size == 4) {
      append(bytes, static_cast<std::uint32_t>(static_cast<std::uint64_t>(whole)));
    } else {
      append(bytes, static_cast<std::uint64_t>(whole));
    }
  }
}

Value read(Reader& reader, Type type) {
  Value value;
  for (std::size_t i = 0; i < info(type).count; ++i) {
    if (is_real(type)) {
      value.real.at(i) = reader.f64();
    } else if (info(type).element_size == 1) {
      const std::uint8_t byte = reader.u8();
      value.whole.at(i) = type == Type::boolean ? static_cast<std::int64_t>(byte != 0) : byte;
    } else if (info(type).element_size == 4) {
      const bool has_sign = type == Type::int32 || type == Type::vector6_int32;
      value.whole.at(i) = has_sign ? reader.i32() : static_cast<std::int64_t>(reader.u32());
    } else {
      value.whole.at(i) = static_cast<std::int64_t>(reader.u64());
    }
  }
  return value;
}

Table::Table(std::vector<Variable> variables)
    : variables_(std::move(variables)), values_(variables_.size()), by_name_(variables_.size()) {
  for (std::size_t i = 0; i < by_name_.size(); ++i) by_name_[i] = i;
  std::sort(by_name_.begin(), by_name_.end(),
            [this](std::size_t a, std::size_t b) { return variables_[a].name < variables_[b].name; });
}

std::optional<std::size_t> Table::find(std::string_view name) const {
  const auto at =
      std::lower_bound(by_name_.begin(), by_name_.end(), name,
                       [this](std::size_t i, std::string_view n) { return variables_[i].name < n; });
  if (at == by_name_.end() || variables_[*at].name != name) return std::nullopt;
  return *at;
}

const Value& Table::operator[](std::string_view name) const {
  const auto index = find(name);
  if (!index) throw std::out_of_range("no such RTDE variable: " + std::string(name));
  return values_[*index];
}

Value& Table::operator[](std::string_view name) {
  return const_cast<Value&>(std::as_const(*this)[name]);
}

void Table::set_vector(std::string_view name, std::span<const double> numbers) {
  Value& value = (*this)[name];
  for (std::size_t i = 0; i < std::min(numbers.size(), value.real.size()); ++i) value.real.at(i) = numbers[i];
}

Table output_table() {
  return Table(variables_of(kOutputs, kOutputRegisters));
}
Table input_table() {
  return Table(variables_of(kInputs, kInputRegisters));
}

}  // namespace takt::rtde
