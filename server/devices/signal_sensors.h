#pragma once
// Sensors of a quantity that the cell computes anyway: limit switches of joints, force switches, temperature sensors,
// switches that detect a held Part. They read it once a step, at the motion at its beginning, with forced values in place.
#include <optional>
#include <string>
#include <vector>

#include "server/devices/device_type.h"
#include "server/devices/sensor_filter.h"

namespace takt {

/// A signal by its name, with the place of the key in the file.
struct StatedSignal {
  std::string name, place;
};

struct ScenarioLimitSwitch {
  std::string robot, joint, place_of_joint;
  double position = 0.0;
  SwitchParameters output;
};
struct ScenarioForceSwitch {
  StatedSignal signal;    ///< or
  std::string component;  ///< whose resultant contact force is measured
  MeasuringParameters measuring;
  SwitchParameters output;
};
struct ScenarioTemperatureSensor {
  std::string of, place_of_of;
  MeasuringParameters measuring;
  std::optional<double> switch_degC;
  SwitchParameters output;
};
struct ScenarioPresenceSensor {
  std::string holder;
  SwitchParameters output;
};
DeviceType limit_switch_type();
DeviceType force_switch_type();
DeviceType temperature_sensor_type();
DeviceType presence_sensor_type();

struct SignalSensorParameters {
  enum class Kind : std::uint8_t { signal, contact_force, held };
  Kind kind = Kind::signal;
  std::string source;  ///< signal: NAME.SIGNAL
  int component = -1;  ///< contact_force, held
  bool absolute = false;
  bool has_value = false;  ///< reports the measured value, as its first signal
  bool switches = true;
  MeasuringParameters measuring;
  SwitchParameters output;
};

class SignalSensors final : public PartMechanism {
 public:
  struct Entry {
    SignalSensorParameters parameters;
    int device = -1;
    SignalRef source;
  };
  struct Model {
    std::vector<Entry> sensors;
    std::vector<int> parts;  ///< components
  };
  static constexpr const char* kName = "sensors of signals";
  enum MeasuringSignal : int { measured, reached };
  enum SwitchSignal : int { active };
  enum PresenceSignal : int { part_present, part };

  /// `model` outlives it.
  explicit SignalSensors(const Model& model);

  void start(ComponentInteraction& interaction) override;
  bool update(double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction) override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  struct Sensor {
    MeasuringFilter measuring;
    SwitchFilter output;
    int held = -1;
  };

  const Model& model_;
  std::vector<Sensor> sensors_;
  bool all_ = true;        ///< holders are looked at whatever has changed
  bool starting_ = false;  ///< the next update is that of the initial state, ahead of the first step
};

}  // namespace takt
