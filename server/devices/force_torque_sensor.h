#pragma once
// Force-torque sensors between the flange of a robot and its grippers. A sensor measures the wrench of all that it carries on the
// flange: weight and inertia of the grippers, the Parts that they hold, and contact.
//
// From level of detail 2 on the wrench follows from the dynamics of the robot (DynamicRobot::Output::flange_load_W). At level 1
// the grippers' accelerations are differences of their velocities, from one step to the next.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/devices/device_type.h"

namespace takt {

/// Three axes of a sensor: forces (N) or torques (N m).
struct SensorAxes {
  double range = 0.0;             ///< largest value reported; 0: without bound
  double noise = 0.0;             ///< standard deviation of each sample
  Vec3 bias = Vec3::Zero();       ///< added from the start on
  double drift_per_sqrt_s = 0.0;  ///< standard deviation of the bias' random walk after one second
  double resolution = 0.0;        ///< values are multiples of it; 0: continuous
};

/// The keys of a sensor in a scenario.
struct ScenarioForceTorqueSensor {
  std::string robot;
  Pose X_FS;               ///< sensor frame S in the flange
  double rate_hz = 0.0;    ///< of samples; 0: one in each step
  double filter_hz = 0.0;  ///< cut-off of a low-pass filter of first order; 0: none
  int seed = 1;
  SensorAxes force, torque;
};
DeviceType force_torque_sensor_type();

struct ForceTorqueSensorParameters {
  int robot = -1;
  int device = -1;
  Pose X_FS;
  double rate_hz = 0.0, filter_hz = 0.0;
  std::uint64_t seed = 1;
  SensorAxes force, torque;
  std::size_t bodies = 0;  ///< palms and jaws that it carries
};

/// From true wrenches to what a sensor reports: bias, drift, noise, filter, tare, range, resolution, in this order. Without a
/// cell, for tests with closed forms.
class SensorChannel {
 public:
  using Values = std::array<double, 6>;  ///< force, torque

  explicit SensorChannel(const ForceTorqueSensorParameters& parameters) : p_(parameters) {}
  void reset() { *this = SensorChannel(p_); }
  /// The sample `period_s` after the one before it. Noise depends on the seed and the number of the sample alone.
  void sample(const Wrench& wrench_S, double period_s);
  /// The next samples are relative to the last one.
  void tare() { tare_ = filtered_; }
  const Values& values() const { return values_; }
  /// A value has reached the range.
  bool overloaded() const { return overloaded_; }
  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  ForceTorqueSensorParameters p_;
  std::uint64_t samples_ = 0;
  Values drift_{}, filtered_{}, tare_{}, values_{};
  bool overloaded_ = false;
};

class ForceTorqueSensors final : public PartMechanism {
 public:
  struct Model {
    std::vector<ForceTorqueSensorParameters> sensors;
  };
  static constexpr const char* kName = "force-torque sensors";
  enum Signal : int { force_x, force_y, force_z, torque_x, torque_y, torque_z, overload, tare, kSignals };

  /// `model` outlives it.
  explicit ForceTorqueSensors(const Model& model);

  void start(ComponentInteraction& interaction) override;
  bool update(double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction) override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  struct Sensor {
    SensorChannel channel;
    std::uint64_t next_sample = 0;  ///< number of the next one, at next_sample / rate_hz
    bool tare_was_set = false;
    std::vector<Twist> before;  ///< of palms and jaws, one step ago
    bool has_before = false;
  };
  /// Of the grippers and what acts on them on the flange, about its origin.
  static Wrench from_motion(const ForceTorqueSensorParameters& p, double h, const CellMotion& motion,
                            const CellPlant& plant, std::span<const Wrench> wrenches, Sensor& sensor);

  const Model& model_;
  std::vector<Sensor> sensors_;
  std::uint64_t steps_ = 0;
  bool starting_ = false;  ///< the next update is that of the initial state, ahead of the first step
};

}  // namespace takt
