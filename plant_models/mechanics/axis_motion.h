#pragma once
// Motion of one axis with bounded speed and acceleration: a trapezoid of speed from any state of motion to rest at a target, or
// to a constant speed. Position and speed are functions of time, the speed is the derivative of the position, and both
// are continuous.
#include <array>
#include <cstddef>
#include <limits>

namespace takt {

class StateReader;
class StateWriter;

/// m or rad, and s.
struct AxisLimits {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double acceleration = 1.0;  ///< > 0, also of braking
};

class AxisMotion {
 public:
  /// At rest at this position.
  void rest_at(double position);
  /// Discrete, at time t: to rest at the target by the fastest trapezoid with at most this speed (> 0). The target is kept within
  /// the limits. Motion away from the target, or too fast to stop there, brakes first and returns.
  void move_to(double t, double target, double max_speed, const AxisLimits& limits);
  /// Discrete, at time t: to this speed, and to rest at the end of the limits, or at once for a speed of zero.
  void run_at(double t, double speed, const AxisLimits& limits);

  double position(double t) const;
  double speed(double t) const;
  /// Where it jumps: that of the next piece.
  double acceleration(double t) const;
  /// True if it stands from t on.
  bool at_rest(double t) const { return t >= end_s_ && end_speed_ == 0.0; }
  /// The next time after t at which the acceleration jumps, or infinity.
  double next_corner(double t) const;
  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  /// Constant acceleration from t0 on, until the next piece.
  struct Piece {
    double t0 = 0.0, q0 = 0.0, v0 = 0.0, a = 0.0;
  };
  static constexpr std::size_t kPieces = 3;
  const Piece* piece(double t) const;
  void add(double duration_s, double acceleration, Piece& next);

  std::array<Piece, kPieces> pieces_{};
  std::size_t count_ = 0;
  double end_s_ = 0.0, end_position_ = 0.0, end_speed_ = 0.0;  ///< from end_s_ on: constant speed
};

}  // namespace takt
