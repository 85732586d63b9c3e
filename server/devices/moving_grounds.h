#pragma once
// Axes that carry Grounds: linear axes (lifts among them), turntables and pneumatic cylinders. Their motion is a function of time
// (plant_models/mechanics/axis_motion.h); commands act at the begin of a step. What lies on a Ground that moves is carried by
// the substitute force, or by friction at level of detail 3. A load beyond what the drive has stops the axis between two steps
// (server/devices/axis_loads.h); a smaller one does not change its motion.
//
// An axis may stand on a Ground that another axis carries.
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "plant_models/ground_carrier.h"
#include "plant_models/mechanics/axis_motion.h"
#include "server/devices/device_type.h"
#include "server/devices/drive_work.h"

namespace takt {

/// What all axes have in common.
struct ScenarioMovedGrounds {
  std::vector<std::string> grounds;
  std::string mounted_on;  ///< empty: the world
};

/// The keys of a linear axis in a scenario.
struct ScenarioLinearAxis {
  ScenarioMovedGrounds moved;
  double moving_mass_kg = 0.0, friction_N = 0.0;
  std::optional<double> max_force_N;
  Vec3 direction_W = Vec3::UnitX();
  std::vector<double> stroke_m{0.0, 0.0};  ///< lower, upper
  double position_m = 0.0;                 ///< at the start
  double max_speed_m_per_s = 0.0, max_acceleration_m_per_s2 = 0.0;
};
DeviceType linear_axis_type();

/// The keys of a turntable in a scenario.
struct ScenarioTurntable {
  ScenarioMovedGrounds moved;
  double moving_mass_kg = 0.0, moving_inertia_kg_m2 = 0.0, friction_N_m = 0.0;
  std::optional<double> max_torque_N_m;
  Vec3 axis_W = Vec3::UnitZ(), center_W = Vec3::Zero();
  std::optional<std::vector<double>> range_rad;  ///< lower, upper; unset: endless
  double position_rad = 0.0;                     ///< at the start
  double max_speed_rad_per_s = 0.0, max_acceleration_rad_per_s2 = 0.0;
};
DeviceType turntable_type();

/// The keys of a cylinder in a scenario.
struct ScenarioCylinder {
  ScenarioMovedGrounds moved;
  double moving_mass_kg = 0.0, friction_N = 0.0;
  std::optional<double> bore_m;
  double rod_m = 0.0, pressure_Pa = 6e5;
  Vec3 direction_W = Vec3::UnitX();
  double stroke_m = 0.0, extend_time_s = 0.0;
  std::optional<double> retract_time_s;
  double acceleration_m_per_s2 = 20.0;
  double switch_range_m = 0.001;
  bool extended = false;  ///< at the start
};
DeviceType cylinder_type();

struct CarriedGround {
  int component = -1;
  Pose X_WG;  ///< at the start
};

/// What moves with an axis besides its load, and what its drive has.
struct AxisDrive {
  double mass_kg = 0.0;        ///< at the origin of the first Ground, or on the axis of a rotary one
  double inertia_kg_m2 = 0.0;  ///< of a rotary one, about its axis
  double friction = 0.0;       ///< against the motion: N, or N m
  /// Largest forces (N) or torques (N m), >= 0, along and against the coordinate.
  double forward_limit = std::numeric_limits<double>::infinity();
  double backward_limit = std::numeric_limits<double>::infinity();
  bool piston = false;
  Vec3 gravity_W = Vec3::Zero();
};

struct MovingGroundsParameters {
  bool rotary = false;
  AxisDrive drive;
  Vec3 axis_W = Vec3::UnitX();   ///< of length 1
  Vec3 center_W = Vec3::Zero();  ///< on the axis of a rotary one
  std::vector<CarriedGround> grounds;
  int mount = -1;  ///< component id of a Ground, or -1
  Pose X_WM;       ///< of this, at the start
  double lower = 0.0, upper = 0.0, acceleration = 1.0;
  double start = 0.0;
  double forward_speed = 0.0, backward_speed = 0.0;  ///< largest
  double switch_range = 0.0;                         ///< of end switches
};

/// The plant model of all of them; the subclasses have the signals.
class MovingGrounds : public DeviceModel, public GroundCarrier {
 public:
  explicit MovingGrounds(const MovingGroundsParameters& parameters);

  void write_motion(double t, const double* x, CellMotion& motion) const override;
  double next_time_event(double t) const override { return motion_.next_corner(t); }
  void reset() override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

