#pragma once
// Emergency stop, safety door and speed override of a cell.
//
// A stop is latched: it ends with a change of `reset` from 0 to 1 while no cause is left. While a device stops the
// cell, robots brake on their paths (ReferenceMotion::stop), their commands are refused, and devices move nothing
// (CellPlant::motion_allowed). Grippers hold what they hold. The override scales the time of trajectories that takt
// executes; of several devices the smallest counts. It follows its command at a bounded rate, so that velocities do not jump.
#include <vector>

#include "server/devices/device_type.h"

namespace takt {

/// The keys of a safety device in a scenario.
struct ScenarioSafety {
  double override_ramp_s = 0.5;  ///< from 0 to 100 %
};
DeviceType safety_type();

class Safety final : public PartMechanism {
 public:
  struct Device {
    int device = -1;
    double override_ramp_s = 0.0;
  };
  struct Model {
    std::vector<Device> devices;
  };
  static constexpr const char* kName = "safety";
  enum Signal : int { emergency_stop, door_closed, reset, speed_override, released, speed, kSignals };

  /// `model` outlives it.
  explicit Safety(const Model& model) : model_(model), states_(model.devices.size()) {
    notices_.reserve(model.devices.size());
  }

  void start(ComponentInteraction& interaction) override;
  void begin_step(StepControl& control) override;
  bool update(double, const CellMotion&, CellPlant&, ComponentInteraction&) override { return false; }
  std::span<const DeviceNotice> notices() const override { return notices_; }
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;
  void loaded(CellPlant& plant) const override;

 private:
  struct State {
    bool stopped = false;
    bool reset = false;  ///< value in the step before
    double share = 1.0;  ///< present override
  };
  const Model& model_;
  std::vector<State> states_;
  std::vector<DeviceNotice> notices_;
};

}  // namespace takt
