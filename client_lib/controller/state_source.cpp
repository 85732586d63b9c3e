#include "client_lib/controller/state_source.h"

namespace takt::controller {

StatePart part_of(std::string_view list, std::string_view key) {
  if (key.empty() || key == "force" || key == "torque" || key == "effort" || key == "motor_power")
    return StatePart::all;
  return list == "components" ? StatePart::component : StatePart::machines;
}

}  // namespace takt::controller
