// The kinds of devices in scenarios. A new kind adds its line and its header.
#include "server/devices/clamps.h"
#include "server/devices/conveyor.h"
#include "server/devices/device_type.h"
#include "server/devices/fmu.h"
#include "server/devices/force_torque_sensor.h"
#include "server/devices/furnace.h"
#include "server/devices/heat_source.h"
#include "server/devices/heated_part.h"
#include "server/devices/joint_torque.h"
#include "server/devices/lua_device.h"
#include "server/devices/moving_grounds.h"
#include "server/devices/part_flow.h"
#include "server/devices/part_holders.h"
#include "server/devices/safety.h"
#include "server/devices/scene_sensors.h"
#include "server/devices/screw_joints.h"
#include "server/devices/signal_sensors.h"
#include "server/devices/ssp.h"

namespace takt {

const std::vector<DeviceType>& device_types() {
  static const std::vector<DeviceType> types{
      heated_part_type(), furnace_type(), screw_joint_type(), screwdriver_type(), nut_runner_type(),
      force_torque_sensor_type(), fmu_type(), ssp_type(), lua_device_type(), joint_torque_type(),
      heat_source_type(), linear_axis_type(), turntable_type(), cylinder_type(), conveyor_type(),
      clamp_type(), source_type(), sink_type(), vacuum_gripper_type(), magnetic_gripper_type(),
      three_jaw_gripper_type(), tool_changer_type(), safety_type(),
      // Sensors read what the others do.
      light_barrier_type(), light_curtain_type(), proximity_box_type(), distance_sensor_type(),
      identification_reader_type(), limit_switch_type(), force_switch_type(), temperature_sensor_type(),
      presence_sensor_type()};
  return types;
}

}  // namespace takt
