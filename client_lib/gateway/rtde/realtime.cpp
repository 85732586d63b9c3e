#include "client_lib/gateway/rtde/realtime.h"

#include <array>

namespace takt::rtde {
namespace {

struct Field {
  std::string_view name;  ///< of the RTDE output; empty: zeros
  std::size_t count = 1;
  int minor = 0;  ///< first version 5.`minor` that has it
};

constexpr std::array kFields{
    Field{"timestamp"},
    Field{"target_q", 6},
    Field{"target_qd", 6},
    Field{"target_qdd", 6},
    Field{"target_current", 6},
    Field{"target_moment", 6},
    Field{"actual_q", 6},
    Field{"actual_qd", 6},
    Field{"actual_current", 6},
    Field{"joint_control_output", 6},
    Field{"actual_TCP_pose", 6},
    Field{"actual_TCP_speed", 6},
    Field{"actual_TCP_force", 6},
    Field{"target_TCP_pose", 6},
    Field{"target_TCP_speed", 6},
    Field{"actual_digital_input_bits"},
    Field{"joint_temperatures", 6},
    Field{"actual_execution_time"},
    Field{""},  // test value
    Field{"robot_mode"},
    Field{"joint_mode", 6},
    Field{"safety_mode"},
    Field{"", 6},
    Field{"actual_tool_accelerometer", 3},
    Field{"", 6},
    Field{"speed_scaling"},
    Field{"actual_momentum"},
    Field{"", 2},
    Field{"actual_main_voltage"},
    Field{"actual_robot_voltage"},
    Field{"actual_robot_current"},
    Field{"actual_joint_voltage", 6},
    Field{"actual_digital_output_bits"},
    Field{"runtime_state"},
    Field{"elbow_position", 3},
    Field{"elbow_velocity", 3},
    Field{"safety_status", 1, 4},
    Field{"", 3, 9},
    Field{"payload", 1, 10},
    Field{"payload_cog", 3, 10},
    Field{"payload_inertia", 6, 10},
};

}  // namespace

std::string realtime_package(const Table& outputs, int minor) {
  std::string numbers;
  for (const Field& field : kFields) {
    if (minor < field.minor) continue;
    if (field.name.empty()) {
      for (std::size_t i = 0; i < field.count; ++i) append(numbers, 0.0);
      continue;
    }
    const std::size_t index = outputs.find(field.name).value();
    const Value& value = outputs.value(index);
    const bool real = is_real(outputs.variables()[index].type);
    for (std::size_t i = 0; i < field.count; ++i)
      append(numbers, real ? value.real.at(i) : static_cast<double>(value.whole.at(i)));
  }
  std::string package;
  append(package, static_cast<std::int32_t>(sizeof(std::int32_t) + numbers.size()));
  return package + numbers;
}

}  // namespace takt::rtde
