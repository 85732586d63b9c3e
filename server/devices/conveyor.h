#pragma once
// Conveyors: a Ground whose surface moves in itself, straight or around an axis. The Ground stands, or moves with the axis that
// carries it.
//
// What lies on it is held in the material of the belt by the substitute force (CellMotion::carrier), and slides where
// something blocks it (sliding_parts.h). At level of detail 3 the material's velocity enters the law of friction.
#include <optional>
#include <string>

#include "plant_models/ground_carrier.h"
#include "plant_models/mechanics/axis_motion.h"
#include "server/devices/device_type.h"
#include "server/devices/drive_work.h"

namespace takt {

/// Of a belt that runs around an axis.
struct ScenarioConveyorCurve {
  Vec3 center_G = Vec3::Zero(), axis_G = Vec3::UnitZ();
  double radius_m = 0.0;
};

/// The keys of a conveyor in a scenario.
struct ScenarioConveyor {
  std::string ground;
  Vec3 direction_G = Vec3::UnitX();
  std::optional<ScenarioConveyorCurve> curve;
  double max_speed_m_per_s = 0.0, max_acceleration_m_per_s2 = 0.0;
  double moving_mass_kg = 0.0, friction_N = 0.0;
  std::optional<double> speed_m_per_s;  ///< until another one is commanded; unset: the largest
  bool running = false;                 ///< at the start
};
DeviceType conveyor_type();

struct ConveyorParameters {
  int ground = -1;
  bool curved = false;
  Vec3 axis_G = Vec3::UnitX();   ///< of length 1: direction, or axis of rotation
  Vec3 center_G = Vec3::Zero();  ///< on the axis
  double radius_m = 1.0;         ///< of the line where its speed counts
  double max_speed = 0.0, acceleration = 1.0, set_speed = 0.0;
  double mass_kg = 0.0, friction_N = 0.0;  ///< of belt and rollers
  bool running = false;
};

class Conveyor final : public DeviceModel, public GroundCarrier {
 public:
  enum Signal : int { run, set_speed, speed_now, position, force, power, energy, kSignals };
  explicit Conveyor(const ConveyorParameters& parameters);

  void write_motion(double t, const double* x, CellMotion& motion) const override;
  double next_time_event(double t) const override { return motion_.next_corner(t); }
  void reset() override;
  void set_signal(double t, int signal, double value) override;
  void read_signals(double t, const double* x, const CellMotion& motion,
                    std::span<double> signals) const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

  /// Discrete, at the begin of a step of length h, after the commands: what acts on the belt's Ground, about its origin. Counts
  /// the work of the drive.
  void take_load(double t, double h, const Wrench& load_W, const CellMotion& motion);

  int belt() const override { return p_.ground; }
  void allow_motion(double t, bool allowed) override;
  bool at_rest(double t) const override { return motion_.at_rest(t); }
  double coordinate(double t) const override { return motion_.position(t); }
  double speed(double t) const override { return motion_.speed(t); }

 private:
  void follow(double t);

  ConveyorParameters p_;
  AxisMotion motion_;
  bool run_ = false, halted_ = false;
  double set_speed_ = 0.0;
  DriveWork work_;
};

}  // namespace takt
