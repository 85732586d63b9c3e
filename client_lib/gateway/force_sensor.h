#pragma once
// A force-torque sensor of the cell (section `force_torque_sensors` of a scenario), as a protocol shows it. It reports the wrench
// that grippers and what they carry exert on the flange: weight, inertia and contact.
#include <array>
#include <string>

#include "client_lib/client.h"
#include "plant_models/spatial.h"
#include "server/fields/fields.h"

namespace takt::gateway {

/// Key `force_sensor`: a force-torque sensor on the flange of `robot`; `doc` says what shows it.
void describe_force_sensor(Fields& f, std::string& device, const CellInfo& cell, const std::string& robot,
                           const char* doc);

class ForceSensor {
 public:
  /// Throws ScenarioError where the device has no wrench or no robot carries it.
  ForceSensor(const CellInfo& cell, const std::string& device);
  /// The sensor's frame S in the flange F.
  const Pose& X_FS() const { return X_FS_; }
  /// Force (N) and torque (N m) in the axes of S, about its origin.
  Wrench wrench_S(const State& state) const;
  /// The same in the axes of the flange, about its origin.
  Wrench wrench_F(const State& state) const;
  /// Forces and torques of wrench_S(), as messages list them.
  std::array<double, 6> values(const State& state) const;

 private:
  std::size_t device_ = 0;
  std::array<std::size_t, 6> place_{};  ///< of each value among the device's signals
  Pose X_FS_;
};

}  // namespace takt::gateway
