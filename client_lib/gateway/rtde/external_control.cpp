#include "client_lib/gateway/rtde/external_control.h"

#include "client_lib/gateway/rtde/big_endian.h"

namespace takt::rtde {
namespace {

constexpr double kScale = 1e-6;

void read_scaled(Reader& reader, std::array<double, 6>& values) {
  for (double& value : values) value = kScale * reader.i32();
}

}  // namespace

ReverseMessage reverse_message(std::string_view bytes) {
  Reader reader(bytes);
  ReverseMessage message;
  message.timeout_ms = reader.i32();
  for (std::size_t i = 0; i < message.raw.size(); ++i) {
    message.raw.at(i) = reader.i32();
    message.values.at(i) = kScale * message.raw.at(i);
  }
  message.mode = static_cast<ControlMode>(reader.i32());
  return message;
}

TrajectoryPoint trajectory_point(std::string_view bytes) {
  Reader reader(bytes);
  TrajectoryPoint point;
  read_scaled(reader, point.target);
  read_scaled(reader, point.second);
  read_scaled(reader, point.third);
  point.time_s = kScale * reader.i32();
  point.spline_type = reader.i32();
  point.blend_radius_m = kScale * point.spline_type;
  point.type = static_cast<PointType>(reader.i32());
  return point;
}

ScriptCommand script_command(std::string_view bytes) {
  Reader reader(bytes);
  ScriptCommand command;
  command.type = static_cast<ScriptCommandType>(reader.i32());
  for (double& value : command.values) value = kScale * reader.i32();
  return command;
}

std::string int32_bytes(std::int32_t value) {
  std::string bytes;
  append(bytes, value);
  return bytes;
}

}  // namespace takt::rtde