  std::span<const int> carried() const override { return carried_; }
  int mount() const override { return p_.mount; }
  void allow_motion(double t, bool allowed) override;
  bool at_rest(double t) const override { return motion_.at_rest(t); }
  double coordinate(double t) const override { return motion_.position(t); }
  double speed(double t) const override { return motion_.speed(t); }

  /// The force or torque of the drive along the coordinate that balances friction and this load about load_point(motion).
  double drive_force(double t, const Wrench& load_W, const CellMotion& motion) const;
  /// The wrench of the moving mass on the carriage at that point, weight and inertia.
  Wrench own_load(double t, const CellMotion& motion) const;
  Vec3 load_point(const CellMotion& motion) const;
  /// Discrete, at the begin of a step of length h, after the commands: the drive's force now, which counts its work. A motion
  /// that needs more than the drive has stops: of an axis, whose drive bears peaks, by the mean over 20 ms. A piston gains what
  /// its force leaves, and stands where nothing is left. True if the motion has changed.
  bool take_load(double t, double h, double force);
  /// An axis: the load was too much, and the command has not changed since. A piston: it has stood against it for 0.1 s.
  bool overloaded() const { return overloaded_; }
  double force() const { return work_.force; }
  /// What the drive has in the direction of its present force.
  double force_limit() const { return work_.force < 0.0 ? p_.drive.backward_limit : p_.drive.forward_limit; }
  bool rotary() const { return p_.rotary; }

 protected:
  /// Moves as the newest commands ask.
  virtual void follow(double t) = 0;
  /// The same after a changed command, unless it is halted: then later.
  void follow_changed(double t) {
    overloaded_ = false;
    limited_ = 0;
    stood_s_ = 0.0;
    follow_if_allowed(t);
  }
  const DriveWork& work() const { return work_; }
  AxisLimits limits() const { return {p_.lower, p_.upper, p_.acceleration}; }
  bool at_lower(double t) const { return coordinate(t) <= p_.lower + p_.switch_range; }
  bool at_upper(double t) const { return coordinate(t) >= p_.upper - p_.switch_range; }

  MovingGroundsParameters p_;
  AxisMotion motion_;

 private:
  void write_acceleration(double t, const CarriedGround& ground, CellMotion& motion) const;
  void follow_if_allowed(double t) {
    if (!halted_ && (!overloaded_ || p_.drive.piston)) follow(t);
  }
  bool limit_axis(double t);
  bool limit_piston(double t, double h, double load);
  /// Of the motion at t, or that begins there: 1, -1, or 0.
  int direction(double t) const;
  /// Rotates directions of the world at the start to those of now, as the mount turned.
  Mat3 turned(const CellMotion& motion) const;

  std::vector<int> carried_;
  bool halted_ = false, overloaded_ = false;
  bool loaded_ = false;  ///< the mean force is known
  int limited_ = 0;      ///< a piston whose force is used up: 1 on its way out, -1 in; else 0
  DriveWork work_;
  double mean_force_ = 0.0, stood_s_ = 0.0;
};

/// An axis that goes to positions, or runs at a speed: of `set_position` and `set_speed` the one that changed last counts.
class PositionAxis final : public MovingGrounds {
 public:
  enum Signal : int {
    set_position,
    set_speed,
    position,
    speed_now,
    in_position,
    lower_end,
    upper_end,
    drive_force_now,
    drive_power,
    drive_energy,
    overload,
    kSignals
  };
  explicit PositionAxis(const MovingGroundsParameters& parameters);
  void reset() override;
  void set_signal(double t, int signal, double value) override;
  void read_signals(double t, const double* x, const CellMotion& motion,
                    std::span<double> signals) const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  void follow(double t) override;

  double target_ = 0.0, run_ = 0.0;
  bool runs_ = false;  ///< the speed changed last
};

/// A double-acting cylinder: extends while its valve is on, else retracts.
class Cylinder final : public MovingGrounds {
 public:
  enum Signal : int { extend, position, extended, retracted, rod_force, overload, kSignals };
  explicit Cylinder(const MovingGroundsParameters& parameters);
  void reset() override;
  void set_signal(double t, int signal, double value) override;
  void read_signals(double t, const double* x, const CellMotion& motion,
                    std::span<double> signals) const override;
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;

 private:
  void follow(double t) override;

  bool extend_ = false;
};

/// The speed of a trapezoid over this way in this time (s); acceleration * time^2 >= 4 way.
double trapezoid_speed(double way, double time_s, double acceleration);

}  // namespace takt
