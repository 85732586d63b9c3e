// The kinds of devices in scenarios. A new kind adds its line and its header.
#include "server/devices/device_type.h"
#include "server/devices/force_torque_sensor.h"
#include "server/devices/furnace.h"
#include "server/devices/heated_part.h"
#include "server/devices/screw_joints.h"

namespace takt {

const std::vector<DeviceType>& device_types() {
  static const std::vector<DeviceType> types{heated_part_type(), furnace_type(), screw_joint_type(),
                                             screwdriver_type(), force_torque_sensor_type()};
  return types;
}

}  // namespace takt
